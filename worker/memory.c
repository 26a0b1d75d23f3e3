/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/memory.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

static int create(const char *name, uint64_t size, int seals, int *ret_fd, struct pen_error *err)
{
	int fd = memfd_create(name, MFD_CLOEXEC | MFD_ALLOW_SEALING);

	if (fd < 0)
		return pen_error_system(err, errno, "memfd_create");
	if (ftruncate(fd, (off_t)size) < 0 || fcntl(fd, F_ADD_SEALS, seals) < 0) {
		int r = pen_error_system(
			err, errno, "%s memory of %llu bytes", name, (unsigned long long)size);

		(void)close(fd);
		return r;
	}
	*ret_fd = fd;
	return 0;
}

int pen_memory_results(uint32_t count, int *ret_fd, struct pen_error *err)
{
	return create("pen-results", count * sizeof(struct pen_result),
		F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL, ret_fd, err);
}

int pen_memory_create(const char *name, uint64_t size, int *ret_fd, struct pen_error *err)
{
	return create(name, size, F_SEAL_SHRINK | F_SEAL_GROW, ret_fd, err);
}

int pen_memory_seal(int fd, struct pen_error *err)
{
	if (fcntl(fd, F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_SEAL) < 0)
		return pen_error_system(err, errno, "cannot seal memory");
	return 0;
}

int pen_memory_map(int fd, const void **ret_data, size_t *ret_size, struct pen_error *err)
{
	off_t size = lseek(fd, 0, SEEK_END);
	void *data;

	if (size < 0)
		return pen_error_system(err, errno, "lseek");
	data = mmap(NULL, (size_t)size, PROT_READ, MAP_SHARED, fd, 0);
	if (data == MAP_FAILED)
		return pen_error_system(err, errno, "mmap");
	*ret_data = data;
	*ret_size = (size_t)size;
	return 0;
}

int pen_memory_map_result(
	int fd, uint32_t slot, struct pen_result **ret_result, struct pen_error *err)
{
	void *data = mmap(NULL, sizeof(struct pen_result), PROT_READ | PROT_WRITE, MAP_SHARED, fd,
		(off_t)(slot * sizeof(struct pen_result)));

	if (data == MAP_FAILED)
		return pen_error_system(err, errno, "mmap");
	*ret_result = data;
	return 0;
}
