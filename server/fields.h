/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_FIELDS_H
#define PEN_SERVER_FIELDS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* What HTTP request fields say (RFC 9110). Each takes NULL for an absent field. */

/* Whether If-None-Match lists etag, by weak comparison, or is "*". */
bool pen_field_etag_matches(const char *if_none_match, const char *etag);

/* Whether a media type field names this type, whatever its case and parameters. */
bool pen_field_media_type_is(const char *content_type, const char *media_type);

/*
 * Which of the media types an Accept field likes best, the first of equals: an index, or count when
 * it accepts none. An absent field accepts all.
 */
size_t pen_field_accept(const char *accept, const char *const *media_types, size_t count);

enum pen_range_result { PEN_RANGE_WHOLE, PEN_RANGE_PART, PEN_RANGE_UNSATISFIABLE };

/*
 * A Range field over size bytes. One range of bytes is a part; anything else that is not
 * unsatisfiable, several ranges among it, means the whole.
 */
enum pen_range_result pen_field_range(
	const char *range, uint64_t size, uint64_t *ret_first, uint64_t *ret_count);

/* Digits and nothing else, at most max. */
bool pen_field_number(const char *text, uint64_t max, uint64_t *ret_number);

/* The seconds of "wait" in a Prefer field (RFC 7240); 0 when it has none, or none that is a number.
 */
uint32_t pen_field_wait(const char *prefer);

/* Whether a Cache-Control field has this directive, whatever its case; one with a value is another.
 */
bool pen_field_has_directive(const char *cache_control, const char *directive);

/* Whether a Host field has this name, whatever its case, and any port. */
bool pen_field_host_is(const char *host, const char *name);

/* Whether a Host field names this machine itself: 127.0.0.1, localhost or [::1], and any port. */
bool pen_field_host_is_local(const char *host);

#endif
