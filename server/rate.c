/* SPDX-License-Identifier: Apache-2.0 */
#include "server/rate.h"

#include <stddef.h>

/*
 * Of this token; else the one that is due first. When tokens are taken back and others come, that
 * is one of those that have asked for nothing in a while, whom it costs nothing to be forgotten.
 */
static size_t find_slot(const struct pen_rates *rates, const struct pen_sha256 *token)
{
	size_t first = 0;

	for (size_t i = 0; i < PEN_TOKENS_MAX; i++) {
		if (pen_sha256_equal(&rates->slots[i].token, token))
			return i;
		if (rates->slots[i].due_ms < rates->slots[first].due_ms)
			first = i;
	}
	return first;
}

int64_t pen_rates_take(struct pen_rates *rates, const struct pen_owner *owner, int64_t now_ms)
{
	const int64_t ahead_max = (int64_t)(PEN_SUBMIT_BURST - 1) * PEN_SUBMIT_EVERY_MS;
	int64_t due_ms = now_ms;
	size_t slot;

	if (!owner->is_known)
		return 0;
	slot = find_slot(rates, &owner->token);
	if (pen_sha256_equal(&rates->slots[slot].token, &owner->token) &&
		rates->slots[slot].due_ms > now_ms)
		due_ms = rates->slots[slot].due_ms;
	if (due_ms - now_ms > ahead_max)
		return due_ms - now_ms - ahead_max;
	rates->slots[slot].token = owner->token;
	rates->slots[slot].due_ms = due_ms + PEN_SUBMIT_EVERY_MS;
	return 0;
}
