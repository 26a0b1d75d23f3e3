/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CONTENT_H
#define PEN_SERVER_CONTENT_H

#include "core/base/digest.h"
#include "core/base/error.h"

/*
 * The content address of a render: what of a scene, named by the digest of its canonical text, a
 * worker of an equivalence class makes, bit for bit.
 */
int pen_content_of(const struct pen_sha256 *scene, const char *equivalence_class,
	struct pen_sha256 *ret_content, struct pen_error *err);

#endif
