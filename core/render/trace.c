/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/trace.h"

#include "core/render/admit.h"
#include "core/render/handful.h"
#include "core/render/isa.h"
#include "core/render/sphere.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

_Static_assert(sizeof(struct pen_rays) == sizeof(struct RTCRay16), "rays are Embree's");
_Static_assert(sizeof(struct pen_packet) == sizeof(struct RTCRayHit16), "packets are Embree's");
_Static_assert(offsetof(struct pen_rays, time) == offsetof(struct RTCRay16, time) &&
		       offsetof(struct pen_rays, tfar) == offsetof(struct RTCRay16, tfar) &&
		       offsetof(struct pen_hits, geometry) == offsetof(struct RTCHit16, geomID) &&
		       offsetof(struct pen_hits, instance) == offsetof(struct RTCHit16, instID),
	"lanes are Embree's");
_Static_assert(PEN_NO_INDEX == RTC_INVALID_GEOMETRY_ID, "no hit is Embree's");

/* What Embree's callbacks get: a model of spheres, and who tests it. */
struct sphere_set {
	struct pen_spheres spheres;
	const struct pen_kernel *kernel;
	bool lets_pass; /* some shape of the model does */
};

/* What Embree hands to the callbacks of one call. */
struct question {
	struct RTCIntersectContext context; /* first: Embree knows no more */
	const struct pen_kernel *kernel;
	const struct pen_sieve *sieve;
	const struct pen_geometry *geometry;
};

struct pen_trace {
	struct pen_trace *base; /* whose trees this one stands on, or NULL */
	RTCDevice device;
	RTCScene scene;
	struct sphere_set *sets; /* by model */
	RTCScene *models;	 /* of those that are placed, by model; NULL for the others */
	RTCGeometry *shapes;	 /* instances, by shape; NULL for the others; owned by scene */
	const struct pen_geometry *geometry;
	bool *sieves;			   /* by model: whether a shape of it lets rays pass */
	uint32_t model_count, shape_count; /* those of base included */
	bool is_tree_empty;		   /* all is in the handful, or in base */
	struct pen_admit_box box;	   /* that all of scene is in */
	bool occludes_coherently;	   /* rtcOccluded16 ends with the coherent flag */
	struct pen_handful handful;	   /* what is not in scene */
	const struct pen_kernel *kernel;
};

/* A device made before its scene is known: one a process. */
static struct {
	RTCDevice device;
	enum pen_isa isa;
} spare;

const char *pen_trace_version(void)
{
	return RTC_VERSION_STRING;
}

static int device_create(enum pen_isa isa, RTCDevice *ret_device, struct pen_error *err)
{
	RTCDevice device = rtcNewDevice(pen_isa_embree_config(isa));

	if (!device)
		return pen_error_set(err, PEN_EUNSUPPORTED,
			"Embree has no device for %s on this machine (error %d)", pen_isa_name(isa),
			(int)rtcGetDeviceError(NULL));
	*ret_device = device;
	return 0;
}

int pen_trace_warm_up(enum pen_isa isa, struct pen_error *err)
{
	if (spare.device)
		return 0;
	spare.isa = isa;
	return device_create(isa, &spare.device, err);
}

static int device_take(enum pen_isa isa, RTCDevice *ret_device, struct pen_error *err)
{
	if (!spare.device || spare.isa != isa)
		return device_create(isa, ret_device, err);
	*ret_device = spare.device;
	spare.device = NULL;
	return 0;
}

static void set_triangles(
	RTCGeometry to, const struct pen_geometry *geometry, const struct pen_model *model)
{
	const size_t vertex_bytes = 3 * sizeof(float);

	/* The pool's indices count from its first vertex, so the buffer of step 0 begins there. */
	for (uint32_t step = 0; step < model->step_count; step++)
		rtcSetSharedGeometryBuffer(to, RTC_BUFFER_TYPE_VERTEX, step, RTC_FORMAT_FLOAT3,
			geometry->vertices, (size_t)step * model->vertex_count * vertex_bytes,
			vertex_bytes, (size_t)model->vertex_first + model->vertex_count);
	rtcSetSharedGeometryBuffer(to, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
		geometry->indices, 3 * sizeof(uint32_t) * (size_t)model->first,
		3 * sizeof(uint32_t), model->count);
}

