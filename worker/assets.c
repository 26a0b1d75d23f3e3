/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/assets.h"

#include "core/base/clock.h"
#include "core/base/limits.h"
#include "worker/memory.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { FETCHES_MAX = 4, KEEP_MS = 10000, RETRY_MS = 1000 };

enum asset_state { ASSET_FETCHING, ASSET_READY, ASSET_FAILED };

struct asset {
	enum asset_state state;
	struct pen_sha256 sha256;
	int64_t used_ms, failed_ms;
	bool is_missing; /* of a failed one: the coordinator lacks it */
	int fd;		 /* -1 until its first piece */
	uint64_t size, received;
	struct pen_sha256_stream *stream; /* of one that is being fetched */
	char reason[PEN_REASON_MAX];	  /* of a failed one */
};

struct pen_assets {
	struct pen_assets_events events;
	uint64_t bytes_max, bytes; /* of those that are ready */
	struct asset **items;
	uint32_t count, fetches;
};

static struct asset *find(const struct pen_assets *assets, const struct pen_sha256 *sha256)
{
	for (uint32_t i = 0; i < assets->count; i++)
		if (pen_sha256_equal(&assets->items[i]->sha256, sha256))
			return assets->items[i];
	return NULL;
}

static void asset_destroy(struct asset *asset)
{
	pen_sha256_stream_destroy(asset->stream);
	if (asset->fd >= 0)
		(void)close(asset->fd);
	free(asset);
}

static void drop(struct pen_assets *assets, uint32_t index)
{
	struct asset *asset = assets->items[index];

	assets->bytes -= asset->state == ASSET_READY ? asset->size : 0;
	assets->fetches -= asset->state == ASSET_FETCHING;
	asset_destroy(asset);
	assets->items[index] = assets->items[--assets->count];
}

static uint32_t index_of(const struct pen_assets *assets, const struct asset *asset)
{
	uint32_t i = 0;

	while (assets->items[i] != asset)
		i++;
	return i;
}

/* Those that are not ready take no memory worth speaking of. */
static void make_room(struct pen_assets *assets)
{
	const int64_t now_ms = pen_clock_ms();

	while (assets->bytes > assets->bytes_max || assets->count >= PEN_ASSETS_CACHED_MAX) {
		uint32_t oldest = assets->count;

		for (uint32_t i = 0; i < assets->count; i++)
			if (assets->items[i]->state != ASSET_FETCHING &&
				now_ms - assets->items[i]->used_ms > KEEP_MS &&
				(oldest == assets->count ||
					assets->items[i]->used_ms < assets->items[oldest]->used_ms))
				oldest = i;
		if (oldest == assets->count)
			return;
		drop(assets, oldest);
	}
}

static struct asset *add(struct pen_assets *assets, const struct pen_sha256 *sha256)
{
	struct asset **items, *asset;

	make_room(assets);
	if (assets->count >= PEN_ASSETS_CACHED_MAX)
		return NULL;
	items = realloc(assets->items, (assets->count + 1) * sizeof(struct asset *));
	if (!items)
		return NULL;
	assets->items = items;
	asset = calloc(1, sizeof *asset);
	if (!asset)
		return NULL;
	asset->sha256 = *sha256;
	asset->fd = -1;
	if (pen_sha256_stream_create(&asset->stream, NULL) < 0) {
		free(asset);
		return NULL;
	}
	items[assets->count++] = asset;
	assets->fetches++;
	return asset;
}

enum pen_demand pen_assets_demand(struct pen_assets *assets, const struct pen_sha256 *sha256,
	int *ret_fd, const char **ret_reason, bool *ret_missing)
{
	struct asset *asset = find(assets, sha256);

	if (asset && asset->state == ASSET_FAILED && pen_clock_ms() - asset->failed_ms > RETRY_MS) {
		drop(assets, index_of(assets, asset));
		asset = NULL;
	}
	if (!asset && assets->fetches < FETCHES_MAX) {
		asset = add(assets, sha256);
		if (asset)
			assets->events.fetch(assets->events.user, sha256);
	}
	if (!asset)
		return PEN_DEMAND_WAIT;
	asset->used_ms = pen_clock_ms();
	if (asset->state == ASSET_FETCHING)
		return PEN_DEMAND_WAIT;
	*ret_fd = asset->fd;
	*ret_reason = asset->reason;
	*ret_missing = asset->is_missing;
	return asset->state == ASSET_READY ? PEN_DEMAND_READY : PEN_DEMAND_FAILED;
}

