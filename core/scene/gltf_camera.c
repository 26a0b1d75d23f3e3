/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf_camera.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static void refuse_name(
	struct pen_gltf_reading *r, const struct pen_gltf_camera_found *cameras, size_t count)
{
	char names[160] = "";

	for (size_t i = 0; i < count; i++) {
		const char *name = cameras[i].name[0] ? cameras[i].name : cameras[i].node_name;
		const size_t length = strlen(names);

		(void)snprintf(names + length, sizeof names - length, "%s\"%.40s\"",
			i > 0 ? ", " : "", name);
	}
	r->pointer = "/camera/from";
	r->place[0] = '\0';
	pen_gltf_refuse(r, "no glTF camera has this name; there %s %s", count > 0 ? "are" : "is",
		count > 0 ? names : "none");
}

static const struct pen_gltf_camera_found *find(struct pen_gltf_reading *r)
{
	const struct pen_gltf_camera_found *cameras =
		(const struct pen_gltf_camera_found *)(const void *)r->cameras.data;
	const size_t count = r->cameras.size / sizeof *cameras;
	const struct pen_camera_desc *wanted = &r->scene->camera;

	if (!wanted->from)
		return (wanted->given & ~(uint32_t)PEN_CAMERA_FOCUS) == 0 && count > 0 ? cameras
										       : NULL;
	for (size_t i = 0; i < count; i++)
		if (strcmp(cameras[i].name, wanted->from) == 0 ||
			strcmp(cameras[i].node_name, wanted->from) == 0)
			return &cameras[i];
	refuse_name(r, cameras, count);
	return NULL;
}

/* The height is the asset's, the width follows from the image. */
static void set_field(struct pen_gltf_reading *r, const struct pen_gltf_camera *from)
{
	const struct pen_image_desc *image = &r->scene->image;
	const double aspect = (double)image->width / image->height;
	struct pen_camera_desc *to = &r->scene->camera;

	if (from->is_orthographic) {
		if (from->ymag > 0.0 && from->ymag <= PEN_COORDINATE_MAX)
			to->orthographic_width = 2.0 * from->ymag * aspect;
		else
			pen_gltf_refuse(r, "its ymag must be greater than 0");
		return;
	}
	if (from->yfov > 0.0 && from->yfov < M_PI)
		to->horizontal_fov = 360.0 / M_PI * atan(tan(0.5 * from->yfov) * aspect);
	else
		pen_gltf_refuse(r, "its yfov must lie between 0 and pi");
}

void pen_gltf_camera_choose(struct pen_gltf_reading *r)
{
	const struct pen_gltf_camera_found *found = find(r);
	struct pen_camera_desc *to = &r->scene->camera;

	if (!found)
		return;
	r->pointer = "/camera";
	(void)snprintf(r->place, sizeof r->place, "glTF camera \"%.60s\"", found->name);
	if (!(to->given & PEN_CAMERA_FOV))
		set_field(r, found->camera);
	if (!(to->given & PEN_CAMERA_KEYS))
		to->node = found->node;
}