/* The box of a sphere over the whole shutter, and a little more than rounding can take away. */
static void bound_sphere(const struct RTCBoundsFunctionArguments *args)
{
	const struct sphere_set *set = args->geometryUserPtr;
	struct RTCBounds *box = args->bounds_o;

	*box = (struct RTCBounds){.lower_x = INFINITY,
		.lower_y = INFINITY,
		.lower_z = INFINITY,
		.upper_x = -INFINITY,
		.upper_y = -INFINITY,
		.upper_z = -INFINITY};
	for (uint32_t step = 0; step < set->spheres.step_count; step++) {
		const struct pen_sphere *s =
			set->spheres.first + (size_t)step * set->spheres.stride + args->primID;
		const float r = s->radius * (1.0f + 0x1p-20f);
		const float slack = 0x1p-22f * (fabsf(s->x) + fabsf(s->y) + fabsf(s->z)) + r;

		box->lower_x = fminf(box->lower_x, s->x - slack);
		box->lower_y = fminf(box->lower_y, s->y - slack);
		box->lower_z = fminf(box->lower_z, s->z - slack);
		box->upper_x = fmaxf(box->upper_x, s->x + slack);
		box->upper_y = fmaxf(box->upper_y, s->y + slack);
		box->upper_z = fmaxf(box->upper_z, s->z + slack);
	}
}

/* Rows of n values that Embree's ray and hit packets consist of. */
enum { ROW_TNEAR = 3, ROW_TIME = 7, ROW_TFAR = 8, ROW_ID = 10, RAY_ROWS = 12 };
enum { HIT_U = 3, HIT_V = 4, HIT_PRIMITIVE = 5, HIT_GEOMETRY = 6, HIT_INSTANCE = 7 };
enum { ROW_PRIMITIVE = 17, ROW_GEOMETRY = 18, ROW_INSTANCE = 19 };

/* Whether the ray of a question stops at a shape. */
static bool stops(const struct question *question, struct pen_meeting *meeting, uint32_t geometry,
	uint32_t instance)
{
	meeting->shape = instance != RTC_INVALID_GEOMETRY_ID ? instance : geometry;
	return !question->geometry->shapes[meeting->shape].lets_pass ||
	       question->kernel->sieve_stops(question->sieve, meeting);
}

/* Embree's filter of triangles: a hit that is no longer valid is passed over. */
static void filter_hits(const struct RTCFilterFunctionNArguments *args)
{
	const struct question *question = (const struct question *)(const void *)args->context;
	const unsigned int n = args->N;
	const float *ray = (const float *)(const void *)args->ray;
	const float *hit = (const float *)(const void *)args->hit;
	const uint32_t *ray_ids = (const uint32_t *)(const void *)args->ray;
	const uint32_t *hit_ids = (const uint32_t *)(const void *)args->hit;

	for (unsigned int i = 0; i < n; i++) {
		const struct pen_vec3 d = {ray[4 * n + i], ray[5 * n + i], ray[6 * n + i]};
		struct pen_meeting meeting = {
			.lane = (int)ray_ids[ROW_ID * n + i],
			.primitive = hit_ids[HIT_PRIMITIVE * n + i],
			.u = hit[HIT_U * n + i],
			.v = hit[HIT_V * n + i],
			.normal = {hit[i], hit[n + i], hit[2 * n + i]},
		};

		meeting.behind = pen_dot(d, meeting.normal) > 0.0f;
		if (args->valid[i] && !stops(question, &meeting, hit_ids[HIT_GEOMETRY * n + i],
					      hit_ids[HIT_INSTANCE * n + i]))
			args->valid[i] = 0;
	}
}

