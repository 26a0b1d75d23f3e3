/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_ARENA_H
#define PEN_BASE_ARENA_H

#include <stddef.h>

/*
 * Memory that is freed all at once, with a ceiling. Blocks grow by doubling; every piece is
 * aligned to 64 bytes when its size is at least 64, else to 16, and is zeroed.
 */
struct pen_arena {
	struct pen_arena_block *head;
	size_t used; /* bytes handed out since the last reset */
	size_t max;
};

void pen_arena_init(struct pen_arena *arena, size_t max);
void pen_arena_finish(struct pen_arena *arena);

/* Forgets every piece and keeps the largest block. */
void pen_arena_reset(struct pen_arena *arena);

/* NULL when the ceiling or the system refuses, or when count * size overflows. */
void *pen_arena_alloc(struct pen_arena *arena, size_t count, size_t size);

/* A copy of the first length bytes of text, with a NUL behind; NULL as pen_arena_alloc. */
char *pen_arena_text(struct pen_arena *arena, const char *text, size_t length);

#endif
