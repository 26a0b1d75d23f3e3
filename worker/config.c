/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/config.h"

#include <arpa/inet.h>
#include <errno.h>
#include <getopt.h>
#include <limits.h>
#include <sched.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum option_id {
	OPTION_CONNECT = 256,
	OPTION_PROCESSES,
	OPTION_NAME,
	OPTION_ISA,
	OPTION_KEY_FD,
	OPTION_KEY_FILE,
	OPTION_PARENT_DEATH,
	OPTION_SANDBOX,
	OPTION_LOG_LEVEL,
	OPTION_LOG_FORMAT,
	OPTION_ASSET_CACHE,
	OPTION_HELP,
	OPTION_VERSION
};

static const struct option options[] = {
	{"connect", required_argument, NULL, OPTION_CONNECT},
	{"processes", required_argument, NULL, OPTION_PROCESSES},
	{"name", required_argument, NULL, OPTION_NAME},
	{"isa", required_argument, NULL, OPTION_ISA},
	{"key-fd", required_argument, NULL, OPTION_KEY_FD},
	{"key-file", required_argument, NULL, OPTION_KEY_FILE},
	{"parent-death", optional_argument, NULL, OPTION_PARENT_DEATH},
	{"sandbox", required_argument, NULL, OPTION_SANDBOX},
	{"asset-cache", required_argument, NULL, OPTION_ASSET_CACHE},
	{"log-level", required_argument, NULL, OPTION_LOG_LEVEL},
	{"log-format", required_argument, NULL, OPTION_LOG_FORMAT},
	{"help", no_argument, NULL, OPTION_HELP},
	{"version", no_argument, NULL, OPTION_VERSION},
	{0},
};

const char *pen_worker_config_usage(void)
{
	return "usage: penumbra-worker --connect HOST:PORT [option...]\n"
	       "Renders tiles for the coordinator at HOST:PORT.\n"
	       "\n"
	       "  --processes N        render processes (default: one per core)\n"
	       "  --name NAME          how the coordinator lists this worker (default: host-pid)\n"
	       "  --isa v2|v3|v4       instruction set (default: the best of this processor)\n"
	       "  --sandbox MODE       require, best-effort or off (best-effort for a coordinator "
	       "on\n"
	       "                       a loopback address, else require)\n"
	       "  --asset-cache MIB    memory for assets that later scenes may name (default: an\n"
	       "                       eighth of the machine's)\n"
	       "  --log-level LEVEL    error, warning, info (default) or debug\n"
	       "  --log-format FORMAT  text (default), or json: a line of it an event\n"
	       "  --key-file FILE      what the coordinator knows this worker by, of penumbra "
	       "worker add;\n"
	       "                       the connection is TLS then\n"
	       "  --key-fd FD          the same from a descriptor, for one connection\n"
	       "  --parent-death[=PID] end when the parent process does, which is PID\n"
	       "  --help, --version\n";
}

static uint32_t core_count(void)
{
	cpu_set_t cores;
	int count;

	if (sched_getaffinity(0, sizeof cores, &cores) < 0)
		return 1;
	count = CPU_COUNT(&cores);
	return count < (int)PEN_PROCESSES_MAX ? (uint32_t)count : PEN_PROCESSES_MAX;
}

static uint64_t memory_bytes(void)
{
	return (uint64_t)sysconf(_SC_PHYS_PAGES) * (uint64_t)sysconf(_SC_PAGESIZE);
}

static int parse_number(const char *text, long min, long max, const char *option, long *ret_number,
	struct pen_error *err)
{
	char *end;
	long number;

	errno = 0;
	number = strtol(text, &end, 10);
	if (errno || end == text || *end || number < min || number > max)
		return pen_error_set(
			err, PEN_EINVALID, "%s takes a number from %ld to %ld", option, min, max);
	*ret_number = number;
	return 0;
}

/* HOST:PORT, where an IPv6 host may stand in brackets. */
static int parse_address(const char *text, struct pen_worker_config *config, struct pen_error *err)
{
	const char *colon = strrchr(text, ':');
	size_t length = colon ? (size_t)(colon - text) : 0;
	long port;
	int r;

	if (length == 0)
		return pen_error_set(err, PEN_EINVALID, "--connect takes HOST:PORT");
	r = parse_number(colon + 1, 1, 65535, "the port of --connect", &port, err);
	if (r < 0)
		return r;
	if (text[0] == '[' && text[length - 1] == ']') {
		text++;
		length -= 2;
	}
	if (length == 0 || length > PEN_NAME_MAX)
		return pen_error_set(err, PEN_EINVALID, "the host of --connect is too long");
	memcpy(config->host, text, length);
	config->host[length] = '\0';
	(void)snprintf(config->port, sizeof config->port, "%ld", port);
	return 0;
}

