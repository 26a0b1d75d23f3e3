/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/scene.h"

#include "core/render/camera_place.h"
#include "core/render/isa.h"
#include "core/render/lights.h"
#include "core/render/surfaces.h"

#include <stdlib.h>

static struct pen_target target_of(const struct pen_geometry *geometry, uint32_t index)
{
	const struct pen_shape *shape = &geometry->shapes[index];
	const struct pen_model *model = &geometry->models[shape->model];
	const bool rests = shape->placement_count == 0 && model->step_count == 1;
	struct pen_target target = {
		.route = PEN_ROUTE_SLOW,
		.surface = shape->surface,
		.first = model->first,
		.normal_offset = PEN_NO_INDEX,
	};

	if (rests && model->type == PEN_MODEL_TRIANGLES) {
		target.route = PEN_ROUTE_TRIANGLE;
		target.normal_offset = model->normal_offset;
	} else if (rests && model->type == PEN_MODEL_SPHERES) {
		target.route = PEN_ROUTE_SPHERE;
	} else if (shape->placement_count == 0 && model->type == PEN_MODEL_SPHERES) {
		target.route = PEN_ROUTE_TRAVELLER;
	}
	return target;
}

static int create_targets(struct pen_render_scene *scene, struct pen_error *err)
{
	const struct pen_geometry *geometry = &scene->geometry;

	scene->targets = calloc(geometry->shape_count + 1ul, sizeof *scene->targets);
	if (!scene->targets)
		return pen_error_memory(err);
	for (uint32_t i = 0; i < geometry->shape_count; i++)
		scene->targets[i] = target_of(geometry, i);
	scene->targets[geometry->shape_count] = (struct pen_target){
		.route = PEN_ROUTE_NONE,
		.surface = scene->desc->material_count + scene->desc->light_count,
		.normal_offset = PEN_NO_INDEX,
	};
	return 0;
}

static int create_camera(struct pen_render_scene *scene, struct pen_error *err)
{
	const struct pen_scene *desc = scene->desc;
	const struct pen_shutter shutter = pen_shutter_of(desc, scene->frame);
	struct pen_camera_desc camera;
	struct pen_camera_key *keys;
	int r = pen_camera_place(desc, &shutter, &camera, &keys, err);

	if (r < 0)
		return r;
	if (desc->integrator.type == PEN_INTEGRATOR_WHITTED)
		camera.aperture_radius = 0.0;
	pen_filter_init(&scene->filter, &desc->image);
	r = pen_camera_init(&scene->camera, &camera, desc->image.width, desc->image.height, err);
	free(keys);
	return r;
}

int pen_render_kernel(enum pen_isa isa, const struct pen_kernel **ret_kernel, struct pen_error *err)
{
	static const struct pen_kernel *const kernels[PEN_ISA_COUNT] = {
		[PEN_ISA_V2] = &pen_kernel_v2,
		[PEN_ISA_V3] = &pen_kernel_v3,
		[PEN_ISA_V4] = &pen_kernel_v4,
	};

	if (!pen_isa_supported(isa))
		return pen_error_set(
			err, PEN_EUNSUPPORTED, "this processor does not run %s", pen_isa_name(isa));
	*ret_kernel = kernels[isa];
	return 0;
}

/* Everything that is made from the geometry and what traces it. */
static int create_tables(struct pen_render_scene *scene, struct pen_error *err)
{
	int r = pen_surfaces_create(scene, err);

	scene->has_cones = scene->has_textures || scene->environment;
	if (r == 0)
		r = create_targets(scene, err);
	if (r == 0 && !scene->lights)
		r = pen_lights_create(scene, &scene->lights, err);
	if (r == 0)
		r = create_camera(scene, err);
	return r;
}

