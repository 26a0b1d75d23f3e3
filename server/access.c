/* SPDX-License-Identifier: Apache-2.0 */
#include "server/access.h"
#include "server/complaint.h"

#include "server/config.h"
#include "server/data_dir.h"
#include "server/key_file.h"
#include "server/token.h"
#include "server/worker_key.h"

#include <errno.h>
#include <fcntl.h>
#include <getopt.h>
#include <limits.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static const char token_usage[] =
	"usage: penumbra token add NAME [--scope LIST] [--output FILE]\n"
	"       penumbra token list\n"
	"       penumbra token remove NAME\n"
	"Say who may use a coordinator over HTTP. Once there is a token, every request needs\n"
	"one; a coordinator that runs sees the change within a second.\n"
	"\n"
	"  --scope LIST   of submit, read, metrics, admin, with commas (submit,read)\n"
	"  --output FILE  write the secret there, for its owner alone, instead of printing it\n"
	"  --data DIR     as of `penumbra serve`\n"
	"  --tokens FILE  as of `penumbra serve`\n"
	"  --help         print this\n"
	"\n"
	"The secret is told this once: what is kept is its hash.\n";

static const char worker_usage[] =
	"usage: penumbra worker add NAME [--output FILE]\n"
	"       penumbra worker list\n"
	"       penumbra worker remove NAME\n"
	"Say which workers of other machines may join a coordinator. Once there is a key,\n"
	"every worker needs one, each its own; a coordinator that runs sees the change\n"
	"within a second, and lets go of a worker whose key is gone.\n"
	"\n"
	"  --output FILE       write the key there, for its owner alone, instead of printing it\n"
	"  --data DIR          as of `penumbra serve`\n"
	"  --worker-keys FILE  as of `penumbra serve`\n"
	"  --help              print this\n"
	"\n"
	"The worker takes the key as --key-file.\n";

struct request {
	const char *verb, *name;    /* NULL: not given */
	const char *scope, *output; /* NULL: not given */
	char data[PATH_MAX], file[PATH_MAX];
	bool help;
};

static int take_option(struct request *request, int option, struct pen_error *err)
{
	switch (option) {
	case 'd': return pen_config_parse_data(optarg, request->data, err);
	case 's': request->scope = optarg; return 0;
	case 'o': request->output = optarg; return 0;
	case 'h': request->help = true; return 0;
	case 'f':
		if (snprintf(request->file, PATH_MAX, "%s", optarg) < PATH_MAX)
			return 0;
		return pen_error_set(err, PEN_EINVALID, "the file's name is too long");
	default: return pen_error_set(err, PEN_EINVALID, "unknown or incomplete option");
	}
}

/* Where the keys are, if that was not said: in the data directory, which is made for them. */
static int find_file(struct request *request, const char *usual, struct pen_error *err)
{
	int r = 0;

	if (request->file[0] != '\0')
		return 0;
	if (request->data[0] == '\0')
		r = pen_config_default_data(request->data, err);
	if (r == 0)
		r = pen_data_dir_make(request->data, err);
	if (r == 0 && snprintf(request->file, PATH_MAX, "%s/%s", request->data, usual) >= PATH_MAX)
		r = pen_error_set(err, PEN_EINVALID, "the data directory's name is too long");
	return r;
}

static bool is_verb(const char *verb)
{
	return strcmp(verb, "add") == 0 || strcmp(verb, "list") == 0 || strcmp(verb, "remove") == 0;
}

/* PEN_COMMAND_OK when there is something to do; help has been printed else. */
static int parse(int argc, char **argv, const struct option *options, const char *help,
	struct request *request)
{
	struct pen_error err;
	int option;

	optind = 1;
	while ((option = getopt_long(argc, argv, ":", options, NULL)) != -1)
		if (take_option(request, option, &err) < 0)
			return pen_complain_usage(argv[0], err.text);
	if (request->help) {
		(void)fputs(help, stdout);
		return PEN_COMMAND_OK;
	}
	if (argc - optind < 1 || argc - optind > 2)
		return pen_complain_usage(argv[0], "add NAME, list or remove NAME is missing");
	request->verb = argv[optind];
	request->name = argc - optind == 2 ? argv[optind + 1] : NULL;
	if ((strcmp(request->verb, "list") == 0) != (request->name == NULL))
		return pen_complain_usage(argv[0], "add and remove take a name, list takes none");
	if (!is_verb(request->verb))
		return pen_complain_usage(argv[0], "this takes add, list or remove");
	return PEN_COMMAND_OK;
}

