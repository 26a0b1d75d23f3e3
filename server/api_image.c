/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_image.h"

#include "core/base/text.h"
#include "server/api_render.h"
#include "server/fields.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* An image on its way to the client: what the answer says of it, as it was when it was asked for.
 */
struct delivery {
	struct pen_exchange *exchange;
	enum pen_image_format format;
	bool final;
	struct pen_api_image_manner manner;
	double progress;
	char etag[PEN_ANSWER_VALUE];
};

/* The fields that 200, 206 and 304 share. */
static void add_fields(struct pen_answer *answer, const struct delivery *delivery)
{
	pen_answer_field(answer, "ETag", delivery->etag);
	pen_answer_field(answer, "Cache-Control",
		delivery->final ? "max-age=31536000, immutable" : "no-cache");
	if (delivery->manner.is_negotiated)
		pen_answer_field(answer, "Vary", "Accept");
	if (delivery->manner.is_shared)
		pen_answer_field(answer, "Access-Control-Allow-Origin", "*");
}

/* Rounded down, so that 1.00 is the end and not nearly. */
static void add_progress(struct pen_answer *answer, double progress)
{
	if (progress < 1.0)
		pen_answer_field_of(
			answer, "Penumbra-Progress", "%.2f", floor(progress * 100.0) / 100.0);
	else
		pen_answer_field(answer, "Penumbra-Progress", "1.00");
}

/* Cuts the answer down to the range that the client asked for, if it did. */
static void apply_range(struct pen_answer *answer, const struct delivery *delivery)
{
	const char *range = pen_exchange_field(delivery->exchange, "Range");
	const char *if_range = pen_exchange_field(delivery->exchange, "If-Range");
	uint64_t whole = answer->size, first, count;

	pen_answer_field(answer, "Accept-Ranges", "bytes");
	if (if_range && strcmp(if_range, delivery->etag) != 0)
		return;
	switch (pen_field_range(range, whole, &first, &count)) {
	case PEN_RANGE_WHOLE: return;
	case PEN_RANGE_PART:
		answer->status = 206;
		answer->offset = first;
		answer->size = count;
		pen_answer_field_of(answer, "Content-Range",
			"bytes %" PRIu64 "-%" PRIu64 "/%" PRIu64, first, first + count - 1, whole);
		return;
	case PEN_RANGE_UNSATISFIABLE:
		pen_answer_finish(answer);
		pen_answer_problem(answer, 416, "the image ends before that range");
		pen_answer_field_of(answer, "Content-Range", "bytes */%" PRIu64, whole);
		return;
	}
}

/* With the image in a file, or in memory. */
static void deliver(
	const struct delivery *delivery, int fd, struct pen_shared_bytes *bytes, uint64_t size)
{
	struct pen_answer answer;

	pen_answer_init(&answer, 200);
	answer.content_type = pen_image_format_media_type(delivery->format);
	answer.fd = fd;
	answer.bytes = bytes;
	answer.size = size;
	add_fields(&answer, delivery);
	add_progress(&answer, delivery->progress);
	apply_range(&answer, delivery);
	pen_exchange_answer(delivery->exchange, &answer);
}

static void encoded(void *user, int fd, uint64_t size, const struct pen_error *err)
{
	struct delivery *delivery = user;

	if (fd >= 0)
		deliver(delivery, fd, NULL, size);
	else
		pen_exchange_error(delivery->exchange, err);
	free(delivery);
}

/* By the path's extension, else by Accept; answers 404 or 406 and returns false. */
static bool choose_format(
	struct pen_exchange *exchange, const char *extension, enum pen_image_format *ret_format)
{
	const char *media_types[PEN_IMAGE_FORMATS];
	size_t choice;

	if (extension[0]) {
		if (pen_image_format_parse(extension, ret_format))
			return true;
		pen_exchange_problem(exchange, 404, "an image is .png, .jpg, .exr or .hdr");
		return false;
	}
	for (unsigned i = 0; i < PEN_IMAGE_FORMATS; i++)
		media_types[i] = pen_image_format_media_type((enum pen_image_format)i);
	choice = pen_field_accept(
		pen_exchange_field(exchange, "Accept"), media_types, PEN_IMAGE_FORMATS);
	if (choice == PEN_IMAGE_FORMATS) {
		pen_exchange_problem(exchange, 406,
			"offered are image/png, image/jpeg, image/x-exr and image/vnd.radiance");
		return false;
	}
	*ret_format = (enum pen_image_format)choice;
	return true;
}

