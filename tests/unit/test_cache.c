/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cache.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

struct fixture {
	char directory[64];
	struct pen_cache cache;
};

static int set_up(void **state)
{
	struct fixture *fixture = calloc(1, sizeof *fixture);
	struct pen_error err;

	assert_non_null(fixture);
	(void)snprintf(fixture->directory, sizeof fixture->directory, "/tmp/penumbra-test-XXXXXX");
	assert_non_null(mkdtemp(fixture->directory));
	assert_int_equal(pen_cache_init(&fixture->cache, fixture->directory, &err), 0);
	*state = fixture;
	return 0;
}

static int tear_down(void **state)
{
	struct fixture *fixture = *state;

	pen_cache_finish(&fixture->cache);
	/* Fails when a file was left behind. */
	assert_int_equal(rmdir(fixture->directory), 0);
	free(fixture);
	return 0;
}

/* A file that holds its key; size is what the cache is told of it. */
static void put(struct pen_cache *cache, const char *key, uint64_t size)
{
	struct pen_error err;
	int write_fd, read_fd;

	assert_int_equal(pen_cache_file_create(cache, &write_fd, &read_fd, &err), 0);
	assert_int_equal(write(write_fd, key, strlen(key)), strlen(key));
	assert_int_equal(close(write_fd), 0);
	pen_cache_put(cache, key, read_fd, size);
}

static bool has(struct pen_cache *cache, const char *key)
{
	char text[PEN_CACHE_KEY] = "";
	uint64_t size;
	int fd = pen_cache_find(cache, key, &size);

	if (fd < 0)
		return false;
	assert_int_equal(pread(fd, text, sizeof text - 1, 0), strlen(key));
	assert_string_equal(text, key);
	assert_int_equal(write(fd, "x", 1), -1);
	assert_int_equal(close(fd), 0);
	return true;
}

static void put_number(struct pen_cache *cache, unsigned number)
{
	char key[16];

	(void)snprintf(key, sizeof key, "%u.png", number);
	put(cache, key, 1);
}

/* Breaks if a file is found under another's key, or can be changed by who reads it. */
static void test_find(void **state)
{
	struct fixture *fixture = *state;

	put(&fixture->cache, "a/1.png", 7);
	put(&fixture->cache, "a/1.exr", 9);
	assert_true(has(&fixture->cache, "a/1.png"));
	assert_true(has(&fixture->cache, "a/1.exr"));
	assert_false(has(&fixture->cache, "a/1"));
	assert_int_equal(fixture->cache.bytes, 16);
	put(&fixture->cache, "a/1.png", 8);
	assert_true(has(&fixture->cache, "a/1.png"));
	assert_int_equal(fixture->cache.bytes, 17);
}

/* Breaks at one file more than there are places, or if one that is used goes before one that is
 * not. */
static void test_least_recently_used_goes_first(void **state)
{
	struct fixture *fixture = *state;

	for (unsigned i = 0; i < PEN_CACHE_FILES; i++)
		put_number(&fixture->cache, i);
	assert_true(has(&fixture->cache, "0.png"));
	put_number(&fixture->cache, PEN_CACHE_FILES);
	assert_true(has(&fixture->cache, "0.png"));
	assert_false(has(&fixture->cache, "1.png"));
	assert_true(has(&fixture->cache, "2.png"));
}

/* Breaks if the bytes kept pass their bound, or one large file can not be kept at all. */
static void test_bytes_are_bounded(void **state)
{
	struct fixture *fixture = *state;

	put(&fixture->cache, "a", PEN_CACHE_BYTES - 1);
	put(&fixture->cache, "b", 1);
	assert_true(has(&fixture->cache, "a"));
	put(&fixture->cache, "c", 1);
	assert_false(has(&fixture->cache, "b"));
	assert_true(has(&fixture->cache, "a"));
	put(&fixture->cache, "d", PEN_CACHE_BYTES * 4);
	assert_true(has(&fixture->cache, "d"));
	assert_false(has(&fixture->cache, "a"));
	put(&fixture->cache, "e", 1);
	assert_false(has(&fixture->cache, "d"));
	assert_int_equal(fixture->cache.bytes, 1);
}

