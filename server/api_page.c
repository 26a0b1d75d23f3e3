/* SPDX-License-Identifier: Apache-2.0 */
#include "server/api_page.h"

#include "core/base/digest.h"
#include "server/fields.h"
#include "server/page.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/*
 * The page runs its own files alone, shows images of this service and those that it makes, sends
 * nothing elsewhere, and stands in no other page.
 */
#define POLICY                                                                                     \
	"default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "          \
	"connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"

static void add_fields(struct pen_answer *answer, const char *etag)
{
	pen_answer_field(answer, "ETag", etag);
	pen_answer_field(answer, "Cache-Control", "no-cache");
	pen_answer_field(answer, "Content-Security-Policy", POLICY);
	pen_answer_field(answer, "Cross-Origin-Opener-Policy", "same-origin");
}

void pen_api_page(struct pen_exchange *exchange, const struct pen_api_parameters *parameters)
{
	struct pen_answer answer;
	struct pen_page page;
	char etag[32];

	if (!pen_page_find(parameters->page[0] ? parameters->page : "index.html", &page)) {
		pen_exchange_problem(exchange, 404, "the web page has no such file");
		return;
	}
	(void)snprintf(etag, sizeof etag, "\"%016" PRIx64 "\"", pen_xxh3(page.bytes, page.size));
	if (pen_field_etag_matches(pen_exchange_field(exchange, "If-None-Match"), etag)) {
		pen_answer_init(&answer, 304);
		add_fields(&answer, etag);
		pen_exchange_answer(exchange, &answer);
		return;
	}
	pen_answer_init(&answer, 200);
	answer.content_type = page.media_type;
	answer.text = malloc(page.size);
	if (!answer.text) {
		pen_exchange_problem(exchange, 500, "there is no memory for the page");
		return;
	}
	memcpy(answer.text, page.bytes, page.size);
	answer.size = page.size;
	add_fields(&answer, etag);
	pen_exchange_answer(exchange, &answer);
}
