/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_TREE_H
#define PEN_SERVER_TREE_H

#include <jansson.h>

/*
 * JSON in the making. Where memory lacks for a member or an element the whole becomes NULL, and
 * stays so: whoever made it asks once, at the end, and nobody is told a part as if it were all.
 */

/* value becomes the tree's, whatever happens; NULL: there was no memory for it. */
void pen_tree_set(json_t **object, const char *key, json_t *value);
void pen_tree_append(json_t **array, json_t *value);

/*
 * The compact text of a tree, which the call takes; heap. NULL without memory, which json_dumps
 * does not always say: it leaves out what did not fit.
 */
char *pen_tree_text(json_t *tree);

#endif
