/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/arena.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

/* Broken by pieces that overlap, are not zeroed or are aligned too weakly, in any block. */
static void pieces_are_apart_zeroed_and_aligned(void **state)
{
	unsigned char *pieces[400];
	struct pen_arena arena;

	(void)state;
	pen_arena_init(&arena, 1 << 24);
	for (size_t i = 0; i < 400; i++) {
		size_t size = i + 1;

		pieces[i] = pen_arena_alloc(&arena, size, 1);
		assert_non_null(pieces[i]);
		assert_int_equal((uintptr_t)pieces[i] % (size >= 64 ? 64 : 16), 0);
		for (size_t k = 0; k < size; k++)
			assert_int_equal(pieces[i][k], 0);
		memset(pieces[i], (int)(i & 0xff), size);
	}
	for (size_t i = 0; i < 400; i++)
		for (size_t k = 0; k <= i; k++)
			assert_int_equal(pieces[i][k], i & 0xff);
	pen_arena_finish(&arena);
}

/* Broken by a ceiling that is off by one, or that counts a refused piece. */
static void ceiling_is_exact(void **state)
{
	struct pen_arena arena;

	(void)state;
	pen_arena_init(&arena, 1000);
	assert_null(pen_arena_alloc(&arena, 1001, 1));
	assert_non_null(pen_arena_alloc(&arena, 999, 1));
	assert_int_equal(arena.used, 999);
	assert_null(pen_arena_alloc(&arena, 2, 1));
	assert_non_null(pen_arena_alloc(&arena, 1, 1));
	assert_null(pen_arena_alloc(&arena, 1, 1));
	pen_arena_finish(&arena);
}

/* Broken by a product that wraps around to a small size. */
static void overflow_is_refused(void **state)
{
	struct pen_arena arena;

	(void)state;
	pen_arena_init(&arena, SIZE_MAX);
	assert_null(pen_arena_alloc(&arena, SIZE_MAX / 2, 3));
	pen_arena_finish(&arena);
}

/* Broken when a piece larger than every block gets less than it asked for. */
static void large_pieces_fit(void **state)
{
	size_t size = (size_t)20 << 20;
	struct pen_arena arena;
	unsigned char *piece;

	(void)state;
	pen_arena_init(&arena, (size_t)32 << 20);
	piece = pen_arena_alloc(&arena, size, 1);
	assert_non_null(piece);
	piece[size - 1] = 1;
	assert_non_null(pen_arena_alloc(&arena, 16, 1));
	pen_arena_finish(&arena);
}

/* Broken by a reset that keeps the count, or old bytes in new pieces. */
static void reset_starts_over(void **state)
{
	struct pen_arena arena;
	unsigned char *piece;

	(void)state;
	pen_arena_init(&arena, 100000);
	for (int i = 0; i < 90; i++)
		memset(pen_arena_alloc(&arena, 1000, 1), 0xff, 1000);
	pen_arena_reset(&arena);
	assert_int_equal(arena.used, 0);
	piece = pen_arena_alloc(&arena, 100000, 1);
	assert_non_null(piece);
	for (size_t i = 0; i < 100000; i++)
		assert_int_equal(piece[i], 0);
	pen_arena_finish(&arena);
}

/* Broken by a copy that takes the bytes behind length along or forgets the NUL. */
static void text_is_cut_at_its_length(void **state)
{
	struct pen_arena arena;

	(void)state;
	pen_arena_init(&arena, 100);
	assert_string_equal(pen_arena_text(&arena, "penumbra", 3), "pen");
	assert_string_equal(pen_arena_text(&arena, "x", 0), "");
	assert_null(pen_arena_text(&arena, "", SIZE_MAX));
	pen_arena_finish(&arena);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(pieces_are_apart_zeroed_and_aligned),
		cmocka_unit_test(ceiling_is_exact),
		cmocka_unit_test(overflow_is_refused),
		cmocka_unit_test(large_pieces_fit),
		cmocka_unit_test(reset_starts_over),
		cmocka_unit_test(text_is_cut_at_its_length),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
