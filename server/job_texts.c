/* SPDX-License-Identifier: Apache-2.0 */
#include "server/job_texts.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

enum { TEXTS = 4 };

static void list_texts(struct pen_job *job, char **ret_texts[static TEXTS])
{
	ret_texts[0] = &job->name;
	ret_texts[1] = &job->equivalence_class;
	ret_texts[2] = &job->errors;
	ret_texts[3] = &job->warnings;
}

int pen_job_texts_copy(struct pen_job *job, struct pen_error *err)
{
	char **texts[TEXTS];
	int r = 0;

	list_texts(job, texts);
	for (size_t i = 0; i < TEXTS; i++) {
		char *copy = *texts[i] ? strdup(*texts[i]) : NULL;

		if (*texts[i] && !copy)
			r = pen_error_memory(err);
		*texts[i] = copy;
	}
	if (r < 0)
		pen_job_texts_free(job);
	return r;
}

void pen_job_texts_free(struct pen_job *job)
{
	char **texts[TEXTS];

	list_texts(job, texts);
	for (size_t i = 0; i < TEXTS; i++) {
		free(*texts[i]);
		*texts[i] = NULL;
	}
}
