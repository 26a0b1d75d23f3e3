/* SPDX-License-Identifier: Apache-2.0 */
#include "server/fields.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

static const char *skip_blanks(const char *text)
{
	return text + strspn(text, " \t");
}

bool pen_field_etag_matches(const char *if_none_match, const char *etag)
{
	const char *opaque = strncmp(etag, "W/", 2) == 0 ? etag + 2 : etag;
	size_t length = strlen(opaque);
	const char *at;

	if (!if_none_match)
		return false;
	at = skip_blanks(if_none_match);
	if (*at == '*')
		return true;
	while (*at) {
		const char *end;

		if (strncmp(at, "W/", 2) == 0)
			at += 2;
		end = *at == '"' ? strchr(at + 1, '"') : NULL;
		if (!end)
			return false;
		end++;
		if ((size_t)(end - at) == length && memcmp(at, opaque, length) == 0)
			return true;
		at = end + strspn(end, " \t,");
	}
	return false;
}

bool pen_field_media_type_is(const char *content_type, const char *media_type)
{
	size_t length = strlen(media_type);

	return content_type && strncasecmp(content_type, media_type, length) == 0 &&
	       strchr("; \t", content_type[length]);
}

/* The weight of one element of an Accept field, which ends before end: 1 without a valid q. */
static double quality(const char *element, const char *end)
{
	const char *at = element;

	while ((at = memchr(at, ';', (size_t)(end - at)))) {
		at = skip_blanks(at + 1);
		if (strncasecmp(at, "q=", 2) == 0)
			return strtod(at + 2, NULL);
	}
	return 1.0;
}

/* How exactly an element names a media type: 0 not at all, 1 by any type, 2 by any subtype, 3. */
static unsigned precision(const char *element, size_t length, const char *media_type)
{
	size_t type = strcspn(media_type, "/") + 1;

	if (length == strlen(media_type) && strncasecmp(element, media_type, length) == 0)
		return 3;
	if (length == type + 1 && element[type] == '*' &&
		strncasecmp(element, media_type, type) == 0)
		return 2;
	return length == 3 && memcmp(element, "*/*", 3) == 0;
}

/* What an Accept field gives a media type: the most precise element that names it counts. */
static double acceptance(const char *accept, const char *media_type)
{
	unsigned best = 0;
	double weight = 0.0;

	for (const char *at = skip_blanks(accept); *at;) {
		const char *end = at + strcspn(at, ",");
		unsigned found = precision(at, strcspn(at, ",; \t"), media_type);

		if (found > best) {
			best = found;
			weight = quality(at, end);
		}
		at = end + strspn(end, " \t,");
	}
	return weight;
}

size_t pen_field_accept(const char *accept, const char *const *media_types, size_t count)
{
	size_t best = count;
	double most = 0.0;

	for (size_t i = 0; i < count; i++) {
		double weight = accept ? acceptance(accept, media_types[i]) : 1.0;

		if (weight > most) {
			most = weight;
			best = i;
		}
	}
	return best;
}

/* Digits to a number, as large as can be when there are too many; false without a digit. */
static bool take_number(const char **text, uint64_t *ret_number)
{
	char *end;

	if (!isdigit((unsigned char)**text))
		return false;
	*ret_number = strtoull(*text, &end, 10);
	*text = end;
	return true;
}

enum pen_range_result pen_field_range(
	const char *range, uint64_t size, uint64_t *ret_first, uint64_t *ret_count)
{
	uint64_t first = 0, last = UINT64_MAX;
	bool has_first, has_last;

	if (!range || strncasecmp(range, "bytes=", 6) != 0)
		return PEN_RANGE_WHOLE;
	range = skip_blanks(range + 6);
	has_first = take_number(&range, &first);
	if (*range++ != '-')
		return PEN_RANGE_WHOLE;
	has_last = take_number(&range, &last);
	if (*skip_blanks(range) != '\0' || (!has_first && !has_last) || (has_first && last < first))
		return PEN_RANGE_WHOLE;
	if (!has_first) {
		/* The last so many bytes. */
		first = last < size ? size - last : 0;
		if (last == 0)
			first = size;
		last = UINT64_MAX;
	}
	if (first >= size)
		return PEN_RANGE_UNSATISFIABLE;
	*ret_first = first;
	*ret_count = (last < size ? last + 1 : size) - first;
	return PEN_RANGE_PART;
}

bool pen_field_number(const char *text, uint64_t max, uint64_t *ret_number)
{
	char *end;
	unsigned long long number;

	if (!isdigit((unsigned char)text[0]))
		return false;
	errno = 0;
	number = strtoull(text, &end, 10);
	if (errno != 0 || *end != '\0' || number > max)
		return false;
	*ret_number = number;
	return true;
}

/* The first of the elements between commas and semicolons that is name, or name = …; else NULL. */
static const char *find_element(const char *field, const char *name, char after)
{
	const size_t length = strlen(name);

	for (const char *at = field; at && *at; at += strcspn(at, ",;")) {
		const char *end;

		at += strspn(at, " \t,;");
		end = at + length;
		if (strncasecmp(at, name, length) != 0)
			continue;
		end = skip_blanks(end);
		if (*end == after || (after == '\0' && (*end == ',' || *end == ';')))
			return end;
	}
	return NULL;
}

uint32_t pen_field_wait(const char *prefer)
{
	const char *at = find_element(prefer, "wait", '=');
	uint64_t seconds;
	bool quoted;

	if (!at)
		return 0;
	at = skip_blanks(at + 1);
	quoted = *at == '"';
	at += quoted;
	if (!take_number(&at, &seconds))
		return 0;
	if (quoted && *at++ != '"')
		return 0;
	at = skip_blanks(at);
	if (*at != '\0' && *at != ',' && *at != ';')
		return 0;
	return seconds < UINT32_MAX ? (uint32_t)seconds : UINT32_MAX;
}

bool pen_field_has_directive(const char *cache_control, const char *directive)
{
	return find_element(cache_control, directive, '\0') != NULL;
}

bool pen_field_host_is(const char *host, const char *name)
{
	const size_t length = strlen(name);
	const char *rest = host + length;

	if (strncasecmp(host, name, length) != 0)
		return false;
	if (*rest == ':')
		rest += 1 + strspn(rest + 1, "0123456789");
	return *rest == '\0';
}

bool pen_field_host_is_local(const char *host)
{
	static const char *const names[] = {"127.0.0.1", "localhost", "[::1]"};

	for (size_t i = 0; host && i < sizeof names / sizeof names[0]; i++)
		if (pen_field_host_is(host, names[i]))
			return true;
	return false;
}
