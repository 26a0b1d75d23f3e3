/* SPDX-License-Identifier: Apache-2.0 */
#include <embree3/rtcore.h>

#include <immintrin.h>
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/*
 * Rays per second by Embree, one at a time and in packets of sixteen: camera, shadow and reflected
 * rays as Whitted's ray tracer casts them (a packet is a block of 4x4 pixels) and as distribution
 * ray tracing does (a packet is sixteen samples of one pixel, over lens, light and lobe). The scene
 * is a field of spheres of triangles. Prints "kind rays run single packet" lines, in millions of
 * rays a second of processor time.
 */
enum { LANES = 16, SIDE = 512, SEGMENTS = 48, SPHERES = 400, RUNS = 5 };
enum { PACKETS = SIDE * SIDE / LANES };
enum kind { WHITTED, DISTRIBUTION };

struct vec {
	float x, y, z;
};

static struct vec vec(float x, float y, float z)
{
	return (struct vec){x, y, z};
}

static struct vec madd(struct vec a, float s, struct vec b)
{
	return vec(a.x * s + b.x, a.y * s + b.y, a.z * s + b.z);
}

static float dot(struct vec a, struct vec b)
{
	return a.x * b.x + a.y * b.y + a.z * b.z;
}

static struct vec unit(struct vec a)
{
	return madd(a, 1.0f / sqrtf(dot(a, a)), vec(0, 0, 0));
}

/* The next number in [0,1) of a linear congruential sequence. */
static float draw(uint64_t *state)
{
	*state = *state * 6364136223846793005u + 1442695040888963407u;
	return (float)(*state >> 40) * 0x1p-24f;
}

static struct vec draw_in_ball(uint64_t *state)
{
	struct vec v;

	do
		v = vec(2.0f * draw(state) - 1.0f, 2.0f * draw(state) - 1.0f,
			2.0f * draw(state) - 1.0f);
	while (dot(v, v) > 1.0f);
	return v;
}

static void add_sphere(RTCDevice device, RTCScene scene, struct vec center, float radius)
{
	const uint32_t rings = SEGMENTS / 2;
	RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
	float *vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
		RTC_FORMAT_FLOAT3, 3 * sizeof(float), (size_t)(rings + 1) * SEGMENTS);
	uint32_t *indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
		RTC_FORMAT_UINT3, 3 * sizeof(uint32_t), (size_t)2 * rings * SEGMENTS);

	for (uint32_t r = 0; r <= rings; r++)
		for (uint32_t s = 0; s < SEGMENTS; s++) {
			const float down = 3.14159265f * (float)r / (float)rings;
			const float around = 6.2831853f * (float)s / (float)SEGMENTS;

			*vertices++ = center.x + radius * sinf(down) * cosf(around);
			*vertices++ = center.y + radius * cosf(down);
			*vertices++ = center.z + radius * sinf(down) * sinf(around);
		}
	for (uint32_t r = 0; r < rings; r++)
		for (uint32_t s = 0; s < SEGMENTS; s++) {
			const uint32_t a = r * SEGMENTS + s;
			const uint32_t b = r * SEGMENTS + (s + 1) % SEGMENTS;
			const uint32_t corners[6] = {
				a, b, a + SEGMENTS, b, b + SEGMENTS, a + SEGMENTS};

			memcpy(indices, corners, sizeof corners);
			indices += 6;
		}
	rtcCommitGeometry(geometry);
	rtcAttachGeometry(scene, geometry);
	rtcReleaseGeometry(geometry);
}

static void add_floor(RTCDevice device, RTCScene scene)
{
	static const float corners[4][3] = {
		{-200, 0, -200}, {-200, 0, 200}, {200, 0, 200}, {200, 0, -200}};
	static const uint32_t triangles[2][3] = {{0, 1, 2}, {0, 2, 3}};
	RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);

	memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
		       sizeof corners[0], 4),
		corners, sizeof corners);
	memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
		       sizeof triangles[0], 2),
		triangles, sizeof triangles);
	rtcCommitGeometry(geometry);
	rtcAttachGeometry(scene, geometry);
	rtcReleaseGeometry(geometry);
}

static RTCScene build(RTCDevice device)
{
	RTCScene scene = rtcNewScene(device);
	uint64_t state = 1;

	add_floor(device, scene);
	for (int i = 0; i < SPHERES; i++) {
		const float radius = 0.2f + 0.3f * draw(&state);

		add_sphere(device, scene,
			vec(1.4f * (float)(i % 20) - 13.3f + draw(&state), radius,
				-1.4f * (float)(i / 20) + draw(&state)),
			radius);
	}
	rtcCommitScene(scene);
	return scene;
}

