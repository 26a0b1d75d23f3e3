/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/limits.h"
#include "server/quota.h"

/* clang-format off */
#include <stdarg.h>
#include <stddef.h>
#include <setjmp.h>
#include <cmocka.h>
/* clang-format on */
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { SIDE = 16, SLOT = SIDE * SIDE };

static void make_framebuf(struct pen_framebuf *framebuf)
{
	*framebuf = (struct pen_framebuf){
		.film = pen_film_of(PEN_PLANE_MOMENTS),
		.rounds = pen_rounds_of(PEN_ROUNDS_ADAPTIVE, 128, 16),
	};
	pen_tiling_init(&framebuf->tiling, (struct pen_rect){3, 0, 40, 20}, SIDE);
}

/* Broken by a tile that waits for pixels that have stopped, or ends before one that has not. */
static void demands_follow_the_pixels(void **state)
{
	struct pen_framebuf framebuf;
	struct pen_quota quota;
	struct pen_demand demand;
	uint8_t mask[PEN_MASK_BYTES_MAX];

	(void)state;
	make_framebuf(&framebuf);
	assert_int_equal(pen_quota_init(&quota, &framebuf, NULL), 0);
	demand = pen_quota_demand(&quota, 0);
	assert_int_equal(demand.rounds, 1);
	assert_false(demand.is_final);
	assert_int_equal(demand.pixels, 13 * 16);
	assert_int_equal(demand.samples, 13 * 16 * 128);
	assert_false(pen_quota_mask(&quota, 0, 0, mask));

	quota.decided = 1;
	demand = pen_quota_demand(&quota, 0);
	assert_true(demand.is_final);
	assert_int_equal(demand.rounds, 1);
	assert_int_equal(demand.samples, 13 * 16 * 16);

	quota.rounds[5] = quota.rounds[13] = 2;
	demand = pen_quota_demand(&quota, 0);
	assert_false(demand.is_final);
	assert_int_equal(demand.rounds, 2);
	assert_int_equal(demand.pixels, 2);
	assert_int_equal(demand.samples, (13 * 16 - 2) * 16 + 2 * 128);
	assert_true(pen_quota_mask(&quota, 0, 1, mask));
	assert_int_equal(pen_mask_count(mask, pen_tiling_rect(&framebuf.tiling, 0)), 2);
	assert_true(pen_mask_has(mask, 5) && pen_mask_has(mask, 13));

	quota.rounds[SLOT + 9] = PEN_QUOTA_ALL;
	demand = pen_quota_demand(&quota, 1);
	assert_true(demand.is_final);
	assert_int_equal(demand.rounds, pen_round_count(&framebuf.rounds));
	assert_int_equal(demand.pixels, 1);
	pen_quota_finish(&quota);
}

static void load(const struct pen_framebuf *framebuf, int fd, uint32_t decided, uint8_t rounds)
{
	struct pen_quota quota;

	assert_int_equal(pen_quota_init(&quota, framebuf, NULL), 0);
	pen_quota_load(&quota, fd);
	assert_int_equal(quota.decided, decided);
	assert_int_equal(quota.rounds[2 * SLOT + 3], rounds);
	pen_quota_finish(&quota);
}

/* Broken by a copy that is written over the only good one, or that is taken though it is torn. */
static void a_torn_copy_is_not_taken(void **state)
{
	struct pen_framebuf framebuf;
	struct pen_quota quota;
	const int fd = memfd_create("framebuffer", 0);
	off_t tiles, copy;

	(void)state;
	make_framebuf(&framebuf);
	tiles = (off_t)pen_framebuf_bytes(&framebuf);
	copy = (off_t)pen_quota_bytes(&framebuf) / 2;
	assert_int_equal(ftruncate(fd, tiles + 2 * copy), 0);
	load(&framebuf, fd, 0, 1);
	assert_int_equal(pen_quota_init(&quota, &framebuf, NULL), 0);
	for (uint32_t i = 1; i <= 3; i++) {
		quota.decided = i;
		quota.rounds[2 * SLOT + 3] = (uint8_t)(i + 1);
		assert_int_equal(pen_quota_save(&quota, fd, NULL), 0);
		load(&framebuf, fd, i, (uint8_t)(i + 1));
	}
	assert_int_equal(pwrite(fd, "\x77", 1, tiles + copy + copy / 2), 1);
	load(&framebuf, fd, 2, 3);
	assert_int_equal(pwrite(fd, "\x77", 1, tiles + copy / 2), 1);
	load(&framebuf, fd, 0, 1);
	pen_quota_finish(&quota);
	(void)close(fd);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(demands_follow_the_pixels),
		cmocka_unit_test(a_torn_copy_is_not_taken),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
