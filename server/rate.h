/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_RATE_H
#define PEN_SERVER_RATE_H

#include "core/base/limits.h"
#include "server/owner.h"

#include <stdint.h>

/*
 * How often each token may ask for a render: PEN_SUBMIT_BURST at once, then one in
 * PEN_SUBMIT_EVERY_MS. Who asks without a token is not counted. Zeroed, nobody has asked yet.
 */
struct pen_rates {
	struct {
		struct pen_sha256 token;
		int64_t due_ms; /* by when all that it asked for was its share */
	} slots[PEN_TOKENS_MAX];
};

/* 0: it is counted. Else it is not, and would be that many milliseconds later. */
int64_t pen_rates_take(struct pen_rates *rates, const struct pen_owner *owner, int64_t now_ms);

#endif