/* A lane of rows of n values, which meets a sphere at a distance. */
static bool stops_at_sphere(const struct question *question, const struct sphere_set *set,
	const float *rows, unsigned int n, unsigned int lane, uint32_t primitive, uint32_t geometry,
	float distance)
{
	const struct pen_sphere sphere =
		pen_sphere_at(&set->spheres, (int32_t)primitive, rows[ROW_TIME * n + lane]);
	const float *origin = rows + lane, *direction = rows + 4ul * n + lane;
	const struct pen_vec3 d = {direction[0], direction[n], direction[2ul * n]};
	const struct pen_vec3 from = {
		origin[0] - sphere.x, origin[n] - sphere.y, origin[2ul * n] - sphere.z};
	uint32_t id;
	struct pen_meeting meeting = {
		.primitive = primitive,
		.normal = pen_madd(from, distance, d),
	};

	memcpy(&id, &rows[ROW_ID * n + lane], sizeof id);
	meeting.lane = (int)id;
	meeting.behind = pen_dot(d, meeting.normal) > 0.0f;
	return stops(question, &meeting, geometry, question->context.instID[0]);
}

/* Where lanes that do not stop at a sphere's first wall meet its second, if they stop there. */
static void pass_spheres(const struct question *question, const struct sphere_set *set,
	const float *rows, unsigned int n, uint32_t primitive, uint32_t geometry, float *distances)
{
	_Alignas(64) float copy[RAY_ROWS * PEN_LANES];
	_Alignas(64) float second[PEN_LANES];
	bool passed[PEN_LANES], any = false;

	memcpy(copy, rows, sizeof(float) * RAY_ROWS * n);
	for (unsigned int i = 0; i < n; i++) {
		passed[i] = distances[i] < rows[ROW_TFAR * n + i] &&
			    !stops_at_sphere(
				    question, set, rows, n, i, primitive, geometry, distances[i]);
		if (passed[i])
			copy[ROW_TNEAR * n + i] = distances[i] * (1.0f + 0x1p-18f);
		any |= passed[i];
	}
	if (!any)
		return;
	set->kernel->sphere_distances(&set->spheres, primitive, copy, n, second);
	for (unsigned int i = 0; i < n; i++) {
		const bool stopped =
			second[i] < rows[ROW_TFAR * n + i] &&
			stops_at_sphere(question, set, rows, n, i, primitive, geometry, second[i]);

		if (passed[i])
			distances[i] = stopped ? second[i] : INFINITY;
	}
}

static void intersect_sphere(const struct RTCIntersectFunctionNArguments *args)
{
	const struct sphere_set *set = args->geometryUserPtr;
	const unsigned int n = args->N;
	float *rows = (float *)(void *)args->rayhit;
	uint32_t *ids = (uint32_t *)(void *)args->rayhit;
	_Alignas(64) float distances[PEN_LANES];

	set->kernel->sphere_distances(&set->spheres, args->primID, rows, n, distances);
	if (set->lets_pass)
		pass_spheres((const struct question *)(const void *)args->context, set, rows, n,
			args->primID, args->geomID, distances);
	for (unsigned int i = 0; i < n; i++) {
		if (!args->valid[i] || !(distances[i] < rows[ROW_TFAR * n + i]))
			continue;
		rows[ROW_TFAR * n + i] = distances[i];
		ids[ROW_PRIMITIVE * n + i] = args->primID;
		ids[ROW_GEOMETRY * n + i] = args->geomID;
		ids[ROW_INSTANCE * n + i] = args->context->instID[0];
	}
}

