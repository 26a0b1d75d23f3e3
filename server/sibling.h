/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SIBLING_H
#define PEN_SERVER_SIBLING_H

#include <stddef.h>

/*
 * Where another program of ours is: beside the running one, or, where it is not there, name alone,
 * to be found in PATH.
 */
void pen_sibling_path(const char *name, char *ret_path, size_t size);

#endif