/* From ?layer=, else the colour; answers 404 and returns false. */
static bool choose_layer(struct pen_exchange *exchange, uint32_t layers, enum pen_layer *ret_layer)
{
	const char *given = pen_exchange_query(exchange, "layer");
	char text[128] = "the image has no such layer; it has ";
	size_t length = strlen(text);

	*ret_layer = PEN_LAYER_COLOR;
	if (!given || (pen_layer_parse(given, ret_layer) && layers >> *ret_layer & 1))
		return true;
	for (unsigned i = PEN_LAYER_COLOR; i < PEN_LAYERS; i++)
		if (layers >> i & 1)
			length += (size_t)snprintf(text + length, sizeof text - length, "%s%s",
				i > 0 ? ", " : "", pen_layer_name((enum pen_layer)i));
	pen_exchange_problem(exchange, 404, text);
	return false;
}

/*
 * From ?exposure=, else as the scene says, which speaks of the colour; answers 400 and returns
 * false.
 */
static bool choose_exposure(struct pen_exchange *exchange, enum pen_layer layer, double *exposure)
{
	const char *text = pen_exchange_query(exchange, "exposure");
	char *end;

	if (layer != PEN_LAYER_COLOR)
		*exposure = 0.0;
	if (!text)
		return true;
	*exposure = strtod(text, &end);
	if (end != text && *end == '\0' && fabs(*exposure) <= PEN_EXPOSURE_MAX)
		return true;
	pen_exchange_problem(exchange, 400, "exposure must be a number from -64 to 64, in stops");
	return false;
}

/* The frame of the path, or the latest one; answers 404 and returns false. */
static bool choose_frame(struct pen_exchange *exchange, const struct pen_job *job, const char *text,
	struct pen_job_frame *ret_frame)
{
	uint32_t number = pen_jobs_frame_latest(job);
	char *end;

	if (text[0]) {
		unsigned long given = strtoul(text, &end, 10);

		if (text[0] < '0' || text[0] > '9' || *end != '\0' || given < job->frame_first ||
			given - job->frame_first >= job->frame_count) {
			pen_exchange_problem(exchange, 404, "the render has no such frame");
			return false;
		}
		number = (uint32_t)given;
	}
	*ret_frame = pen_jobs_frame(job, number);
	return true;
}

/* The framebuffer, or before anything is rendered a file of zeros, which reads as no samples. */
static int open_framebuffer(struct pen_api *api, const struct pen_job *job, uint32_t frame,
	uint64_t revision, int *ret_fd, struct pen_error *err)
{
	int r = revision == 0 ? PEN_ENOTFOUND
			      : pen_jobs_open_image(api->jobs, job, frame, ret_fd, err);
	int fd;

	if (r != PEN_ENOTFOUND)
		return r;
	fd = open("/dev/zero", O_RDONLY | O_CLOEXEC);
	if (fd < 0)
		return pen_error_system(err, errno, "/dev/zero");
	*ret_fd = fd;
	return 0;
}

static void request_encoding(const struct delivery *delivery, const struct pen_encoding *encoding,
	const struct pen_job *job)
{
	struct pen_exchange *exchange = delivery->exchange;
	struct pen_error err = PEN_ERROR_INIT;
	struct delivery *copy = malloc(sizeof *copy);
	int fd;
	int r;

	if (!copy) {
		(void)pen_error_memory(&err);
		pen_exchange_error(exchange, &err);
		return;
	}
	*copy = *delivery;
	r = open_framebuffer(exchange->api, job, encoding->frame, encoding->revision, &fd, &err);
	if (r == 0)
		r = pen_encoders_request(
			exchange->api->encoders, encoding, fd, encoded, copy, &err);
	if (r < 0) {
		free(copy);
		pen_exchange_error(exchange, &err);
	}
}

