/* SPDX-License-Identifier: Apache-2.0 */
#include "server/page.h"

#include "server/embed.h"

#include <string.h>

/* The build writes PAGE(number, name, path in the tree) for each file into page_files.inc. */
#define PAGE(number, name, path) PEN_EMBED("page_" #number, path);
#include "server/page_files.inc"
#undef PAGE

#define PAGE(number, name, path)                                                                   \
	extern const char page_##number[];                                                         \
	extern const uint64_t page_##number##_size;
#include "server/page_files.inc"
#undef PAGE

static const struct file {
	const char *name, *bytes;
	const uint64_t *size;
} files[] = {
#define PAGE(number, name, path) {name, page_##number, &page_##number##_size},
#include "server/page_files.inc"
#undef PAGE
};

static const char *media_type_of(const char *name)
{
	static const struct {
		const char *ending, *media_type;
	} types[] = {
		{".html", "text/html; charset=utf-8"},
		{".js", "text/javascript; charset=utf-8"},
		{".css", "text/css; charset=utf-8"},
		{".svg", "image/svg+xml"},
		{".json", "application/json"},
	};
	const char *ending = strrchr(name, '.');
	size_t i = 0;

	while (strcmp(types[i].ending, ending) != 0)
		i++;
	return types[i].media_type;
}

bool pen_page_find(const char *name, struct pen_page *ret_page)
{
	for (size_t i = 0; i < sizeof files / sizeof files[0]; i++) {
		if (strcmp(files[i].name, name) != 0)
			continue;
		*ret_page = (struct pen_page){media_type_of(name), files[i].bytes, *files[i].size};
		return true;
	}
	return false;
}
