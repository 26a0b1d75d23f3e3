/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/limits.h"
#include "server/key_file.h"
#include "server/token.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cmocka.h>

static char directory[] = "/tmp/penumbra-test-XXXXXX";
static char path[64];

static int make_directory(void **state)
{
	(void)state;
	if (!mkdtemp(directory))
		return -1;
	(void)snprintf(path, sizeof path, "%s/tokens", directory);
	return 0;
}

static int remove_directory(void **state)
{
	(void)state;
	(void)unlink(path);
	return rmdir(directory);
}

static void write_file(const char *text, mode_t mode)
{
	FILE *file = fopen(path, "we");

	assert_non_null(file);
	assert_true(fputs(text, file) >= 0);
	assert_int_equal(fclose(file), 0);
	assert_int_equal(chmod(path, mode), 0);
}

/* Breaks if a scope that does not exist counts as one that does, or admin lacks another. */
static void test_scopes(void **state)
{
	static const char *const wrong[] = {
		"", ",", "read,", ",read", "Read", "read submit", "reads", "none", "0"};
	char text[PEN_SCOPES_TEXT];
	unsigned scopes = 99;

	(void)state;
	for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++)
		assert_int_equal(pen_scopes_parse(wrong[i], &scopes, NULL), PEN_EINVALID);
	assert_int_equal(scopes, 99);
	assert_int_equal(pen_scopes_parse("read,submit,read", &scopes, NULL), 0);
	assert_int_equal(scopes, PEN_SCOPE_READ | PEN_SCOPE_SUBMIT);
	pen_scopes_format(scopes, text);
	assert_string_equal(text, "submit,read");
	assert_int_equal(pen_scopes_parse("admin", &scopes, NULL), 0);
	assert_int_equal(scopes, PEN_SCOPE_ALL);
	pen_scopes_format(scopes, text);
	assert_string_equal(text, "admin");
	assert_int_equal(pen_scopes_parse("submit,read,metrics", &scopes, NULL), 0);
	assert_int_equal(scopes & PEN_SCOPE_ADMIN, 0);
}

/* Breaks if a secret is kept, is not found again, or something near it is taken for it. */
static void test_secrets(void **state)
{
	struct pen_tokens tokens = {0}, loaded = {0};
	char first[PEN_TOKEN_TEXT], second[PEN_TOKEN_TEXT], text[4096], near[PEN_TOKEN_TEXT + 1];
	const struct pen_token *found;
	struct stat status;
	size_t size;
	FILE *file;

	(void)state;
	assert_int_equal(pen_tokens_add(&tokens, "a", PEN_SCOPE_READ, first, NULL), 0);
	assert_int_equal(pen_tokens_add(&tokens, "b", PEN_SCOPE_ALL, second, NULL), 0);
	assert_int_equal(strlen(first), PEN_TOKEN_TEXT - 1);
	assert_string_not_equal(first, second);
	assert_int_equal(pen_tokens_add(&tokens, "a", PEN_SCOPE_READ, second, NULL), PEN_ECONFLICT);
	assert_int_equal(pen_tokens_save(&tokens, path, NULL), 0);
	assert_int_equal(stat(path, &status), 0);
	assert_int_equal(status.st_mode & 0777, 0600);
	file = fopen(path, "re");
	assert_non_null(file);
	size = fread(text, 1, sizeof text - 1, file);
	(void)fclose(file);
	text[size] = '\0';
	assert_null(strstr(text, first + 4));
	assert_int_equal(pen_tokens_load(&loaded, path, NULL), 0);
	found = pen_tokens_find(&loaded, first);
	assert_non_null(found);
	assert_string_equal(found->name, "a");
	assert_int_equal(found->scopes, PEN_SCOPE_READ);
	for (size_t i = 0; i < sizeof first - 1; i++) {
		memcpy(near, first, sizeof first);
		near[i] ^= 1;
		assert_null(pen_tokens_find(&loaded, near));
	}
	memcpy(near, first, sizeof first);
	near[sizeof first - 2] = '\0';
	assert_null(pen_tokens_find(&loaded, near));
	(void)snprintf(near, sizeof near, "%s0", first);
	assert_null(pen_tokens_find(&loaded, near));
	assert_null(pen_tokens_find(&loaded, ""));
	assert_int_equal(pen_tokens_remove(&loaded, "a", NULL), 0);
	assert_null(pen_tokens_find(&loaded, first));
	assert_non_null(pen_tokens_find(&loaded, second));
	assert_int_equal(pen_tokens_remove(&loaded, "a", NULL), PEN_ENOTFOUND);
	pen_tokens_finish(&tokens);
	pen_tokens_finish(&loaded);
}

