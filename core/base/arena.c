/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/arena.h"

#include <stdalign.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct pen_arena_block {
	struct pen_arena_block *next;
	size_t size; /* of data */
	size_t used;
	alignas(64) unsigned char data[];
};

enum { BLOCK_MIN = 16384, BLOCK_MAX = 1 << 24 };

void pen_arena_init(struct pen_arena *arena, size_t max)
{
	*arena = (struct pen_arena){.max = max};
}

void pen_arena_finish(struct pen_arena *arena)
{
	struct pen_arena_block *block = arena->head;

	while (block) {
		struct pen_arena_block *next = block->next;

		free(block);
		block = next;
	}
	pen_arena_init(arena, arena->max);
}

void pen_arena_reset(struct pen_arena *arena)
{
	struct pen_arena_block *keep = arena->head;

	for (struct pen_arena_block *b = arena->head; b; b = b->next)
		if (b->size > keep->size)
			keep = b;
	for (struct pen_arena_block *b = arena->head; b;) {
		struct pen_arena_block *next = b->next;

		if (b != keep)
			free(b);
		b = next;
	}
	arena->head = keep;
	arena->used = 0;
	if (keep) {
		keep->next = NULL;
		keep->used = 0;
	}
}

static struct pen_arena_block *block_create(const struct pen_arena *arena, size_t size)
{
	size_t want = arena->head ? arena->head->size * 2 : BLOCK_MIN;
	struct pen_arena_block *block;

	if (want > BLOCK_MAX)
		want = BLOCK_MAX;
	if (want < size)
		want = size;
	want = (want + 63) & ~(size_t)63;
	block = aligned_alloc(64, sizeof *block + want);
	if (block)
		*block = (struct pen_arena_block){.size = want};
	return block;
}

void *pen_arena_alloc(struct pen_arena *arena, size_t count, size_t size)
{
	struct pen_arena_block *block = arena->head;
	size_t total, start, align;

	if (__builtin_mul_overflow(count, size, &total) || total > arena->max - arena->used)
		return NULL;
	align = total >= 64 ? 64 : 16;
	start = block ? (block->used + align - 1) & ~(align - 1) : 0;
	if (!block || start > block->size || block->size - start < total) {
		block = block_create(arena, total);
		if (!block)
			return NULL;
		block->next = arena->head;
		arena->head = block;
		start = 0;
	}
	block->used = start + total;
	arena->used += total;
	return memset(block->data + start, 0, total);
}

char *pen_arena_text(struct pen_arena *arena, const char *text, size_t length)
{
	char *copy = length < SIZE_MAX ? pen_arena_alloc(arena, length + 1, 1) : NULL;

	if (copy)
		memcpy(copy, text, length);
	return copy;
}
