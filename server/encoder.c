/* SPDX-License-Identifier: Apache-2.0 */
/*
 * penumbra-encoder: turns framebuffers into image files for the coordinator, which starts it and
 * talks to it as server/encoding.h says. It ends when the coordinator closes its end.
 */
#include "core/base/limits.h"
#include "core/base/log.h"
#include "core/base/sandbox.h"
#include "core/base/tile.h"
#include "core/image/codec.h"
#include "core/image/shrink.h"
#include "server/encoding.h"
#include "server/framebuf.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

/* Rows of the image from those of the framebuffer. */
struct source {
	const struct pen_encoding_request *request;
	struct pen_framebuf framebuf;
	struct pen_framebuf_rows rows;
	float *film; /* a row */
};

/* The values of a layer of a pixel that is rendered, from its film; returns past the last. */
static float *layer_values(
	const struct pen_film *film, enum pen_layer layer, const float *sums, float *ret_values)
{
	const float *of = sums;

	switch (layer) {
	case PEN_LAYER_DEPTH:
		of = sums + film->depth;
		*ret_values++ = of[1] > 0.0f ? of[0] / of[1] : INFINITY;
		return ret_values;
	case PEN_LAYER_SAMPLES: *ret_values++ = sums[PEN_CHANNEL_COUNT]; return ret_values;
	case PEN_LAYER_ALBEDO: of = sums + film->albedo; break;
	case PEN_LAYER_NORMAL: of = sums + film->normal; break;
	case PEN_LAYER_COLOR: break;
	}
	for (uint32_t c = 0; c < 3; c++)
		*ret_values++ = of[c] / sums[PEN_CHANNEL_COUNT];
	if (layer == PEN_LAYER_COLOR)
		*ret_values++ = 1.0f;
	return ret_values;
}

/* A pixel of the colour and, in an EXR, of all other layers. */
static float *color_values(const struct source *source, const float *sums, float *ret_values)
{
	const struct pen_encoding_request *request = source->request;

	ret_values = layer_values(&source->framebuf.film, PEN_LAYER_COLOR, sums, ret_values);
	for (unsigned i = PEN_LAYER_ALBEDO; i < PEN_LAYERS; i++)
		if (request->format == PEN_IMAGE_EXR && request->layers >> i & 1)
			ret_values = layer_values(
				&source->framebuf.film, (enum pen_layer)i, sums, ret_values);
	return ret_values;
}

/* A value as formats can show it that hold no negative and no infinite ones: in 0..1. */
static float shown_value(const struct pen_encoding_request *request, float value)
{
	switch ((enum pen_layer)request->layer) {
	case PEN_LAYER_NORMAL: return 0.5f + 0.5f * value;
	case PEN_LAYER_DEPTH: return 1.0f / (1.0f + value);
	case PEN_LAYER_SAMPLES: return value / (float)request->samples;
	case PEN_LAYER_ALBEDO:
	case PEN_LAYER_COLOR: break;
	}
	return value;
}

/* A pixel that shows one layer: its values as colours, a single one as grey. */
static float *shown_values(const struct source *source, const float *sums, float *ret_values)
{
	const struct pen_encoding_request *request = source->request;
	const enum pen_layer layer = (enum pen_layer)request->layer;

	(void)layer_values(&source->framebuf.film, layer, sums, ret_values);
	if (pen_layer_channels(layer) == 1)
		ret_values[1] = ret_values[2] = ret_values[0];
	for (uint32_t c = 0; c < 3 && request->format != PEN_IMAGE_EXR; c++)
		ret_values[c] = shown_value(request, ret_values[c]);
	ret_values[3] = 1.0f;
	return ret_values + 4;
}

/* How many values color_values or shown_values gives. */
static size_t value_count(const struct pen_encoding_request *request)
{
	size_t count = 4;

	for (unsigned i = PEN_LAYER_ALBEDO; i < PEN_LAYERS; i++)
		if (request->format == PEN_IMAGE_EXR && request->layer == PEN_LAYER_COLOR &&
			request->layers >> i & 1)
			count += pen_layer_channels((enum pen_layer)i);
	return count;
}

static int source_row(void *user, uint32_t y, float *ret_values, struct pen_error *err)
{
	struct source *source = user;
	const struct pen_rect crop = source->framebuf.tiling.crop;
	const size_t count = value_count(source->request);
	const float *sums = source->film;
	int r = pen_framebuf_row(&source->rows, y - crop.y0, source->film, err);

	if (r < 0)
		return r;
	for (uint32_t x = crop.x0; x < crop.x1; x++, sums += source->framebuf.film.channels) {
		if (sums[PEN_CHANNEL_COUNT] > 0.0f) {
			ret_values = source->request->layer == PEN_LAYER_COLOR
					     ? color_values(source, sums, ret_values)
					     : shown_values(source, sums, ret_values);
			continue;
		}
		memset(ret_values, 0, count * sizeof *ret_values);
		ret_values += count;
	}
	return 0;
}