static void occlude_by_sphere(const struct RTCOccludedFunctionNArguments *args)
{
	const struct sphere_set *set = args->geometryUserPtr;
	const unsigned int n = args->N;
	float *rows = (float *)(void *)args->ray;
	_Alignas(64) float distances[PEN_LANES];

	set->kernel->sphere_distances(&set->spheres, args->primID, rows, n, distances);
	if (set->lets_pass)
		pass_spheres((const struct question *)(const void *)args->context, set, rows, n,
			args->primID, args->geomID, distances);
	for (unsigned int i = 0; i < n; i++)
		if (args->valid[i] && distances[i] < rows[ROW_TFAR * n + i])
			rows[ROW_TFAR * n + i] = -INFINITY;
}

static void set_spheres(RTCGeometry to, struct sphere_set *set, uint32_t count)
{
	rtcSetGeometryUserPrimitiveCount(to, count);
	rtcSetGeometryUserData(to, set);
	rtcSetGeometryBoundsFunction(to, bound_sphere, NULL);
	rtcSetGeometryIntersectFunction(to, intersect_sphere);
	rtcSetGeometryOccludedFunction(to, occlude_by_sphere);
}

static void set_disk(
	RTCGeometry to, const struct pen_geometry *geometry, const struct pen_model *model)
{
	const struct pen_disk *disk = &geometry->disks[model->first];

	rtcSetSharedGeometryBuffer(to, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, disk,
		offsetof(struct pen_disk, bounds), sizeof *disk, model->count);
	rtcSetSharedGeometryBuffer(to, RTC_BUFFER_TYPE_NORMAL, 0, RTC_FORMAT_FLOAT3, disk,
		offsetof(struct pen_disk, normal), sizeof *disk, model->count);
}

/* Puts a model into an Embree scene under an id. */
static void attach_model(const struct pen_trace *trace, RTCScene scene, uint32_t id,
	const struct pen_geometry *geometry, uint32_t index)
{
	static const enum RTCGeometryType types[] = {
		[PEN_MODEL_TRIANGLES] = RTC_GEOMETRY_TYPE_TRIANGLE,
		[PEN_MODEL_SPHERES] = RTC_GEOMETRY_TYPE_USER,
		[PEN_MODEL_DISK] = RTC_GEOMETRY_TYPE_ORIENTED_DISC_POINT,
	};
	const struct pen_model *model = &geometry->models[index];
	RTCGeometry to = rtcNewGeometry(trace->device, types[model->type]);

	rtcSetGeometryBuildQuality(to, RTC_BUILD_QUALITY_MEDIUM);
	if (model->type == PEN_MODEL_TRIANGLES)
		rtcSetGeometryTimeStepCount(to, model->step_count);
	switch (model->type) {
	case PEN_MODEL_TRIANGLES: set_triangles(to, geometry, model); break;
	case PEN_MODEL_SPHERES: set_spheres(to, &trace->sets[index], model->count); break;
	case PEN_MODEL_DISK: set_disk(to, geometry, model); break;
	}
	if (trace->sieves[index] && model->type == PEN_MODEL_TRIANGLES) {
		rtcSetGeometryIntersectFilterFunction(to, filter_hits);
		rtcSetGeometryOccludedFilterFunction(to, filter_hits);
	}
	rtcCommitGeometry(to);
	rtcAttachGeometryByID(scene, to, id);
	rtcReleaseGeometry(to);
}

static RTCScene scene_create(RTCDevice device)
{
	RTCScene scene = rtcNewScene(device);

	rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
	rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
	return scene;
}

static RTCScene model_scene(
	struct pen_trace *trace, const struct pen_geometry *geometry, uint32_t model)
{
	const bool lets_pass = trace->sieves[model];

	if (trace->base && model < trace->base->model_count) {
		trace = trace->base;
		trace->sieves[model] |= lets_pass;
		trace->sets[model].lets_pass |= lets_pass;
	}
	if (!trace->models[model]) {
		trace->models[model] = scene_create(trace->device);
		attach_model(trace, trace->models[model], 0, geometry, model);
		rtcCommitScene(trace->models[model]);
	}
	return trace->models[model];
}

