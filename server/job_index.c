/* SPDX-License-Identifier: Apache-2.0 */
#include "server/job_index.h"

#include <search.h>
#include <stdlib.h>
#include <string.h>

struct index_entry {
	struct pen_sha256 key;
	struct pen_job *job;
};

static int compare(const void *left, const void *right)
{
	const struct index_entry *a = left, *b = right;

	return memcmp(&a->key, &b->key, sizeof a->key);
}

static struct index_entry *find(const struct pen_job_index *index, const struct pen_sha256 *key)
{
	const struct index_entry sought = {.key = *key};
	struct index_entry **place = tfind(&sought, &index->entries, compare);

	return place ? *place : NULL;
}

void pen_job_index_finish(struct pen_job_index *index)
{
	tdestroy(index->entries, free);
	index->entries = NULL;
}

void pen_job_index_put(
	struct pen_job_index *index, const struct pen_sha256 *key, struct pen_job *job)
{
	struct index_entry *entry = find(index, key);

	if (entry) {
		entry->job = job;
		return;
	}
	entry = calloc(1, sizeof *entry);
	if (!entry)
		return;
	*entry = (struct index_entry){*key, job};
	if (!tsearch(entry, &index->entries, compare))
		free(entry);
}

void pen_job_index_drop(
	struct pen_job_index *index, const struct pen_sha256 *key, const struct pen_job *job)
{
	struct index_entry *entry = find(index, key);

	if (!entry || entry->job != job)
		return;
	(void)tdelete(entry, &index->entries, compare);
	free(entry);
}

struct pen_job *pen_job_index_find(const struct pen_job_index *index, const struct pen_sha256 *key)
{
	const struct index_entry *entry = find(index, key);

	return entry ? entry->job : NULL;
}
