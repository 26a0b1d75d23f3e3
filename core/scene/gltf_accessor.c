/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/gltf_accessor.h"

#include <math.h>
#include <string.h>

/* Component types as glTF numbers them. */
enum component {
	COMPONENT_BYTE = 5120,
	COMPONENT_UNSIGNED_BYTE,
	COMPONENT_SHORT,
	COMPONENT_UNSIGNED_SHORT,
	COMPONENT_UNSIGNED_INT = 5125,
	COMPONENT_FLOAT
};

static size_t component_size(int component)
{
	switch (component) {
	case COMPONENT_BYTE:
	case COMPONENT_UNSIGNED_BYTE: return 1;
	case COMPONENT_SHORT:
	case COMPONENT_UNSIGNED_SHORT: return 2;
	case COMPONENT_UNSIGNED_INT:
	case COMPONENT_FLOAT: return 4;
	default: return 0;
	}
}

bool pen_gltf_view_find(struct pen_gltf_reading *r, int index, struct pen_gltf_bytes *ret_bytes)
{
	const struct pen_gltf_model *m = r->model;
	const struct pen_gltf_view *view;
	const struct pen_gltf_bytes *buffer;

	if (index < 0 || (size_t)index >= m->view_count) {
		pen_gltf_refuse(r, "there is no buffer view %d", index);
		return false;
	}
	view = &m->views[index];
	if (view->buffer < 0 || (size_t)view->buffer >= m->buffer_count) {
		pen_gltf_refuse(r, "buffer view %d: there is no buffer %d", index, view->buffer);
		return false;
	}
	buffer = &m->buffers[view->buffer];
	if (view->offset > buffer->size || view->size > buffer->size - view->offset) {
		pen_gltf_refuse(r,
			"buffer view %d: %zu bytes from %zu on leave its buffer of %zu bytes",
			index, view->size, view->offset, buffer->size);
		return false;
	}
	*ret_bytes = (struct pen_gltf_bytes){
		.bytes = (const char *)buffer->bytes + view->offset,
		.size = view->size,
		.offset = buffer->offset == SIZE_MAX ? SIZE_MAX : buffer->offset + view->offset,
	};
	return true;
}

/* Elements at even distances, checked to lie within their view. */
struct run {
	const unsigned char *first; /* NULL: all zero */
	size_t stride, count;
	int component;
	uint32_t width;
	bool normalized;
};

/* Finds elements of run's shape; its first and stride are set. */
static bool find_run(struct pen_gltf_reading *r, int view, size_t offset, struct run *run)
{
	const size_t size = component_size(run->component) * run->width;
	struct pen_gltf_bytes bytes;
	size_t last, end;

	if (!pen_gltf_view_find(r, view, &bytes))
		return false;
	run->stride = r->model->views[view].stride;
	if (run->stride == 0)
		run->stride = size;
	if (run->stride < size) {
		pen_gltf_refuse(r, "buffer view %d: elements of %zu bytes at a stride of %zu", view,
			size, run->stride);
		return false;
	}
	if (run->count == 0)
		return true;
	if (__builtin_mul_overflow(run->stride, run->count - 1, &last) ||
		__builtin_add_overflow(last, size, &end) ||
		__builtin_add_overflow(end, offset, &end) || end > bytes.size) {
		pen_gltf_refuse(r,
			"%zu elements from byte %zu on leave buffer view %d of %zu bytes",
			run->count, offset, view, bytes.size);
		return false;
	}
	run->first = (const unsigned char *)bytes.bytes + offset;
	return true;
}

static const struct pen_gltf_accessor *find_accessor(
	struct pen_gltf_reading *r, int index, uint32_t width, size_t count)
{
	const struct pen_gltf_accessor *accessor;