static int scene_new(const struct pen_scene *desc, const struct pen_pictures *pictures,
	uint32_t frame, enum pen_isa isa, struct pen_render_scene **ret_scene,
	struct pen_error *err)
{
	const struct pen_kernel *kernel = NULL;
	struct pen_render_scene *scene;
	int r = pen_render_kernel(isa, &kernel, err);

	if (r < 0)
		return r;
	if (!pictures && desc->picture_count > 0)
		return pen_error_set(err, PEN_EINVALID, "the scene's pictures are not there");
	scene = calloc(1, sizeof *scene);
	if (!scene)
		return pen_error_memory(err);
	scene->desc = desc;
	scene->pictures = pictures;
	scene->frame = frame;
	scene->kernel = kernel;
	scene->background = pen_vec3_load(desc->background.color);
	scene->environment = pen_pictures_environment(pictures);
	*ret_scene = scene;
	return 0;
}

/* Ends the making of a scene. */
static int conclude(struct pen_render_scene *scene, int r, struct pen_render_scene **ret_scene)
{
	if (r < 0)
		pen_render_scene_destroy(scene);
	else
		*ret_scene = scene;
	return r;
}

int pen_render_scene_create(const struct pen_scene *desc, const struct pen_pictures *pictures,
	uint32_t frame, enum pen_isa isa, struct pen_render_scene **ret_scene,
	struct pen_error *err)
{
	struct pen_render_scene *scene;
	unsigned int state;
	int r = scene_new(desc, pictures, frame, isa, &scene, err);

	if (r < 0)
		return r;
	state = pen_isa_denormals_flush();
	r = pen_geometry_init(&scene->geometry, desc, frame, err);
	if (r == 0)
		r = pen_trace_create(&scene->geometry, isa, scene->kernel, &scene->trace, err);
	if (r == 0)
		r = create_tables(scene, err);
	pen_isa_denormals_restore(state);
	return conclude(scene, r, ret_scene);
}

int pen_render_scene_create_on(const struct pen_scene *desc, const struct pen_pictures *pictures,
	uint32_t frame, enum pen_isa isa, const struct pen_geometry *geometry,
	struct pen_trace *base, uint32_t shape_first, struct pen_lights **lights,
	struct pen_render_scene **ret_scene, struct pen_error *err)
{
	struct pen_render_scene *scene;
	unsigned int state;
	int r = scene_new(desc, pictures, frame, isa, &scene, err);

	if (r < 0)
		return r;
	scene->is_of_shot = true;
	scene->geometry = *geometry;
	scene->lights = *lights;
	scene->has_shared_lights = *lights != NULL;
	state = pen_isa_denormals_flush();
	r = pen_trace_create_on(base, &scene->geometry, shape_first, &scene->trace, err);
	if (r == 0)
		r = create_tables(scene, err);
	if (r == 0 && !*lights && pen_lights_rest(scene->lights, desc, shape_first)) {
		*lights = scene->lights;
		scene->has_shared_lights = true;
	}
	pen_isa_denormals_restore(state);
	return conclude(scene, r, ret_scene);
}

int pen_render_scene_look(struct pen_render_scene *scene, struct pen_error *err)
{
	const unsigned int state = pen_isa_denormals_flush();
	int r;

	pen_camera_finish(&scene->camera);
	pen_surfaces_set_share(scene);
	r = create_camera(scene, err);
	pen_isa_denormals_restore(state);
	return r;
}

void pen_render_scene_destroy(struct pen_render_scene *scene)
{
	if (!scene)
		return;
	pen_camera_finish(&scene->camera);
	if (!scene->has_shared_lights)
		pen_lights_destroy(scene->lights);
	free(scene->targets);
	pen_surfaces_destroy(scene);
	pen_trace_destroy(scene->trace);
	if (!scene->is_of_shot)
		pen_geometry_finish(&scene->geometry);
	free(scene);
}

int pen_render_warm_up(enum pen_isa isa, struct pen_error *err)
{
	return pen_trace_warm_up(isa, err);
}
