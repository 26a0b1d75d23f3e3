/* SPDX-License-Identifier: Apache-2.0 */
#include "server/config_file.h"

#include "core/base/limits.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

static const char blanks[] = " \t\r\n";

/* Without the blanks at either end; changes text. */
static char *trim(char *text)
{
	size_t length;

	text += strspn(text, blanks);
	for (length = strlen(text); length > 0 && strchr(blanks, text[length - 1]); length--)
		;
	text[length] = '\0';
	return text;
}

static void cut_comment(char *line)
{
	for (char *at = line; (at = strchr(at, '#')); at++) {
		if (at != line && !strchr(blanks, at[-1]))
			continue;
		*at = '\0';
		return;
	}
}

static int read_line(char *line, pen_config_set set, void *user, struct pen_error *err)
{
	char *equals, *key;

	cut_comment(line);
	key = trim(line);
	if (*key == '\0')
		return 0;
	equals = strchr(key, '=');
	if (!equals || equals == key)
		return pen_error_set(err, PEN_EINVALID, "a line is KEY = VALUE");
	*equals = '\0';
	return set(user, trim(key), trim(equals + 1), err);
}

/* A whole line, or what is left of one at the end of the file; -1 at the end or after a fault. */
static int next_line(FILE *file, char *ret_line, int size, struct pen_error *err)
{
	size_t length;

	if (!fgets(ret_line, size, file))
		return -1;
	length = strlen(ret_line);
	if (length > 0 && (ret_line[length - 1] == '\n' || feof(file)))
		return 0;
	(void)pen_error_set(
		err, PEN_EINVALID, "a line has at most %d bytes, none of which is 0", size - 2);
	return -1;
}

static int read_lines(
	FILE *file, const char *path, pen_config_set set, void *user, struct pen_error *err)
{
	char line[PEN_CONFIG_LINE_MAX + 2];
	struct pen_error fault = PEN_ERROR_INIT;
	unsigned number = 0;
	int r = 0;

	while (r == 0 && next_line(file, line, sizeof line, &fault) == 0) {
		if (++number > PEN_CONFIG_LINES_MAX)
			r = pen_error_set(&fault, PEN_ELIMIT, "there are more than %u lines",
				PEN_CONFIG_LINES_MAX);
		else
			r = read_line(line, set, user, &fault);
	}
	if (ferror(file))
		return pen_error_system(err, errno, "cannot read %s", path);
	if (r == 0 && fault.code != PEN_OK) { /* of next_line */
		number++;
		r = fault.code;
	}
	if (r < 0)
		(void)pen_error_set(err, r, "%s:%u: %s", path, number, fault.text);
	return r;
}

int pen_config_file_read(const char *path, pen_config_set set, void *user, struct pen_error *err)
{
	FILE *file = fopen(path, "re");
	int r;

	if (!file && errno == ENOENT)
		return pen_error_set(err, PEN_ENOTFOUND, "there is no file %s", path);
	if (!file)
		return pen_error_system(err, errno, "cannot open %s", path);
	r = read_lines(file, path, set, user, err);
	(void)fclose(file);
	return r;
}