static struct RTCQuaternionDecomposition quaternion_of(const struct pen_placement *p)
{
	struct RTCQuaternionDecomposition q;

	rtcInitQuaternionDecomposition(&q);
	rtcQuaternionDecompositionSetScale(
		&q, (float)p->scale[0], (float)p->scale[1], (float)p->scale[2]);
	rtcQuaternionDecompositionSetSkew(
		&q, (float)p->skew_xy, (float)p->skew_xz, (float)p->skew_yz);
	rtcQuaternionDecompositionSetQuaternion(&q, (float)p->rotate[3], (float)p->rotate[0],
		(float)p->rotate[1], (float)p->rotate[2]);
	rtcQuaternionDecompositionSetTranslation(
		&q, (float)p->translate[0], (float)p->translate[1], (float)p->translate[2]);
	return q;
}

static void attach_instance(
	struct pen_trace *trace, const struct pen_geometry *geometry, uint32_t id)
{
	const struct pen_shape *shape = &geometry->shapes[id];
	const struct pen_placement *placements = geometry->placements + shape->placement_first;
	RTCGeometry to = rtcNewGeometry(trace->device, RTC_GEOMETRY_TYPE_INSTANCE);
	/* An instance of something that deforms must move too, if only on the spot. */
	const struct pen_model *model = &geometry->models[shape->model];
	const bool deforms = model->type == PEN_MODEL_TRIANGLES && model->step_count > 1;
	const uint32_t steps = deforms && shape->placement_count == 1 ? 2 : shape->placement_count;

	rtcSetGeometryInstancedScene(to, model_scene(trace, geometry, shape->model));
	rtcSetGeometryTimeStepCount(to, steps);
	if (steps == 1)
		rtcSetGeometryTransform(to, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, shape->world);
	for (uint32_t i = 0; i < steps && steps > 1; i++) {
		const struct RTCQuaternionDecomposition q =
			quaternion_of(&placements[i % shape->placement_count]);

		rtcSetGeometryTransformQuaternion(to, i, &q);
	}
	rtcCommitGeometry(to);
	rtcAttachGeometryByID(trace->scene, to, id);
	trace->shapes[id] = to;
	rtcReleaseGeometry(to);
}

static void prepare_spheres(struct pen_trace *trace, const struct pen_geometry *geometry,
	const struct pen_kernel *kernel)
{
	for (uint32_t i = 0; i < geometry->model_count; i++) {
		const struct pen_model *model = &geometry->models[i];

		if (model->type == PEN_MODEL_SPHERES)
			trace->sets[i] = (struct sphere_set){
				.spheres = {geometry->spheres + model->first, model->count,
					model->step_count},
				.kernel = kernel,
				.lets_pass = trace->sieves[i],
			};
	}
}

static void bound_scene(struct pen_trace *trace)
{
	struct RTCBounds b;

	rtcGetSceneBounds(trace->scene, &b);
	pen_admit_box_init(&trace->box, (const float[3]){b.lower_x, b.lower_y, b.lower_z},
		(const float[3]){b.upper_x, b.upper_y, b.upper_z});
}

static void attach_shapes(
	struct pen_trace *trace, const struct pen_geometry *geometry, uint32_t first)
{
	trace->scene = scene_create(trace->device);
	trace->is_tree_empty = true;
	for (uint32_t id = first; id < geometry->shape_count; id++) {
		const struct pen_shape *shape = &geometry->shapes[id];

		if (pen_handful_take(&trace->handful, geometry, id))
			continue;
		trace->is_tree_empty = false;
		if (shape->placement_count > 0)
			attach_instance(trace, geometry, id);
		else
			attach_model(trace, trace->scene, id, geometry, shape->model);
	}
	/* Embree's threads would look out for more to do, and keep the forks to come waiting. */
	if (trace->is_tree_empty)
		return;
	rtcCommitScene(trace->scene);
	bound_scene(trace);
}

