/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_ASSET_H
#define PEN_SERVER_API_ASSET_H

#include "server/api.h"

/* Before the body of a PUT: where it goes. False when the exchange has been answered. */
bool pen_api_asset_admit(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

/* PUT and HEAD (and GET, which answers like HEAD) of /v1/assets/sha256/{hex}. */
void pen_api_asset_put(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_asset_get(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

/* POST of /v1/assets/missing: which of a list the service does not have. */
void pen_api_assets_missing(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

#endif
