/* SPDX-License-Identifier: Apache-2.0 */
#include "server/job_table.h"

#include <assert.h>
#include <search.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct id_entry {
	char id[PEN_JOB_ID_TEXT];
	struct pen_job *job; /* NULL: removed */
	struct pen_owner owner;
};

static int compare_entries(const void *left, const void *right)
{
	const struct id_entry *a = left, *b = right;

	return strcmp(a->id, b->id);
}

void pen_job_table_init(struct pen_job_table *table)
{
	*table = (struct pen_job_table){0};
}

void pen_job_table_finish(struct pen_job_table *table)
{
	tdestroy(table->ids, free);
	free(table->jobs);
	pen_job_table_init(table);
}

static int add_id(struct pen_job_table *table, const char *id, const struct pen_owner *owner,
	struct pen_job *job, struct pen_error *err)
{
	struct id_entry *entry = calloc(1, sizeof *entry);
	struct id_entry **place;

	if (!entry)
		return pen_error_memory(err);
	(void)snprintf(entry->id, sizeof entry->id, "%s", id);
	entry->job = job;
	entry->owner = *owner;
	place = tsearch(entry, &table->ids, compare_entries);
	if (!place) {
		free(entry);
		return pen_error_memory(err);
	}
	assert(*place == entry);
	return 0;
}

/* How many of the jobs have a number < before. */
static size_t count_older(const struct pen_job_table *table, uint64_t before)
{
	size_t low = 0, high = table->count;

	while (low < high) {
		size_t middle = low + (high - low) / 2;

		if (table->jobs[middle]->number < before)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

int pen_job_table_add(struct pen_job_table *table, struct pen_job *job, struct pen_error *err)
{
	int r;

	assert(table->count == 0 || table->jobs[table->count - 1]->number < job->number);
	if (table->count == table->capacity) {
		size_t capacity = table->capacity ? 2 * table->capacity : 64;
		struct pen_job **jobs =
			reallocarray(table->jobs, capacity, sizeof(struct pen_job *));

		if (!jobs)
			return pen_error_memory(err);
		table->jobs = jobs;
		table->capacity = capacity;
	}
	r = add_id(table, job->id, &job->owner, job, err);
	if (r == 0)
		table->jobs[table->count++] = job;
	return r;
}

static struct id_entry *find_entry(const struct pen_job_table *table, const char *id)
{
	struct id_entry key;
	struct id_entry **place;

	if (strlen(id) != PEN_JOB_ID_TEXT - 1)
		return NULL;
	memcpy(key.id, id, sizeof key.id);
	place = tfind(&key, &table->ids, compare_entries);
	return place ? *place : NULL;
}

void pen_job_table_remove(struct pen_job_table *table, const struct pen_job *job)
{
	size_t place = count_older(table, job->number);
	struct id_entry *entry = find_entry(table, job->id);

	assert(entry && entry->job == job && table->jobs[place] == job);
	entry->job = NULL;
	table->count--;
	memmove(table->jobs + place, table->jobs + place + 1,
		(table->count - place) * sizeof(struct pen_job *));
}

void pen_job_table_forget(struct pen_job_table *table, const struct pen_job *job)
{
	struct id_entry *entry = find_entry(table, job->id);

	pen_job_table_remove(table, job);
	(void)tdelete(entry, &table->ids, compare_entries);
	free(entry);
}

int pen_job_table_add_removed(struct pen_job_table *table, const char *id,
	const struct pen_owner *owner, struct pen_error *err)
{
	return add_id(table, id, owner, NULL, err);
}

struct pen_job *pen_job_table_find(const struct pen_job_table *table, const char *id)
{
	const struct id_entry *entry = find_entry(table, id);

	return entry ? entry->job : NULL;
}

const struct pen_owner *pen_job_table_find_removed(
	const struct pen_job_table *table, const char *id)
{
	const struct id_entry *entry = find_entry(table, id);

	return entry && !entry->job ? &entry->owner : NULL;
}

struct pen_job *pen_job_table_find_number(const struct pen_job_table *table, uint64_t number)
{
	size_t place = count_older(table, number);

	if (place == table->count || table->jobs[place]->number != number)
		return NULL;
	return table->jobs[place];
}

struct pen_job *pen_job_table_older(const struct pen_job_table *table, uint64_t before)
{
	size_t count = count_older(table, before);

	return count > 0 ? table->jobs[count - 1] : NULL;
}
