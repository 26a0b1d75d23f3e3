/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/pictures.h"

#include "core/base/limits.h"
#include "core/base/sandbox.h"
#include "core/scene/parse.h"

#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

struct pen_pictures {
	struct pen_mipmap **mipmaps; /* two a picture: as it is stored, and from sRGB; or NULL */
	uint32_t *textures;	     /* mipmap of each texture */
	uint32_t picture_count;
	struct pen_environment *environment; /* NULL without a background */
	uint64_t bytes;
};

static void note(
	const struct pen_picture_desc *desc, const char *fault, struct pen_scene_errors *errors)
{
	struct pen_scene_error *to;
	const char *place = desc->place ? desc->place : "";

	if (errors->count >= PEN_SCENE_ERRORS_MAX)
		return;
	to = &errors->items[errors->count++];
	(void)snprintf(to->pointer, sizeof to->pointer, "%s", desc->pointer);
	(void)snprintf(to->detail, sizeof to->detail, "%s%sthe image cannot be used: %s", place,
		place[0] ? ": " : "", fault);
}

static int find_bytes(const struct pen_picture_desc *desc, const struct pen_blob *blob,
	struct pen_blob *ret_bytes, struct pen_error *err)
{
	if (desc->bytes) {
		*ret_bytes = (struct pen_blob){desc->bytes, desc->size};
		return 0;
	}
	if (desc->offset > blob->size || desc->size > blob->size - desc->offset)
		return pen_error_set(err, PEN_EINVALID, "it reaches past the end of its file");
	ret_bytes->bytes = (const uint8_t *)blob->bytes + desc->offset;
	ret_bytes->size = desc->size > 0 ? desc->size : blob->size - desc->offset;
	return 0;
}

static int load_one(struct pen_pictures *pictures, const struct pen_picture_desc *desc,
	const struct pen_blob *blob, uint32_t mipmap, struct pen_error *err)
{
	struct pen_picture picture = {0};
	struct pen_blob bytes = {NULL, 0};
	uint64_t size;
	int r = find_bytes(desc, blob, &bytes, err);

	if (r == 0)
		r = pen_sandbox_allow_cpu(PEN_PICTURE_CPU_S, err);
	if (r == 0)
		r = pen_picture_decode(bytes.bytes, bytes.size, &picture, err);
	if (r < 0)
		return r;
	size = pen_mipmap_bytes(picture.type, picture.width, picture.height);
	if (size > PEN_PICTURES_BYTES_MAX - pictures->bytes) {
		pen_picture_finish(&picture);
		return pen_error_set(err, PEN_ELIMIT,
			"all pictures together would take more than %lu MiB of memory",
			PEN_PICTURES_BYTES_MAX >> 20);
	}
	pictures->bytes += size;
	return pen_mipmap_create(&picture, mipmap % 2 == 1, &pictures->mipmaps[mipmap], err);
}

/* wanted: whether each mipmap is. Only a lack of memory ends it early. */
static int load_wanted(struct pen_pictures *pictures, const struct pen_scene *scene,
	const struct pen_blob *blobs, const bool *wanted, struct pen_scene_errors *errors,
	struct pen_error *err)
{
	struct pen_error fault = PEN_ERROR_INIT;
	const size_t before = errors->count;

	for (uint32_t i = 0; i < 2 * scene->picture_count; i++) {
		const struct pen_picture_desc *desc = &scene->pictures[i / 2];
		int r;

		if (!wanted[i])
			continue;
		r = load_one(pictures, desc, &blobs[desc->asset], i, &fault);
		if (r == PEN_ENOMEM)
			return pen_error_memory(err);
		if (r < 0)
			note(desc, fault.text, errors);
	}
	if (errors->count > before)
		return pen_error_set(err, PEN_EINVALID, "a picture of the scene cannot be used");
	return 0;
}

static uint32_t mipmap_of(const struct pen_texture_desc *texture)
{
	return 2 * texture->picture + (texture->is_srgb ? 1 : 0);
}

static uint32_t mipmap_of_background(const struct pen_scene *scene)
{
	return 2 * scene->background.picture + 1;
}

static int allocate(struct pen_pictures *pictures, const struct pen_scene *scene, bool **ret_wanted,
	struct pen_error *err)
{
	bool *wanted = calloc(2ul * scene->picture_count + 1, sizeof *wanted);

	*ret_wanted = wanted;
	pictures->picture_count = scene->picture_count;
	pictures->mipmaps = calloc(2ul * scene->picture_count + 1, sizeof(struct pen_mipmap *));
	pictures->textures = calloc(scene->texture_count + 1ul, sizeof *pictures->textures);
	if (!wanted || !pictures->mipmaps || !pictures->textures)
		return pen_error_memory(err);
	for (uint32_t i = 0; i < scene->texture_count; i++) {
		pictures->textures[i] = mipmap_of(&scene->textures[i]);
		wanted[pictures->textures[i]] = true;
	}
	if (scene->background.picture != PEN_NO_INDEX)
		wanted[mipmap_of_background(scene)] = true;
	return 0;
}

int pen_pictures_load(const struct pen_scene *scene, const struct pen_blob *blobs,
	struct pen_scene_errors *errors, struct pen_pictures **ret_pictures, struct pen_error *err)
{
	struct pen_pictures *pictures = calloc(1, sizeof *pictures);
	bool *wanted = NULL;
	int r = pictures ? allocate(pictures, scene, &wanted, err) : pen_error_memory(err);

	if (r == 0)
		r = load_wanted(pictures, scene, blobs, wanted, errors, err);
	if (r == 0)
		r = pen_sandbox_allow_cpu(0, err);
	if (r == 0 && scene->background.picture != PEN_NO_INDEX)
		r = pen_environment_create(pictures->mipmaps[mipmap_of_background(scene)],
			&scene->background, &pictures->environment, err);
	free(wanted);
	if (r < 0)
		pen_pictures_destroy(pictures);
	else
		*ret_pictures = pictures;
	return r;
}

void pen_pictures_destroy(struct pen_pictures *pictures)
{
	if (!pictures)
		return;
	pen_environment_destroy(pictures->environment);
	for (uint32_t i = 0; pictures->mipmaps && i < 2 * pictures->picture_count; i++)
		pen_mipmap_destroy(pictures->mipmaps[i]);
	free(pictures->mipmaps);
	free(pictures->textures);
	free(pictures);
}

const struct pen_mipmap *pen_pictures_texture(const struct pen_pictures *pictures, uint32_t texture)
{
	return pictures->mipmaps[pictures->textures[texture]];
}

const struct pen_environment *pen_pictures_environment(const struct pen_pictures *pictures)
{
	return pictures ? pictures->environment : NULL;
}
