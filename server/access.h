/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_ACCESS_H
#define PEN_SERVER_ACCESS_H

/*
 * The commands that say who may come in: `penumbra token`, `penumbra worker`, `penumbra cert`. Each
 * takes argv with its own name first and returns an exit code; what it has to say goes to standard
 * output, complaints to standard error.
 */

int pen_access_token(int argc, char **argv);
int pen_access_worker(int argc, char **argv);
int pen_access_cert(int argc, char **argv);

#endif