static int trace_new(const struct pen_geometry *geometry, const struct pen_kernel *kernel,
	struct pen_trace **ret_trace, struct pen_error *err)
{
	struct pen_trace *trace = calloc(1, sizeof *trace);

	if (!trace)
		return pen_error_memory(err);
	trace->kernel = kernel;
	trace->geometry = geometry;
	trace->model_count = geometry->model_count;
	trace->shape_count = geometry->shape_count;
	trace->models = calloc(geometry->model_count + 1ul, sizeof(RTCScene));
	trace->shapes = calloc(geometry->shape_count + 1ul, sizeof(RTCGeometry));
	trace->sets = calloc(geometry->model_count + 1ul, sizeof *trace->sets);
	trace->sieves = calloc(geometry->model_count + 1ul, sizeof *trace->sieves);
	if (!trace->models || !trace->shapes || !trace->sets || !trace->sieves) {
		pen_trace_destroy(trace);
		return pen_error_memory(err);
	}
	for (uint32_t i = 0; i < geometry->shape_count; i++)
		trace->sieves[geometry->shapes[i].model] |= geometry->shapes[i].lets_pass;
	*ret_trace = trace;
	return 0;
}

static int build(struct pen_trace *trace, const struct pen_geometry *geometry, uint32_t first,
	struct pen_error *err)
{
	enum RTCError failure;

	prepare_spheres(trace, geometry, trace->kernel);
	attach_shapes(trace, geometry, first);
	failure = rtcGetDeviceError(trace->device);
	if (failure == RTC_ERROR_NONE)
		return 0;
	return pen_error_set(err, failure == RTC_ERROR_OUT_OF_MEMORY ? PEN_ENOMEM : PEN_EINVALID,
		"Embree refuses the scene (error %d)", (int)failure);
}

int pen_trace_create(const struct pen_geometry *geometry, enum pen_isa isa,
	const struct pen_kernel *kernel, struct pen_trace **ret_trace, struct pen_error *err)
{
	struct pen_trace *trace;
	int r = trace_new(geometry, kernel, &trace, err);

	if (r < 0)
		return r;
	/*
	 * With native packets of sixteen, Embree 3.13.5's coherent occlusion never returns from
	 * some packets with idle lanes among moving instances.
	 */
	trace->occludes_coherently = isa != PEN_ISA_V4;
	r = device_take(isa, &trace->device, err);
	if (r == 0)
		r = build(trace, geometry, 0, err);
	if (r < 0)
		pen_trace_destroy(trace);
	else
		*ret_trace = trace;
	return r;
}

int pen_trace_create_on(struct pen_trace *base, const struct pen_geometry *geometry, uint32_t first,
	struct pen_trace **ret_trace, struct pen_error *err)
{
	struct pen_trace *trace;
	int r = trace_new(geometry, base->kernel, &trace, err);

	if (r < 0)
		return r;
	trace->base = base;
	trace->occludes_coherently = base->occludes_coherently;
	trace->device = base->device;
	rtcRetainDevice(trace->device);
	trace->handful = base->handful;
	r = build(trace, geometry, first, err);
	if (r < 0)
		pen_trace_destroy(trace);
	else
		*ret_trace = trace;
	return r;
}

void pen_trace_destroy(struct pen_trace *trace)
{
	if (!trace)
		return;
	if (trace->scene)
		rtcReleaseScene(trace->scene);
	for (uint32_t i = 0; i < trace->model_count && trace->models; i++)
		if (trace->models[i])
			rtcReleaseScene(trace->models[i]);
	if (trace->device)
		rtcReleaseDevice(trace->device);
	free(trace->sieves);
	free(trace->sets);
	free(trace->models);
	free(trace->shapes);
	free(trace);
}

