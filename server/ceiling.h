/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CEILING_H
#define PEN_SERVER_CEILING_H

#include <stddef.h>
#include <stdint.h>

/*
 * The most memory that the coordinator comes to use for what others send it, by the limits of
 * core/base/limits.h: what it says at its start. Workers and encoders are processes of their own.
 * Renders that are over and kept come on top, at about a KiB each.
 */
enum { PEN_CEILING_PARTS = 10, PEN_CEILING_TEXT = 320 };

struct pen_ceiling {
	struct {
		const char *name; /* static */
		uint64_t bytes;
	} parts[PEN_CEILING_PARTS];
	uint64_t bytes; /* of all */
};

/* waiting_max: how many renders may wait or be rendered. */
void pen_ceiling_compute(uint32_t waiting_max, struct pen_ceiling *ret_ceiling);

/* A sentence with all its parts in MiB. */
void pen_ceiling_format(const struct pen_ceiling *ceiling, char ret_text[static PEN_CEILING_TEXT]);

#endif
