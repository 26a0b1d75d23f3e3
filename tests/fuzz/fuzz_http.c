/* SPDX-License-Identifier: Apache-2.0 */

/*
 * Any bytes as a request: "METHOD PATH?QUERY", fields, an empty line, a body. Over fake renders,
 * every request is answered once, with a status that the interface has, and no input in a problem.
 * Encoders and streams are left out: they have processes and clients.
 */
#include "server/api.h"
#include "server/asset_file.h"
#include "server/framing.h"
#include "server/shelf.h"
#include "server/watch.h"
#include "tests/support/fake_jobs.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { PAIRS_MAX = 32 };

struct pair {
	char *name, *value;
};

struct request {
	struct pen_exchange exchange;
	struct pair fields[PAIRS_MAX], queries[PAIRS_MAX];
	unsigned field_count, query_count, answers;
};

static char dir[] = "/dev/shm/penumbra-fuzz.XXXXXX";

static void check(bool holds)
{
	if (!holds)
		abort();
}

/* What http.c offers to the interface. */

static struct request *request_of(const struct pen_exchange *exchange)
{
	return (struct request *)(uintptr_t)exchange; /* its first member */
}

static bool is_offered(unsigned status)
{
	static const uint16_t offered[] = {200, 201, 202, 204, 206, 303, 304, 400, 403, 404, 405,
		406, 409, 410, 412, 413, 415, 416, 421, 422, 428, 429, 501, 503, 507};

	for (unsigned i = 0; i < sizeof offered / sizeof offered[0]; i++)
		if (offered[i] == status)
			return true;
	return false;
}

void pen_exchange_answer(struct pen_exchange *exchange, struct pen_answer *answer)
{
	check(request_of(exchange)->answers++ == 0);
	check(is_offered(answer->status));
	for (size_t i = 0; i < answer->field_count; i++)
		check(!strpbrk(answer->fields[i].value, "\r\n"));
	pen_answer_finish(answer);
}

void pen_exchange_stream(struct pen_exchange *exchange, const struct pen_answer *answer,
	const struct pen_stream_source *source)
{
	check(request_of(exchange)->answers++ == 0 && answer->status == 200);
	source->finish(source->user);
}

void pen_exchange_problem(struct pen_exchange *exchange, unsigned status, const char *detail)
{
	struct pen_answer answer;

	pen_answer_problem(&answer, status, detail);
	pen_exchange_answer(exchange, &answer);
}

void pen_exchange_error(struct pen_exchange *exchange, const struct pen_error *err)
{
	struct pen_answer answer;

	pen_answer_error(&answer, err);
	pen_exchange_answer(exchange, &answer);
}

const char *pen_exchange_field(const struct pen_exchange *exchange, const char *name)
{
	const struct request *request = request_of(exchange);

	for (unsigned i = 0; i < request->field_count; i++)
		if (strcasecmp(request->fields[i].name, name) == 0)
			return request->fields[i].value;
	return NULL;
}

const char *pen_exchange_query(const struct pen_exchange *exchange, const char *name)
{
	const struct request *request = request_of(exchange);

	for (unsigned i = 0; i < request->query_count; i++)
		if (strcmp(request->queries[i].name, name) == 0)
			return request->queries[i].value;
	return NULL;
}

void pen_exchange_each_query(const struct pen_exchange *exchange,
	void (*take)(void *user, const char *name, const char *value), void *user)
{
	const struct request *request = request_of(exchange);

	for (unsigned i = 0; i < request->query_count; i++)
		take(user, request->queries[i].name,
			request->queries[i].value ? request->queries[i].value : "");
}

/* What the encoders offer: nothing is cached, and there are too many of them. */

int pen_encoders_cached(
	struct pen_encoders *encoders, const struct pen_encoding *encoding, uint64_t *ret_size)
{
	(void)encoders, (void)encoding, (void)ret_size;
	return -1;
}

struct pen_shared_bytes *pen_encoders_hold(
	struct pen_encoders *encoders, const struct pen_encoding *encoding)
{
	(void)encoders, (void)encoding;
	return NULL;
}

int pen_encoders_request(struct pen_encoders *encoders, const struct pen_encoding *encoding,
	int framebuffer_fd, pen_encoding_fn *fn, void *user, struct pen_error *err)
{
	(void)encoders, (void)fn, (void)user;
	check(encoding->exposure >= -64 && encoding->exposure <= 64);
	check(encoding->out_width <= 16384 && encoding->out_height <= 16384);
	(void)close(framebuffer_fd);
	return pen_error_set(err, PEN_EAGAIN, "too many images at once");
}

void pen_encoders_forget(struct pen_encoders *encoders, const char *job_id)
{
	(void)encoders, (void)job_id;
}

