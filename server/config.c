/* SPDX-License-Identifier: Apache-2.0 */
#include "server/config.h"

#include "core/base/limits.h"
#include "server/config_file.h"
#include "server/confine.h"

#include <arpa/inet.h>
#include <errno.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <uv.h>

const char pen_config_usage[] =
	"usage: penumbra serve [OPTION]...\n"
	"Run the coordinator, with a farm on this machine.\n"
	"\n"
	"  --listen ADDR:PORT         HTTP (127.0.0.1:8080; port 0: any free one)\n"
	"  --listen-unix PATH         HTTP by a socket in the file system, for this user\n"
	"  --worker-listen ADDR:PORT  workers (127.0.0.1:8081)\n"
	"  --data DIR                 renders and scenes ($XDG_STATE_HOME/penumbra, or\n"
	"                             ~/.local/state/penumbra)\n"
	"  --processes N              render processes here (one for each core; 0: none)\n"
	"  --isa v2|v3|v4             instruction set of the local farm (the best there is)\n"
	"  --tile N                   tile size in pixels, a multiple of 16 (chosen by image)\n"
	"  --keep-assets HOURS        kept scenes, and files that no scene names (24)\n"
	"  --keep-renders HOURS       renders that are over (0: for ever)\n"
	"  --keep-frames MIB          what frames may take on the disk (0: any)\n"
	"  --max-waiting N            renders that may wait at once (1000)\n"
	"  --tokens FILE              who may use HTTP (DIR/tokens); see penumbra token\n"
	"  --worker-keys FILE         which workers may come (DIR/worker-keys); see penumbra "
	"worker\n"
	"  --tls-cert FILE            certificate of HTTP, with those it goes back to (none: no "
	"TLS)\n"
	"  --tls-key FILE             its key; see penumbra cert\n"
	"  --sandbox MODE             of encoders and the local worker: require, best-effort or\n"
	"                             off (require if others can reach it, else best-effort)\n"
	"  --log-level LEVEL          error, warning, info or debug (info)\n"
	"  --log-format FORMAT        text, or json: a line of it an event (text)\n"
	"  --config FILE              these options but the next as lines KEY = VALUE\n"
	"                             ($PENUMBRA_CONFIG); see penumbra.conf(5)\n"
	"  --parent-death[=PID]       end when the process that started this one does, PID\n"
	"  --help                     print this\n"
	"\n"
	"Off loopback, HTTP needs TLS and tokens, and workers need keys. Both\n"
	"addresses are printed when the coordinator is ready, and written to DIR/ports.\n";

static int parse_number(const char *text, uint32_t max, uint32_t *ret_number)
{
	char *end;
	unsigned long number;

	errno = 0;
	number = strtoul(text, &end, 10);
	if (errno != 0 || *text < '0' || *text > '9' || *end != '\0' || number > max)
		return -1;
	*ret_number = (uint32_t)number;
	return 0;
}

static int parse_host(const char *host, uint16_t port, struct sockaddr_storage *ret_address)
{
	struct sockaddr_in *ip4 = (struct sockaddr_in *)ret_address;
	struct sockaddr_in6 *ip6 = (struct sockaddr_in6 *)ret_address;

	memset(ret_address, 0, sizeof *ret_address);
	if (strcmp(host, "localhost") == 0)
		host = "127.0.0.1";
	if (uv_ip4_addr(host, port, ip4) == 0)
		return 0;
	return uv_ip6_addr(host, port, ip6);
}

bool pen_config_is_loopback(const struct sockaddr_storage *address)
{
	if (address->ss_family == AF_INET6)
		return IN6_IS_ADDR_LOOPBACK(&((const struct sockaddr_in6 *)address)->sin6_addr);
	return ntohl(((const struct sockaddr_in *)address)->sin_addr.s_addr) >> 24 == 127;
}

/* "127.0.0.1:8080", "[::1]:8080", "localhost:0" */
static int parse_address(const char *option, const char *text, struct sockaddr_storage *ret_address,
	struct pen_error *err)
{
	const char *colon = strrchr(text, ':');
	char host[INET6_ADDRSTRLEN + 2];
	size_t length = colon ? (size_t)(colon - text) : 0;
	const char *begin = text;
	uint32_t port;