/* To a new file of the caller's alone, or to standard output. */
static int tell_secret(const struct request *request, const char *secret, struct pen_error *err)
{
	int fd, r = 0;

	if (!request->output) {
		(void)printf("%.*s\n", (int)strcspn(secret, "\n"), secret);
		return 0;
	}
	fd = open(request->output, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
	if (fd < 0)
		return pen_error_system(err, errno, "cannot make %s", request->output);
	if (dprintf(fd, "%.*s\n", (int)strcspn(secret, "\n"), secret) < 0)
		r = pen_error_system(err, errno, "cannot write %s", request->output);
	(void)close(fd);
	return r;
}

static int add_token(
	struct pen_tokens *tokens, const struct request *request, struct pen_error *err)
{
	char secret[PEN_TOKEN_TEXT];
	unsigned scopes;
	int r = pen_scopes_parse(request->scope ? request->scope : "submit,read", &scopes, err);

	if (r == 0)
		r = pen_tokens_add(tokens, request->name, scopes, secret, err);
	if (r == 0)
		r = pen_tokens_save(tokens, request->file, err);
	if (r == 0)
		r = tell_secret(request, secret, err);
	explicit_bzero(secret, sizeof secret);
	return r;
}

static int remove_token(
	struct pen_tokens *tokens, const struct request *request, struct pen_error *err)
{
	int r = pen_tokens_remove(tokens, request->name, err);

	return r == 0 ? pen_tokens_save(tokens, request->file, err) : r;
}

static int list_tokens(const struct pen_tokens *tokens)
{
	char scopes[PEN_SCOPES_TEXT];

	for (size_t i = 0; i < tokens->count; i++) {
		pen_scopes_format(tokens->list[i].scopes, scopes);
		(void)printf("%-24s  %s\n", tokens->list[i].name, scopes);
	}
	return 0;
}

static int change_tokens(const struct request *request, struct pen_error *err)
{
	struct pen_tokens tokens = {0};
	int lock = -1;
	int r = pen_key_file_lock(request->file, &lock, err);

	if (r < 0)
		return r;
	r = pen_tokens_load(&tokens, request->file, err);
	if (r == 0 && strcmp(request->verb, "add") == 0)
		r = add_token(&tokens, request, err);
	else if (r == 0 && strcmp(request->verb, "remove") == 0)
		r = remove_token(&tokens, request, err);
	else if (r == 0)
		r = list_tokens(&tokens);
	(void)close(lock);
	pen_tokens_finish(&tokens);
	return r;
}

static int add_worker(
	struct pen_worker_keys *keys, const struct request *request, struct pen_error *err)
{
	const struct pen_worker_key *key = NULL;
	char text[PEN_WORKER_KEY_TEXT];
	int r = pen_worker_keys_add(keys, request->name, &key, err);

	if (r == 0)
		r = pen_worker_keys_save(keys, request->file, err);
	if (r < 0)
		return r;
	pen_worker_key_format(key->name, key->bits, text);
	r = tell_secret(request, text, err);
	explicit_bzero(text, sizeof text);
	return r;
}

static int remove_worker(
	struct pen_worker_keys *keys, const struct request *request, struct pen_error *err)
{
	int r = pen_worker_keys_remove(keys, request->name, err);

	return r == 0 ? pen_worker_keys_save(keys, request->file, err) : r;
}

static int list_workers(const struct pen_worker_keys *keys)
{
	for (size_t i = 0; i < keys->count; i++)
		(void)printf("%s\n", keys->list[i].name);
	return 0;
}

static int change_workers(const struct request *request, struct pen_error *err)
{
	struct pen_worker_keys keys = {0};
	int lock = -1;
	int r = pen_key_file_lock(request->file, &lock, err);

	if (r < 0)
		return r;
	r = pen_worker_keys_load(&keys, request->file, err);
	if (r == 0 && strcmp(request->verb, "add") == 0)
		r = add_worker(&keys, request, err);
	else if (r == 0 && strcmp(request->verb, "remove") == 0)
		r = remove_worker(&keys, request, err);
	else if (r == 0)
		r = list_workers(&keys);
	(void)close(lock);
	pen_worker_keys_finish(&keys);
	return r;
}

static int run(struct request *request, const char *usual_file,
	int (*change)(const struct request *request, struct pen_error *err))
{
	struct pen_error err = PEN_ERROR_INIT;

	(void)umask(077);
	if (find_file(request, usual_file, &err) < 0 || change(request, &err) < 0)
		return pen_complain(&err);
	return PEN_COMMAND_OK;
}

int pen_access_token(int argc, char **argv)
{
	static const struct option options[] = {{"data", required_argument, NULL, 'd'},
		{"scope", required_argument, NULL, 's'}, {"output", required_argument, NULL, 'o'},
		{"tokens", required_argument, NULL, 'f'}, {"help", no_argument, NULL, 'h'}, {0}};
	struct request request = {0};
	int code = parse(argc, argv, options, token_usage, &request);

	return code == PEN_COMMAND_OK && !request.help ? run(&request, "tokens", change_tokens)
						       : code;
}

int pen_access_worker(int argc, char **argv)
{
	static const struct option options[] = {{"data", required_argument, NULL, 'd'},
		{"output", required_argument, NULL, 'o'},
		{"worker-keys", required_argument, NULL, 'f'}, {"help", no_argument, NULL, 'h'},
		{0}};
	struct request request = {0};
	int code = parse(argc, argv, options, worker_usage, &request);

	return code == PEN_COMMAND_OK && !request.help
		       ? run(&request, "worker-keys", change_workers)
		       : code;
}
