/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_SCHEMA_H
#define PEN_SERVER_SCHEMA_H

/* The tables of the store, as SQL that leads from each version to the next; 0 is an empty file. */
enum { PEN_SCHEMA_VERSION = 10 };

extern const char *const pen_schema_migrations[PEN_SCHEMA_VERSION];

#endif