static int append(struct asset *asset, const struct pen_msg *msg, struct pen_error *err)
{
	const struct pen_msg_scene_data *data = &msg->u.scene_data;
	int r = 0;

	if (asset->fd < 0) {
		asset->size = data->size;
		r = pen_memory_create("pen-asset", data->size, &asset->fd, err);
	}
	if (r == 0 && (data->size != asset->size || data->offset != asset->received))
		r = pen_error_set(err, PEN_EPROTOCOL, "an asset's pieces come out of order");
	if (r == 0)
		r = pen_sha256_stream_append(asset->stream, msg->payload, msg->payload_size, err);
	if (r < 0)
		return r;
	if (pwrite(asset->fd, msg->payload, msg->payload_size, (off_t)data->offset) !=
		(ssize_t)msg->payload_size)
		return pen_error_set(err, PEN_EIO, "no memory for an asset");
	asset->received += msg->payload_size;
	return 0;
}

static int check(const struct asset *asset, struct pen_error *err)
{
	struct pen_sha256 found;

	pen_sha256_stream_take(asset->stream, &found);
	if (!pen_sha256_equal(&found, &asset->sha256))
		return pen_error_set(err, PEN_EPROTOCOL, "an asset was damaged on the way");
	return pen_memory_seal(asset->fd, err);
}

static void end_fetch(struct pen_assets *assets, struct asset *asset, const struct pen_error *err)
{
	pen_sha256_stream_destroy(asset->stream);
	asset->stream = NULL;
	assets->fetches--;
	if (err->code < 0) {
		asset->state = ASSET_FAILED;
		asset->failed_ms = pen_clock_ms();
		asset->is_missing = err->code == PEN_ENOTFOUND;
		(void)snprintf(asset->reason, sizeof asset->reason, "%s", err->text);
	} else {
		asset->state = ASSET_READY;
		assets->bytes += asset->size;
	}
	make_room(assets);
	assets->events.changed(assets->events.user);
}

void pen_assets_receive(struct pen_assets *assets, const struct pen_msg *asset_data)
{
	struct asset *asset = find(assets, &asset_data->u.scene_data.sha256);
	struct pen_error err = PEN_ERROR_INIT;
	char name[PEN_SHA256_TEXT];

	if (!asset || asset->state != ASSET_FETCHING)
		return;
	if (asset_data->u.scene_data.missing) {
		pen_sha256_format(&asset->sha256, name);
		(void)pen_error_set(&err, PEN_ENOTFOUND,
			"the coordinator does not have the asset sha256:%s", name);
	} else if (append(asset, asset_data, &err) == 0) {
		if (asset->received < asset->size)
			return;
		(void)check(asset, &err);
	}
	end_fetch(assets, asset, &err);
}

void pen_assets_disconnect(struct pen_assets *assets)
{
	for (uint32_t i = assets->count; i-- > 0;)
		if (assets->items[i]->state != ASSET_READY)
			drop(assets, i);
}

int pen_assets_create(uint64_t bytes_max, const struct pen_assets_events *events,
	struct pen_assets **ret_assets, struct pen_error *err)
{
	struct pen_assets *assets = calloc(1, sizeof *assets);

	if (!assets)
		return pen_error_memory(err);
	assets->events = *events;
	assets->bytes_max = bytes_max;
	*ret_assets = assets;
	return 0;
}

void pen_assets_destroy(struct pen_assets *assets)
{
	if (!assets)
		return;
	while (assets->count > 0)
		drop(assets, assets->count - 1);
	free(assets->items);
	free(assets);
}
