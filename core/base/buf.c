/* SPDX-License-Identifier: Apache-2.0 */
#include "core/base/buf.h"

#include "core/base/error.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void pen_buf_init(struct pen_buf *buf, size_t max)
{
	*buf = (struct pen_buf){.max = max};
}

void pen_buf_finish(struct pen_buf *buf)
{
	free(buf->data);
	pen_buf_init(buf, buf->max);
}

void pen_buf_clear(struct pen_buf *buf)
{
	buf->size = 0;
	buf->failed = buf->starved = false;
	if (buf->data)
		buf->data[0] = '\0';
}

void *pen_buf_reserve(struct pen_buf *buf, size_t size)
{
	size_t capacity = buf->capacity ? buf->capacity : 256;
	char *data;

	if (buf->failed || size > buf->max || buf->size > buf->max - size)
		goto fail;
	while (capacity - 1 < buf->size + size)
		capacity *= 2;
	if (capacity != buf->capacity) {
		data = realloc(buf->data, capacity);
		buf->starved = !data;
		if (!data)
			goto fail;
		buf->data = data;
		buf->capacity = capacity;
	}
	return buf->data + buf->size;
fail:
	buf->failed = true;
	return NULL;
}

int pen_buf_append(struct pen_buf *buf, const void *data, size_t size)
{
	bool fits = size <= buf->max && buf->size <= buf->max - size;
	char *end = pen_buf_reserve(buf, size);

	if (!end)
		return fits ? PEN_ENOMEM : PEN_ELIMIT;
	if (size > 0)
		memcpy(end, data, size);
	buf->size += size;
	buf->data[buf->size] = '\0';
	return 0;
}

int pen_buf_text(struct pen_buf *buf, const char *text)
{
	return pen_buf_append(buf, text, strlen(text));
}

int pen_buf_printf(struct pen_buf *buf, const char *format, ...)
{
	va_list args;
	char *end;
	int size;

	va_start(args, format);
	size = vsnprintf(NULL, 0, format, args);
	va_end(args);
	assert(size >= 0);
	end = pen_buf_reserve(buf, (size_t)size);
	if (!end)
		return PEN_ELIMIT;
	va_start(args, format);
	(void)vsnprintf(end, (size_t)size + 1, format, args);
	va_end(args);
	buf->size += (size_t)size;
	return 0;
}

void pen_buf_consume(struct pen_buf *buf, size_t size)
{
	assert(size <= buf->size);
	if (size == 0)
		return;
	buf->size -= size;
	memmove(buf->data, buf->data + size, buf->size + 1);
}

char *pen_buf_take(struct pen_buf *buf)
{
	char *data = buf->data;

	pen_buf_init(buf, buf->max);
	return data;
}
