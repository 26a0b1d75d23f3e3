/* SPDX-License-Identifier: Apache-2.0 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "server/recent.h"

static const struct pen_recent_text *put_and_find(struct pen_recent *recent,
	const struct pen_job *put, const struct pen_job *asked, int64_t ms)
{
	pen_recent_put(recent, put, 1000, "{}", 2);
	return pen_recent_find(recent, asked, ms);
}

/* Breaks if a render that goes on is told of as it was, or one that is over is told of anew. */
static void test_how_long_a_text_stands(void **state)
{
	struct pen_recent recent = {0};
	const struct pen_job runs = {.number = 7, .revision = 3, .state = PEN_JOB_RUNNING};
	const struct pen_job over = {.number = 7, .revision = 3, .state = PEN_JOB_DONE};

	(void)state;
	assert_null(pen_recent_find(&recent, &runs, 1000));
	assert_non_null(put_and_find(&recent, &runs, &runs, 1099));
	assert_null(put_and_find(&recent, &runs, &runs, 1100));
	assert_non_null(put_and_find(&recent, &over, &over, INT64_MAX - 1));
	pen_recent_finish(&recent);
}

/* Breaks if one render's text is another's, or that of a change is the one before it. */
static void test_whose_a_text_is(void **state)
{
	struct pen_recent recent = {0};
	const struct pen_job one = {.number = 7, .revision = 3, .state = PEN_JOB_DONE};
	const struct pen_job changed = {.number = 7, .revision = 4, .state = PEN_JOB_DONE};
	const struct pen_job neighbour = {
		.number = 7 + PEN_RECENT_TEXTS_MAX, .revision = 3, .state = PEN_JOB_DONE};

	(void)state;
	assert_null(put_and_find(&recent, &one, &changed, 1000));
	assert_null(put_and_find(&recent, &one, &neighbour, 1000));
	assert_null(put_and_find(&recent, &neighbour, &one, 1000));
	pen_recent_finish(&recent);
}

/* At N and N+1. Breaks if a long text stays, or the one before it does. */
static void test_how_long_a_text_may_be(void **state)
{
	static char text[PEN_RECENT_BYTES_MAX + 1];
	struct pen_recent recent = {0};
	const struct pen_job job = {.number = 7, .revision = 3, .state = PEN_JOB_DONE};
	const struct pen_recent_text *found;

	(void)state;
	memset(text, 'a', sizeof text);
	pen_recent_put(&recent, &job, 0, text, PEN_RECENT_BYTES_MAX);
	found = pen_recent_find(&recent, &job, 0);
	assert_non_null(found);
	assert_int_equal(found->size, PEN_RECENT_BYTES_MAX);
	assert_memory_equal(found->text, text, found->size);
	pen_recent_put(&recent, &job, 0, text, PEN_RECENT_BYTES_MAX + 1);
	assert_null(pen_recent_find(&recent, &job, 0));
	pen_recent_finish(&recent);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_how_long_a_text_stands),
		cmocka_unit_test(test_whose_a_text_is),
		cmocka_unit_test(test_how_long_a_text_may_be),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
