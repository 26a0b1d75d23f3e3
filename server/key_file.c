/* SPDX-License-Identifier: Apache-2.0 */
#include "server/key_file.h"

#include "core/base/digest.h"
#include "core/base/limits.h"
#include "server/durable.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

static const char blanks[] = " \t\r";

/* The manager's own directory is closed to others, and shows an access list as a group's rights. */
static bool is_credential(const char *path)
{
	const char *directory = getenv("CREDENTIALS_DIRECTORY");
	size_t length = directory ? strlen(directory) : 0;

	return length > 0 && strncmp(path, directory, length) == 0 && path[length] == '/';
}

/* The whole file behind *ret_text, which ends with a NUL. */
static int read_text(int fd, const char *path, char *ret_text, struct pen_error *err)
{
	struct stat status;
	size_t size = 0;
	ssize_t n = 1;

	if (fstat(fd, &status) < 0)
		return pen_error_system(err, errno, "cannot read %s", path);
	if ((status.st_mode & 077) != 0 && !is_credential(path))
		return pen_error_set(err, PEN_EINVALID,
			"others may read the keys in %s: make it its owner's alone by chmod 600",
			path);
	while (size <= PEN_KEY_FILE_MAX && n > 0) {
		n = read(fd, ret_text + size, PEN_KEY_FILE_MAX + 1 - size);
		if (n < 0 && errno != EINTR)
			return pen_error_system(err, errno, "cannot read %s", path);
		size += n > 0 ? (size_t)n : 0;
	}
	if (size > PEN_KEY_FILE_MAX || memchr(ret_text, '\0', size))
		return pen_error_set(err, PEN_EINVALID, "%s is no file of keys", path);
	ret_text[size] = '\0';
	return 0;
}

static int take_line(char *line, pen_key_line take, void *user, struct pen_error *err)
{
	char *words[PEN_KEY_WORDS_MAX], *rest = NULL;
	char *word = strtok_r(line, blanks, &rest);

	if (!word || *word == '#')
		return 0;
	for (size_t i = 0; i < PEN_KEY_WORDS_MAX; i++) {
		words[i] = word ? word : line + strlen(line);
		word = word ? strtok_r(NULL, blanks, &rest) : NULL;
	}
	if (word)
		return pen_error_set(err, PEN_EINVALID, "the line has too many words");
	return take(user, words, err);
}

static int take_lines(
	const char *path, char *text, pen_key_line take, void *user, struct pen_error *err)
{
	struct pen_error fault = PEN_ERROR_INIT;
	unsigned number = 0;
	char *next;
	int r = 0;

	for (char *line = text; r == 0 && line; line = next) {
		next = strchr(line, '\n');
		if (next)
			*next++ = '\0';
		number++;
		r = take_line(line, take, user, &fault);
	}
	return r < 0 ? pen_error_set(err, r, "%s:%u: %s", path, number, fault.text) : 0;
}

int pen_key_file_read(const char *path, pen_key_line take, void *user, struct pen_error *err)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC), r;
	char *text;

	if (fd < 0 && errno == ENOENT)
		return pen_error_set(err, PEN_ENOTFOUND, "there is no file %s", path);
	if (fd < 0)
		return pen_error_system(err, errno, "cannot open %s", path);
	text = malloc(PEN_KEY_FILE_MAX + 2);
	r = text ? read_text(fd, path, text, err) : pen_error_memory(err);
	(void)close(fd);
	if (r == 0)
		r = take_lines(path, text, take, user, err);
	if (text)
		explicit_bzero(text, PEN_KEY_FILE_MAX + 2);
	free(text);
	return r;
}

/* Both parts of a path; directory has room for PATH_MAX characters. */
static const char *split(const char *path, char *ret_directory)
{
	const char *slash = strrchr(path, '/');

	if (!slash)
		(void)snprintf(ret_directory, PATH_MAX, ".");
	else
		(void)snprintf(ret_directory, PATH_MAX, "%.*s",
			slash == path ? 1 : (int)(slash - path), path);
	return slash ? slash + 1 : path;
}

int pen_key_file_write(const char *path, const char *text, size_t size, struct pen_error *err)
{
	char directory[PATH_MAX];
	const char *name = split(path, directory);
	struct stat owner;
	int r = pen_durable_write(directory, name, text, size, err);

	/* Root may have been asked to, on behalf of the service whose directory it is. */
	if (r == 0 && geteuid() == 0 && stat(directory, &owner) == 0 && owner.st_uid != 0 &&
		chown(path, owner.st_uid, owner.st_gid) < 0)
		return pen_error_system(err, errno, "cannot hand %s to its user", path);
	return r;
}

int pen_key_file_lock(const char *path, int *ret_lock, struct pen_error *err)
{
	char directory[PATH_MAX];
	int fd;

	(void)split(path, directory);
	fd = open(directory, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
	if (fd < 0 || flock(fd, LOCK_EX) < 0) {
		int errno_value = errno;

		if (fd >= 0)
			(void)close(fd);
		return pen_error_system(err, errno_value, "cannot lock %s", directory);
	}
	*ret_lock = fd;
	return 0;
}

uint64_t pen_key_file_version(const char *path)
{
	struct stat status;
	uint64_t seen[4];

	if (stat(path, &status) < 0)
		return 0;
	seen[0] = (uint64_t)status.st_ino;
	seen[1] = (uint64_t)status.st_size;
	seen[2] = (uint64_t)status.st_mtim.tv_sec * 1000000000u + (uint64_t)status.st_mtim.tv_nsec;
	seen[3] = (uint64_t)status.st_ctim.tv_sec * 1000000000u + (uint64_t)status.st_ctim.tv_nsec;
	return pen_xxh3(seen, sizeof seen) | 1;
}

bool pen_key_name_valid(const char *name)
{
	static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
				      "0123456789._-";
	size_t length = strlen(name);

	return length >= 1 && length <= PEN_KEY_NAME_MAX && strspn(name, letters) == length &&
	       name[0] != '-' && name[0] != '.';
}
