/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/clock.h"

#include <stdio.h>
#include <time.h>

static int64_t now_us(clockid_t id)
{
	struct timespec now;

	(void)clock_gettime(id, &now);
	return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

int64_t pen_clock_ms(void)
{
	return now_us(CLOCK_BOOTTIME) / 1000;
}

int64_t pen_clock_us(void)
{
	return now_us(CLOCK_BOOTTIME);
}

int64_t pen_clock_wall_ms(void)
{
	return now_us(CLOCK_REALTIME) / 1000;
}

void pen_clock_format(int64_t wall_ms, char *ret_text, size_t size)
{
	time_t seconds = (time_t)(wall_ms / 1000);
	struct tm utc;
	size_t used;

	(void)gmtime_r(&seconds, &utc);
	used = strftime(ret_text, size, "%Y-%m-%dT%H:%M:%S", &utc);
	(void)snprintf(ret_text + used, size - used, ".%03dZ", (int)(wall_ms % 1000));
}
