/* SPDX-License-Identifier: Apache-2.0 */
#include "server/owner.h"

#include <string.h>

bool pen_owner_equal(const struct pen_owner *a, const struct pen_owner *b)
{
	return a->is_known == b->is_known && pen_sha256_equal(&a->token, &b->token);
}

int pen_owner_mix(const struct pen_owner *owner, const struct pen_sha256 *digest,
	struct pen_sha256 *ret_mixed, struct pen_error *err)
{
	uint8_t both[2 * sizeof digest->bytes];

	if (!owner->is_known) {
		*ret_mixed = *digest;
		return 0;
	}
	memcpy(both, digest->bytes, sizeof digest->bytes);
	memcpy(both + sizeof digest->bytes, owner->token.bytes, sizeof owner->token.bytes);
	return pen_sha256_of(both, sizeof both, ret_mixed, err);
}
