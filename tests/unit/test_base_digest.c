/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/digest.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

/* The examples of FIPS 180-4: broken by any other digest, or by digits out of order. */
static void sha256_matches_the_standard(void **state)
{
	static const struct {
		const char *text, *digest;
	} vectors[] = {
		{"", "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
		{"abc", "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"},
		{"abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq",
			"248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1"},
	};
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_sha256 digest;
	char text[PEN_SHA256_TEXT];

	(void)state;
	for (size_t i = 0; i < sizeof vectors / sizeof *vectors; i++) {
		const char *input = vectors[i].text;

		assert_int_equal(pen_sha256_of(input, strlen(input), &digest, &err), 0);
		pen_sha256_format(&digest, text);
		assert_string_equal(text, vectors[i].digest);
	}
}

/* FIPS 180-4's long message: broken by an input that is cut. */
static void sha256_takes_a_million_bytes(void **state)
{
	struct pen_sha256 digest, expected;
	char *bytes = malloc(1000000);

	(void)state;
	assert_non_null(bytes);
	memset(bytes, 'a', 1000000);
	assert_int_equal(pen_sha256_of(bytes, 1000000, &digest, NULL), 0);
	assert_true(pen_sha256_parse(
		"cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0", &expected));
	assert_true(pen_sha256_equal(&digest, &expected));
	free(bytes);
}

/* Broken by a parser that takes capitals, other letters, short texts, or writes on failure. */
static void parse_takes_64_lower_case_digits(void **state)
{
	static const char good[] =
		"00ff0123456789abcdef000000000000000000000000000000000000000000ff tail";
	struct pen_sha256 digest, before;
	char text[sizeof good];

	(void)state;
	assert_true(pen_sha256_parse(good, &digest));
	pen_sha256_format(&digest, text);
	assert_memory_equal(text, good, PEN_SHA256_TEXT - 1);
	before = digest;
	for (size_t i = 0; i < PEN_SHA256_TEXT - 1; i++) {
		static const char bad[] = {'\0', 'g', 'A', '/', ':', ' '};

		for (size_t k = 0; k < sizeof bad; k++) {
			memcpy(text, good, sizeof text);
			text[i] = bad[k];
			assert_false(pen_sha256_parse(text, &digest));
			assert_true(pen_sha256_equal(&digest, &before));
		}
	}
}

/* Broken by a comparison that skips a byte. */
static void equal_looks_at_every_byte(void **state)
{
	struct pen_sha256 a = {{0}}, b;

	(void)state;
	for (size_t i = 0; i < sizeof a.bytes; i++) {
		b = a;
		assert_true(pen_sha256_equal(&a, &b));
		b.bytes[i] ^= 0x80;
		assert_false(pen_sha256_equal(&a, &b));
	}
}

/* Values of xxHash's own xxhsum -H3: broken by a seed, or by another of its functions. */
static void xxh3_matches_xxhsum(void **state)
{
	(void)state;
	assert_true(pen_xxh3("", 0) == 0x2d06800538d394c2u);
	assert_true(pen_xxh3("abc", 3) == 0x78af5f94892f3950u);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(sha256_matches_the_standard),
		cmocka_unit_test(sha256_takes_a_million_bytes),
		cmocka_unit_test(parse_takes_64_lower_case_digits),
		cmocka_unit_test(equal_looks_at_every_byte),
		cmocka_unit_test(xxh3_matches_xxhsum),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
