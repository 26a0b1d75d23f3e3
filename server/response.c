/* SPDX-License-Identifier: Apache-2.0 */
#include "server/response.h"

#include <microhttpd.h>
#include <string.h>

static bool answer_has(const struct pen_answer *answer, const char *name)
{
	for (size_t i = 0; i < answer->field_count; i++)
		if (strcmp(answer->fields[i].name, name) == 0)
			return true;
	return false;
}

static bool add_field(struct MHD_Response *response, const char *name, const char *value)
{
	return MHD_add_response_header(response, name, value) == MHD_YES;
}

/* What stands in all others is not repeated with a 304: what the client has of them stays. */
bool pen_response_add_fields(struct MHD_Response *response, const struct pen_answer *answer)
{
	static const char *const always[][2] = {
		{"X-Content-Type-Options", "nosniff"},
		{"Content-Security-Policy", "default-src 'none'"},
		{"Referrer-Policy", "no-referrer"},
		{"Cross-Origin-Resource-Policy", "same-origin"},
	};
	bool good = true;

	for (size_t i = 0; answer->status != 304 && i < sizeof always / sizeof always[0]; i++)
		if (!answer_has(answer, always[i][0]))
			good = add_field(response, always[i][0], always[i][1]) && good;
	if (answer->content_type)
		good = add_field(response, MHD_HTTP_HEADER_CONTENT_TYPE, answer->content_type) &&
		       good;
	for (size_t i = 0; i < answer->field_count; i++)
		good = add_field(response, answer->fields[i].name, answer->fields[i].value) && good;
	return good;
}

static void release_bytes(void *bytes)
{
	pen_shared_bytes_release(bytes);
}

static struct MHD_Response *response_with_body(const struct pen_answer *answer)
{
	if (answer->fd >= 0)
		return MHD_create_response_from_fd_at_offset64(
			answer->size, answer->fd, answer->offset);
	if (answer->bytes)
		return MHD_create_response_from_buffer_with_free_callback_cls((size_t)answer->size,
			answer->bytes->data + answer->offset, release_bytes, answer->bytes);
	return MHD_create_response_from_buffer((size_t)answer->size, answer->text,
		answer->text ? MHD_RESPMEM_MUST_FREE : MHD_RESPMEM_PERSISTENT);
}

struct MHD_Response *pen_response_of(struct pen_answer *answer)
{
	struct MHD_Response *response = response_with_body(answer);

	if (!response) {
		pen_answer_finish(answer);
		return NULL;
	}
	answer->fd = -1;
	answer->text = NULL;
	answer->bytes = NULL;
	if (pen_response_add_fields(response, answer))
		return response;
	MHD_destroy_response(response);
	return NULL;
}

static bool is_same(const struct pen_unchanged_response *item, const struct pen_answer *answer)
{
	if (!item->response || item->field_count != answer->field_count ||
		item->values_size != answer->values_size ||
		memcmp(item->values, answer->values, answer->values_size) != 0)
		return false;
	for (size_t i = 0; i < answer->field_count; i++)
		if (strcmp(item->names[i], answer->fields[i].name) != 0)
			return false;
	return true;
}

static void keep(struct pen_unchanged_response *item, const struct pen_answer *answer,
	struct MHD_Response *response)
{
	if (item->response)
		MHD_destroy_response(item->response);
	item->response = response;
	item->field_count = answer->field_count;
	item->values_size = answer->values_size;
	memcpy(item->values, answer->values, answer->values_size);
	for (size_t i = 0; i < answer->field_count; i++)
		item->names[i] = answer->fields[i].name;
}

struct MHD_Response *pen_unchanged_get(struct pen_unchanged *unchanged, struct pen_answer *answer)
{
	struct MHD_Response *response;

	for (size_t i = 0; i < PEN_UNCHANGED_MAX; i++)
		if (is_same(&unchanged->items[i], answer))
			return unchanged->items[i].response;
	response = pen_response_of(answer);
	if (!response)
		return NULL;
	keep(&unchanged->items[unchanged->next], answer, response);
	unchanged->next = (unchanged->next + 1) % PEN_UNCHANGED_MAX;
	return response;
}

void pen_unchanged_finish(struct pen_unchanged *unchanged)
{
	for (size_t i = 0; i < PEN_UNCHANGED_MAX; i++)
		if (unchanged->items[i].response)
			MHD_destroy_response(unchanged->items[i].response);
	*unchanged = (struct pen_unchanged){.next = 0};
}
