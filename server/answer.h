/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_ANSWER_H
#define PEN_SERVER_ANSWER_H

#include "core/base/error.h"
#include "core/scene/parse.h"
#include "server/shared_bytes.h"

#include <jansson.h>
#include <stddef.h>
#include <stdint.h>

/* An HTTP answer before it is sent: status, fields, and a body in memory or in a file. */

enum { PEN_ANSWER_FIELDS_MAX = 8, PEN_ANSWER_VALUES = 768, PEN_ANSWER_VALUE = 256 };

struct pen_answer_field {
	const char *name;  /* static */
	const char *value; /* in values */
};

struct pen_answer {
	unsigned status;
	const char *content_type;	/* static; NULL without a body */
	char *text;			/* heap, or NULL */
	int fd;				/* a file, or -1; not with text */
	struct pen_shared_bytes *bytes; /* held, or NULL; not with those */
	uint64_t offset;		/* in the file or bytes */
	uint64_t size;			/* of the body */
	struct pen_answer_field fields[PEN_ANSWER_FIELDS_MAX];
	size_t field_count, values_size;
	char values[PEN_ANSWER_VALUES];
};

/* Without a body. */
void pen_answer_init(struct pen_answer *answer, unsigned status);

/* Frees what is left of the body; pen_exchange_answer does it for the answers that it takes. */
void pen_answer_finish(struct pen_answer *answer);

/*
 * Adds a field, whose value is copied; one of PEN_ANSWER_VALUE bytes or more, or more than all have
 * room for, is an error of the program.
 */
void pen_answer_field(struct pen_answer *answer, const char *name, const char *value);
void pen_answer_field_of(struct pen_answer *answer, const char *name, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* A copy of a text as the body; content_type is static. Without memory the answer becomes a 500. */
void pen_answer_text(struct pen_answer *answer, unsigned status, const char *content_type,
	const char *text, size_t size);

/* tree as the body, whose reference passes; without memory the answer becomes a 500. */
void pen_answer_json(struct pen_answer *answer, unsigned status, json_t *tree);

/* An application/problem+json body (RFC 9457); detail is one sentence that echoes no input. */
void pen_answer_problem(struct pen_answer *answer, unsigned status, const char *detail);

/* 400 with every offender; each pointer gets prefix in front. */
void pen_answer_scene_errors(
	struct pen_answer *answer, const struct pen_scene_errors *errors, const char *prefix);

/* A problem with the status that suits the code, and Retry-After where trying again may help. */
void pen_answer_error(struct pen_answer *answer, const struct pen_error *err);

#endif
