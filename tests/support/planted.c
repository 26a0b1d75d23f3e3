/* SPDX-License-Identifier: Apache-2.0 */
#include <dlfcn.h>
#include <stdlib.h>
#include <string.h>

/*
 * A library that goes wrong where it reads or writes an image, to be preloaded (LD_PRELOAD) into
 * the farm of any build. PENUMBRA_PLANTED says, before the sandbox stands, what whoever reads a PNG
 * does, "crash" or "loop", or that writing one crashes, "write", but for the first that a process
 * writes, which is the encoder's before its sandbox.
 */

#define EXPORT __attribute__((visibility("default")))

static enum { NOTHING, CRASH, LOOP, WRITE } planted;

static __attribute__((constructor)) void plant(void)
{
	const char *word = getenv("PENUMBRA_PLANTED");

	if (word && strcmp(word, "crash") == 0)
		planted = CRASH;
	else if (word && strcmp(word, "loop") == 0)
		planted = LOOP;
	else if (word && strcmp(word, "write") == 0)
		planted = WRITE;
}

EXPORT int png_sig_cmp(const unsigned char *signature, size_t start, size_t count);

/* What libpng's readers call first, and nobody else. */
EXPORT int png_sig_cmp(const unsigned char *signature, size_t start, size_t count)
{
	static const unsigned char magic[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
	volatile unsigned steps = 0;

	if (planted == CRASH)
		*(volatile char *)(size_t)count = 0;
	while (planted == LOOP)
		steps++;
	return memcmp(signature + start, magic + start, count);
}

EXPORT void png_write_end(void *png, void *info);

EXPORT void png_write_end(void *png, void *info)
{
	static unsigned calls;
	void *real = dlsym(RTLD_NEXT, "png_write_end");
	void (*write_end)(void *, void *);

	if (planted == WRITE && ++calls > 1)
		*(volatile char *)(size_t)calls = 0;
	memcpy(&write_end, &real, sizeof real);
	write_end(png, info);
}
