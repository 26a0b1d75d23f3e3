/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_BUF_H
#define PEN_BASE_BUF_H

#include <stdbool.h>
#include <stddef.h>

/*
 * A growing run of bytes with a ceiling set at init, so that no peer can make it grow without end.
 * The bytes are always followed by a NUL that does not count.
 */
struct pen_buf {
	char *data; /* NULL until the first byte */
	size_t size;
	size_t capacity;
	size_t max;
	bool failed;  /* an append was refused; later ones are too */
	bool starved; /* for lack of memory */
};

void pen_buf_init(struct pen_buf *buf, size_t max);
void pen_buf_finish(struct pen_buf *buf);

/* Empties the buffer and keeps its memory. */
void pen_buf_clear(struct pen_buf *buf);

/* Append; PEN_ELIMIT past max, PEN_ENOMEM. A caller may append in a row and check failed once. */
int pen_buf_append(struct pen_buf *buf, const void *data, size_t size);
int pen_buf_text(struct pen_buf *buf, const char *text);
int pen_buf_printf(struct pen_buf *buf, const char *format, ...)
	__attribute__((format(printf, 2, 3)));

/* Drops the first size bytes (size <= buf->size). */
void pen_buf_consume(struct pen_buf *buf, size_t size);

/* Makes room for size more bytes and returns where they go; NULL as append fails. Then add to size.
 */
void *pen_buf_reserve(struct pen_buf *buf, size_t size);

/* Hands the bytes to the caller, who frees them; the buffer is empty afterwards. May return NULL.
 */
char *pen_buf_take(struct pen_buf *buf);

#endif
