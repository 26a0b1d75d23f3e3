/* SPDX-License-Identifier: Apache-2.0 */
#include "server/ceiling.h"

#include "core/base/limits.h"

#include <assert.h>
#include <inttypes.h>
#include <stdio.h>

enum {
	CONNECTION_BYTES = 4 << 10, /* beside its header: libmicrohttpd's, and the request's */
	COPIES = 3,		    /* of a scene: as it came, canonical, on its way to the disk */
	READERS = 4,		    /* threads of libuv's pool */
	RENDER_BYTES = 4 << 10,	    /* beside what is told of its scene */
};

static uint64_t tree_bytes(void)
{
	return (uint64_t)PEN_SCENE_NODES_MAX * PEN_SCENE_NODE_BYTES + PEN_SCENE_BYTES_MAX;
}

/* What is told of a scene: errors and warnings. */
static uint64_t report_bytes(void)
{
	return PEN_SCENE_ERRORS_MAX * 2ull * PEN_SCENE_ERROR_BYTES_MAX +
	       (uint64_t)PEN_SCENE_WARNINGS_MAX * PEN_SCENE_WARNING_BYTES_MAX;
}

void pen_ceiling_compute(uint32_t waiting_max, struct pen_ceiling *ret_ceiling)
{
	*ret_ceiling = (struct pen_ceiling){
		.parts = {{"connections",
				  (uint64_t)(PEN_HTTP_CONNECTIONS_MAX + PEN_HTTP_LOCAL_MAX) *
					  (PEN_HTTP_MEMORY + CONNECTION_BYTES)},
			{"bodies", (uint64_t)COPIES * PEN_HTTP_BODIES_MAX},
			{"scenes being read", READERS * tree_bytes()},
			{"scenes at hand", PEN_SHELF_TREES_MAX * tree_bytes()},
			{"answers", PEN_HTTP_ANSWERS_MAX}, {"images", PEN_CACHE_HELD_BYTES},
			{"events", (uint64_t)PEN_STREAMS_MAX * PEN_STREAM_TEXT_MAX},
			{"workers", (uint64_t)PEN_WORKERS_MAX * PEN_FRAME_PAYLOAD_MAX},
			{"results", (uint64_t)PEN_MERGING_MAX * PEN_TILE_BYTES_MAX},
			{"renders", waiting_max * (RENDER_BYTES + report_bytes())}},
	};
	for (size_t i = 0; i < PEN_CEILING_PARTS; i++)
		ret_ceiling->bytes += ret_ceiling->parts[i].bytes;
}

void pen_ceiling_format(const struct pen_ceiling *ceiling, char ret_text[static PEN_CEILING_TEXT])
{
	int used = snprintf(ret_text, PEN_CEILING_TEXT,
		"memory: at most %" PRIu64 " MiB by the limits:", ceiling->bytes >> 20);

	for (size_t i = 0; i < PEN_CEILING_PARTS; i++) {
		used += snprintf(ret_text + used, PEN_CEILING_TEXT - (size_t)used, "%s %s %" PRIu64,
			i > 0 ? "," : "", ceiling->parts[i].name, ceiling->parts[i].bytes >> 20);
		assert(used < PEN_CEILING_TEXT);
	}
}
