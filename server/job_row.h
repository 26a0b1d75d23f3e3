/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_JOB_ROW_H
#define PEN_SERVER_JOB_ROW_H

#include "server/job.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct sqlite3_stmt;

/* A column of a row as text, cut to size and empty where it is NULL. */
void pen_row_text(char *ret_text, size_t size, struct sqlite3_stmt *row, int column);

/* The same as a number; a count that does not fit is 0. */
uint32_t pen_row_count(struct sqlite3_stmt *row, int column);
uint64_t pen_row_number(struct sqlite3_stmt *row, int column);

/* Nobody's where it is NULL; false when it is neither that nor an owner. */
bool pen_row_owner(struct sqlite3_stmt *row, int column, struct pen_owner *ret_owner);

/* The owner must stay as it is until the statement is reset. */
void pen_row_bind_owner(struct sqlite3_stmt *put, int place, const struct pen_owner *owner);

/* A job as a row of the store's table: the statement that puts one, and that which gives all. */
extern const char pen_job_row_put[], pen_job_row_load[];

/* The job must stay as it is until the statement is reset. */
void pen_job_row_bind(struct sqlite3_stmt *put, const struct pen_job *job);

/* The texts are the row's; false when the row is not one this program has written. */
bool pen_job_row_read(struct sqlite3_stmt *row, struct pen_job *ret_job);

#endif
