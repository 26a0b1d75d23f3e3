/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_CLIENT_H
#define PEN_SERVER_CLI_CLIENT_H

#include "core/base/error.h"

#include <jansson.h>
#include <stddef.h>

/*
 * HTTP with one server over one kept connection. Every call ends early, with PEN_ECLOSED, after
 * an interrupt (interrupt.h). Failures: PEN_ECLOSED when the server cannot be reached or stops
 * answering; for its refusals the text is the answer's detail and the code PEN_EINVALID (400, 422),
 * PEN_ENOTFOUND (404, 410), PEN_ECONFLICT (409), PEN_ELIMIT (413), PEN_EAGAIN (429, 503) or
 * PEN_EIO; PEN_EPROTOCOL when the answer is no answer.
 */
struct pen_client;

struct pen_credentials;

/* url: "http://HOST:PORT", or "unix:PATH", as the user typed it. credentials are borrowed; NULL:
 * none. */
int pen_client_create(const char *url, const struct pen_credentials *credentials,
	struct pen_client **ret_client, struct pen_error *err);
void pen_client_destroy(struct pen_client *client);

/* The path in "unix:PATH"; NULL when url is another. */
const char *pen_client_socket(const char *url);

/*
 * One request whose answer is JSON. body may be NULL; path begins with '/'. The answer stays the
 * client's: pen_client_answer has it until the next call.
 */
int pen_client_call(struct pen_client *client, const char *method, const char *path,
	const char *body, size_t size, struct pen_error *err);

/* Gets path and writes the bytes to fd from its beginning on. */
int pen_client_download(struct pen_client *client, const char *path, int fd, struct pen_error *err);

/* Hears of an upload, whose share that has gone out is 0..1. */
struct pen_client_watch {
	void (*moved)(void *user, double share);
	void *user;
};

/* Puts the bytes at path; whatever the answer's body is. */
int pen_client_upload(struct pen_client *client, const char *path, const void *data, size_t size,
	const struct pen_client_watch *watch, struct pen_error *err);

/* The last answer's JSON, also of a refusal; NULL without one. Borrowed. */
json_t *pen_client_answer(const struct pen_client *client);

#endif
