/* SPDX-License-Identifier: Apache-2.0 */
#include "server/document.h"

/* The assembler finds the files as the compiler finds headers: from the root of the tree. */
#define EMBED(name, path)                                                                          \
	__asm__(".pushsection .rodata\n"                                                           \
		".globl pen_document_" name "_begin\n.globl pen_document_" name "_end\n"           \
		".hidden pen_document_" name "_begin\n.hidden pen_document_" name "_end\n"         \
		"pen_document_" name "_begin:\n.incbin \"" path "\"\npen_document_" name "_end:\n" \
		".popsection\n")

EMBED("openapi", "server/openapi.json");
EMBED("scene_schema", "core/scene/scene.schema.json");

extern const char pen_document_openapi_begin[], pen_document_openapi_end[];
extern const char pen_document_scene_schema_begin[], pen_document_scene_schema_end[];

struct pen_document pen_document_openapi(void)
{
	return (struct pen_document){pen_document_openapi_begin,
		(size_t)(pen_document_openapi_end - pen_document_openapi_begin)};
}

struct pen_document pen_document_scene_schema(void)
{
	return (struct pen_document){pen_document_scene_schema_begin,
		(size_t)(pen_document_scene_schema_end - pen_document_scene_schema_begin)};
}
