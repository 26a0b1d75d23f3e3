/* SPDX-License-Identifier: Apache-2.0 */
#include "server/document.h"

#include <stdint.h>

/*
 * A file's bytes and their number. The assembler finds files as the compiler finds headers: from
 * the root of the tree.
 */
#define EMBED(name, path)                                                                          \
	__asm__(".pushsection .rodata\n.balign 8\n"                                                \
		".globl document_" name "\n.hidden document_" name "\n"                            \
		".globl document_" name "_size\n.hidden document_" name "_size\n"                  \
		"document_" name "_size: .quad 1f - 0f\n"                                          \
		"document_" name ":\n0:\n.incbin \"" path "\"\n1:\n.popsection\n")

EMBED("openapi", "server/openapi.json");
EMBED("scene_schema", "core/scene/scene.schema.json");

extern const char document_openapi[], document_scene_schema[];
extern const uint64_t document_openapi_size, document_scene_schema_size;

struct pen_document pen_document_openapi(void)
{
	return (struct pen_document){document_openapi, document_openapi_size};
}

struct pen_document pen_document_scene_schema(void)
{
	return (struct pen_document){document_scene_schema, document_scene_schema_size};
}
