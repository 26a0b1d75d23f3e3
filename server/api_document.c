/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_document.h"

#include "core/base/digest.h"
#include "server/document.h"
#include "server/fields.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void answer_document(struct pen_exchange *exchange, struct pen_document document)
{
	struct pen_answer answer;
	char etag[32];

	(void)snprintf(
		etag, sizeof etag, "\"%016" PRIx64 "\"", pen_xxh3(document.text, document.size));
	if (pen_field_etag_matches(pen_exchange_field(exchange, "If-None-Match"), etag)) {
		pen_answer_init(&answer, 304);
	} else {
		pen_answer_text(&answer, 200, "application/json", document.text, document.size);
	}
	pen_answer_field(&answer, "ETag", etag);
	pen_answer_field(&answer, "Cache-Control", "no-cache");
	pen_exchange_answer(exchange, &answer);
}

void pen_api_openapi(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	(void)parameters;
	answer_document(exchange, pen_document_openapi());
}

void pen_api_scene_schema(
	struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	(void)parameters;
	answer_document(exchange, pen_document_scene_schema());
}
