/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/key.h"

#include "core/base/digest.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { LINE_MAX_BYTES = PEN_SECURE_NAME_MAX + 1 + 2 * PEN_SECURE_KEY + 2 };

static int parse(char *line, struct pen_key *ret_key, struct pen_error *err)
{
	struct pen_key key = {.is_single_use = false};
	struct pen_sha256 bits;
	char *digits = strchr(line, ' ');
	size_t length = digits ? (size_t)(digits - line) : 0;

	if (length == 0 || length > PEN_SECURE_NAME_MAX || !pen_sha256_parse(digits + 1, &bits) ||
		strcspn(digits + PEN_SHA256_TEXT, "\r\n") != 0)
		return pen_error_set(
			err, PEN_EINVALID, "that is no key: penumbra worker add NAME prints one");
	memcpy(key.name, line, length);
	memcpy(key.bits, bits.bytes, sizeof key.bits);
	explicit_bzero(&bits, sizeof bits);
	*ret_key = key;
	explicit_bzero(&key, sizeof key);
	return 0;
}

int pen_key_read(int fd, struct pen_key *ret_key, struct pen_error *err)
{
	char line[LINE_MAX_BYTES + 1] = "";
	size_t size = 0;
	ssize_t r = 1;
	int code;

	while (size < sizeof line - 1 && r != 0) {
		r = read(fd, line + size, sizeof line - 1 - size);
		if (r < 0 && errno != EINTR)
			break;
		size += r > 0 ? (size_t)r : 0;
	}
	(void)close(fd);
	line[size] = '\0';
	code = parse(line, ret_key, err);
	explicit_bzero(line, sizeof line);
	return code;
}

/* The service manager's own directory is closed to others. */
static bool is_credential(const char *path)
{
	const char *directory = getenv("CREDENTIALS_DIRECTORY");
	size_t length = directory ? strlen(directory) : 0;

	return length > 0 && strncmp(path, directory, length) == 0 && path[length] == '/';
}

int pen_key_read_file(const char *path, struct pen_key *ret_key, struct pen_error *err)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC);
	struct stat status;

	if (fd < 0)
		return pen_error_system(err, errno, "cannot open %s", path);
	if (fstat(fd, &status) < 0 || ((status.st_mode & 077) != 0 && !is_credential(path))) {
		(void)close(fd);
		return pen_error_set(err, PEN_EINVALID,
			"others may read the key in %s: make it its owner's alone by chmod 600",
			path);
	}
	return pen_key_read(fd, ret_key, err);
}
