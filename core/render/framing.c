/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/framing.h"

#include "core/base/limits.h"
#include "core/render/deform.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* How much further off than where the nearest corner touches the image's border. */
#define SPARE 1.1

/* Right, up and back of the view, and the middle of what it shows. */
struct view {
	double axes[3][3];
	double middle[3];
	double tangents[2]; /* of half the image's width and height */
};

/* What is seen of an object's corners. */
typedef void visit_corner(void *context, const double corner[3]);

static double dot(const double a[3], const double b[3])
{
	return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool is_wanted(const struct pen_scene *scene)
{
	const struct pen_camera_desc *camera = &scene->camera;

	return !camera->from && camera->node == PEN_NO_INDEX &&
	       (camera->given & ~(uint32_t)PEN_CAMERA_FOCUS) == 0;
}

/* What holds a mesh that is bent, as it is at a time. */
static int find_bent_box(const struct pen_scene *scene, const struct pen_object_desc *mesh,
	double time, struct pen_box *ret, struct pen_error *err)
{
	struct pen_object_desc bent = *mesh;
	int r;

	bent.u.mesh.vertices = calloc(mesh->u.mesh.vertex_count + 1ul, 3 * sizeof(float));
	if (!bent.u.mesh.vertices)
		return pen_error_memory(err);
	r = pen_deform_at(scene, mesh, time, bent.u.mesh.vertices, NULL, err);
	if (r == 0)
		*ret = pen_motion_box(&bent);
	free(bent.u.mesh.vertices);
	return r;
}

/* The box of each sphere and mesh in its own coordinates. */
static int find_boxes(
	const struct pen_scene *scene, double time, struct pen_box *boxes, struct pen_error *err)
{
	int r = 0;

	for (uint32_t i = 0; i < scene->object_count && r == 0; i++) {
		const struct pen_object_desc *object = &scene->objects[i];

		if (object->type == PEN_OBJECT_MESH && object->u.mesh.deform)
			r = find_bent_box(scene, object, time, &boxes[i], err);
		else if (object->type == PEN_OBJECT_MESH || object->type == PEN_OBJECT_SPHERE)
			boxes[i] = pen_motion_box(object);
	}
	return r;
}

static void visit_corners(const struct pen_scene *scene, const struct pen_box *boxes, double time,
	visit_corner *visit, void *context)
{
	for (uint32_t i = 0; i < scene->object_count; i++) {
		const struct pen_object_desc *object = &scene->objects[i];
		const struct pen_affine world = pen_motion_world(scene, object, time);
		const struct pen_box *box =
			&boxes[object->type == PEN_OBJECT_INSTANCE ? object->u.instance.of : i];

		for (int k = 0; k < 8 && object->visible && box->lower[0] <= box->upper[0]; k++) {
			double corner[3], placed[3];

			for (int axis = 0; axis < 3; axis++)
				corner[axis] = k >> axis & 1 ? box->upper[axis] : box->lower[axis];
			pen_affine_point(&world, corner, placed);
			visit(context, placed);
		}
	}
}

static void grow(void *context, const double corner[3])
{
	struct pen_box *box = context;

	for (int axis = 0; axis < 3; axis++) {
		box->lower[axis] = fmin(box->lower[axis], corner[axis]);
		box->upper[axis] = fmax(box->upper[axis], corner[axis]);
	}
}

/* How far from the middle the eye must be to see a corner. */
struct reach {
	const struct view *view;
	double distance;
};

static void extend(void *context, const double corner[3])
{
	struct reach *reach = context;
	const struct view *view = reach->view;
	double from[3];

	for (int axis = 0; axis < 3; axis++)
		from[axis] = corner[axis] - view->middle[axis];
	for (int side = 0; side < 2; side++)
		reach->distance = fmax(reach->distance,
			dot(from, view->axes[2]) +
				fabs(dot(from, view->axes[side])) / view->tangents[side]);
}

/* Looking at the middle of a box. */
static struct view view_of(const struct pen_scene *scene, const struct pen_box *box)
{
	const struct pen_image_desc *image = &scene->image;
	const double half = tan(scene->camera.horizontal_fov * M_PI / 360.0);
	const double back[3] = {0.4, 0.3, 1.0};
	const double flat = hypot(back[0], back[2]), length = hypot(flat, back[1]);
	struct view view = {
		.axes = {{back[2] / flat, 0.0, -back[0] / flat},
			{-back[0] * back[1] / (flat * length), flat / length,
				-back[1] * back[2] / (flat * length)},
			{back[0] / length, back[1] / length, back[2] / length}},
		.tangents = {half, half * image->height / image->width},
	};

	for (int axis = 0; axis < 3; axis++)
		view.middle[axis] = 0.5 * (box->lower[axis] + box->upper[axis]);
	return view;
}

/* Places the camera so that it sees the visible ones of the boxes. */
static void look(const struct pen_scene *scene, const struct pen_box *boxes, double time,
	struct pen_camera_desc *camera)
{
	struct pen_box all = {.lower = {HUGE_VAL, HUGE_VAL, HUGE_VAL},
		.upper = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
	struct reach reach = {.distance = 0.0};
	struct view view;

	visit_corners(scene, boxes, time, grow, &all);
	if (!(all.lower[0] <= all.upper[0]))
		return;
	view = view_of(scene, &all);
	reach.view = &view;
	visit_corners(scene, boxes, time, extend, &reach);
	reach.distance = reach.distance > 0.0 ? SPARE * reach.distance : 1.0;
	for (int axis = 0; axis < 3; axis++) {
		camera->look_at[axis] = view.middle[axis];
		camera->position[axis] = view.middle[axis] + reach.distance * view.axes[2][axis];
	}
	if (!(camera->given & PEN_CAMERA_FOCUS))
		camera->focus_distance = fmin(reach.distance, PEN_COORDINATE_MAX);
}

int pen_framing_choose(
	const struct pen_scene *scene, struct pen_camera_desc *camera, struct pen_error *err)
{
	const double time = pen_shutter_of(scene, scene->frames.first).open;
	struct pen_box *boxes;
	int r;

	if (!is_wanted(scene))
		return 0;
	boxes = calloc(scene->object_count + 1ul, sizeof *boxes);
	if (!boxes)
		return pen_error_memory(err);
	r = find_boxes(scene, time, boxes, err);
	if (r == 0)
		look(scene, boxes, time, camera);
	free(boxes);
	return r;
}
