/* SPDX-License-Identifier: Apache-2.0 */
#include "server/trace_context.h"

#include <assert.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>

/* version-trace-parent-flags, in lower-case hexadecimal digits */
enum { TRACE_AT = 3, TRACE = 32, PARENT_AT = 36, PARENT = 16, FLAGS_AT = 53, LENGTH = 55 };
static_assert(LENGTH + 1 == PEN_TRACEPARENT_TEXT, "a traceparent of version 00");

static const char digits[] = "0123456789abcdef";

static bool is_hex(const char *text, size_t count)
{
	return strspn(text, digits) >= count;
}

static bool is_zero(const char *text, size_t count)
{
	return strspn(text, "0") >= count;
}

/* Fields of later versions may go on behind what is known of them. */
static bool is_readable(const char *text)
{
	const size_t length = strlen(text);

	if (length < LENGTH || !is_hex(text, 2) || strncmp(text, "ff", 2) == 0 ||
		text[TRACE_AT - 1] != '-' || text[PARENT_AT - 1] != '-' ||
		text[FLAGS_AT - 1] != '-')
		return false;
	if (length > LENGTH && (strncmp(text, "00", 2) == 0 || text[LENGTH] != '-'))
		return false;
	return is_hex(text + TRACE_AT, TRACE) && !is_zero(text + TRACE_AT, TRACE) &&
	       is_hex(text + PARENT_AT, PARENT) && !is_zero(text + PARENT_AT, PARENT) &&
	       is_hex(text + FLAGS_AT, 2);
}

bool pen_trace_context_valid(const char *text)
{
	return strlen(text) == LENGTH && strncmp(text, "00", 2) == 0 && is_readable(text);
}

bool pen_trace_context_continue(const char *traceparent, char ret_own[static PEN_TRACEPARENT_TEXT])
{
	uint64_t parent;
	bool is_recorded;

	if (!traceparent || !is_readable(traceparent) ||
		getrandom(&parent, sizeof parent, 0) != sizeof parent)
		return false;
	is_recorded = ((strchr(digits, traceparent[FLAGS_AT + 1]) - digits) & 1) != 0;
	(void)snprintf(ret_own, PEN_TRACEPARENT_TEXT, "00-%.*s-%016llx-%s", TRACE,
		traceparent + TRACE_AT, (unsigned long long)(parent ? parent : 1),
		is_recorded ? "01" : "00");
	return true;
}
