/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_CLOCK_H
#define PEN_BASE_CLOCK_H

#include <stddef.h>
#include <stdint.h>

/* Milliseconds and microseconds since boot, suspend included: for leases, deadlines, durations. */
int64_t pen_clock_ms(void);
int64_t pen_clock_us(void);

/* Milliseconds since 1970: for display only. */
int64_t pen_clock_wall_ms(void);

/* "2026-01-31T12:00:00.123Z"; size >= 25. */
void pen_clock_format(int64_t wall_ms, char *ret_text, size_t size);

#endif
