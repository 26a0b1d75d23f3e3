/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_ERROR_H
#define PEN_BASE_ERROR_H

/* What a function returns when it fails: 0 is success, failures are negative. */
enum pen_code {
	PEN_OK = 0,
	PEN_EINVALID = -1,     /* what was given is wrong; the text names the culprit */
	PEN_ENOMEM = -2,       /* an allocation failed */
	PEN_EIO = -3,	       /* the system refused; the text holds strerror */
	PEN_ELIMIT = -4,       /* a bound of core/base/limits.h was passed */
	PEN_ENOTFOUND = -5,    /* no such thing */
	PEN_EPROTOCOL = -6,    /* a peer broke the protocol */
	PEN_EAGAIN = -7,       /* not now; try later */
	PEN_ECLOSED = -8,      /* the peer or the service has gone */
	PEN_ECONFLICT = -9,    /* the thing's state does not allow it */
	PEN_ENOSPACE = -10,    /* the disk is full */
	PEN_EUNSUPPORTED = -11 /* valid, but not offered */
};

/*
 * Why a call failed, for a person to read: one line, no newline, naming culprit and cure.
 * The lowest level that knows the reason writes it; higher levels pass it on untouched.
 */
struct pen_error {
	int code; /* enum pen_code */
	char text[512];
};

/* clang-format off */
#define PEN_ERROR_INIT {.code = PEN_OK, .text = ""}
/* clang-format on */

/* Fills *err (which may be NULL) and returns code, so that a failing function ends in one line. */
int pen_error_set(struct pen_error *err, int code, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/*
 * As pen_error_set with PEN_EIO (PEN_ENOSPACE for ENOSPC and EDQUOT); appends
 * strerror(errno_value).
 */
int pen_error_system(struct pen_error *err, int errno_value, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* PEN_ENOMEM with the standard text. */
int pen_error_memory(struct pen_error *err);

#endif