	if (length >= 2 && begin[0] == '[' && begin[length - 1] == ']') {
		begin++;
		length -= 2;
	}
	if (!colon || length == 0 || length >= sizeof host ||
		parse_number(colon + 1, UINT16_MAX, &port) < 0)
		return pen_error_set(err, PEN_EINVALID, "--%s takes ADDRESS:PORT", option);
	memcpy(host, begin, length);
	host[length] = '\0';
	if (parse_host(host, (uint16_t)port, ret_address) != 0)
		return pen_error_set(err, PEN_EINVALID,
			"--%s takes a numeric address, as in 127.0.0.1:8080", option);
	return 0;
}

static int parse_isa(const char *text, const char **ret_isa, struct pen_error *err)
{
	static const char *const names[] = {"v2", "v3", "v4"};

	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		if (strcmp(text, names[i]) != 0)
			continue;
		*ret_isa = names[i];
		return 0;
	}
	return pen_error_set(err, PEN_EINVALID, "--isa takes v2, v3 or v4");
}

static int parse_tile(const char *text, uint32_t *ret_tile_px, struct pen_error *err)
{
	uint32_t tile_px;

	if (parse_number(text, PEN_TILE_SIDE_MAX, &tile_px) < 0 || tile_px < 16 ||
		tile_px % 16 != 0)
		return pen_error_set(err, PEN_EINVALID,
			"--tile takes a multiple of 16 from 16 to %u", PEN_TILE_SIDE_MAX);
	*ret_tile_px = tile_px;
	return 0;
}

int pen_config_parse_data(const char *text, char *ret_dir, struct pen_error *err)
{
	if (text[0] == '\0' || snprintf(ret_dir, PATH_MAX, "%s", text) >= PATH_MAX - 128)
		return pen_error_set(err, PEN_EINVALID, "--data takes a directory");
	return 0;
}

int pen_config_default_data(char *ret_dir, struct pen_error *err)
{
	const char *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
	char path[PATH_MAX];

	if (state && state[0] == '/')
		(void)snprintf(path, sizeof path, "%s/penumbra", state);
	else if (home && home[0] == '/')
		(void)snprintf(path, sizeof path, "%s/.local/state/penumbra", home);
	else
		return pen_error_set(
			err, PEN_EINVALID, "there is no HOME: name a directory with --data");
	return pen_config_parse_data(path, ret_dir, err);
}

enum {
	LISTEN = 1,
	LISTEN_UNIX,
	WORKER_LISTEN,
	DATA,
	PROCESSES,
	ISA,
	TILE,
	KEEP_ASSETS,
	KEEP_RENDERS,
	KEEP_FRAMES,
	MAX_WAITING,
	TOKENS,
	WORKER_KEYS,
	TLS_CERT,
	TLS_KEY,
	SANDBOX,
	LOG_LEVEL,
	LOG_FORMAT,
	CONFIG,
	PARENT_DEATH,
	HELP
};

static const struct option options[] = {
	{"listen", required_argument, NULL, LISTEN},
	{"listen-unix", required_argument, NULL, LISTEN_UNIX},
	{"worker-listen", required_argument, NULL, WORKER_LISTEN},
	{"data", required_argument, NULL, DATA},
	{"processes", required_argument, NULL, PROCESSES},
	{"isa", required_argument, NULL, ISA},
	{"tile", required_argument, NULL, TILE},
	{"keep-assets", required_argument, NULL, KEEP_ASSETS},
	{"keep-renders", required_argument, NULL, KEEP_RENDERS},
	{"keep-frames", required_argument, NULL, KEEP_FRAMES},
	{"max-waiting", required_argument, NULL, MAX_WAITING},
	{"tokens", required_argument, NULL, TOKENS},
	{"worker-keys", required_argument, NULL, WORKER_KEYS},
	{"tls-cert", required_argument, NULL, TLS_CERT},
	{"tls-key", required_argument, NULL, TLS_KEY},
	{"sandbox", required_argument, NULL, SANDBOX},
	{"log-level", required_argument, NULL, LOG_LEVEL},
	{"log-format", required_argument, NULL, LOG_FORMAT},
	{"config", required_argument, NULL, CONFIG},
	{"parent-death", optional_argument, NULL, PARENT_DEATH},
	{"help", no_argument, NULL, HELP},
	{NULL, 0, NULL, 0},
};

