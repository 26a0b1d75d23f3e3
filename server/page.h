/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_PAGE_H
#define PEN_SERVER_PAGE_H

#include <stdbool.h>
#include <stdint.h>

/*
 * A file of the web page, server/web in the source tree, and the demo scene as demo.json; the build
 * puts them into the program.
 */
struct pen_page {
	const char *media_type;
	const char *bytes;
	uint64_t size;
};

/* name is relative to server/web. False when there is no such file. */
bool pen_page_find(const char *name, struct pen_page *ret_page);

#endif
