/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_SCENE_H
#define PEN_SERVER_API_SCENE_H

#include "server/api.h"

/* PUT and GET of /v1/scenes/sha256/{hash}: scenes that are kept for many views. */
void pen_api_scene_put(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_scene_get(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

/* GET /v1/renders/{id}/scene. */
void pen_api_render_scene(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

#endif
