/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_API_PAGE_H
#define PEN_SERVER_API_PAGE_H

#include "server/api.h"

/* GET / and /web/{page}: the web page and its files. */
void pen_api_page(struct pen_exchange *exchange, const struct pen_api_parameters *parameters);

#endif
