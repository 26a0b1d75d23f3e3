/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_SESSION_H
#define PEN_SERVER_CLI_SESSION_H

#include "core/base/error.h"
#include "server/cli/client.h"
#include "server/cli/credentials.h"
#include "server/cli/options.h"

#include <stdbool.h>

/* One run of a command that talks to a running server. */
struct pen_session {
	struct pen_options options;
	struct pen_credentials credentials;
	struct pen_client *client;
	struct pen_error err;
};

/* True: go on and close in the end. False: the command is over with *ret_exit. */
bool pen_session_open(struct pen_session *session, const struct pen_usage *usage, int argc,
	char **argv, int *ret_exit);

/* r: what the command came to, 0 or negative with session->err filled. Returns the exit code. */
int pen_session_close(struct pen_session *session, int r);

#endif