static int source_init(struct source *source, const struct pen_encoding_request *request, int fd,
	struct pen_error *err)
{
	source->request = request;
	source->framebuf.film = pen_film_of(request->planes);
	pen_tiling_init(&source->framebuf.tiling, request->crop, request->tile_px);
	source->film =
		calloc((size_t)pen_rect_width(request->crop) * source->framebuf.film.channels,
			sizeof *source->film);
	if (!source->film)
		return pen_error_memory(err);
	return pen_framebuf_rows_init(&source->rows, fd, &source->framebuf, err);
}

static void source_finish(struct source *source)
{
	pen_framebuf_rows_finish(&source->rows);
	free(source->film);
}

/* What the image shows is there, in the framebuffer too. */
static bool layers_valid(const struct pen_encoding_request *request)
{
	const struct pen_film film = pen_film_of(request->planes);

	return request->layers < 1u << PEN_LAYERS && request->layer < PEN_LAYERS &&
	       request->layers >> PEN_LAYER_COLOR & 1 && request->layers >> request->layer & 1 &&
	       (film.albedo || !(request->layers >> PEN_LAYER_ALBEDO & 1)) &&
	       (film.normal || !(request->layers >> PEN_LAYER_NORMAL & 1)) &&
	       (film.depth || !(request->layers >> PEN_LAYER_DEPTH & 1)) && request->samples > 0;
}

/* Nothing, or a region of the image and what it can be shrunk to. */
static bool region_valid(const struct pen_encoding_request *request)
{
	const struct pen_rect whole = {.x1 = request->width, .y1 = request->height};

	if (request->out_width == 0)
		return true;
	return (request->format == PEN_IMAGE_PNG || request->format == PEN_IMAGE_JPEG) &&
	       pen_rect_valid(request->region) && pen_rect_contains(whole, request->region) &&
	       request->out_width <= pen_rect_width(request->region) && request->out_height > 0 &&
	       request->out_height <= pen_rect_height(request->region);
}

static bool request_valid(const struct pen_encoding_request *request)
{
	struct pen_rect whole = {.x1 = request->width, .y1 = request->height};

	return request->format < PEN_IMAGE_FORMATS && request->width <= PEN_IMAGE_SIDE_MAX &&
	       request->height <= PEN_IMAGE_SIDE_MAX && pen_rect_valid(request->crop) &&
	       pen_rect_contains(whole, request->crop) && request->tile_px > 0 &&
	       request->tile_px % 16 == 0 && request->tile_px <= PEN_TILE_SIDE_MAX &&
	       isfinite(request->exposure) && layers_valid(request) && region_valid(request) &&
	       memchr(request->content, '\0', sizeof request->content) &&
	       memchr(request->equivalence_class, '\0', sizeof request->equivalence_class);
}

static int encode_region(struct source *source, const struct pen_image_spec *whole, int file_fd,
	uint64_t *ret_size, struct pen_error *err)
{
	const struct pen_encoding_request *request = source->request;
	struct pen_image_spec spec = *whole;
	struct pen_shrink shrink = {
		.row = source_row,
		.user = source,
		.window = request->crop,
		.region = request->region,
		.width = request->out_width,
		.height = request->out_height,
	};
	int r = pen_shrink_init(&shrink, err);

	spec.width = request->out_width;
	spec.height = request->out_height;
	spec.window = (struct pen_rect){.x1 = spec.width, .y1 = spec.height};
	if (r == 0)
		r = pen_image_encode(&spec, pen_shrink_row, &shrink, file_fd, ret_size, err);
	pen_shrink_finish(&shrink);
	return r;
}

static int encode(const struct pen_encoding_request *request, int framebuffer_fd, int file_fd,
	uint64_t *ret_size, struct pen_error *err)
{
	struct source source = {.film = NULL};
	struct pen_image_spec spec = {
		.format = (enum pen_image_format)request->format,
		.width = request->width,
		.height = request->height,
		.window = request->crop,
		.final = request->final != 0,
		.exposure = request->exposure,
		.is_plain = request->layer > PEN_LAYER_ALBEDO,
		.layers = request->layer == PEN_LAYER_COLOR ? request->layers : 0,
		.origin = {request->content, request->equivalence_class, request->samples,
			request->frame},
	};
	int r;

	if (!request_valid(request))
		return pen_error_set(err, PEN_EPROTOCOL, "the encoding request is not valid");
	r = source_init(&source, request, framebuffer_fd, err);
	if (r == 0)
		r = request->out_width != 0
			    ? encode_region(&source, &spec, file_fd, ret_size, err)
			    : pen_image_encode(&spec, source_row, &source, file_fd, ret_size, err);
	source_finish(&source);
	return r;
}

