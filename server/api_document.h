/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_DOCUMENT_H
#define PEN_SERVER_API_DOCUMENT_H

#include "server/api.h"

/* GET /openapi.json and /scene.schema.json. */
void pen_api_openapi(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_scene_schema(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

#endif
