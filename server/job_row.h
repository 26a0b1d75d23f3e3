/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_JOB_ROW_H
#define PEN_SERVER_JOB_ROW_H

#include "server/job.h"

#include <stdbool.h>

struct sqlite3_stmt;

/* A job as a row of the store's table: the statement that puts one, and that which gives all. */
extern const char pen_job_row_put[], pen_job_row_load[];

/* The job must stay as it is until the statement is reset. */
void pen_job_row_bind(struct sqlite3_stmt *put, const struct pen_job *job);

/* The texts are the row's; false when the row is not one this program has written. */
bool pen_job_row_read(struct sqlite3_stmt *row, struct pen_job *ret_job);

#endif
