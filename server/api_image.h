/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_IMAGE_H
#define PEN_SERVER_API_IMAGE_H

#include "server/api.h"

/* GET of /v1/renders/{id}/image.{png,jpg,exr,hdr}, and of /image by Accept. */
void pen_api_image_get(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

#endif
