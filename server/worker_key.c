/* SPDX-License-Identifier: Apache-2.0 */
#include "server/worker_key.h"

#include "core/base/buf.h"
#include "core/base/digest.h"
#include "server/key_file.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

static int append(
	struct pen_worker_keys *keys, const char *name, const uint8_t *bits, struct pen_error *err)
{
	struct pen_worker_key *list;

	if (!pen_key_name_valid(name))
		return pen_error_set(err, PEN_EINVALID,
			"a name has 1 to %u letters, digits, dots, dashes and underscores",
			PEN_KEY_NAME_MAX);
	if (pen_worker_keys_find(keys, name))
		return pen_error_set(err, PEN_ECONFLICT, "there is a worker %s already", name);
	if (keys->count == PEN_WORKERS_MAX)
		return pen_error_set(
			err, PEN_ELIMIT, "there are keys of %u workers already", PEN_WORKERS_MAX);
	list = realloc(keys->list, (keys->count + 1) * sizeof *list);
	if (!list)
		return pen_error_memory(err);
	keys->list = list;
	list += keys->count++;
	(void)snprintf(list->name, sizeof list->name, "%s", name);
	memcpy(list->bits, bits, sizeof list->bits);
	return 0;
}

static int take_line(void *user, char *words[PEN_KEY_WORDS_MAX], struct pen_error *err)
{
	struct pen_sha256 bits;

	if (strlen(words[1]) != PEN_SHA256_TEXT - 1 || !pen_sha256_parse(words[1], &bits) ||
		words[2][0] != '\0')
		return pen_error_set(err, PEN_EINVALID, "a line is NAME and 64 hex digits");
	return append(user, words[0], bits.bytes, err);
}

int pen_worker_keys_load(struct pen_worker_keys *keys, const char *path, struct pen_error *err)
{
	struct pen_worker_keys loaded = {0};
	int r = pen_key_file_read(path, take_line, &loaded, err);

	if (r < 0 && r != PEN_ENOTFOUND) {
		pen_worker_keys_finish(&loaded);
		return r;
	}
	pen_worker_keys_finish(keys);
	*keys = loaded;
	return 0;
}

void pen_worker_key_format(const char *name, const uint8_t *bits, char *ret_text)
{
	static_assert(sizeof(struct pen_sha256) == PEN_SECURE_KEY, "both are 256 bits");
	char digits[PEN_SHA256_TEXT];
	struct pen_sha256 copy;

	memcpy(copy.bytes, bits, sizeof copy.bytes);
	pen_sha256_format(&copy, digits);
	(void)snprintf(ret_text, PEN_WORKER_KEY_TEXT, "%s %s\n", name, digits);
	explicit_bzero(&copy, sizeof copy);
	explicit_bzero(digits, sizeof digits);
}

int pen_worker_keys_save(
	const struct pen_worker_keys *keys, const char *path, struct pen_error *err)
{
	char line[PEN_WORKER_KEY_TEXT];
	struct pen_buf text;
	int r;

	pen_buf_init(&text, PEN_KEY_FILE_MAX);
	for (size_t i = 0; i < keys->count; i++) {
		pen_worker_key_format(keys->list[i].name, keys->list[i].bits, line);
		(void)pen_buf_text(&text, line);
	}
	r = text.failed ? pen_error_memory(err)
			: pen_key_file_write(path, text.data ? text.data : "", text.size, err);
	if (text.data)
		explicit_bzero(text.data, text.size);
	explicit_bzero(line, sizeof line);
	pen_buf_finish(&text);
	return r;
}

void pen_worker_keys_finish(struct pen_worker_keys *keys)
{
	if (keys->list)
		explicit_bzero(keys->list, keys->count * sizeof *keys->list);
	free(keys->list);
	*keys = (struct pen_worker_keys){0};
}

int pen_worker_keys_add(struct pen_worker_keys *keys, const char *name,
	const struct pen_worker_key **ret_key, struct pen_error *err)
{
	uint8_t bits[PEN_SECURE_KEY];
	int r;

	if (getrandom(bits, sizeof bits, 0) != sizeof bits)
		return pen_error_system(err, errno, "no random bits");
	r = append(keys, name, bits, err);
	explicit_bzero(bits, sizeof bits);
	if (r == 0)
		*ret_key = &keys->list[keys->count - 1];
	return r;
}

int pen_worker_keys_remove(struct pen_worker_keys *keys, const char *name, struct pen_error *err)
{
	const struct pen_worker_key *key = pen_worker_keys_find(keys, name);
	size_t at;

	if (!key)
		return pen_error_set(err, PEN_ENOTFOUND, "there is no worker %s", name);
	at = (size_t)(key - keys->list);
	keys->count--;
	memmove(keys->list + at, keys->list + at + 1, (keys->count - at) * sizeof *keys->list);
	return 0;
}

const struct pen_worker_key *pen_worker_keys_find(
	const struct pen_worker_keys *keys, const char *name)
{
	for (size_t i = 0; i < keys->count; i++)
		if (strcmp(keys->list[i].name, name) == 0)
			return &keys->list[i];
	return NULL;
}
