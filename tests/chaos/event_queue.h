/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_CHAOS_EVENT_QUEUE_H
#define PEN_TESTS_CHAOS_EVENT_QUEUE_H

#include "proto/msg.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum event_type {
	/* at the coordinator */
	EVENT_TICK,
	EVENT_SUBMIT,
	EVENT_BEGIN,
	EVENT_MERGED,
	EVENT_FLUSHED,
	EVENT_SYNCED,
	EVENT_DECIDED,
	EVENT_STORED,
	EVENT_GONE,
	/* messages to it */
	EVENT_HELLO,
	EVENT_PROGRESS,
	EVENT_RESULT,
	EVENT_FAILURE,
	EVENT_DRAINING,
	/* messages to a worker */
	EVENT_LEASE,
	EVENT_REVOKE,
	EVENT_CLOSED,
	/* at a worker */
	EVENT_DIAL,
	EVENT_BEAT,
	EVENT_UNIT_END,
	/* of the world */
	EVENT_NEMESIS,
	EVENT_HEAL
};

struct event {
	int64_t at_ms;
	uint64_t order; /* of pushing: events of one moment keep it */
	enum event_type type;
	uint32_t worker;
	uint64_t connection;  /* of the worker: messages of an older one are not read */
	uint64_t incarnation; /* of the job, likewise */
	uint64_t job;
	struct pen_msg_lease lease;
	uint32_t detail; /* a pen_fault, a job's state, a kind of lie */
	uint64_t samples;
};

struct event_queue {
	struct event *items; /* a heap */
	size_t count, capacity;
	uint64_t order_last;
};

/* Aborts without memory. */
void event_queue_push(struct event_queue *queue, const struct event *event);
bool event_queue_pop(struct event_queue *queue, struct event *ret_event);
void event_queue_finish(struct event_queue *queue);

#endif
