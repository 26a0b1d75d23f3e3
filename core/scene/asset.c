/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/asset.h"

#include <string.h>

static const char prefix[] = "sha256:";

/* Room for one more element of an array whose room is the power of two that holds count. */
static void *grow(struct pen_reader *reader, void *elements, size_t count, size_t size)
{
	void *room;

	if ((count & (count - 1)) != 0)
		return elements;
	room = pen_reader_alloc(reader, count > 0 ? 2 * count : 1, size);
	if (room && count > 0)
		memcpy(room, elements, count * size);
	return room;
}

/* False after an offence. What the text says otherwise is for the one who wrote it to mend. */
static bool read_digest(struct pen_reader *reader, const struct pen_place *at, const json_t *value,
	struct pen_sha256 *ret_digest)
{
	const char *text = json_string_value(value);
	const size_t length = sizeof prefix - 1;

	if (!text)
		pen_reader_refuse(reader, at, "must be a string");
	else if (strncmp(text, prefix, length) != 0)
		pen_reader_refuse(reader, at,
			"must be \"sha256:\" and 64 hex digits: upload the file with PUT "
			"/v1/assets/sha256/{hex} and put its hash here; no URL is fetched and no "
			"path is opened, but the penumbra command does this for relative paths");
	else if (!pen_sha256_parse(text + length, ret_digest) || strlen(text) != length + 64)
		pen_reader_refuse(
			reader, at, "must have 64 lower-case hex digits behind \"sha256:\"");
	else
		return true;
	return false;
}

void pen_asset_read(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	struct pen_scene *scene = reader->scene;
	struct pen_asset_desc asset, *assets;
	uint32_t *index = desc;

	if (!read_digest(reader, at, value, &asset.sha256))
		return;
	if (scene->asset_count == PEN_ASSETS_MAX) {
		pen_reader_refuse(reader, at, "is one file too many: a scene refers to at most %u",
			PEN_ASSETS_MAX);
		return;
	}
	asset.pointer = pen_reader_pointer(reader, at);
	assets = grow(reader, scene->assets, scene->asset_count, sizeof *assets);
	if (!asset.pointer || !assets)
		return;
	scene->assets = assets;
	*index = scene->asset_count++;
	assets[*index] = asset;
}

void pen_picture_read(
	struct pen_reader *reader, const struct pen_place *at, json_t *value, void *desc)
{
	struct pen_scene *scene = reader->scene;
	struct pen_picture_desc picture = {.place = "", .asset = PEN_NO_INDEX}, *pictures;
	uint32_t *index = desc;

	pen_asset_read(reader, at, value, &picture.asset);
	if (picture.asset == PEN_NO_INDEX)
		return;
	picture.pointer = pen_reader_pointer(reader, at->parent);
	pictures = grow(reader, scene->pictures, scene->picture_count, sizeof *pictures);
	if (!picture.pointer || !pictures)
		return;
	scene->pictures = pictures;
	*index = scene->picture_count++;
	pictures[*index] = picture;
}