static int parse_hours(
	const char *option, const char *value, uint32_t *ret_s, struct pen_error *err)
{
	if (parse_number(value, PEN_KEEP_HOURS_MAX, ret_s) < 0)
		return pen_error_set(err, PEN_EINVALID, "--%s takes a number of hours from 0 to %u",
			option, PEN_KEEP_HOURS_MAX);
	*ret_s *= 3600;
	return 0;
}

static int parse_path(const char *option, const char *value, char *ret_path, struct pen_error *err)
{
	if (value[0] == '\0' || snprintf(ret_path, PATH_MAX, "%s", value) >= PATH_MAX)
		return pen_error_set(err, PEN_EINVALID, "--%s takes a file", option);
	return 0;
}

static int parse_option(
	struct pen_config *config, int option, const char *value, struct pen_error *err)
{
	uint32_t number;

	switch (option) {
	case LISTEN: return parse_address("listen", value, &config->listen, err);
	case LISTEN_UNIX: return parse_path("listen-unix", value, config->listen_unix, err);
	case WORKER_LISTEN:
		return parse_address("worker-listen", value, &config->worker_listen, err);
	case DATA: return pen_config_parse_data(value, config->data_dir, err);
	case PROCESSES:
		if (parse_number(value, PEN_PROCESSES_MAX, &config->processes) < 0)
			return pen_error_set(err, PEN_EINVALID,
				"--processes takes a number from 0 to %u", PEN_PROCESSES_MAX);
		return 0;
	case ISA: return parse_isa(value, &config->isa, err);
	case TILE: return parse_tile(value, &config->tile_px, err);
	case KEEP_ASSETS: return parse_hours("keep-assets", value, &config->keep_assets_s, err);
	case KEEP_RENDERS: return parse_hours("keep-renders", value, &config->keep_renders_s, err);
	case KEEP_FRAMES:
		if (parse_number(value, PEN_KEEP_MIB_MAX, &number) < 0)
			return pen_error_set(err, PEN_EINVALID,
				"--keep-frames takes a number of MiB from 0 to %u",
				PEN_KEEP_MIB_MAX);
		config->keep_bytes = (uint64_t)number << 20;
		return 0;
	case MAX_WAITING:
		if (parse_number(value, PEN_JOBS_QUEUED_CEILING, &config->waiting_max) < 0 ||
			config->waiting_max == 0)
			return pen_error_set(err, PEN_EINVALID,
				"--max-waiting takes a number from 1 to %u",
				PEN_JOBS_QUEUED_CEILING);
		return 0;
	case TOKENS: return parse_path("tokens", value, config->tokens, err);
	case WORKER_KEYS: return parse_path("worker-keys", value, config->worker_keys, err);
	case TLS_CERT: return parse_path("tls-cert", value, config->tls_cert, err);
	case TLS_KEY: return parse_path("tls-key", value, config->tls_key, err);
	case SANDBOX:
		config->has_sandbox = true;
		return pen_sandbox_mode_parse(value, &config->sandbox, err);
	case LOG_LEVEL: return pen_log_level_parse(value, &config->log_level, err);
	case LOG_FORMAT: return pen_log_format_parse(value, &config->log_format, err);
	case PARENT_DEATH:
		if (!value || parse_number(value, INT_MAX, &number) == 0) {
			config->parent = value ? (pid_t)number : getppid();
			return 0;
		}
		return pen_error_set(err, PEN_EINVALID, "--parent-death takes a process's number");
	default: config->help = true; return 0;
	}
}

static void set_defaults(struct pen_config *ret_config)
{
	unsigned cores = uv_available_parallelism();

	*ret_config = (struct pen_config){
		.processes = cores < PEN_PROCESSES_MAX ? cores : PEN_PROCESSES_MAX,
		.keep_assets_s = 24 * 3600,
		.waiting_max = PEN_JOBS_QUEUED_MAX,
		.log_level = PEN_LOG_INFO,
	};
	(void)parse_host("127.0.0.1", 8080, &ret_config->listen);
	(void)parse_host("127.0.0.1", 8081, &ret_config->worker_listen);
}

