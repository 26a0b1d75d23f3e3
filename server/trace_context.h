/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_TRACE_CONTEXT_H
#define PEN_SERVER_TRACE_CONTEXT_H

#include "core/base/limits.h"

#include <stdbool.h>

/*
 * The W3C's Trace Context, level 1: whoever asks for a render tells of which trace that is a part,
 * and finds what became of it in the logs of coordinator and workers under the same id.
 *
 * Reads a traceparent field and makes the one under which a render goes on: the same trace, a new
 * parent, the flag of recording, in version 00. False, and nothing made, when the field is NULL or
 * not well-formed, which the standard has ignored; or without random bits.
 */
bool pen_trace_context_continue(const char *traceparent, char ret_own[static PEN_TRACEPARENT_TEXT]);

/* Whether text is a traceparent of version 00. */
bool pen_trace_context_valid(const char *text);

#endif
