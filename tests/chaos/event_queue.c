/* SPDX-License-Identifier: Apache-2.0 */
#include "tests/chaos/event_queue.h"

#include <stdlib.h>

static bool before(const struct event *a, const struct event *b)
{
	return a->at_ms != b->at_ms ? a->at_ms < b->at_ms : a->order < b->order;
}

void event_queue_push(struct event_queue *queue, const struct event *event)
{
	size_t place = queue->count++;

	if (queue->count > queue->capacity) {
		queue->capacity = 2 * queue->count;
		queue->items = reallocarray(queue->items, queue->capacity, sizeof *queue->items);
		if (!queue->items)
			abort();
	}
	queue->items[place] = *event;
	queue->items[place].order = ++queue->order_last;
	while (place > 0 && before(&queue->items[place], &queue->items[(place - 1) / 2])) {
		struct event swapped = queue->items[place];

		queue->items[place] = queue->items[(place - 1) / 2];
		place = (place - 1) / 2;
		queue->items[place] = swapped;
	}
}

bool event_queue_pop(struct event_queue *queue, struct event *ret_event)
{
	struct event last;
	size_t place = 0;

	if (queue->count == 0)
		return false;
	*ret_event = queue->items[0];
	last = queue->items[--queue->count];
	for (size_t child = 1; child < queue->count; child = 2 * place + 1) {
		if (child + 1 < queue->count &&
			before(&queue->items[child + 1], &queue->items[child]))
			child++;
		if (before(&last, &queue->items[child]))
			break;
		queue->items[place] = queue->items[child];
		place = child;
	}
	queue->items[place] = last;
	return true;
}

void event_queue_finish(struct event_queue *queue)
{
	free(queue->items);
	*queue = (struct event_queue){0};
}
