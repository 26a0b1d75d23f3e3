/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_OWNER_H
#define PEN_SERVER_OWNER_H

#include "core/base/digest.h"
#include "core/base/error.h"

#include <stdbool.h>

/*
 * Whose a render is: that of the token it was asked for with, told by the hash of the token's
 * secret. So a token that takes the name of a removed one does not take its renders. Zeroed it is
 * nobody's: asked for without a token.
 */
struct pen_owner {
	bool is_known;
	struct pen_sha256 token; /* zeroed unless known */
};

bool pen_owner_equal(const struct pen_owner *a, const struct pen_owner *b);

/* The same digest for each owner another one; nobody's is the digest itself. */
int pen_owner_mix(const struct pen_owner *owner, const struct pen_sha256 *digest,
	struct pen_sha256 *ret_mixed, struct pen_error *err);

#endif
