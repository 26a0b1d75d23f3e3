/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_INTAKE_H
#define PEN_WORKER_INTAKE_H

#include "core/base/error.h"
#include "core/scene/desc.h"

/*
 * A scene process's way to its assets: asks the pool for those that the scene names, each once, and
 * calls use with the bytes of every mention. The bytes are gone when use returns. Blocks until the
 * pool has sent all; the process ends when the pool has gone or breaks the protocol.
 */
int pen_intake_run(int channel, const struct pen_scene *scene,
	int (*use)(void *user, const struct pen_blob *blobs, struct pen_error *err), void *user,
	struct pen_error *err);

#endif