	if (index < 0 || (size_t)index >= r->model->accessor_count) {
		pen_gltf_refuse(r, "there is no accessor %d", index);
		return NULL;
	}
	accessor = &r->model->accessors[index];
	if (component_size(accessor->component) == 0)
		pen_gltf_refuse(
			r, "accessor %d: %d is no component type", index, accessor->component);
	else if (accessor->width != width || accessor->is_matrix != (width == 16))
		pen_gltf_refuse(r, "accessor %d: its type must have %u components, not %u", index,
			width, accessor->width);
	else if (count != PEN_GLTF_ANY && accessor->count != count)
		pen_gltf_refuse(r, "accessor %d: it must have %zu elements, not %zu", index, count,
			accessor->count);
	else if (accessor->count >= UINT32_MAX / 16)
		pen_gltf_refuse(
			r, "accessor %d: %zu elements are too many", index, accessor->count);
	else
		return accessor;
	return NULL;
}

static float signed_value(int value, int most, bool normalized)
{
	if (!normalized)
		return (float)value;
	return fmaxf((float)value / (float)most, -1.0f);
}

static float component_value(const unsigned char *at, int component, bool normalized)
{
	uint16_t half;
	uint32_t word;
	float real;

	switch (component) {
	case COMPONENT_BYTE: return signed_value((int8_t)at[0], INT8_MAX, normalized);
	case COMPONENT_UNSIGNED_BYTE: return normalized ? (float)at[0] / 255.0f : (float)at[0];
	case COMPONENT_SHORT:
		memcpy(&half, at, sizeof half);
		return signed_value((int16_t)half, INT16_MAX, normalized);
	case COMPONENT_UNSIGNED_SHORT:
		memcpy(&half, at, sizeof half);
		return normalized ? (float)half / 65535.0f : (float)half;
	case COMPONENT_UNSIGNED_INT:
		memcpy(&word, at, sizeof word);
		return normalized ? (float)word / 4294967295.0f : (float)word;
	default: memcpy(&real, at, sizeof real); return real;
	}
}

static uint32_t component_integer(const unsigned char *at, int component)
{
	uint16_t half;
	uint32_t word;

	switch (component) {
	case COMPONENT_UNSIGNED_BYTE: return at[0];
	case COMPONENT_UNSIGNED_SHORT: memcpy(&half, at, sizeof half); return half;
	default: memcpy(&word, at, sizeof word); return word;
	}
}

static bool is_unsigned(int component)
{
	return component == COMPONENT_UNSIGNED_BYTE || component == COMPONENT_UNSIGNED_SHORT ||
	       component == COMPONENT_UNSIGNED_INT;
}

/* Where the numbers of a run go: one array or the other. */
struct numbers {
	float *floats;
	uint32_t *integers;
};

static void store(const struct run *run, size_t from, struct numbers to, size_t index)
{
	const size_t size = component_size(run->component);
	const unsigned char *at = run->first + run->stride * from;

	for (uint32_t k = 0; k < run->width; k++, at += size) {
		if (to.floats)
			to.floats[index * run->width + k] =
				component_value(at, run->component, run->normalized);
		else
			to.integers[index * run->width + k] = component_integer(at, run->component);
	}
}

/* Puts a sparse accessor's values in the place of those that it names. */
static bool substitute(struct pen_gltf_reading *r, int index,
	const struct pen_gltf_accessor *accessor, struct numbers to)
{
	struct run values = {.component = accessor->component,
		.width = accessor->width,
		.normalized = accessor->normalized};
	struct run places = {.component = accessor->index_component, .width = 1};
	uint32_t before = 0;

	if (accessor->sparse_count < 0 || (size_t)accessor->sparse_count > accessor->count ||
		accessor->index_offset < 0 || accessor->value_offset < 0 ||
		!is_unsigned(accessor->index_component)) {
		pen_gltf_refuse(r, "accessor %d: its sparse part makes no sense", index);
		return false;
	}
	values.count = places.count = (size_t)accessor->sparse_count;
	if (!find_run(r, accessor->index_view, (size_t)accessor->index_offset, &places) ||
		!find_run(r, accessor->value_view, (size_t)accessor->value_offset, &values))
		return false;
	for (size_t i = 0; i < places.count; i++) {
		const uint32_t place =
			component_integer(places.first + places.stride * i, places.component);

		if (place >= accessor->count || (i > 0 && place <= before)) {
			pen_gltf_refuse(r,
				"accessor %d: sparse index %u; they must rise and stay below %zu",
				index, place, accessor->count);
			return false;
		}
		store(&values, i, to, place);
		before = place;
	}
	return true;
}

