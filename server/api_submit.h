/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_SUBMIT_H
#define PEN_SERVER_API_SUBMIT_H

#include "server/api.h"

/* Before the body: a GLB goes into a file. False when the exchange has been answered. */
bool pen_api_submit_admit(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

/* POST of /v1/renders: a scene, an envelope around one, or a GLB. */
void pen_api_submit(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

#endif