/* Breaks if a render's images are served after it was removed. */
static void test_forget(void **state)
{
	struct fixture *fixture = *state;

	put(&fixture->cache, "a/1.png", 1);
	put(&fixture->cache, "b/1.png", 1);
	put(&fixture->cache, "a/2.png", 1);
	pen_cache_forget(&fixture->cache, "a/");
	assert_false(has(&fixture->cache, "a/1.png"));
	assert_false(has(&fixture->cache, "a/2.png"));
	assert_true(has(&fixture->cache, "b/1.png"));
	assert_int_equal(fixture->cache.bytes, 1);
}

static bool is_found(struct pen_cache *cache, const char *key)
{
	uint64_t size;
	int fd = pen_cache_find(cache, key, &size);

	if (fd >= 0)
		assert_int_equal(close(fd), 0);
	return fd >= 0;
}

/* Whether it is in memory, and right there. */
static bool is_held(struct pen_cache *cache, const char *key)
{
	struct pen_shared_bytes *bytes = pen_cache_hold(cache, key);

	if (bytes)
		assert_memory_equal(bytes->data, key, strlen(key));
	pen_shared_bytes_release(bytes);
	return bytes != NULL;
}

/* A file of that many bytes, which begins with its key. */
static void put_whole(struct pen_cache *cache, const char *key, uint64_t size)
{
	struct pen_error err;
	int write_fd, read_fd;

	assert_int_equal(pen_cache_file_create(cache, &write_fd, &read_fd, &err), 0);
	assert_int_equal(write(write_fd, key, strlen(key)), strlen(key));
	assert_int_equal(ftruncate(write_fd, (off_t)size), 0);
	assert_int_equal(close(write_fd), 0);
	pen_cache_put(cache, key, read_fd, size);
}

/* At N and N+1 bytes. Breaks if what is asked for once takes memory, or what is large does. */
static void test_what_is_held_in_memory(void **state)
{
	struct pen_cache *cache = &((struct fixture *)*state)->cache;

	put_whole(cache, "a", PEN_CACHE_HELD_MAX);
	put_whole(cache, "b", PEN_CACHE_HELD_MAX + 1);
	assert_false(is_held(cache, "a"));
	assert_true(is_found(cache, "a") && is_found(cache, "b"));
	assert_true(is_held(cache, "a"));
	assert_false(is_held(cache, "b"));
	assert_false(is_held(cache, "c"));
}

/* Breaks if bytes go while an answer has them, if those are not counted, or are counted for ever.
 */
static void test_memory_is_bounded(void **state)
{
	enum { COUNT = PEN_CACHE_HELD_BYTES / PEN_CACHE_HELD_MAX };
	struct pen_cache *cache = &((struct fixture *)*state)->cache;
	struct pen_shared_bytes *held[COUNT];

	for (unsigned i = 0; i < COUNT; i++) {
		put_whole(cache, "a", PEN_CACHE_HELD_MAX);
		assert_true(is_found(cache, "a"));
		held[i] = pen_cache_hold(cache, "a");
		assert_non_null(held[i]);
	}
	put_whole(cache, "b", PEN_CACHE_HELD_MAX);
	assert_true(is_found(cache, "b"));
	assert_false(is_held(cache, "b"));
	for (unsigned i = 0; i < COUNT; i++) {
		assert_int_equal(held[i]->data[0], 'a');
		pen_shared_bytes_release(held[i]);
	}
	assert_true(is_held(cache, "b"));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test_setup_teardown(test_find, set_up, tear_down),
		cmocka_unit_test_setup_teardown(
			test_least_recently_used_goes_first, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_bytes_are_bounded, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_forget, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_what_is_held_in_memory, set_up, tear_down),
		cmocka_unit_test_setup_teardown(test_memory_is_bounded, set_up, tear_down),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