/* The request */

static enum pen_method read_method(const char *name)
{
	static const char *const names[] = {
		"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"};

	for (unsigned i = 0; i < sizeof names / sizeof names[0]; i++)
		if (strcmp(name, names[i]) == 0)
			return (enum pen_method)i;
	return PEN_METHOD_OTHER;
}

static void read_queries(struct request *request, char *text)
{
	for (char *save, *item = strtok_r(text, "&", &save);
		item && request->query_count < PAIRS_MAX; item = strtok_r(NULL, "&", &save)) {
		struct pair *pair = &request->queries[request->query_count++];

		pair->name = item;
		pair->value = strchr(item, '=');
		if (pair->value) {
			*pair->value++ = '\0';
			(void)pen_framing_unescape(pair->value);
		}
		(void)pen_framing_unescape(pair->name);
	}
}

static void read_line(struct request *request, char *line)
{
	char *path = strchr(line, ' '), *query;

	request->exchange.method = PEN_METHOD_OTHER;
	request->exchange.path = "/";
	if (!path)
		return;
	*path++ = '\0';
	request->exchange.method = read_method(line);
	request->exchange.path = path;
	query = strchr(path, '?');
	if (query) {
		*query++ = '\0';
		read_queries(request, query);
	}
	(void)pen_framing_unescape(path);
}

/* Those that would wait are left out. */
static void read_field(struct request *request, char *line)
{
	char *value = strchr(line, ':');

	if (!value || request->field_count == PAIRS_MAX || strncasecmp(line, "prefer", 6) == 0)
		return;
	*value++ = '\0';
	request->fields[request->field_count++] = (struct pair){line, value + strspn(value, " ")};
}

/* The text until the empty line; the body is what comes behind it. */
static void read_request(struct request *request, char *text, size_t size)
{
	static char host[] = "Host", localhost[] = "localhost";
	char *end = memmem(text, size, "\n\n", 2);
	size_t head = end ? (size_t)(end - text) : size;

	request->fields[request->field_count++] = (struct pair){host, localhost};
	if (end) {
		check(pen_buf_append(&request->exchange.body, end + 2, size - head - 2) == 0);
		*end = '\0';
	}
	for (char *save, *line = strtok_r(text, "\n", &save), *first = line; line;
		line = strtok_r(NULL, "\n", &save)) {
		if (line == first)
			read_line(request, line);
		else
			read_field(request, line);
	}
	if (!request->exchange.path)
		request->exchange.path = "/";
}

static void handle(struct pen_api *api, struct request *request)
{
	struct pen_exchange *exchange = &request->exchange;
	struct pen_error err = PEN_ERROR_INIT;

	exchange->api = api;
	if (pen_api_admit(exchange)) {
		if (exchange->upload && exchange->body.size > 0)
			(void)pen_asset_upload_append(
				exchange->upload, exchange->body.data, exchange->body.size, &err);
		pen_api_handle(exchange);
	}
	while (request->answers == 0)
		check(uv_run(api->loop, UV_RUN_ONCE) != 0 || request->answers != 0);
}

static void run(uv_loop_t *loop, struct request *request)
{
	struct pen_api api = {.loop = loop, .assets_dir = dir, .scenes_dir = dir};
	struct pen_shelf *shelf;

	api.jobs = fake_jobs_create(loop);
	check(pen_shelf_create(dir, &shelf, NULL) == 0);
	check(pen_watches_create(loop, api.jobs, &api.watches, NULL) == 0);
	api.shelf = shelf;
	handle(&api, request);
	pen_watches_destroy(api.watches);
	pen_recent_finish(&api.recent);
	pen_held_finish(&api.held);
	(void)uv_run(loop, UV_RUN_DEFAULT);
	pen_shelf_destroy(shelf);
	fake_jobs_destroy(api.jobs);
}

static void remove_directory(void)
{
	char command[96];

	(void)snprintf(command, sizeof command, "rm -rf %s", dir);
	if (system(command) != 0)
		(void)fprintf(stderr, "%s stays\n", dir);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static bool has_begun;
	struct request request = {0};
	char *text = malloc(size + 1);
	uv_loop_t loop;

	check(text && uv_loop_init(&loop) == 0);
	if (!has_begun) {
		check(mkdtemp(dir) != NULL);
		(void)atexit(remove_directory);
		has_begun = true;
	}
	memcpy(text, data, size);
	text[size] = '\0';
	pen_buf_init(&request.exchange.body, size + 1);
	read_request(&request, text, size);
	run(&loop, &request);
	pen_buf_finish(&request.exchange.body);
	pen_asset_upload_destroy(request.exchange.upload);
	check(uv_loop_close(&loop) == 0);
	free(text);
	return 0;
}
