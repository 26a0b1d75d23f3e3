/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_SUBMIT_H
#define PEN_SERVER_API_SUBMIT_H

#include "server/api.h"

/* POST of /v1/renders: a scene, or an envelope around one. */
void pen_api_submit(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

#endif