static int parse_isa(const char *text, enum pen_isa *ret_isa, struct pen_error *err)
{
	int r = pen_isa_parse(text, ret_isa, err);

	if (r == 0 && !pen_isa_supported(*ret_isa))
		r = pen_error_set(err, PEN_EINVALID, "this processor does not run %s",
			pen_isa_name(*ret_isa));
	return r;
}

static int parse_name(const char *text, struct pen_worker_config *config, struct pen_error *err)
{
	size_t length = strlen(text);

	if (length == 0 || length > PEN_NAME_MAX)
		return pen_error_set(err, PEN_EINVALID, "--name takes 1 to %u bytes", PEN_NAME_MAX);
	memcpy(config->name, text, length + 1);
	return 0;
}

static int parse_option(
	int id, const char *value, struct pen_worker_config *config, struct pen_error *err)
{
	long number = 0;
	int r;

	switch (id) {
	case OPTION_CONNECT: return parse_address(value, config, err);
	case OPTION_NAME: return parse_name(value, config, err);
	case OPTION_ISA: return parse_isa(value, &config->isa, err);
	case OPTION_SANDBOX:
		config->has_sandbox = true;
		return pen_sandbox_mode_parse(value, &config->sandbox, err);
	case OPTION_LOG_LEVEL: return pen_log_level_parse(value, &config->log_level, err);
	case OPTION_LOG_FORMAT: return pen_log_format_parse(value, &config->log_format, err);
	case OPTION_PROCESSES:
		r = parse_number(value, 1, PEN_PROCESSES_MAX, "--processes", &number, err);
		if (r == 0)
			config->processes = (uint32_t)number;
		return r;
	case OPTION_ASSET_CACHE:
		r = parse_number(value, 0, 1 << 24, "--asset-cache", &number, err);
		if (r == 0)
			config->asset_bytes = (uint64_t)number << 20;
		return r;
	case OPTION_KEY_FD:
		r = parse_number(value, 3, 65535, "--key-fd", &number, err);
		if (r == 0)
			config->key_fd = (int)number;
		return r;
	case OPTION_KEY_FILE: config->key_file = value; return 0;
	case OPTION_PARENT_DEATH:
		number = getppid();
		r = value ? parse_number(value, 1, INT_MAX, "--parent-death", &number, err) : 0;
		config->parent = (pid_t)number;
		return r;
	case OPTION_HELP: config->help = true; return 0;
	case OPTION_VERSION: config->version = true; return 0;
	default:
		return pen_error_set(err, PEN_EINVALID, "unknown or incomplete option; see --help");
	}
}

/* Not what a name resolves to, which may change. */
static bool is_loopback(const char *host)
{
	struct in6_addr ip6;
	struct in_addr ip4;

	if (inet_pton(AF_INET6, host, &ip6) == 1)
		return IN6_IS_ADDR_LOOPBACK(&ip6);
	return strcmp(host, "localhost") == 0 ||
	       (inet_pton(AF_INET, host, &ip4) == 1 && ntohl(ip4.s_addr) >> 24 == 127);
}

static void set_defaults(struct pen_worker_config *config)
{
	char host[HOST_NAME_MAX + 1] = "worker";

	(void)gethostname(host, sizeof host - 1);
	*config = (struct pen_worker_config){
		.processes = core_count(),
		.isa = pen_isa_best(),
		.log_level = PEN_LOG_INFO,
		.asset_bytes = memory_bytes() / 8,
		.key_fd = -1,
	};
	(void)snprintf(config->name, sizeof config->name, "%s-%ld", host, (long)getpid());
}

int pen_worker_config_parse(
	int argc, char **argv, struct pen_worker_config *ret_config, struct pen_error *err)
{
	struct pen_worker_config config;
	int id, r;

	set_defaults(&config);
	opterr = 0;
	while ((id = getopt_long(argc, argv, "", options, NULL)) != -1) {
		r = parse_option(id, optarg, &config, err);
		if (r < 0)
			return r;
	}
	if (optind < argc)
		return pen_error_set(
			err, PEN_EINVALID, "%s is no option; see --help", argv[optind]);
	if (config.host[0] == '\0' && !config.help && !config.version)
		return pen_error_set(err, PEN_EINVALID, "--connect HOST:PORT is missing");
	if (!config.has_sandbox)
		config.sandbox =
			is_loopback(config.host) ? PEN_SANDBOX_BEST_EFFORT : PEN_SANDBOX_REQUIRE;
	*ret_config = config;
	return 0;
}
