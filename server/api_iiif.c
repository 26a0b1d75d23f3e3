/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_iiif.h"

#include "server/api_image.h"
#include "server/fields.h"
#include "server/tree.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define CONTEXT "http://iiif.io/api/image/3/context.json"

enum { TILE_PX = 512 };

void pen_api_iiif_base(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const struct pen_job *job = pen_api_find_render(exchange, parameters->id);
	struct pen_answer answer;

	if (!job)
		return;
	pen_answer_init(&answer, 303);
	pen_answer_field_of(&answer, "Location", "/v1/renders/%s/iiif/info.json", job->id);
	pen_answer_field(&answer, "Access-Control-Allow-Origin", "*");
	pen_exchange_answer(exchange, &answer);
}

/* 1, 2, 4, … as long as a side is longer than a tile. */
static json_t *scale_factors(uint32_t side)
{
	json_t *list = json_array();
	uint32_t factor = 1;

	pen_tree_append(&list, json_integer(1));
	for (; side / factor > TILE_PX; factor *= 2)
		pen_tree_append(&list, json_integer(2 * (json_int_t)factor));
	return list;
}

/* host is one of this machine's names: any other was refused. */
static json_t *info_json(const struct pen_job *job, const char *host)
{
	const uint32_t side = job->width > job->height ? job->width : job->height;

	return json_pack("{s:s, s:o, s:s, s:s, s:s, s:i, s:i, s:[{s:i, s:o}], s:[s]}", "@context",
		CONTEXT, "id", json_sprintf("http://%s/v1/renders/%s/iiif", host, job->id), "type",
		"ImageService3", "protocol", "http://iiif.io/api/image", "profile", "level1",
		"width", (int)job->width, "height", (int)job->height, "tiles", "width", TILE_PX,
		"scaleFactors", scale_factors(side), "extraFormats", "png");
}

void pen_api_iiif_info(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	static const char *const types[] = {"application/json", "application/ld+json"};
	const struct pen_job *job = pen_api_find_render(exchange, parameters->id);
	struct pen_answer answer;

	if (!job)
		return;
	pen_answer_json(&answer, 200, info_json(job, pen_exchange_field(exchange, "Host")));
	if (pen_field_accept(pen_exchange_field(exchange, "Accept"), types, 2) == 1)
		answer.content_type = "application/ld+json;profile=\"" CONTEXT "\"";
	pen_answer_field(&answer, "Vary", "Accept");
	pen_answer_field(&answer, "Cache-Control", "no-cache");
	pen_answer_field(&answer, "Access-Control-Allow-Origin", "*");
	pen_exchange_answer(exchange, &answer);
}

/* Numbers between commas and nothing else: how many, 0 when it is something else. */
static int read_numbers(const char *text, uint64_t *ret_numbers, int max)
{
	char number[16];
	int count = 0;

	for (;; text++) {
		const size_t length = strcspn(text, ",");

		if (count == max || length == 0 || length >= sizeof number)
			return 0;
		(void)snprintf(number, sizeof number, "%.*s", (int)length, text);
		if (!pen_field_number(number, UINT32_MAX, &ret_numbers[count++]))
			return 0;
		text += length;
		if (*text == '\0')
			return count;
	}
}

/* 0, or the status that refuses it. What sticks out of the image is cut off. */
static unsigned read_region(
	const char *text, uint32_t width, uint32_t height, struct pen_rect *ret_region)
{
	const uint32_t side = width < height ? width : height;
	uint64_t n[4];

	*ret_region = (struct pen_rect){.x1 = width, .y1 = height};
	if (strcmp(text, "full") == 0)
		return 0;
	if (strcmp(text, "square") == 0) {
		ret_region->x0 = (width - side) / 2;
		ret_region->y0 = (height - side) / 2;
		ret_region->x1 = ret_region->x0 + side;
		ret_region->y1 = ret_region->y0 + side;
		return 0;
	}
	if (strncmp(text, "pct:", 4) == 0)
		return 501;
	if (read_numbers(text, n, 4) != 4 || n[2] == 0 || n[3] == 0 || n[0] >= width ||
		n[1] >= height)
		return 400;
	*ret_region = (struct pen_rect){(uint32_t)n[0], (uint32_t)n[1],
		(uint32_t)(n[0] + n[2] < width ? n[0] + n[2] : width),
		(uint32_t)(n[1] + n[3] < height ? n[1] + n[3] : height)};
	return 0;
}