/* Parked: its interval is empty, so that nothing is met. */
static void park(struct RTCRayHit *ray)
{
	*ray = (struct RTCRayHit){.ray = {.dir_z = 1, .tnear = 1, .tfar = 0, .mask = ~0u},
		.hit = {.geomID = RTC_INVALID_GEOMETRY_ID, .instID = {RTC_INVALID_GEOMETRY_ID}}};
}

static void aim(struct RTCRayHit *ray, struct vec origin, struct vec direction, float far)
{
	park(ray);
	ray->ray.org_x = origin.x, ray->ray.org_y = origin.y, ray->ray.org_z = origin.z;
	ray->ray.dir_x = direction.x, ray->ray.dir_y = direction.y, ray->ray.dir_z = direction.z;
	ray->ray.tnear = 1e-3f, ray->ray.tfar = far;
}

static void camera_rays(enum kind kind, struct RTCRayHit *rays)
{
	const struct vec eye = {0, 4, 8};
	uint64_t state = 2;

	for (uint32_t i = 0; i < SIDE * SIDE; i++) {
		const uint32_t packet = i / LANES, lane = i % LANES;
		const uint32_t side = SIDE / 4; /* packets a row */
		float x = (float)(packet % side) * 4.0f, y = (float)(packet / side) * 4.0f;
		struct vec from = eye;

		if (kind == WHITTED) {
			x += (float)(lane % 4) + 0.5f;
			y += (float)(lane / 4) + 0.5f;
		} else {
			x += draw(&state);
			y += draw(&state);
			from = madd(draw_in_ball(&state), 0.1f, eye);
		}
		const struct vec focus =
			madd(vec((x / SIDE - 0.5f) * 1.2f, (0.5f - y / SIDE) * 1.2f - 0.35f, -1.0f),
				12.0f, eye);

		aim(&rays[i], from, unit(madd(from, -1.0f, focus)), INFINITY);
	}
}

static bool is_hit(const struct RTCRayHit *ray)
{
	return ray->hit.geomID != RTC_INVALID_GEOMETRY_ID;
}

static struct vec hit_point(const struct RTCRayHit *ray)
{
	return madd(vec(ray->ray.dir_x, ray->ray.dir_y, ray->ray.dir_z), ray->ray.tfar,
		vec(ray->ray.org_x, ray->ray.org_y, ray->ray.org_z));
}

static void shadow_rays(enum kind kind, const struct RTCRayHit *hits, struct RTCRayHit *rays)
{
	uint64_t state = 3;

	for (uint32_t i = 0; i < SIDE * SIDE; i++) {
		struct vec light = {-6, 12, 4};

		park(&rays[i]);
		if (!is_hit(&hits[i]))
			continue;
		if (kind == DISTRIBUTION)
			light = madd(vec(draw(&state), 0, draw(&state)), 4.0f, light);
		aim(&rays[i], hit_point(&hits[i]), madd(hit_point(&hits[i]), -1.0f, light), 0.999f);
	}
}

static void reflected_rays(enum kind kind, const struct RTCRayHit *hits, struct RTCRayHit *rays)
{
	uint64_t state = 4;

	for (uint32_t i = 0; i < SIDE * SIDE; i++) {
		const struct RTCRayHit *from = &hits[i];

		park(&rays[i]);
		if (!is_hit(from))
			continue;
		const struct vec in = {from->ray.dir_x, from->ray.dir_y, from->ray.dir_z};
		struct vec n = unit(vec(from->hit.Ng_x, from->hit.Ng_y, from->hit.Ng_z));

		if (dot(n, in) > 0.0f)
			n = madd(n, -1.0f, vec(0, 0, 0));
		struct vec out = madd(n, -2.0f * dot(n, in), in);
		if (kind == DISTRIBUTION)
			out = unit(madd(draw_in_ball(&state), 0.5f, out));
		if (dot(n, out) > 0.0f)
			aim(&rays[i], hit_point(from), out, INFINITY);
	}
}

