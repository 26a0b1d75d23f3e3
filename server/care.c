/* SPDX-License-Identifier: Apache-2.0 */
#include "server/care.h"

#include "server/backup.h"
#include "server/complaint.h"
#include "server/config.h"
#include "server/data_dir.h"
#include "server/fsck.h"

#include <getopt.h>
#include <inttypes.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static const char fsck_usage[] =
	"usage: penumbra fsck [--data DIR] [--repair]\n"
	"Look through the data directory of a coordinator that does not run.\n"
	"\n"
	"  --data DIR  as of `penumbra serve`\n"
	"  --repair    renders with a damaged or lost frame are rendered again at the\n"
	"              next start: their images are what they were\n"
	"  --help      print this\n";

static const char backup_usage[] =
	"usage: penumbra backup [--data DIR] TARGET\n"
	"Copy the data directory, of a running coordinator or not, to TARGET.\n"
	"\n"
	"  --data DIR  as of `penumbra serve`\n"
	"  --help      print this\n";

static const char restore_usage[] =
	"usage: penumbra restore [--data DIR] BACKUP\n"
	"Check a backup and copy it to the data directory, which must not be there.\n"
	"\n"
	"  --data DIR  as of `penumbra serve`\n"
	"  --help      print this\n";

struct request {
	const char *usage;
	char data[PATH_MAX];
	const char *operand;
	bool repair, help;
};

/* PEN_COMMAND_OK when there is something to do; help has been printed else. */
static int parse(int argc, char **argv, int operands, struct request *request)
{
	static const struct option options[] = {{"data", required_argument, NULL, 'd'},
		{"repair", no_argument, NULL, 'r'}, {"help", no_argument, NULL, 'h'}, {0}};
	struct pen_error err;
	int option;

	optind = 1;
	while ((option = getopt_long(argc, argv, ":", options, NULL)) != -1) {
		if (option == 'd' && pen_config_parse_data(optarg, request->data, &err) < 0)
			return pen_complain_usage(argv[0], err.text);
		request->repair = request->repair || option == 'r';
		request->help = request->help || option == 'h';
		if (option == '?' || option == ':' || (option == 'r' && operands > 0))
			return pen_complain_usage(argv[0], "unknown or incomplete option");
	}
	if (request->help) {
		(void)fputs(request->usage, stdout);
		return PEN_COMMAND_OK;
	}
	if (argc - optind != operands)
		return pen_complain_usage(argv[0],
			operands > 0 ? "one directory is to be named" : "this takes options only");
	request->operand = operands > 0 ? argv[optind] : NULL;
	if (request->data[0] == '\0' && pen_config_default_data(request->data, &err) < 0)
		return pen_complain_usage(argv[0], err.text);
	return PEN_COMMAND_OK;
}

static void print_fault(const char *sentence)
{
	(void)printf("%s\n", sentence);
}

static int print_report(const struct pen_fsck_report *report)
{
	(void)printf("%" PRIu64 " renders, %" PRIu64 " frames: %" PRIu64 " faults", report->renders,
		report->frames, report->faults);
	if (report->repaired > 0)
		(void)printf(", %" PRIu64 " renders will be rendered again", report->repaired);
	(void)printf("\n");
	return report->faults == 0 ? PEN_COMMAND_OK : PEN_COMMAND_FAILED;
}

int pen_care_fsck(int argc, char **argv)
{
	struct request request = {.usage = fsck_usage};
	struct pen_fsck_report report = {.told = print_fault};
	struct pen_data_dir data;
	struct pen_error err;
	int code = parse(argc, argv, 0, &request), r;

	if (code != PEN_COMMAND_OK || request.help)
		return code;
	r = pen_data_dir_lock(&data, request.data, &err);
	if (r < 0)
		return pen_complain(&err);
	r = pen_fsck(request.data, request.repair, &report, &err);
	pen_data_dir_close(&data);
	return r < 0 ? pen_complain(&err) : print_report(&report);
}

int pen_care_backup(int argc, char **argv)
{
	struct request request = {.usage = backup_usage};
	struct pen_fsck_report report = {.told = print_fault};
	struct pen_error err;
	int code = parse(argc, argv, 1, &request);

	if (code != PEN_COMMAND_OK || request.help)
		return code;
	if (pen_backup(request.data, request.operand, &err) < 0 ||
		pen_fsck(request.operand, false, &report, &err) < 0)
		return pen_complain(&err);
	return print_report(&report);
}

int pen_care_restore(int argc, char **argv)
{
	struct request request = {.usage = restore_usage};
	struct pen_fsck_report report = {.told = print_fault};
	struct pen_error err;
	int code = parse(argc, argv, 1, &request);

	if (code != PEN_COMMAND_OK || request.help)
		return code;
	if (pen_fsck(request.operand, false, &report, &err) < 0)
		return pen_complain(&err);
	if (report.faults > 0)
		return print_report(&report);
	if (pen_backup(request.operand, request.data, &err) < 0)
		return pen_complain(&err);
	return print_report(&report);
}
