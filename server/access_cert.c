/* SPDX-License-Identifier: Apache-2.0 */
#include "server/access.h"
#include "server/certificate.h"
#include "server/complaint.h"
#include "server/config.h"
#include "server/data_dir.h"

#include <getopt.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char cert_usage[] =
	"usage: penumbra cert [OPTION]... HOST...\n"
	"Make a certificate, signed by itself, and its key, for a coordinator that is reached\n"
	"as HOST: a name or an address.\n"
	"\n"
	"  --cert FILE  the certificate, which clients need (DIR/cert.pem)\n"
	"  --key FILE   its key, which they must not have (DIR/key.pem)\n"
	"  --data DIR   as of `penumbra serve`\n"
	"  --help       print this\n";

struct request {
	char data[PATH_MAX], cert[PATH_MAX], key[PATH_MAX];
	bool help;
};

static int take_path(const char *text, char *ret_path, struct pen_error *err)
{
	if (snprintf(ret_path, PATH_MAX, "%s", text) >= PATH_MAX)
		return pen_error_set(err, PEN_EINVALID, "a file's name is too long");
	return 0;
}

static int take_option(struct request *request, int option, struct pen_error *err)
{
	switch (option) {
	case 'd': return pen_config_parse_data(optarg, request->data, err);
	case 'c': return take_path(optarg, request->cert, err);
	case 'k': return take_path(optarg, request->key, err);
	case 'h': request->help = true; return 0;
	default: return pen_error_set(err, PEN_EINVALID, "unknown or incomplete option");
	}
}

/* What was not said goes into the data directory, which is made for it. */
static int find_files(struct request *request, struct pen_error *err)
{
	const struct {
		const char *name;
		char *path;
	} files[] = {{"cert.pem", request->cert}, {"key.pem", request->key}};
	int r = 0;

	if (request->cert[0] != '\0' && request->key[0] != '\0')
		return 0;
	if (request->data[0] == '\0')
		r = pen_config_default_data(request->data, err);
	if (r == 0)
		r = pen_data_dir_make(request->data, err);
	for (size_t i = 0; r == 0 && i < 2; i++)
		if (files[i].path[0] == '\0' && snprintf(files[i].path, PATH_MAX, "%s/%s",
							request->data, files[i].name) >= PATH_MAX)
			r = pen_error_set(
				err, PEN_EINVALID, "the data directory's name is too long");
	return r;
}

/* As root made for another's directory, both are the other's. */
static void hand_over(const char *path)
{
	char directory[PATH_MAX];
	const char *slash = strrchr(path, '/');
	struct stat owner;

	(void)snprintf(directory, sizeof directory, "%.*s", slash ? (int)(slash - path + 1) : 1,
		slash ? path : ".");
	if (geteuid() == 0 && stat(directory, &owner) == 0 && owner.st_uid != 0)
		(void)!chown(path, owner.st_uid, owner.st_gid);
}

int pen_access_cert(int argc, char **argv)
{
	static const struct option options[] = {{"data", required_argument, NULL, 'd'},
		{"cert", required_argument, NULL, 'c'}, {"key", required_argument, NULL, 'k'},
		{"help", no_argument, NULL, 'h'}, {0}};
	char fingerprint[PEN_FINGERPRINT_TEXT];
	struct request request = {0};
	struct pen_error err;
	int option;

	optind = 1;
	while ((option = getopt_long(argc, argv, ":", options, NULL)) != -1)
		if (take_option(&request, option, &err) < 0)
			return pen_complain_usage("cert", err.text);
	if (request.help) {
		(void)fputs(cert_usage, stdout);
		return PEN_COMMAND_OK;
	}
	if (optind == argc)
		return pen_complain_usage(
			"cert", "HOST is missing: what the coordinator is reached by");
	(void)umask(022);
	if (find_files(&request, &err) < 0 ||
		pen_certificate_make((const char *const *)argv + optind, (size_t)(argc - optind),
			request.cert, request.key, fingerprint, &err) < 0)
		return pen_complain(&err);
	hand_over(request.cert);
	hand_over(request.key);
	(void)printf("--tls-cert %s --tls-key %s\n", request.cert, request.key);
	(void)fprintf(stderr, "SHA-256 of the certificate: %s\n", fingerprint);
	return PEN_COMMAND_OK;
}
