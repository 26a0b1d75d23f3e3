/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/intake.h"

#include "worker/channel.h"
#include "worker/memory.h"

#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* The assets of a scene, each once. */
struct intake {
	int channel;
	struct pen_sha256 *needs;
	struct pen_blob *assets; /* of each need */
	struct pen_blob *blobs;	 /* of each mention */
	uint32_t count;
};

static uint32_t place_of(const struct intake *intake, const struct pen_sha256 *sha256)
{
	uint32_t i = 0;

	while (i < intake->count && !pen_sha256_equal(&intake->needs[i], sha256))
		i++;
	return i;
}

static int list_needs(struct intake *intake, const struct pen_scene *scene, struct pen_error *err)
{
	intake->needs = calloc(scene->asset_count + 1ul, sizeof *intake->needs);
	intake->assets = calloc(scene->asset_count + 1ul, sizeof *intake->assets);
	intake->blobs = calloc(scene->asset_count + 1ul, sizeof *intake->blobs);
	if (!intake->needs || !intake->assets || !intake->blobs)
		return pen_error_memory(err);
	for (uint32_t i = 0; i < scene->asset_count; i++)
		if (place_of(intake, &scene->assets[i].sha256) == intake->count)
			intake->needs[intake->count++] = scene->assets[i].sha256;
	return 0;
}

static void tell_needs(const struct intake *intake)
{
	for (uint32_t i = 0; i < intake->count; i += PEN_CONTROL_NEEDS_MAX) {
		struct pen_control control = {.type = PEN_CONTROL_NEEDS, .serial = intake->count};

		control.id = intake->count - i < PEN_CONTROL_NEEDS_MAX ? intake->count - i
								       : PEN_CONTROL_NEEDS_MAX;
		memcpy(control.reason, intake->needs + i, control.id * sizeof *intake->needs);
		if (pen_channel_send(intake->channel, &control, sizeof control, NULL, 0) < 0)
			_exit(EXIT_FAILURE);
	}
}

/* The pool sends nothing else before the scene is built. */
static int take_asset(struct intake *intake, uint32_t index, struct pen_error *err)
{
	struct pollfd poll_fd = {.fd = intake->channel, .events = POLLIN};
	struct pen_control control;
	struct pen_blob *asset = &intake->assets[index];
	off_t size;
	int fd, r = 0;

	while (poll(&poll_fd, 1, -1) < 0)
		;
	if (pen_channel_receive(intake->channel, &control, sizeof control, &fd, 1, NULL) < 0)
		_exit(EXIT_SUCCESS);
	if (control.type != PEN_CONTROL_ASSET || control.id != index || fd < 0)
		_exit(EXIT_FAILURE);
	size = lseek(fd, 0, SEEK_END);
	/* Of an empty file there is nothing to map. */
	if (size != 0)
		r = pen_memory_map(fd, &asset->bytes, &asset->size, err);
	(void)close(fd);
	return r;
}

int pen_intake_run(int channel, const struct pen_scene *scene,
	int (*use)(void *user, const struct pen_blob *blobs, struct pen_error *err), void *user,
	struct pen_error *err)
{
	struct intake intake = {.channel = channel};
	int r = list_needs(&intake, scene, err);

	if (r == 0)
		tell_needs(&intake);
	for (uint32_t i = 0; i < intake.count && r == 0; i++)
		r = take_asset(&intake, i, err);
	for (uint32_t i = 0; i < scene->asset_count && r == 0; i++)
		intake.blobs[i] = intake.assets[place_of(&intake, &scene->assets[i].sha256)];
	if (r == 0)
		r = use(user, intake.blobs, err);
	for (uint32_t i = 0; i < intake.count && intake.assets; i++)
		if (intake.assets[i].bytes)
			(void)munmap(
				(void *)(uintptr_t)intake.assets[i].bytes, intake.assets[i].size);
	free(intake.blobs);
	free(intake.assets);
	free(intake.needs);
	return r;
}
