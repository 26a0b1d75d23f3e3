/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/text.h"

#include <math.h>
#include <stdlib.h>

/* The length of the UTF-8 sequence at s without control characters, 0 when it is none. */
static size_t character_length(const unsigned char *s)
{
	if (s[0] < 0x80)
		return s[0] >= 0x20 && s[0] != 0x7f;
	if (s[0] >= 0xc2 && s[0] <= 0xdf)
		return (s[1] & 0xc0) == 0x80 ? 2 : 0;
	if (s[0] >= 0xe0 && s[0] <= 0xef) {
		/* Neither overlong nor a surrogate. */
		if ((s[0] == 0xe0 && s[1] < 0xa0) || (s[0] == 0xed && s[1] > 0x9f))
			return 0;
		return (s[1] & 0xc0) == 0x80 && (s[2] & 0xc0) == 0x80 ? 3 : 0;
	}
	if (s[0] >= 0xf0 && s[0] <= 0xf4) {
		if ((s[0] == 0xf0 && s[1] < 0x90) || (s[0] == 0xf4 && s[1] > 0x8f))
			return 0;
		return (s[1] & 0xc0) == 0x80 && (s[2] & 0xc0) == 0x80 && (s[3] & 0xc0) == 0x80 ? 4
											       : 0;
	}
	return 0;
}

size_t pen_text_plain(const char *text)
{
	const unsigned char *s = (const unsigned char *)text;
	size_t step;

	while (*s && (step = character_length(s)) > 0)
		s += step;
	return (size_t)(s - (const unsigned char *)text);
}

void pen_text_clean(char *text)
{
	for (text += pen_text_plain(text); *text != '\0'; text += pen_text_plain(text))
		*text = *text == '\n' || *text == '\t' ? ' ' : '?';
}

bool pen_text_reals(const char *text, size_t count, double *ret_numbers)
{
	for (size_t i = 0; i < count; i++) {
		char *end;

		ret_numbers[i] = strtod(text, &end);
		if (end == text || !isfinite(ret_numbers[i]) ||
			*end != (i + 1 < count ? ',' : '\0'))
			return false;
		text = end + 1;
	}
	return true;
}

char *pen_text_hex(char *to, uint64_t number)
{
	unsigned shift = (63u - (unsigned)__builtin_clzll(number | 1)) & ~3u;

	for (;; shift -= 4) {
		*to++ = "0123456789abcdef"[number >> shift & 15];
		if (shift == 0)
			return to;
	}
}
