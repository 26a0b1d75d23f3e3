/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_AGAIN_H
#define PEN_SERVER_API_AGAIN_H

#include "server/api.h"

/* A POST of what has been asked for before: by the same Idempotency-Key, or with the same content.
 */

/*
 * Takes the key of the request into submission, if it has one. The digest of the body is the
 * caller's to set. PEN_EINVALID.
 */
int pen_api_again_read_key(const struct pen_exchange *exchange, struct pen_submission *submission,
	struct pen_error *err);

/*
 * The render that there is already, or NULL. A key that came with another body is answered with
 * 422, one whose render is just being accepted with 409: then false.
 */
bool pen_api_again_find(struct pen_exchange *exchange, const struct pen_submission *submission,
	struct pen_job **ret_job);

#endif
