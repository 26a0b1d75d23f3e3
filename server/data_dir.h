/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_DATA_DIR_H
#define PEN_SERVER_DATA_DIR_H

#include "core/base/error.h"

#include <limits.h>

/*
 * The data directory of one coordinator: penumbra.db, scenes/, assets/, kept/, frames/, cache/,
 * tokens, ports, and lock, which keeps a second coordinator out.
 */
struct pen_data_dir {
	const char *path; /* borrowed */
	char scenes[PATH_MAX], assets[PATH_MAX], kept[PATH_MAX], cache[PATH_MAX];
	int lock_fd;
};

/* Makes the directory and those above it, where they are missing. */
int pen_data_dir_make(const char *path, struct pen_error *err);

/* Makes what is missing, readable by its owner alone, and locks it. PEN_ECONFLICT: in use. */
int pen_data_dir_open(struct pen_data_dir *data, const char *path, struct pen_error *err);

/* Locks one that is there, and no more: for whoever looks after it. PEN_ENOTFOUND. */
int pen_data_dir_lock(struct pen_data_dir *data, const char *path, struct pen_error *err);
void pen_data_dir_close(struct pen_data_dir *data);

#endif
