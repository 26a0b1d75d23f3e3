/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CARE_H
#define PEN_SERVER_CARE_H

/*
 * The commands that look after a data directory: `penumbra fsck`, `backup` and `restore`. argv[0]
 * is the command's word; they return an exit code: 0, 1 when it fails or faults are found, 2 for
 * an option that is none.
 */
int pen_care_fsck(int argc, char **argv);
int pen_care_backup(int argc, char **argv);
int pen_care_restore(int argc, char **argv);

#endif