static void extend_box(const struct pen_trace *trace, float box[2][3])
{
	struct RTCBounds b;

	if (trace->is_tree_empty)
		return;
	rtcGetSceneBounds(trace->scene, &b);

	const float lower[3] = {b.lower_x, b.lower_y, b.lower_z};
	const float upper[3] = {b.upper_x, b.upper_y, b.upper_z};

	for (int k = 0; k < 3; k++) {
		box[0][k] = fminf(box[0][k], lower[k]);
		box[1][k] = fmaxf(box[1][k], upper[k]);
	}
}

double pen_trace_radius(const struct pen_trace *trace)
{
	float box[2][3] = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
	double sum = 0.0;

	extend_box(trace, box);
	if (trace->base)
		extend_box(trace->base, box);
	pen_handful_extend_box(&trace->handful, box);
	for (int k = 0; k < 3 && box[0][k] <= box[1][k]; k++) {
		const double size = (double)box[1][k] - (double)box[0][k];

		sum += size * size;
	}
	return 0.5 * sqrt(sum);
}

static struct question question_of(
	const struct pen_trace *trace, const struct pen_sieve *sieve, bool coherent)
{
	struct question question = {
		.kernel = trace->kernel,
		.sieve = sieve,
		.geometry = trace->geometry,
	};

	rtcInitIntersectContext(&question.context);
	question.context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
					  : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
	return question;
}

/* Whether some ray may meet what is in a trace's own tree: most packets of many scenes don't. */
static bool may_meet(const struct pen_trace *trace, const struct pen_rays *rays)
{
	return trace && !trace->is_tree_empty && trace->kernel->admit_box_met(&trace->box, rays);
}

uint32_t pen_trace_closest(const struct pen_trace *trace, bool coherent,
	const struct pen_sieve *sieve, struct pen_packet *packet)
{
	struct question question = question_of(trace, sieve, coherent);
	struct RTCRayHit16 *rayhit = (struct RTCRayHit16 *)(void *)packet;
	_Alignas(64) int32_t valid[PEN_LANES];
	const uint32_t dropped = trace->kernel->admit_rays(&packet->rays, valid);

	memset(packet->hits.geometry, 0xff, sizeof packet->hits.geometry);
	memset(packet->hits.instance, 0xff, sizeof packet->hits.instance);
	trace->kernel->handful_closest(&trace->handful, packet);
	if (may_meet(trace->base, &packet->rays))
		rtcIntersect16(valid, trace->base->scene, &question.context, rayhit);
	if (may_meet(trace, &packet->rays))
		rtcIntersect16(valid, trace->scene, &question.context, rayhit);
	return dropped;
}

uint32_t pen_trace_occluded(const struct pen_trace *trace, bool coherent,
	const struct pen_sieve *sieve, struct pen_rays *rays)
{
	struct question question =
		question_of(trace, sieve, coherent && trace->occludes_coherently);
	struct RTCRay16 *ray = (struct RTCRay16 *)(void *)rays;
	_Alignas(64) int32_t valid[PEN_LANES];
	const uint32_t dropped = trace->kernel->admit_rays(rays, valid);

	if (trace->kernel->handful_occluded(&trace->handful, rays)) {
		if (may_meet(trace->base, rays))
			rtcOccluded16(valid, trace->base->scene, &question.context, ray);
		if (may_meet(trace, rays))
			rtcOccluded16(valid, trace->scene, &question.context, ray);
	}
	for (int i = 0; i < PEN_LANES; i++)
		rays->tfar[i] = valid[i] ? rays->tfar[i] : -1.0f;
	return dropped;
}

void pen_trace_placement(
	const struct pen_trace *trace, uint32_t shape, float time, float ret_world[3][4])
{
	if (trace->base && shape < trace->base->shape_count)
		trace = trace->base;
	rtcGetGeometryTransform(
		trace->shapes[shape], time, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, ret_world);
}
