/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_ENCODE_H
#define PEN_SERVER_ENCODE_H

#include "core/base/error.h"
#include "core/base/format.h"
#include "core/base/layer.h"
#include "core/base/sandbox.h"
#include "core/base/tile.h"

#include <stdbool.h>
#include <stdint.h>
#include <uv.h>

/*
 * Framebuffers to image files, in sandboxed helper processes (the penumbra-encoder program), at
 * most two at a time, so that no image library is ever linked into the coordinator.
 */
struct pen_encoders;

struct pen_encoding {
	const char *job_id;
	uint32_t frame;
	uint64_t revision; /* of the frame: cached results are keyed by it */
	bool final;	   /* the frame is done: full compression; else the fastest */
	enum pen_image_format format;
	uint32_t width, height;		/* of the whole image */
	struct pen_rect region;		/* of it, if out_width is not 0: PNG and JPEG */
	uint32_t out_width, out_height; /* what the region is shrunk to */
	struct pen_tiling tiling;
	uint32_t planes;			 /* enum pen_plane: of the framebuffer */
	uint32_t layers;			 /* 1 << enum pen_layer: the job's */
	enum pen_layer layer;			 /* one of them: what the image shows */
	uint32_t samples;			 /* of a pixel, at most */
	double exposure;			 /* stops; PNG and JPEG */
	const char *content, *equivalence_class; /* "" and NULL: not known yet */
};

/*
 * A file with the encoded image: size bytes, read-only, without a name; the callee closes fd.
 * On failure fd is -1. Called from the loop, never from within pen_encoders_request.
 */
typedef void pen_encoding_fn(void *user, int fd, uint64_t size, const struct pen_error *err);

/*
 * Starts the first helper. program is the path of penumbra-encoder; cache_dir exists and gets the
 * files, which have no name and so vanish with the coordinator.
 */
int pen_encoders_create(uv_loop_t *loop, const char *program, enum pen_sandbox_mode sandbox,
	const char *cache_dir, struct pen_encoders **ret_encoders, struct pen_error *err);

/* Stops the helpers; waiting requests end with PEN_ECLOSED; memory goes when the loop has run. */
void pen_encoders_destroy(struct pen_encoders *encoders);

/*
 * A descriptor of the image if it was encoded lately and is still kept, else -1; the caller closes
 * it. Costs no more than a dup.
 */
int pen_encoders_cached(
	struct pen_encoders *encoders, const struct pen_encoding *encoding, uint64_t *ret_size);

/* The whole image, which the caller releases, if it is kept in memory; else NULL. */
struct pen_shared_bytes *pen_encoders_hold(
	struct pen_encoders *encoders, const struct pen_encoding *encoding);

/*
 * framebuffer_fd (see server/framebuf.h) passes to the callee, also on failure. Equal requests
 * that wait share one encoding. PEN_EAGAIN when PEN_ENCODINGS_WAITING_MAX wait.
 */
int pen_encoders_request(struct pen_encoders *encoders, const struct pen_encoding *encoding,
	int framebuffer_fd, pen_encoding_fn *fn, void *user, struct pen_error *err);

/* Forgets the cached encodings of a job that was deleted. */
void pen_encoders_forget(struct pen_encoders *encoders, const char *job_id);

#endif