static void answer_image(
	struct delivery *delivery, const struct pen_encoding *encoding, const struct pen_job *job)
{
	struct pen_exchange *exchange = delivery->exchange;
	struct pen_shared_bytes *bytes;
	struct pen_answer answer;
	uint64_t size;
	int fd;

	if (pen_field_etag_matches(pen_exchange_field(exchange, "If-None-Match"), delivery->etag)) {
		pen_answer_init(&answer, 304);
		add_fields(&answer, delivery);
		pen_exchange_answer(exchange, &answer);
		return;
	}
	bytes = pen_encoders_hold(exchange->api->encoders, encoding);
	if (bytes) {
		deliver(delivery, -1, bytes, bytes->size);
		return;
	}
	fd = pen_encoders_cached(exchange->api->encoders, encoding, &size);
	if (fd >= 0)
		deliver(delivery, fd, NULL, size);
	else
		request_encoding(delivery, encoding, job);
}

struct pen_encoding pen_api_image_encoding(
	const struct pen_job *job, const struct pen_job_frame *frame)
{
	return (struct pen_encoding){
		.job_id = job->id,
		.frame = frame->number,
		.revision = frame->revision,
		.final = frame->done,
		.width = job->width,
		.height = job->height,
		.tiling = job->tiling,
		.planes = pen_planes_of(job->aovs, job->sampling.mode),
		.layers = pen_layers_of(job->aovs),
		.layer = PEN_LAYER_COLOR,
		.samples = job->sampling.samples,
		.exposure = job->exposure,
		.content = job->content,
		.equivalence_class = job->equivalence_class,
	};
}

static void name_image(const struct pen_api *api, const struct pen_encoding *encoding,
	char ret_etag[static PEN_ANSWER_VALUE])
{
	const struct pen_rect region = encoding->region;
	const char *limit = ret_etag + PEN_ANSWER_VALUE;
	char *end = stpcpy(ret_etag, "\"");

	end = pen_text_hex(end, encoding->final ? 0 : api->boot);
	*end++ = '-';
	end = pen_text_hex(end, encoding->frame);
	*end++ = '-';
	end = pen_text_hex(end, encoding->revision);
	*end++ = '-';
	end = stpcpy(end, pen_layer_name(encoding->layer));
	*end++ = '-';
	end = stpcpy(end, pen_image_format_extension(encoding->format));
	if (encoding->exposure != 0.0)
		end += snprintf(end, (size_t)(limit - end), "%a", encoding->exposure);
	if (encoding->out_width != 0)
		end += snprintf(end, (size_t)(limit - end), "-%u.%u.%u.%u-%u.%u", region.x0,
			region.y0, region.x1, region.y1, encoding->out_width, encoding->out_height);
	(void)stpcpy(end, "\"");
}

void pen_api_image_answer(struct pen_exchange *exchange, const struct pen_job *job,
	const struct pen_job_frame *frame, const struct pen_encoding *encoding,
	struct pen_api_image_manner manner)
{
	struct delivery delivery = {
		.exchange = exchange,
		.format = encoding->format,
		.final = encoding->final,
		.manner = manner,
		.progress = frame->progress,
	};

	if (pen_job_is_over(job->state) && job->image_revision == 0) {
		pen_exchange_problem(
			exchange, 409, "this render ended before any of it was rendered");
		return;
	}
	name_image(exchange->api, encoding, delivery.etag);
	answer_image(&delivery, encoding, job);
}

void pen_api_image_get(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	struct pen_job *job = pen_api_find_render(exchange, parameters->id);
	struct pen_encoding encoding;
	struct pen_job_frame frame;

	if (!job || !choose_frame(exchange, job, parameters->frame, &frame))
		return;
	encoding = pen_api_image_encoding(job, &frame);
	if (!choose_format(exchange, parameters->extension, &encoding.format) ||
		!choose_layer(exchange, encoding.layers, &encoding.layer) ||
		!choose_exposure(exchange, encoding.layer, &encoding.exposure))
		return;
	pen_api_image_answer(exchange, job, &frame, &encoding,
		(struct pen_api_image_manner){.is_negotiated = !parameters->extension[0]});
}
