/* SPDX-License-Identifier: Apache-2.0 */
#include "server/recent.h"

#include <stdlib.h>
#include <string.h>

enum { MOMENT_MS = 100 };

void pen_recent_finish(struct pen_recent *recent)
{
	for (size_t i = 0; i < PEN_RECENT_TEXTS_MAX; i++)
		free(recent->texts[i].text);
	*recent = (struct pen_recent){0};
}

const struct pen_recent_text *pen_recent_find(
	const struct pen_recent *recent, const struct pen_job *job, int64_t now_ms)
{
	const struct pen_recent_text *found = &recent->texts[job->number % PEN_RECENT_TEXTS_MAX];

	if (!found->text || found->number != job->number || found->revision != job->revision ||
		found->until_ms <= now_ms)
		return NULL;
	return found;
}

void pen_recent_put(struct pen_recent *recent, const struct pen_job *job, int64_t now_ms,
	const char *text, size_t size)
{
	struct pen_recent_text *place = &recent->texts[job->number % PEN_RECENT_TEXTS_MAX];
	char *copy = size <= PEN_RECENT_BYTES_MAX ? malloc(size) : NULL;

	free(place->text);
	*place = (struct pen_recent_text){0};
	if (!copy)
		return;
	memcpy(copy, text, size);
	*place = (struct pen_recent_text){
		.number = job->number,
		.revision = job->revision,
		.until_ms = pen_job_is_over(job->state) ? INT64_MAX : now_ms + MOMENT_MS,
		.text = copy,
		.size = size,
	};
}
