/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_CREDENTIALS_H
#define PEN_SERVER_CLI_CREDENTIALS_H

#include "core/base/error.h"

enum { PEN_CREDENTIAL_MAX = 4096 };

/* How a client shows who it is, and knows whom it talks to. */
struct pen_credentials {
	char token[PEN_CREDENTIAL_MAX + 1]; /* "": none */
	const char *ca_file; /* certificates that a server's may go back to; NULL: the system's */
};

/*
 * The token is the first line of the file, or else that of $PENUMBRA_TOKEN_FILE, or else
 * $PENUMBRA_TOKEN; each name may be NULL. ca_file is borrowed, or else it is $PENUMBRA_CA_FILE.
 * PEN_EINVALID: the token is no token; it is told without it.
 */
int pen_credentials_read(const char *token_file, const char *ca_file,
	struct pen_credentials *ret_credentials, struct pen_error *err);

/* PEN_EINVALID when the token would leave this machine in the clear. */
int pen_credentials_check(
	const struct pen_credentials *credentials, const char *url, struct pen_error *err);

#endif