#define HASH "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef"

/* Breaks if a broken line is passed by, or tokens are lost when a file cannot be read. */
static void test_files(void **state)
{
	static const char *const wrong[] = {"a read", "a read " HASH "0", "a read " HASH " more",
		"a reed " HASH, "a/b read " HASH, "a read " HASH "\na submit " HASH,
		"- read " HASH};
	struct pen_tokens tokens = {0};
	struct pen_error err = PEN_ERROR_INIT;

	(void)state;
	write_file("# people\n\n  a read " HASH "\r\nb\tsubmit,read " HASH, 0600);
	assert_int_equal(pen_tokens_load(&tokens, path, NULL), 0);
	assert_int_equal(tokens.count, 2);
	for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
		write_file(wrong[i], 0600);
		assert_int_not_equal(pen_tokens_load(&tokens, path, &err), 0);
		assert_non_null(strstr(err.text, "/tokens:"));
		assert_int_equal(tokens.count, 2);
	}
	for (mode_t bit = 1; bit <= 040; bit <<= 1) {
		write_file("a read " HASH, 0600 | bit);
		assert_int_equal(pen_tokens_load(&tokens, path, &err), PEN_EINVALID);
		assert_non_null(strstr(err.text, "chmod 600"));
	}
	assert_int_equal(unlink(path), 0);
	assert_int_equal(pen_tokens_load(&tokens, path, NULL), 0);
	assert_int_equal(tokens.count, 0);
}

/* Breaks if a bound is off by one: of names, tokens, and bytes of a file. */
static void test_bounds(void **state)
{
	char name[PEN_KEY_NAME_MAX + 2], secret[PEN_TOKEN_TEXT];
	char *text = malloc(PEN_KEY_FILE_MAX + 2);
	struct pen_tokens tokens = {0};

	(void)state;
	assert_non_null(text);
	memset(name, 'x', sizeof name);
	for (size_t n = PEN_KEY_NAME_MAX - 1; n <= PEN_KEY_NAME_MAX + 1; n++) {
		name[n] = '\0';
		assert_int_equal(pen_key_name_valid(name), n <= PEN_KEY_NAME_MAX);
		name[n] = 'x';
	}
	for (unsigned i = 0; i < PEN_TOKENS_MAX; i++) {
		(void)snprintf(name, sizeof name, "%060u", i);
		assert_int_equal(pen_tokens_add(&tokens, name, PEN_SCOPE_READ, secret, NULL), 0);
	}
	assert_int_equal(pen_tokens_add(&tokens, "more", PEN_SCOPE_READ, secret, NULL), PEN_ELIMIT);
	assert_int_equal(pen_tokens_save(&tokens, path, NULL), 0);
	assert_int_equal(pen_tokens_load(&tokens, path, NULL), 0);
	assert_int_equal(tokens.count, PEN_TOKENS_MAX);
	for (size_t n = PEN_KEY_FILE_MAX - 1; n <= PEN_KEY_FILE_MAX + 1; n++) {
		memset(text, '#', n);
		text[n] = '\0';
		write_file(text, 0600);
		assert_int_equal(pen_tokens_load(&tokens, path, NULL),
			n <= PEN_KEY_FILE_MAX ? 0 : PEN_EINVALID);
	}
	pen_tokens_finish(&tokens);
	free(text);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_scopes),
		cmocka_unit_test(test_secrets),
		cmocka_unit_test(test_files),
		cmocka_unit_test(test_bounds),
	};

	return cmocka_run_group_tests(tests, make_directory, remove_directory);
}
