/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_MUSTER_H
#define PEN_SERVER_MUSTER_H

#include "core/base/error.h"
#include "server/worker_key.h"

#include <stdbool.h>
#include <stdint.h>

/*
 * Which workers may come in: those with a key of a file, which is read again when it has changed,
 * and once the one that holds the key that was issued last. What is wrong with a changed file is
 * logged, and the keys stay as they were.
 */
struct pen_muster;

/* The name of the key that is issued; no worker of the file can have it. */
#define PEN_MUSTER_LOCAL "/local"

/*
 * The file need not exist. Without keys in it a worker needs none, unless is_closed; but once there
 * were some, every worker needs one as long as this runs.
 */
int pen_muster_create(
	const char *path, bool is_closed, struct pen_muster **ret_muster, struct pen_error *err);
void pen_muster_destroy(struct pen_muster *muster);

/* True when the file has changed; it is looked at if it is PEN_KEY_AGE_MS since the last time. */
bool pen_muster_refresh(struct pen_muster *muster, int64_t now_ms);

bool pen_muster_is_closed(const struct pen_muster *muster);

/* How many keys the file has. */
uint32_t pen_muster_count(const struct pen_muster *muster);

/* The key of a name, that which was issued among them; false when there is none. */
bool pen_muster_find(const struct pen_muster *muster, const char *name, uint8_t *ret_key);

/*
 * A new key for one local worker, which replaces the last; ret_text holds PEN_WORKER_KEY_TEXT
 * characters.
 */
int pen_muster_issue(struct pen_muster *muster, char *ret_text, struct pen_error *err);

/* The key that was issued is used up; false: it was already. */
bool pen_muster_use_issued(struct pen_muster *muster);

/*
 * Who shows this key has sent wrong pixels. That is remembered as long as this runs, of the last
 * PEN_BARRED_MAX keys, until it is pardoned; a worker that gets a new key has a new start.
 */
void pen_muster_bar(struct pen_muster *muster, const uint8_t *key);
void pen_muster_pardon(struct pen_muster *muster, const uint8_t *key);
bool pen_muster_is_barred(const struct pen_muster *muster, const uint8_t *key);

#endif