/* 1 with a request, 0 when the coordinator has gone. */
static int receive(
	struct pen_encoding_request *ret_request, int ret_fds[static 2], struct pen_error *err)
{
	union {
		struct cmsghdr header;
		char space[CMSG_SPACE(2 * sizeof(int))];
	} control;
	struct iovec data = {.iov_base = ret_request, .iov_len = sizeof *ret_request};
	struct msghdr message = {
		.msg_iov = &data,
		.msg_iovlen = 1,
		.msg_control = control.space,
		.msg_controllen = sizeof control.space,
	};
	const struct cmsghdr *header;
	ssize_t n;

	do
		n = recvmsg(PEN_ENCODER_SOCKET, &message, MSG_CMSG_CLOEXEC);
	while (n < 0 && errno == EINTR);
	if (n == 0)
		return 0;
	if (n < 0)
		return pen_error_system(err, errno, "receiving a request");
	header = CMSG_FIRSTHDR(&message);
	if (n != (ssize_t)sizeof *ret_request || !header || header->cmsg_level != SOL_SOCKET ||
		header->cmsg_type != SCM_RIGHTS || header->cmsg_len != CMSG_LEN(2 * sizeof(int)))
		return pen_error_set(err, PEN_EPROTOCOL, "a request without its descriptors");
	memcpy(ret_fds, CMSG_DATA(header), 2 * sizeof(int));
	return 1;
}

static int serve(struct pen_error *err)
{
	struct pen_encoding_request request;
	int fds[2];
	int r;

	while ((r = receive(&request, fds, err)) > 0) {
		struct pen_encoding_reply reply = {.size = 0};
		struct pen_error why = PEN_ERROR_INIT;

		reply.code = encode(&request, fds[0], fds[1], &reply.size, &why);
		(void)snprintf(reply.text, sizeof reply.text, "%.*s", (int)sizeof reply.text - 1,
			why.text);
		(void)close(fds[0]);
		(void)close(fds[1]);
		if (write(PEN_ENCODER_SOCKET, &reply, sizeof reply) != (ssize_t)sizeof reply)
			return pen_error_system(err, errno, "sending a reply");
	}
	return r;
}

static int black_row(void *user, uint32_t y, float *ret_values, struct pen_error *err)
{
	(void)user, (void)y, (void)err;
	memset(ret_values, 0, 4 * sizeof(float));
	return 0;
}

/* Has the libraries load and set up what they do at first use, which the sandbox would refuse. */
static int warm_up(struct pen_error *err)
{
	struct pen_image_spec spec = {.width = 1, .height = 1, .window = {.x1 = 1, .y1 = 1}};
	uint64_t size;
	int r = 0;

	for (unsigned i = 0; r == 0 && i < PEN_IMAGE_FORMATS; i++) {
		int fd = memfd_create("penumbra-encoder", MFD_CLOEXEC);

		if (fd < 0)
			return pen_error_system(err, errno, "memfd_create");
		spec.format = (enum pen_image_format)i;
		r = pen_image_encode(&spec, black_row, NULL, fd, &size, err);
		(void)close(fd);
	}
	return r;
}

int main(int argc, char **argv)
{
	static const struct pen_sandbox_limits limits = {.memory_bytes = 8ul << 30};
	enum pen_sandbox_mode mode = PEN_SANDBOX_BEST_EFFORT;
	enum pen_log_format format = PEN_LOG_TEXT;
	struct pen_error err = PEN_ERROR_INIT;
	int r = 0;

	for (int i = 1; i < argc && r == 0; i += 2)
		if (i + 1 < argc && strcmp(argv[i], "--sandbox") == 0)
			r = pen_sandbox_mode_parse(argv[i + 1], &mode, &err);
		else if (i + 1 < argc && strcmp(argv[i], "--log-format") == 0)
			r = pen_log_format_parse(argv[i + 1], &format, &err);
		else
			r = pen_error_set(&err, PEN_EINVALID,
				"usage: penumbra-encoder [--sandbox "
				"require|best-effort|off] [--log-format text|json]");
	pen_log_open("penumbra-encoder", PEN_LOG_INFO, format);
	if (r == 0)
		r = pen_process_bind(getppid(), SIGKILL, &err);
	if (r == 0)
		r = warm_up(&err);
	if (r == 0)
		r = pen_sandbox_enter(PEN_SANDBOX_ENCODER, mode, &limits, &err);
	if (r == 0)
		r = serve(&err);
	if (r < 0)
		pen_log(PEN_LOG_ERROR, "%s", err.text);
	return r < 0 ? EXIT_FAILURE : EXIT_SUCCESS;
}
