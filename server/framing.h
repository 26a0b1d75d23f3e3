/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_FRAMING_H
#define PEN_SERVER_FRAMING_H

#include <stddef.h>

struct MHD_Connection;

/*
 * What libmicrohttpd takes and another server on the way may read otherwise: where one request
 * ends and the next begins must not be a matter of opinion (RFC 9112, sections 3.2 and 6).
 */
struct pen_framing_defect {
	unsigned status; /* 0: none */
	const char *detail;
};

/* version: as in the request line. After such a request its connection must be closed. */
struct pen_framing_defect pen_framing_check(struct MHD_Connection *connection, const char *version);

/* Decodes %XX in place, but not %00, at which names would end; the new length. */
size_t pen_framing_unescape(char *text);

#endif