/* A file's settings, and which options they were: each may stand once. */
struct reading {
	struct pen_config *config;
	bool seen[HELP];
};

/* What makes sense for one start only is left to the command line. */
static const struct option *find_setting(const char *key)
{
	for (const struct option *option = options; option->name; option++)
		if (option->val < CONFIG && strcmp(option->name, key) == 0)
			return option;
	return NULL;
}

static int set_from_file(void *user, const char *key, const char *value, struct pen_error *err)
{
	struct reading *reading = user;
	const struct option *option = find_setting(key);
	struct pen_error fault = PEN_ERROR_INIT;
	int r;

	if (!option)
		return pen_error_set(err, PEN_EINVALID, "there is no setting \"%s\"", key);
	if (reading->seen[option->val])
		return pen_error_set(err, PEN_EINVALID, "%s is set above already", key);
	reading->seen[option->val] = true;
	r = parse_option(reading->config, option->val, value, &fault);
	if (r < 0)
		(void)pen_error_set(err, r, "%s",
			strncmp(fault.text, "--", 2) == 0 ? fault.text + 2 : fault.text);
	return r;
}

static int read_file(const char *path, struct pen_config *config, struct pen_error *err)
{
	struct reading reading = {.config = config};

	return pen_config_file_read(path, set_from_file, &reading, err);
}

int pen_config_check(const char *path, struct pen_error *err)
{
	struct pen_config config;
	int r;

	set_defaults(&config);
	r = read_file(path, &config, err);
	return r < 0 ? r : pen_confine_check(pen_confine_mode(&config, &config.listen), err);
}

static int read_words(int argc, char **argv, struct pen_config *config, const char **ret_file,
	struct pen_error *err)
{
	int option, r = 0;

	optind = 1;
	while (r == 0 && (option = getopt_long(argc, argv, ":", options, NULL)) != -1) {
		if (option == ':' || option == '?')
			r = pen_error_set(err, PEN_EINVALID, "%s is no option, or lacks its value",
				argv[optind - 1]);
		else if (option == CONFIG)
			*ret_file = optarg;
		else
			r = parse_option(config, option, optarg, err);
	}
	if (r == 0 && optind < argc)
		r = pen_error_set(err, PEN_EINVALID, "serve takes options only");
	return r;
}

static int read_any_file(const char *named, struct pen_config *config, struct pen_error *err)
{
	const char *usual = getenv("PENUMBRA_CONFIG");
	int r;

	if (named)
		return read_file(named, config, err);
	if (!usual || *usual == '\0')
		return 0;
	r = read_file(usual, config, err);
	return r == PEN_ENOTFOUND ? 0 : r;
}

int pen_config_parse(int argc, char **argv, struct pen_config *ret_config, struct pen_error *err)
{
	struct pen_config config;
	const char *file = NULL;
	int r;

	set_defaults(&config);
	r = read_words(argc, argv, &config, &file, err);
	if (r == 0 && !config.help) {
		/* Once more, over the file. */
		set_defaults(&config);
		r = read_any_file(file, &config, err);
		if (r == 0)
			r = read_words(argc, argv, &config, &file, err);
	}
	if (r == 0 && config.data_dir[0] == '\0')
		r = pen_config_default_data(config.data_dir, err);
	if (r == 0 && (config.tls_cert[0] == '\0') != (config.tls_key[0] == '\0'))
		r = pen_error_set(err, PEN_EINVALID,
			"--tls-cert and --tls-key go together: penumbra cert makes both");
	if (r == 0 && config.tokens[0] == '\0')
		(void)snprintf(
			config.tokens, PATH_MAX, "%.*s/tokens", PATH_MAX - 128, config.data_dir);
	if (r == 0 && config.worker_keys[0] == '\0')
		(void)snprintf(config.worker_keys, PATH_MAX, "%.*s/worker-keys", PATH_MAX - 128,
			config.data_dir);
	if (r == 0)
		*ret_config = config;
	return r;
}
