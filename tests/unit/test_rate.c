/* SPDX-License-Identifier: Apache-2.0 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "server/rate.h"

static struct pen_owner owner_of(uint16_t number)
{
	struct pen_owner owner = {.is_known = true};

	memcpy(owner.token.bytes, &number, sizeof number);
	owner.token.bytes[31] = 1;
	return owner;
}

/* Broken by: a burst of one more or less, a wait that is not long enough or longer than it must. */
static void test_burst_then_pace(void **state)
{
	struct pen_rates rates = {0};
	const struct pen_owner owner = owner_of(1);
	int64_t now_ms = 12345, wait_ms;

	(void)state;
	for (unsigned i = 0; i < PEN_SUBMIT_BURST; i++)
		assert_int_equal(pen_rates_take(&rates, &owner, now_ms), 0);
	for (unsigned i = 0; i < 50; i++) {
		wait_ms = pen_rates_take(&rates, &owner, now_ms);
		assert_int_equal(wait_ms, PEN_SUBMIT_EVERY_MS);
		assert_int_equal(pen_rates_take(&rates, &owner, now_ms + wait_ms - 1), 1);
		now_ms += wait_ms;
		assert_int_equal(pen_rates_take(&rates, &owner, now_ms), 0);
	}
	now_ms += (int64_t)PEN_SUBMIT_BURST * PEN_SUBMIT_EVERY_MS;
	for (unsigned i = 0; i < PEN_SUBMIT_BURST; i++)
		assert_int_equal(pen_rates_take(&rates, &owner, now_ms), 0);
	assert_true(pen_rates_take(&rates, &owner, now_ms) > 0);
}

/* Broken by: one token that slows another, or a bound on who has none. */
static void test_each_its_own(void **state)
{
	struct pen_rates rates = {0};
	const struct pen_owner busy = owner_of(1), other = owner_of(2), nobody = {0};

	(void)state;
	while (pen_rates_take(&rates, &busy, 1) == 0)
		assert_int_equal(pen_rates_take(&rates, &nobody, 1), 0);
	assert_int_equal(pen_rates_take(&rates, &other, 1), 0);
	assert_int_equal(pen_rates_take(&rates, &nobody, 1), 0);
}

/* Broken by: tokens that come and go filling all places, or one's place given away while it is in
 * use. */
static void test_places_are_used_again(void **state)
{
	struct pen_rates rates = {0};
	const struct pen_owner busy = owner_of(1);
	int64_t now_ms = 1000;

	(void)state;
	for (unsigned i = 0; i < PEN_SUBMIT_BURST; i++)
		assert_int_equal(pen_rates_take(&rates, &busy, now_ms), 0);
	for (uint16_t number = 2; number < 2 * PEN_TOKENS_MAX; number++) {
		const struct pen_owner other = owner_of(number);

		assert_int_equal(pen_rates_take(&rates, &other, now_ms), 0);
	}
	assert_int_equal(pen_rates_take(&rates, &busy, now_ms), PEN_SUBMIT_EVERY_MS);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_burst_then_pace),
		cmocka_unit_test(test_each_its_own),
		cmocka_unit_test(test_places_are_used_again),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
