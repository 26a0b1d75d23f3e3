/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_GLB_REQUEST_H
#define PEN_SERVER_GLB_REQUEST_H

#include "core/base/digest.h"
#include "core/base/error.h"
#include "server/exchange.h"

#include <jansson.h>

/*
 * A GLB that is posted by itself: its settings are the query's, and the scene around it is the one
 * that the command line makes of a GLB, so that both have one content address.
 */

/*
 * The envelope of a request, whose scene's object names no asset yet. PEN_EINVALID names a
 * parameter that is unknown, or is no number; whether the numbers make sense is found when the
 * scene is read.
 */
int pen_glb_request_read(
	const struct pen_exchange *exchange, json_t **ret_envelope, struct pen_error *err);

/* Puts the asset in, and gives the envelope's text (heap). PEN_ENOMEM. */
int pen_glb_request_text(json_t *envelope, const struct pen_sha256 *asset, char **ret_text,
	size_t *ret_size, struct pen_error *err);

#endif
