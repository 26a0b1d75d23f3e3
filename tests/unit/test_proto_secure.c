/* SPDX-License-Identifier: Apache-2.0 */
#include "proto/secure.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static const uint8_t key_a[PEN_SECURE_KEY] = {1, 2, 3}, key_b[PEN_SECURE_KEY] = {3, 2, 1};

static bool lookup(void *user, const char *name, uint8_t *ret_key)
{
	unsigned *calls = user;

	++*calls;
	if (strcmp(name, "a") != 0)
		return false;
	memcpy(ret_key, key_a, PEN_SECURE_KEY);
	return true;
}

/* Carries what one end says to the other, in pieces; 0, or what the other end's handshake says. */
static int carry(struct pen_secure *from, struct pen_secure *to, size_t piece)
{
	struct pen_buf *out = pen_secure_out(from);
	int r = 0;

	while (r >= 0 && out->size > 0) {
		size_t size = out->size < piece ? out->size : piece;

		r = pen_secure_feed(to, out->data, size, NULL);
		if (r == 0)
			r = pen_secure_shake(to, NULL);
		pen_buf_consume(out, size);
	}
	return r;
}

/* Negative as soon as either end gives up. */
static int shake(struct pen_secure *client, struct pen_secure *server, size_t piece)
{
	int r = pen_secure_shake(client, NULL);

	for (int turn = 0; r >= 0 && turn < 8; turn++) {
		r = carry(client, server, piece);
		if (r >= 0)
			r = carry(server, client, piece);
	}
	return r;
}

static void say(struct pen_secure *from, struct pen_secure *to, size_t size)
{
	struct pen_buf *out = pen_secure_out(from);
	char *said = malloc(size), *heard = malloc(size + 1);
	size_t got = 0;

	assert_non_null(said);
	assert_non_null(heard);
	for (size_t i = 0; i < size; i++)
		said[i] = (char)(i * 31 >> 3);
	assert_int_equal(pen_secure_write(from, said, size, NULL), 0);
	while (out->size > 0) {
		size_t piece = out->size < 5000 ? out->size : 5000, n = 1;

		assert_int_equal(pen_secure_feed(to, out->data, piece, NULL), 0);
		while (n > 0) {
			assert_int_equal(
				pen_secure_read(to, heard + got, size + 1 - got, &n, NULL), 0);
			got += n;
		}
		pen_buf_consume(out, piece);
	}
	assert_int_equal(got, size);
	assert_memory_equal(said, heard, size);
	free(said);
	free(heard);
}

/* Breaks if the ends do not find each other however the bytes are cut, or lose some of what is
 * said. */
static void test_both_ways(void **state)
{
	static const size_t pieces[] = {1, 7, 100000};

	(void)state;
	for (size_t i = 0; i < sizeof pieces / sizeof *pieces; i++) {
		struct pen_secure *client = NULL, *server = NULL;
		unsigned calls = 0;

		assert_int_equal(pen_secure_create_client("a", key_a, &client, NULL), 0);
		assert_int_equal(pen_secure_create_server(lookup, &calls, &server, NULL), 0);
		assert_true(shake(client, server, pieces[i]) >= 0);
		assert_true(pen_secure_is_open(client) && pen_secure_is_open(server));
		assert_string_equal(pen_secure_name(server), "a");
		assert_int_equal(calls, 1);
		say(client, server, 1);
		say(server, client, 4 << 20);
		say(client, server, 4 << 20);
		pen_secure_destroy(client);
		pen_secure_destroy(server);
	}
}

/* Breaks if a wrong key, or a name that is not there, is let in, or the two can be told apart. */
static void test_strangers(void **state)
{
	static const struct {
		const char *name;
		const uint8_t *key;
	} strangers[] = {{"a", key_b}, {"b", key_b}, {"b", key_a}, {"A", key_a}};
	char first[64] = "";
	size_t first_size = 0;

	(void)state;
	for (size_t i = 0; i < sizeof strangers / sizeof *strangers; i++) {
		struct pen_secure *client = NULL, *server = NULL;
		const struct pen_buf *out;
		unsigned calls = 0;

		assert_int_equal(pen_secure_create_client(
					 strangers[i].name, strangers[i].key, &client, NULL),
			0);
		assert_int_equal(pen_secure_create_server(lookup, &calls, &server, NULL), 0);
		assert_true(shake(client, server, 100000) < 0);
		assert_false(pen_secure_is_open(server));
		assert_false(pen_secure_is_open(client));
		out = pen_secure_out(server);
		assert_true(out->size <= sizeof first);
		if (i == 0) {
			first_size = out->size;
			memcpy(first, out->data ? out->data : "", out->size);
		}
		assert_int_equal(out->size, first_size);
		assert_memory_equal(out->data ? out->data : "", first, first_size);
		pen_secure_destroy(client);
		pen_secure_destroy(server);
	}
}

/* Breaks if a client goes on with a server that has not got its key. */
static void test_another_server(void **state)
{
	struct pen_secure *client = NULL, *server = NULL;
	unsigned calls = 0;

	(void)state;
	assert_int_equal(pen_secure_create_client("a", key_b, &client, NULL), 0);
	assert_int_equal(pen_secure_create_server(lookup, &calls, &server, NULL), 0);
	(void)shake(client, server, 100000);
	assert_false(pen_secure_is_open(client));
	pen_secure_destroy(client);
	pen_secure_destroy(server);
}

/* Breaks if anything but TLS gets further than the first record. */
static void test_nonsense(void **state)
{
	static const char *const texts[] = {"GET / HTTP/1.1\r\n\r\n", "\x16\x03\x01\x00\x05hello",
		"\x16\x03\x03\xff\xff....................", "PENu\x01"};

	(void)state;
	for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
		struct pen_secure *server = NULL;
		unsigned calls = 0;
		char text[64] = "";
		int r = 0;

		(void)snprintf(text, sizeof text, "%s", texts[i]);
		if (i == 1 || i == 2)
			memcpy(text, texts[i], 10);
		assert_int_equal(pen_secure_create_server(lookup, &calls, &server, NULL), 0);
		for (int piece = 0; r == 0 && piece < 4; piece++) {
			r = pen_secure_feed(server, text, sizeof text, NULL);
			if (r == 0)
				r = pen_secure_shake(server, NULL);
		}
		assert_true(r < 0);
		assert_int_equal(calls, 0);
		pen_secure_destroy(server);
	}
}

/* Breaks if a bit that is turned over on the way is taken for what was said. */
static void test_a_bit_on_the_way(void **state)
{
	struct pen_secure *client = NULL, *server = NULL;
	unsigned calls = 0;
	size_t n = 0;
	char text[16];

	(void)state;
	assert_int_equal(pen_secure_create_client("a", key_a, &client, NULL), 0);
	assert_int_equal(pen_secure_create_server(lookup, &calls, &server, NULL), 0);
	assert_true(shake(client, server, 100000) >= 0);
	assert_int_equal(pen_secure_write(client, "0123456789", 10, NULL), 0);
	pen_secure_out(client)->data[12] ^= 4;
	assert_int_equal(pen_secure_feed(server, pen_secure_out(client)->data,
				 pen_secure_out(client)->size, NULL),
		0);
	assert_true(pen_secure_read(server, text, sizeof text, &n, NULL) < 0);
	pen_secure_destroy(client);
	pen_secure_destroy(server);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_both_ways),
		cmocka_unit_test(test_strangers),
		cmocka_unit_test(test_another_server),
		cmocka_unit_test(test_nonsense),
		cmocka_unit_test(test_a_bit_on_the_way),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
