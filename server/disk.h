/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_DISK_H
#define PEN_SERVER_DISK_H

#include "core/base/error.h"

#include <stdint.h>

/*
 * Room on the disk of the data directory. Each kind of use leaves some of it to those that matter
 * more: uploads and new renders to frames that are being rendered, these to the rows of the store
 * and to encoded images, and a file DIR/ballast is given up for changes that make room.
 */
enum pen_disk_use {
	PEN_DISK_ACCEPT, /* leaves PEN_DISK_RESERVE_BYTES, or a sixteenth of a small disk */
	PEN_DISK_RENDER	 /* leaves half of that */
};

/* dir: a descriptor of the directory, or of a file in it. PEN_ENOSPACE. */
int pen_disk_check(int dir, enum pen_disk_use use, uint64_t bytes, struct pen_error *err);

/* The same by path. */
int pen_disk_check_path(
	const char *path, enum pen_disk_use use, uint64_t bytes, struct pen_error *err);

/* Makes the ballast whole when there is ample room, else does nothing. May block on the disk. */
void pen_ballast_fill(const char *dir);

/* Gives it up; 0 when there was any. */
int pen_ballast_drop(const char *dir);

#endif