static double processor_seconds(void)
{
	struct timespec now;

	(void)clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
	return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static void trace_single(RTCScene scene, struct RTCRayHit *rays, bool is_shadow)
{
	struct RTCIntersectContext context;

	rtcInitIntersectContext(&context);
	for (uint32_t i = 0; i < SIDE * SIDE; i++) {
		if (rays[i].ray.tfar == 0.0f)
			continue;
		if (is_shadow)
			rtcOccluded1(scene, &context, &rays[i].ray);
		else
			rtcIntersect1(scene, &context, &rays[i]);
	}
}

static void gather(const struct RTCRayHit *from, struct RTCRayHit16 *to)
{
	for (int k = 0; k < LANES; k++) {
		to->ray.org_x[k] = from[k].ray.org_x, to->ray.dir_x[k] = from[k].ray.dir_x;
		to->ray.org_y[k] = from[k].ray.org_y, to->ray.dir_y[k] = from[k].ray.dir_y;
		to->ray.org_z[k] = from[k].ray.org_z, to->ray.dir_z[k] = from[k].ray.dir_z;
		to->ray.tnear[k] = from[k].ray.tnear, to->ray.tfar[k] = from[k].ray.tfar;
		to->ray.time[k] = 0, to->ray.mask[k] = ~0u;
		to->ray.id[k] = 0, to->ray.flags[k] = 0;
		to->hit.geomID[k] = to->hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
	}
}

static void trace_packets(
	RTCScene scene, struct RTCRayHit16 *packets, bool is_shadow, bool coherent)
{
	static const int valid[LANES] __attribute__((aligned(64))) = {
		-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1};
	struct RTCIntersectContext context;

	rtcInitIntersectContext(&context);
	if (coherent)
		context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
	for (uint32_t i = 0; i < PACKETS; i++) {
		if (is_shadow)
			rtcOccluded16(valid, scene, &context, &packets[i].ray);
		else
			rtcIntersect16(valid, scene, &context, &packets[i]);
	}
}

struct bench {
	RTCScene scene;
	struct RTCRayHit *rays, *copy, *hits;
	struct RTCRayHit16 *packets;
};

/* Leaves what the single rays met in copy. */
static void measure(struct bench *bench, const char *kind, const char *name, bool is_shadow)
{
	const bool coherent = strcmp(name, "camera") == 0;
	uint32_t count = 0;

	for (uint32_t i = 0; i < SIDE * SIDE; i++)
		count += bench->rays[i].ray.tfar != 0.0f;
	for (int run = 0; run < RUNS; run++) {
		memcpy(bench->copy, bench->rays, SIDE * SIDE * sizeof *bench->rays);
		for (uint32_t i = 0; i < PACKETS; i++)
			gather(&bench->rays[(size_t)i * LANES], &bench->packets[i]);
		const double start = processor_seconds();
		trace_single(bench->scene, bench->copy, is_shadow);
		const double middle = processor_seconds();
		trace_packets(bench->scene, bench->packets, is_shadow, coherent);
		const double end = processor_seconds();

		printf("%s %s %d %.3f %.3f\n", kind, name, run, 1e-6 * count / (middle - start),
			1e-6 * count / (end - middle));
	}
}

static void measure_kind(struct bench *bench, enum kind kind, const char *name)
{
	camera_rays(kind, bench->rays);
	measure(bench, name, "camera", false);
	memcpy(bench->hits, bench->copy, SIDE * SIDE * sizeof *bench->hits);
	shadow_rays(kind, bench->hits, bench->rays);
	measure(bench, name, "shadow", true);
	reflected_rays(kind, bench->hits, bench->rays);
	measure(bench, name, "reflected", false);
}

static void *memory(size_t size)
{
	void *found = aligned_alloc(64, size);

	if (!found)
		abort();
	return found;
}

int main(void)
{
	RTCDevice device = rtcNewDevice("threads=1");
	struct bench bench = {
		.scene = build(device),
		.rays = memory(SIDE * SIDE * sizeof *bench.rays),
		.copy = memory(SIDE * SIDE * sizeof *bench.copy),
		.hits = memory(SIDE * SIDE * sizeof *bench.hits),
		.packets = memory(PACKETS * sizeof *bench.packets),
	};

	/* As Embree advises, and as the render processes do. */
	_mm_setcsr(_mm_getcsr() | 0x8040u);
	measure_kind(&bench, WHITTED, "whitted");
	measure_kind(&bench, DISTRIBUTION, "distribution");
	free(bench.packets);
	free(bench.hits);
	free(bench.copy);
	free(bench.rays);
	rtcReleaseScene(bench.scene);
	rtcReleaseDevice(device);
	return 0;
}
