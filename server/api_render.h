/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_RENDER_H
#define PEN_SERVER_API_RENDER_H

#include "server/api.h"

/* The render resource as the contract names its fields. */
json_t *pen_api_render_json(const struct pen_job *job);

/* 0 to 1: the part of its samples that is merged. */
double pen_api_render_progress(const struct pen_job *job);

/* GET, PATCH and DELETE of /v1/renders/{id}; GET of /v1/renders. */
void pen_api_render_get(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_render_patch(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_render_delete(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_render_list(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

#endif
