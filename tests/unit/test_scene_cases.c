/* SPDX-License-Identifier: Apache-2.0 */
#include "core/scene/canonical.h"
#include "core/scene/parse.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

static json_t *parse(const char *text, size_t size)
{
	struct pen_error err = PEN_ERROR_INIT;
	json_t *tree = NULL;

	if (pen_json_parse(text, size, &tree, &err) < 0)
		fail_msg("%s", err.text);
	return tree;
}

static json_t *read_file(const char *path)
{
	static char text[1 << 16];
	FILE *file = fopen(path, "rb");
	size_t size;

	assert_non_null(file);
	size = fread(text, 1, sizeof text, file);
	assert_in_range(size, 1, sizeof text - 1);
	(void)fclose(file);
	return parse(text, size);
}

/*
 * The table is shared with integration/test_schema.py, which puts the same questions to the schema.
 * Broken by a case on which parser and schema do not agree.
 */
static void cases_have_their_verdicts(void **state)
{
	static const char minimal[] = "{\"version\":1,\"image\":{\"width\":8,\"height\":4}}";
	json_t *cases = read_file("unit/scene_cases.json"), *entry;
	size_t i;

	(void)state;
	assert_in_range(json_array_size(cases), 50, 500);
	json_array_foreach (cases, i, entry) {
		struct pen_error err = PEN_ERROR_INIT;
		struct pen_scene_errors errors;
		struct pen_scene *scene = NULL;
		json_t *tree = parse(minimal, sizeof minimal - 1);
		int r;

		r = pen_json_merge_patch(tree, json_object_get(entry, "patch"), &err);
		assert_int_equal(r, 0);
		r = pen_scene_parse(tree, &scene, &errors, &err);
		if (r != (json_is_true(json_object_get(entry, "good")) ? 0 : PEN_EINVALID))
			fail_msg("%s: %s", json_string_value(json_object_get(entry, "case")),
				r < 0 ? err.text : "taken");
		pen_scene_destroy(scene);
		json_decref(tree);
	}
	json_decref(cases);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(cases_have_their_verdicts),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
