/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_FARM_H
#define PEN_SERVER_FARM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The workers as the coordinator knows them; read by the API, written by link.c alone. */
struct pen_farm;

struct pen_worker {
	uint64_t id; /* never used twice */
	char *name;
	char *address; /* "127.0.0.1:4711" */
	uint32_t processes;
	char *equivalence_class;
	char *version;
	bool draining;
	uint32_t leases;     /* held now */
	uint64_t units_done;
	uint64_t samples_done;
	double samples_per_second; /* over the last seconds */
	int64_t connected_ms, heartbeat_ms; /* wall time */
	uint32_t strikes;
};

/* In order of id: the first with id > after (0: of all); NULL at the end. */
const struct pen_worker *pen_farm_next(const struct pen_farm *farm, uint64_t after);

/* Units that could be leased now, and why they wait: "" when none do, else a sentence. */
uint64_t pen_farm_queue_depth(const struct pen_farm *farm);
const char *pen_farm_why_waiting(const struct pen_farm *farm);

#endif
