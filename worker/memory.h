/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_MEMORY_H
#define PEN_WORKER_MEMORY_H

#include "core/base/error.h"
#include "core/base/limits.h"

#include <stddef.h>
#include <stdint.h>

/*
 * Memory that the processes of a worker share by descriptor. Its size is sealed before it is handed
 * out, so that no peer can take pages away from under a reader.
 */

enum { PEN_RESULT_PLACES = 2 };

/*
 * What a render process writes for the pool; one for each slot, side by side in one memory. Units
 * take turns at the places: while the pool reads a unit's pixels the next one is rendered.
 */
struct pen_result {
	_Atomic uint64_t progress; /* samples finished of the unit being rendered */
	_Alignas(4096) float pixels[PEN_RESULT_PLACES][PEN_TILE_BYTES_MAX / sizeof(float)];
};

/* Results of count slots. */
int pen_memory_results(uint32_t count, int *ret_fd, struct pen_error *err);

/* Memory of size bytes for a scene's text or an asset, still open to writing. */
int pen_memory_create(const char *name, uint64_t size, int *ret_fd, struct pen_error *err);

/* From now on nobody can write to it, ourselves included. No writable mapping may exist. */
int pen_memory_seal(int fd, struct pen_error *err);

/* All of it, read-only; the caller unmaps *ret_size bytes. */
int pen_memory_map(int fd, const void **ret_data, size_t *ret_size, struct pen_error *err);

/* The result of one slot, writable; stays for the life of the process. */
int pen_memory_map_result(
	int fd, uint32_t slot, struct pen_result **ret_result, struct pen_error *err);

#endif
