/* SPDX-License-Identifier: Apache-2.0 */

/*
 * The small parsers: any text as each field of a request, as a path's percent signs, as a digest,
 * scopes, a state. What they take is within its bounds, and reads the same when it is written.
 */
#include "core/base/digest.h"
#include "server/fields.h"
#include "server/framing.h"
#include "server/job.h"
#include "server/token.h"
#include "server/verify.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void check(bool holds)
{
	if (!holds)
		abort();
}

static void read_range(const char *text, uint64_t size)
{
	uint64_t first = 0, count = 0;

	if (pen_field_range(text, size, &first, &count) == PEN_RANGE_PART)
		check(count > 0 && first < size && count <= size - first);
}

static void read_fields(const char *text)
{
	static const char *const types[] = {"image/png", "image/jpeg", "image/x-exr"};
	uint64_t number;

	(void)pen_field_etag_matches(text, "\"a\"");
	(void)pen_field_media_type_is(text, "application/json");
	check(pen_field_accept(text, types, 3) <= 3);
	(void)pen_field_wait(text);
	(void)pen_field_has_directive(text, "no-cache");
	(void)pen_field_host_is(text, "example.org");
	(void)pen_field_host_is_local(text);
	if (pen_field_number(text, 1000, &number))
		check(number <= 1000);
	for (uint64_t size = 1; size < 2000; size = 3 * size + 1)
		read_range(text, size);
	read_range(text, UINT64_MAX);
}

static void read_names(const char *text)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_sha256 sha256;
	char again[PEN_SHA256_TEXT];
	enum pen_job_state state;
	enum pen_verify verify;
	unsigned scopes;

	if (strlen(text) == PEN_SHA256_TEXT - 1 && pen_sha256_parse(text, &sha256)) {
		pen_sha256_format(&sha256, again);
		check(strcmp(text, again) == 0);
	}
	if (pen_job_state_parse(text, &state))
		check(strcmp(text, pen_job_state_name(state)) == 0);
	if (pen_verify_parse(text, &verify))
		check(strcmp(text, pen_verify_name(verify)) == 0);
	if (pen_scopes_parse(text, &scopes, &err) == 0)
		check(scopes != 0 && (scopes & ~(unsigned)PEN_SCOPE_ALL) == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	char *text = malloc(size + 1);

	if (!text)
		return 0;
	memcpy(text, data, size);
	text[size] = '\0';
	read_fields(text);
	read_names(text);
	check(pen_framing_unescape(text) == strlen(text));
	free(text);
	return 0;
}
