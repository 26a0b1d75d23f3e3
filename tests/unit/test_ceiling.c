/* SPDX-License-Identifier: Apache-2.0 */
#include <malloc.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/base/limits.h"
#include "core/scene/json.h"
#include "server/ceiling.h"

/* Breaks if a part is not in the sum, or has no name. */
static void test_the_sum(void **state)
{
	struct pen_ceiling ceiling;
	uint64_t sum = 0;

	(void)state;
	pen_ceiling_compute(PEN_JOBS_QUEUED_MAX, &ceiling);
	for (size_t i = 0; i < PEN_CEILING_PARTS; i++) {
		assert_true(ceiling.parts[i].name && ceiling.parts[i].bytes > 0);
		sum += ceiling.parts[i].bytes;
	}
	assert_int_equal(ceiling.bytes, sum);
}

/* Breaks if the operator's choice is not heeded, or the sentence ends early. */
static void test_what_is_told(void **state)
{
	char few[PEN_CEILING_TEXT], many[PEN_CEILING_TEXT];
	struct pen_ceiling ceiling;

	(void)state;
	pen_ceiling_compute(1, &ceiling);
	pen_ceiling_format(&ceiling, few);
	pen_ceiling_compute(PEN_JOBS_QUEUED_CEILING, &ceiling);
	pen_ceiling_format(&ceiling, many);
	assert_string_not_equal(few, many);
	for (size_t i = 0; i < PEN_CEILING_PARTS; i++)
		assert_non_null(strstr(many, ceiling.parts[i].name));
}

static size_t bytes_in_use(void)
{
	const struct mallinfo2 info = mallinfo2();

	return info.uordblks + info.hblkhd;
}

/* What the heap holds for a list of count times piece, each of which is so many nodes. */
static void check_tree(const char *piece, size_t nodes)
{
	const size_t count = PEN_SCENE_NODES_MAX / nodes - 1, size = strlen(piece);
	char *text = malloc(count * size + 1);
	struct pen_error err = PEN_ERROR_INIT;
	size_t before, after;
	json_t *tree;

	assert_non_null(text);
	for (size_t i = 0; i < count; i++)
		memcpy(text + i * size, piece, size);
	text[0] = '[';
	text[count * size - 1] = ']';
	before = bytes_in_use();
	assert_int_equal(pen_json_parse(text, count * size, &tree, &err), 0);
	after = bytes_in_use();
	printf("%s: %zu bytes a node\n", piece, (after - before) / PEN_SCENE_NODES_MAX);
	assert_true(after - before <= (uint64_t)PEN_SCENE_NODES_MAX * PEN_SCENE_NODE_BYTES);
	json_decref(tree);
	free(text);
}

/* Breaks if a kind of scene takes more memory than is told. */
static void test_trees_are_within_it(void **state)
{
	(void)state;
	check_tree(" 1,", 1);
	check_tree(" {},", 1);
	check_tree(" [],", 1);
	check_tree(" \"\",", 1);
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(test_the_sum),
		cmocka_unit_test(test_what_is_told),
		cmocka_unit_test(test_trees_are_within_it),
	};

	return cmocka_run_group_tests(tests, NULL, NULL);
}
