/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_DOCUMENT_H
#define PEN_SERVER_DOCUMENT_H

#include <stddef.h>

/* Files of the source tree that the service gives out; the build puts them into the program. */
struct pen_document {
	const char *text; /* JSON */
	size_t size;
};

struct pen_document pen_document_openapi(void);	     /* OpenAPI 3.1 of version 1 of the API */
struct pen_document pen_document_scene_schema(void); /* see core/scene/parse.h */

#endif
