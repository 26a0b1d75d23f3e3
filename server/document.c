/* SPDX-License-Identifier: Apache-2.0 */
#include "server/document.h"

#include "server/embed.h"

#include <stdint.h>

PEN_EMBED("document_openapi", "server/openapi.json");
PEN_EMBED("document_scene_schema", "core/scene/scene.schema.json");

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
