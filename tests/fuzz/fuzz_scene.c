/* SPDX-License-Identifier: Apache-2.0 */

/*
 * Any bytes as a scene text: nothing but an error or a scene comes of them, and a scene's canonical
 * text is a scene again, with itself as its canonical text.
 */
#include "core/scene/canonical.h"
#include "core/scene/parse.h"

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Appends the canonical text of the scene in text; false when there is none. */
static bool canonical_scene(const char *text, size_t size, struct pen_buf *out)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct pen_scene_errors errors;
	struct pen_scene *scene = NULL;
	json_t *tree = NULL;
	bool good = false;

	if (pen_json_parse(text, size, &tree, &err) == 0 &&
		pen_scene_parse(tree, &scene, &errors, &err) == 0) {
		good = true;
		if (pen_json_canonical(tree, out, &err) < 0)
			abort();
	}
	pen_scene_destroy(scene);
	json_decref(tree);
	return good;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct pen_buf once, twice;

	pen_buf_init(&once, SIZE_MAX / 2);
	pen_buf_init(&twice, SIZE_MAX / 2);
	if (canonical_scene((const char *)data, size, &once) && once.size <= PEN_SCENE_BYTES_MAX) {
		if (!canonical_scene(once.data, once.size, &twice))
			abort();
		if (once.size != twice.size || memcmp(once.data, twice.data, once.size) != 0)
			abort();
	}
	pen_buf_finish(&once);
	pen_buf_finish(&twice);
	return 0;
}
