/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_JOB_TABLE_H
#define PEN_SERVER_JOB_TABLE_H

#include "core/base/error.h"
#include "server/job.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Jobs by id and by number, and the ids and owners of those that were removed. It owns none of the
 * jobs. */
struct pen_job_table {
	struct pen_job **jobs; /* by rising number */
	size_t count, capacity;
	void *ids; /* search tree, see tsearch(3) */
};

void pen_job_table_init(struct pen_job_table *table);
void pen_job_table_finish(struct pen_job_table *table);

/* The job's number is higher than all others. PEN_ENOMEM. */
int pen_job_table_add(struct pen_job_table *table, struct pen_job *job, struct pen_error *err);

/* Its id stays known as that of a removed one. */
void pen_job_table_remove(struct pen_job_table *table, const struct pen_job *job);

int pen_job_table_add_removed(struct pen_job_table *table, const char *id,
	const struct pen_owner *owner, struct pen_error *err);

/* As pen_job_table_remove, and nobody will know that there once was one. */
void pen_job_table_forget(struct pen_job_table *table, const struct pen_job *job);

/* NULL when there is none. */
struct pen_job *pen_job_table_find(const struct pen_job_table *table, const char *id);

/* The owner of one that was removed; NULL when none was that had this id. */
const struct pen_owner *pen_job_table_find_removed(
	const struct pen_job_table *table, const char *id);

struct pen_job *pen_job_table_find_number(const struct pen_job_table *table, uint64_t number);

/* The one with the highest number < before; NULL when there is none. */
struct pen_job *pen_job_table_older(const struct pen_job_table *table, uint64_t before);

#endif
