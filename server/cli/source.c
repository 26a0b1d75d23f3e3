/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/source.h"

#include "core/base/limits.h"
#include "server/cli/folder.h"
#include "server/cli/gltf_pack.h"

#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char hash_prefix[] = "sha256:";

enum { ASSET_TEXT = sizeof hash_prefix - 1 + PEN_SHA256_TEXT };

void pen_source_init(struct pen_source *source)
{
	*source = (struct pen_source){.folder = -1};
	pen_buf_init(&source->text, PEN_SCENE_BYTES_MAX);
	pen_buf_init(&source->held, PEN_ASSET_BYTES_MAX);
}

void pen_source_finish(struct pen_source *source)
{
	for (size_t i = 0; i < source->asset_count; i++)
		free(source->assets[i].path);
	free(source->assets);
	pen_buf_finish(&source->text);
	pen_buf_finish(&source->held);
	if (source->folder >= 0)
		close(source->folder);
	*source = (struct pen_source){.folder = -1};
}

static int file_read(const char *path, struct pen_buf *out, struct pen_error *err)
{
	bool standard_input = strcmp(path, "-") == 0;
	int fd = standard_input ? STDIN_FILENO : open(path, O_RDONLY | O_CLOEXEC);
	int r;

	if (fd < 0)
		return pen_error_system(err, errno, "open %s", path);
	r = pen_folder_drain(fd, path, out, err);
	if (!standard_input)
		close(fd);
	return r;
}

int pen_source_asset_read(const struct pen_source *source, const char *path, struct pen_buf *out,
	struct pen_error *err)
{
	int r = pen_folder_read(source->folder, path, out, err);

	if (r == 0 && pen_gltf_is_text(path))
		r = pen_gltf_pack(out, source->folder, path, err);
	return r;
}

static bool is_known(const struct pen_source *source, const struct pen_sha256 *sha256)
{
	for (size_t i = 0; i < source->asset_count; i++)
		if (pen_sha256_equal(&source->assets[i].sha256, sha256))
			return true;
	return false;
}

/*
 * Takes path, which is NULL for the held bytes; ret_text has ASSET_TEXT characters. A file that
 * stands in several places is entered once.
 */
static int asset_add(struct pen_source *source, const struct pen_buf *bytes, char *path,
	char *ret_text, struct pen_error *err)
{
	struct pen_source_asset asset = {.path = path}, *assets;
	int r = pen_sha256_of(bytes->size ? bytes->data : "", bytes->size, &asset.sha256, err);

	if (r < 0 || is_known(source, &asset.sha256)) {
		free(path);
	} else {
		assets = reallocarray(source->assets, source->asset_count + 1, sizeof *assets);
		if (!assets) {
			free(path);
			return pen_error_memory(err);
		}
		source->assets = assets;
		assets[source->asset_count++] = asset;
	}
	if (r < 0)
		return r;
	memcpy(ret_text, hash_prefix, sizeof hash_prefix);
	pen_sha256_format(&asset.sha256, ret_text + sizeof hash_prefix - 1);
	return 0;
}

/* Puts the hash of a file in the place of its path; passes over what is no path. */
static int mention_resolve(struct pen_source *source, json_t *object, const char *key,
	size_t *ret_count, struct pen_error *err)
{
	const char *path = json_string_value(json_object_get(object, key));
	char text[ASSET_TEXT], *copy;
	struct pen_buf bytes;
	int r;

	if (!path || strncmp(path, hash_prefix, sizeof hash_prefix - 1) == 0)
		return 0;
	copy = strdup(path);
	if (!copy)
		return pen_error_memory(err);
	pen_buf_init(&bytes, PEN_ASSET_BYTES_MAX);
	r = pen_source_asset_read(source, path, &bytes, err);
	if (r == 0)
		r = asset_add(source, &bytes, copy, text, err);
	else
		free(copy);
	pen_buf_finish(&bytes);
	if (r == 0 && json_object_set_new(object, key, json_string(text)) < 0)
		r = pen_error_memory(err);
	*ret_count += r == 0;
	return r;
}

static int mentions_resolve(
	struct pen_source *source, json_t *scene, size_t *ret_count, struct pen_error *err)
{
	json_t *textures = json_object_get(scene, "textures"), *texture, *object;
	int r = mention_resolve(
		source, json_object_get(scene, "background"), "image", ret_count, err);
	const char *name;
	size_t i;

	json_object_foreach (textures, name, texture) {
		if (r == 0)
			r = mention_resolve(source, texture, "image", ret_count, err);
	}
	json_array_foreach (json_object_get(scene, "objects"), i, object) {
		if (r == 0)
			r = mention_resolve(source, object, "asset", ret_count, err);
	}
	return r;
}

/* Only a text in which paths have become hashes is written anew. */
static int scene_resolve(struct pen_source *source, const char *path, struct pen_error *err)
{
	struct pen_buf *text = &source->text;
	json_error_t where;
	size_t count = 0;
	char *changed;
	json_t *scene = json_loadb(
		text->size ? text->data : "", text->size, JSON_REJECT_DUPLICATES, &where);
	int r;

	if (!scene)
		return pen_error_set(err, PEN_EINVALID, "%s: line %d, column %d, byte %d: %s", path,
			where.line, where.column, where.position, where.text);
	r = mentions_resolve(source, scene, &count, err);
	changed = r == 0 && count > 0 ? json_dumps(scene, JSON_COMPACT) : NULL;
	json_decref(scene);
	if (r < 0 || count == 0)
		return r;
	if (!changed)
		return pen_error_memory(err);
	pen_buf_clear(text);
	if (pen_buf_text(text, changed) < 0)
		r = pen_error_set(err, PEN_ELIMIT, "%s is larger than %u MiB", path,
			PEN_SCENE_BYTES_MAX >> 20);
	free(changed);
	return r;
}

static int gltf_wrap(struct pen_source *source, struct pen_error *err)
{
	char text[ASSET_TEXT];
	int r = asset_add(source, &source->held, NULL, text, err);

	if (r < 0)
		return r;
	if (pen_buf_printf(&source->text,
		    "{\"version\":1,\"image\":{\"width\":640,\"height\":360},"
		    "\"integrator\":{\"type\":\"path\"},"
		    "\"objects\":[{\"type\":\"gltf\",\"asset\":\"%s\"}]}",
		    text) < 0)
		return pen_error_memory(err);
	return 0;
}

int pen_source_read(struct pen_source *source, const char *path, struct pen_error *err)
{
	const char *name = strrchr(path, '/') ? strrchr(path, '/') + 1 : path;
	struct pen_buf *held = &source->held;
	int r = file_read(path, held, err);

	if (r == 0)
		r = pen_folder_open(path, &source->folder, err);
	if (r == 0 && pen_gltf_is_text(name))
		r = pen_gltf_pack(held, source->folder, name, err);
	if (r < 0)
		return r;
	if (pen_gltf_is_glb(held))
		return gltf_wrap(source, err);
	if (pen_buf_append(&source->text, held->data, held->size) < 0)
		return pen_error_set(err, PEN_ELIMIT, "%s is larger than %u MiB", path,
			PEN_SCENE_BYTES_MAX >> 20);
	pen_buf_finish(held);
	return scene_resolve(source, path, err);
}