static bool read_numbers(struct pen_gltf_reading *r, int index,
	const struct pen_gltf_accessor *accessor, struct numbers to)
{
	struct run run = {.count = accessor->count,
		.component = accessor->component,
		.width = accessor->width,
		.normalized = accessor->normalized};

	if (accessor->view >= 0 && !find_run(r, accessor->view, accessor->offset, &run))
		return false;
	for (size_t i = 0; i < run.count && run.first; i++)
		store(&run, i, to, i);
	return !accessor->is_sparse || substitute(r, index, accessor, to);
}

/* A few bytes of text may ask for any number of zeros. */
static bool take_zeros(
	struct pen_gltf_reading *r, int index, const struct pen_gltf_accessor *accessor)
{
	const size_t count = accessor->count * accessor->width;

	if (count > PEN_GLTF_ZEROS_MAX - r->asset->zeros) {
		pen_gltf_refuse(r,
			"accessor %d: more than %u numbers of the file have no bytes of their own",
			index, PEN_GLTF_ZEROS_MAX);
		return false;
	}
	r->asset->zeros += count;
	return true;
}

/* Lets an accessor's bytes be found before memory is taken for its numbers. */
static bool precheck(
	struct pen_gltf_reading *r, int index, const struct pen_gltf_accessor *accessor)
{
	struct run run = {.count = accessor->count,
		.component = accessor->component,
		.width = accessor->width};

	return accessor->view < 0 ? take_zeros(r, index, accessor)
				  : find_run(r, accessor->view, accessor->offset, &run);
}

static const float *read_floats(
	struct pen_gltf_reading *r, int index, const struct pen_gltf_accessor *accessor)
{
	float *floats;

	if (!precheck(r, index, accessor))
		return NULL;
	floats = pen_gltf_alloc(r, accessor->count * accessor->width, sizeof *floats);
	if (!floats || !read_numbers(r, index, accessor, (struct numbers){.floats = floats}))
		return NULL;
	for (size_t i = 0; i < accessor->count * accessor->width; i++) {
		if (isfinite(floats[i]) && fabsf(floats[i]) <= (float)PEN_COORDINATE_MAX)
			continue;
		pen_gltf_refuse(r, "accessor %d: element %zu is not finite, or beyond %g", index,
			i / accessor->width, PEN_COORDINATE_MAX);
		return NULL;
	}
	return floats;
}

const float *pen_gltf_accessor_floats(
	struct pen_gltf_reading *r, int index, uint32_t width, size_t count, uint32_t *ret_count)
{
	const struct pen_gltf_accessor *accessor = find_accessor(r, index, width, count);
	struct pen_gltf_floats *cache;

	if (!accessor)
		return NULL;
	cache = &r->asset->floats[index];
	if (!cache->items)
		cache->items = read_floats(r, index, accessor);
	if (cache->items)
		*ret_count = (uint32_t)accessor->count;
	return cache->items;
}

uint32_t *pen_gltf_accessor_integers(
	struct pen_gltf_reading *r, int index, uint32_t width, size_t count, uint32_t *ret_count)
{
	const struct pen_gltf_accessor *accessor = find_accessor(r, index, width, count);
	uint32_t *integers;

	if (!accessor)
		return NULL;
	if (!is_unsigned(accessor->component)) {
		pen_gltf_refuse(r, "accessor %d: it must hold unsigned integers", index);
		return NULL;
	}
	if (!precheck(r, index, accessor))
		return NULL;
	integers = pen_gltf_alloc(r, accessor->count * width, sizeof *integers);
	if (!integers || !read_numbers(r, index, accessor, (struct numbers){.integers = integers}))
		return NULL;
	*ret_count = (uint32_t)accessor->count;
	return integers;
}

uint32_t pen_gltf_accessor_width(const struct pen_gltf_reading *r, int index)
{
	if (index < 0 || (size_t)index >= r->model->accessor_count)
		return 0;
	return r->model->accessors[index].width;
}
