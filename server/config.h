/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CONFIG_H
#define PEN_SERVER_CONFIG_H

#include "core/base/error.h"
#include "core/base/log.h"
#include "core/base/sandbox.h"

#include <limits.h>
#include <netinet/in.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/types.h>

/* What `penumbra serve` was told on its command line and in its file, defaults filled in. */
struct pen_config {
	struct sockaddr_storage listen, worker_listen; /* loopback; port 0: any */
	char listen_unix[PATH_MAX];		       /* "": none */
	char data_dir[PATH_MAX];
	uint32_t processes;	    /* of the local worker; 0: none is started */
	const char *isa;	    /* of the local worker, a constant; NULL: its best */
	char worker_keys[PATH_MAX]; /* file of them */
	char tls_cert[PATH_MAX], tls_key[PATH_MAX]; /* "": no TLS */
	char tokens[PATH_MAX];			    /* file of them */
	uint32_t tile_px;			    /* 0: chosen for each image */
	uint32_t keep_assets_s;			    /* that no render names */
	uint32_t keep_renders_s;		    /* that are over; 0: for ever */
	uint64_t keep_bytes;			    /* of frames; 0: without bound */
	uint32_t waiting_max;			    /* renders that are not over */
	bool has_sandbox;			    /* else server/confine.h chooses */
	enum pen_sandbox_mode sandbox;
	enum pen_log_level log_level;
	enum pen_log_format log_format;
	pid_t parent; /* end when it does; 0: live on */
	bool help;
};

/* The text of --help. */
extern const char pen_config_usage[];

/*
 * The file is that of --config, which must exist, or that of the variable PENUMBRA_CONFIG, which
 * need not; the command line goes over it. PEN_EINVALID names the option, or the line of the file,
 * and what it takes.
 */
int pen_config_parse(int argc, char **argv, struct pen_config *ret_config, struct pen_error *err);

/*
 * Whether serve would accept the file: the same errors, PEN_ENOTFOUND among them, and those of a
 * sandbox that the file's settings require.
 */
int pen_config_check(const char *path, struct pen_error *err);

/* A directory as --data takes it, and the one that is meant without it; of PATH_MAX characters. */
int pen_config_parse_data(const char *text, char *ret_dir, struct pen_error *err);
int pen_config_default_data(char *ret_dir, struct pen_error *err);

/* Whether nobody but this machine can reach it. */
bool pen_config_is_loopback(const struct sockaddr_storage *address);

#endif
