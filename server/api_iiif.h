/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_IIIF_H
#define PEN_SERVER_API_IIIF_H

#include "server/api.h"

/*
 * The latest frame of a render as the IIIF Image API 3.0 offers images, level 1 and PNG: for
 * viewers that zoom. Below /v1/renders/{id}/iiif: nothing, info.json, and the images.
 */
void pen_api_iiif_base(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_iiif_info(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_iiif_image(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

#endif
