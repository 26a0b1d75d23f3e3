/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_FARM_H
#define PEN_SERVER_API_FARM_H

#include "server/api.h"

/* GET /v1/workers, /v1/farm, /metrics, /livez and /readyz. */
void pen_api_workers(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

/* POST of /v1/workers/{id}/drain and /reset. */
void pen_api_worker_drain(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_worker_reset(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

void pen_api_farm(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_metrics(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_livez(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);
void pen_api_readyz(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

#endif
