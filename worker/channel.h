/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_CHANNEL_H
#define PEN_WORKER_CHANNEL_H

#include "core/base/error.h"
#include "core/base/limits.h"
#include "core/render/render.h"

#include <assert.h>
#include <stdint.h>
#include <sys/types.h>

/*
 * What the processes of one worker say to each other: whole structs over SOCK_SEQPACKET pairs,
 * descriptors attached. The pool makes every pair and keeps one end; its end never blocks.
 */

enum pen_control_type {
	/* pool to zygote */
	PEN_CONTROL_FORK = 1, /* make scene process id; attached: its channel, its result memory */
	PEN_CONTROL_KILL,     /* end scene process id */
	/* pool to scene process */
	PEN_CONTROL_LOAD, /* attached: the scene's text; frame will be asked for first */
	PEN_CONTROL_LOOK, /* attached: the text of a scene that differs in its view alone: show that
			     from now on; all render processes are started anew */
	PEN_CONTROL_START, /* fork the render process of slot id for frame, in place of the one
			      before; attached: its channel */
	PEN_CONTROL_ASSET, /* an asset that it needs; attached: its bytes */
	/* scene process to pool */
	PEN_CONTROL_NEEDS,   /* id hashes of assets in reason, of serial in all: the next ones that
				it needs */
	PEN_CONTROL_ERROR,   /* before FAILED: something wrong with the scene at pointer: reason */
	PEN_CONTROL_WARNING, /* before READY: something of its assets is left out: reason */
	PEN_CONTROL_READY,   /* the scene has been built */
	PEN_CONTROL_FAILED,  /* it, or a frame of it, cannot be: reason */
	/* zygote and scene process to pool: a child (id) ended or was stopped: wait status */
	PEN_CONTROL_CHILD
};

struct pen_control {
	uint32_t type;
	uint32_t id;
	int32_t status;
	uint32_t frame;
	uint32_t serial; /* of START; CHILD of a scene process repeats it */
	char pointer[PEN_SCENE_ERROR_BYTES_MAX + 1];  /* ends in NUL */
	char reason[PEN_SCENE_WARNING_BYTES_MAX + 1]; /* ends in NUL */
};
static_assert(sizeof(struct pen_control) == 788, "no padding");

enum { PEN_CONTROL_NEEDS_MAX = sizeof(((struct pen_control *)0)->reason) / 32 };

/*
 * pool to render process; the answer to each is one pen_answer. One of lease 0 is no order:
 * channels bytes of text are the next message, as in PEN_CONTROL_LOOK, and the answer tells which
 * frames are ready after that.
 */
struct pen_order {
	uint64_t lease;
	struct pen_unit unit; /* its mask is the receiver's to set */
	uint32_t channels;    /* of the scene's film */
	uint32_t has_mask;    /* 0 or 1 */
	uint32_t place;	      /* for its pixels, below PEN_RESULT_PLACES */
	uint32_t unused;
	uint8_t mask[PEN_MASK_BYTES_MAX];
};
static_assert(sizeof(struct pen_order) == 64 + PEN_MASK_BYTES_MAX, "no padding");

/*
 * render process to pool. The first one, with lease 0, says that the process is ready, and for
 * which frames: only those may be ordered.
 */
struct pen_answer {
	uint64_t lease;
	uint32_t frame_first, frame_end;
	uint64_t xxh3; /* of the pixels in the slot's result memory */
	uint64_t render_us;
	struct pen_render_stats stats;
};
static_assert(sizeof(struct pen_answer) == 64, "no padding");

enum { PEN_CHANNEL_FDS_MAX = 2, PEN_LOOK_BYTES_MAX = 64 << 10 };

/* A connected pair, close-on-exec. ret_pool does not block and is told who sends. */
int pen_channel_pair(int *ret_pool, int *ret_child, struct pen_error *err);

/* PEN_EAGAIN when the peer's queue is full, PEN_ECLOSED when it has gone. */
int pen_channel_send(int fd, const void *message, size_t size, const int *fds, size_t fd_count);

/*
 * Receives one message of exactly size bytes. fds gets at most fd_count descriptors (the caller
 * closes them), absent ones are -1; *ret_sender, which may be NULL, the peer's process id as the
 * kernel knows it, 0 when it does not. PEN_EAGAIN, PEN_ECLOSED, or PEN_EPROTOCOL for another size.
 */
int pen_channel_receive(
	int fd, void *message, size_t size, int *fds, size_t fd_count, pid_t *ret_sender);

#endif
