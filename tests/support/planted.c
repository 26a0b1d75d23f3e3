/* SPDX-License-Identifier: Apache-2.0 */
#include <stdlib.h>
#include <string.h>

/*
 * A library that goes wrong where it reads an image, to be preloaded (LD_PRELOAD) into a worker of
 * any build: PENUMBRA_PLANTED says "crash" or "loop" before the sandbox stands, and whatever reads
 * a PNG does that. It writes PNGs as ever.
 */

#define EXPORT __attribute__((visibility("default")))

static enum { NOTHING, CRASH, LOOP } planted;

static __attribute__((constructor)) void plant(void)
{
	const char *word = getenv("PENUMBRA_PLANTED");

	if (word && strcmp(word, "crash") == 0)
		planted = CRASH;
	else if (word && strcmp(word, "loop") == 0)
		planted = LOOP;
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
