/* SPDX-License-Identifier: Apache-2.0 */
#include "server/muster.h"

#include "core/base/clock.h"
#include "core/base/log.h"
#include "server/key_file.h"

#include <errno.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

struct pen_muster {
	char path[PATH_MAX];
	struct pen_worker_keys keys;
	uint64_t version; /* of the file that they were read from */
	int64_t looked_ms;
	bool is_closed;
	bool has_issued;
	uint8_t issued[PEN_SECURE_KEY];
	uint8_t barred[PEN_BARRED_MAX][PEN_SECURE_KEY]; /* a ring; zeros are nobody's */
	size_t barred_next;
};

static int load(struct pen_muster *muster, struct pen_error *err)
{
	int r;

	/* Looked at before it is read: a change in between is seen the next time. */
	muster->version = pen_key_file_version(muster->path);
	r = pen_worker_keys_load(&muster->keys, muster->path, err);
	if (r == 0 && muster->keys.count > 0)
		muster->is_closed = true;
	return r;
}

int pen_muster_create(
	const char *path, bool is_closed, struct pen_muster **ret_muster, struct pen_error *err)
{
	struct pen_muster *muster = calloc(1, sizeof *muster);
	int r;

	if (!muster)
		return pen_error_memory(err);
	(void)snprintf(muster->path, sizeof muster->path, "%s", path);
	muster->is_closed = is_closed;
	muster->looked_ms = pen_clock_ms();
	r = load(muster, err);
	if (r < 0) {
		pen_muster_destroy(muster);
		return r;
	}
	*ret_muster = muster;
	return 0;
}

void pen_muster_destroy(struct pen_muster *muster)
{
	if (!muster)
		return;
	pen_worker_keys_finish(&muster->keys);
	explicit_bzero(muster, sizeof *muster);
	free(muster);
}

bool pen_muster_refresh(struct pen_muster *muster, int64_t now_ms)
{
	struct pen_error err = PEN_ERROR_INIT;

	if (now_ms - muster->looked_ms < PEN_KEY_AGE_MS)
		return false;
	muster->looked_ms = now_ms;
	if (pen_key_file_version(muster->path) == muster->version)
		return false;
	if (load(muster, &err) < 0) {
		pen_log(PEN_LOG_ERROR, "the workers' keys stay as they were: %s", err.text);
		return false;
	}
	pen_log(PEN_LOG_INFO, "there are keys of %zu workers now", muster->keys.count);
	return true;
}

bool pen_muster_is_closed(const struct pen_muster *muster)
{
	return muster->is_closed;
}

uint32_t pen_muster_count(const struct pen_muster *muster)
{
	return (uint32_t)muster->keys.count;
}

bool pen_muster_find(const struct pen_muster *muster, const char *name, uint8_t *ret_key)
{
	const struct pen_worker_key *key = pen_worker_keys_find(&muster->keys, name);

	if (key)
		memcpy(ret_key, key->bits, PEN_SECURE_KEY);
	else if (muster->has_issued && strcmp(name, PEN_MUSTER_LOCAL) == 0)
		memcpy(ret_key, muster->issued, PEN_SECURE_KEY);
	else
		return false;
	return true;
}

int pen_muster_issue(struct pen_muster *muster, char *ret_text, struct pen_error *err)
{
	if (getrandom(muster->issued, sizeof muster->issued, 0) != sizeof muster->issued)
		return pen_error_system(err, errno, "no random bits");
	muster->has_issued = true;
	pen_worker_key_format(PEN_MUSTER_LOCAL, muster->issued, ret_text);
	return 0;
}

bool pen_muster_use_issued(struct pen_muster *muster)
{
	bool was_there = muster->has_issued;

	muster->has_issued = false;
	explicit_bzero(muster->issued, sizeof muster->issued);
	return was_there;
}

/* Its place among the barred; PEN_BARRED_MAX when it is none of them. */
static size_t find_barred(const struct pen_muster *muster, const uint8_t *key)
{
	size_t i = 0;

	while (i < PEN_BARRED_MAX && memcmp(muster->barred[i], key, PEN_SECURE_KEY) != 0)
		i++;
	return i;
}

void pen_muster_bar(struct pen_muster *muster, const uint8_t *key)
{
	if (pen_muster_is_barred(muster, key))
		return;
	memcpy(muster->barred[muster->barred_next], key, PEN_SECURE_KEY);
	muster->barred_next = (muster->barred_next + 1) % PEN_BARRED_MAX;
}

void pen_muster_pardon(struct pen_muster *muster, const uint8_t *key)
{
	size_t i = find_barred(muster, key);

	if (i < PEN_BARRED_MAX)
		explicit_bzero(muster->barred[i], PEN_SECURE_KEY);
}

bool pen_muster_is_barred(const struct pen_muster *muster, const uint8_t *key)
{
	return find_barred(muster, key) < PEN_BARRED_MAX;
}
