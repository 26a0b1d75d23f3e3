/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_SUPPORT_LOAD_H
#define PEN_TESTS_SUPPORT_LOAD_H

#include "core/render/pictures.h"
#include "core/scene/desc.h"

#include <stddef.h>

/* Scene files for programs without a farm. Whatever goes wrong ends the program with code 1. */

_Noreturn void load_fail(const char *text);

/* Zeros, for one more than count. */
void *load_allocate(size_t count, size_t size);

struct pen_scene *load_scene(const char *path);

/* directory holds assets as files named by their SHA-256; NULL: the current one. */
struct pen_pictures *load_assets(struct pen_scene *scene, const char *directory);

#endif
