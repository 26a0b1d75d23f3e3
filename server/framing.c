/* SPDX-License-Identifier: Apache-2.0 */
#include "server/framing.h"

#include <microhttpd.h>
#include <string.h>
#include <strings.h>

struct fields {
	unsigned hosts, lengths, codings;
	const char *coding; /* the last one */
};

static enum MHD_Result count_field(
	void *user, enum MHD_ValueKind kind, const char *name, const char *value)
{
	struct fields *fields = user;

	(void)kind;
	if (strcasecmp(name, MHD_HTTP_HEADER_HOST) == 0)
		fields->hosts++;
	if (strcasecmp(name, MHD_HTTP_HEADER_CONTENT_LENGTH) == 0)
		fields->lengths++;
	if (strcasecmp(name, MHD_HTTP_HEADER_TRANSFER_ENCODING) == 0) {
		fields->codings++;
		fields->coding = value ? value : "";
	}
	return MHD_YES;
}

struct pen_framing_defect pen_framing_check(struct MHD_Connection *connection, const char *version)
{
	struct fields fields = {0};

	(void)MHD_get_connection_values(connection, MHD_HEADER_KIND, count_field, &fields);
	if (fields.hosts > 1)
		return (struct pen_framing_defect){400, "the request has more than one Host field"};
	if (fields.lengths > 1)
		return (struct pen_framing_defect){400, "the request has more than one length"};
	if (fields.codings == 0)
		return (struct pen_framing_defect){0, NULL};
	if (fields.lengths > 0 || fields.codings > 1)
		return (struct pen_framing_defect){
			400, "the request has a transfer coding and a length, or two codings"};
	if (strcasecmp(fields.coding, "chunked") != 0)
		return (struct pen_framing_defect){501, "the only transfer coding is chunked"};
	if (strcmp(version, MHD_HTTP_VERSION_1_1) != 0)
		return (struct pen_framing_defect){400, "HTTP/1.0 has no transfer codings"};
	return (struct pen_framing_defect){0, NULL};
}

static int digit(char c)
{
	if (c >= '0' && c <= '9')
		return c - '0';
	c = (char)(c | 0x20);
	return c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

/* The byte that %XX stands for; 0 for what is left as it is. */
static char decode(const char *text)
{
	int high = text[0] == '%' ? digit(text[1]) : -1;
	int low = high >= 0 ? digit(text[2]) : -1;

	return low >= 0 ? (char)(high * 16 + low) : '\0';
}

size_t pen_framing_unescape(char *text)
{
	char *end = text + strcspn(text, "%");

	for (const char *at = end; *at;) {
		char byte = decode(at);

		*end++ = byte ? byte : *at;
		at += byte ? 3 : 1;
	}
	*end = '\0';
	return (size_t)(end - text);
}