/* The other side of what has the region's shape. */
static uint32_t follow(uint64_t side, uint32_t of, uint32_t other)
{
	const double length = floor((double)side * other / of + 0.5);

	return length < 1 ? 1 : length > other ? other : (uint32_t)length;
}

static unsigned read_size(
	const char *text, struct pen_rect region, uint32_t *ret_width, uint32_t *ret_height)
{
	const uint32_t width = pen_rect_width(region), height = pen_rect_height(region);
	const size_t length = strlen(text);
	char side[32];
	uint64_t n[2] = {width, height};

	(void)snprintf(side, sizeof side, "%s", text);
	if (text[0] == '^' || text[0] == '!' || strncmp(text, "pct:", 4) == 0)
		return 501;
	if (length > 0 && text[length - 1] == ',') {
		side[length - 1] = '\0';
		if (read_numbers(side, n, 1) != 1)
			return 400;
		n[1] = follow(n[0], width, height);
	} else if (text[0] == ',') {
		if (read_numbers(text + 1, n + 1, 1) != 1)
			return 400;
		n[0] = follow(n[1], height, width);
	} else if (strcmp(text, "max") != 0 && read_numbers(text, n, 2) != 2) {
		return 400;
	}
	if (n[0] == 0 || n[1] == 0 || n[0] > width || n[1] > height)
		return 400;
	*ret_width = (uint32_t)n[0];
	*ret_height = (uint32_t)n[1];
	return 0;
}

/* The turn and the quality have one value that is offered here, and others that are known. */
static unsigned check_rest(const struct pen_api_parameters *parameters)
{
	static const char *const qualities[] = {"color", "gray", "bitonal"};
	const char *turn = parameters->turn + (parameters->turn[0] == '!');
	unsigned status = 0;

	if (strcmp(parameters->turn, "0") != 0)
		status = turn[0] && turn[strspn(turn, "0123456789.")] == '\0' ? 501 : 400;
	if (status != 0 || strcmp(parameters->quality, "default") == 0)
		return status;
	for (size_t i = 0; i < sizeof qualities / sizeof *qualities; i++)
		if (strcmp(parameters->quality, qualities[i]) == 0)
			return i == 0 ? 0 : 501;
	return 400;
}

static unsigned read_image(
	const struct pen_api_parameters *parameters, struct pen_encoding *encoding)
{
	unsigned status = read_region(
		parameters->region, encoding->width, encoding->height, &encoding->region);

	if (status == 0)
		status = read_size(parameters->size, encoding->region, &encoding->out_width,
			&encoding->out_height);
	if (status == 0)
		status = check_rest(parameters);
	if (status == 0 && strcmp(parameters->extension, "png") != 0 &&
		strcmp(parameters->extension, "jpg") != 0)
		status = 501;
	return status;
}

void pen_api_iiif_image(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	const struct pen_job *job = pen_api_find_render(exchange, parameters->id);
	struct pen_encoding encoding;
	struct pen_job_frame frame;
	unsigned status;

	if (!job)
		return;
	frame = pen_jobs_frame(job, pen_jobs_frame_latest(job));
	encoding = pen_api_image_encoding(job, &frame);
	status = read_image(parameters, &encoding);
	if (status != 0) {
		pen_exchange_problem(exchange, status,
			status == 501
				? "offered are regions full, square and x,y,w,h; sizes max, w,"
				  " ,h and w,h; no turn, default quality, jpg and png"
				: "this is no part of the image: see the IIIF Image API 3.0");
		return;
	}
	(void)pen_image_format_parse(parameters->extension, &encoding.format);
	pen_api_image_answer(
		exchange, job, &frame, &encoding, (struct pen_api_image_manner){.is_shared = true});
}
