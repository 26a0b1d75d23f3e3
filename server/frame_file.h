/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_FRAME_FILE_H
#define PEN_SERVER_FRAME_FILE_H

#include "server/framebuf.h"
#include "server/job.h"

/* Where a frame's framebuffer lies in a data directory; ret_path holds PATH_MAX characters. */
void pen_frame_file_path(
	const char *data_dir, const struct pen_job *job, uint32_t frame, char *ret_path);

/* What is in it. */
struct pen_framebuf pen_frame_file_shape(const struct pen_job *job);

#endif
