/* SPDX-License-Identifier: Apache-2.0 */
#include "server/listener.h"

#include <errno.h>
#include <netinet/in.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

enum { BACKLOG = 511, MODE = 0660 };

static int open_socket(int family, int *ret_fd, struct pen_error *err)
{
	*ret_fd = socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
	return *ret_fd < 0 ? pen_error_system(err, errno, "socket") : 0;
}

int pen_listener_tcp(const struct sockaddr_storage *address, int *ret_fd, struct pen_error *err)
{
	const socklen_t size = address->ss_family == AF_INET6 ? sizeof(struct sockaddr_in6)
							      : sizeof(struct sockaddr_in);
	int one = 1, fd;

	if (open_socket(address->ss_family, &fd, err) < 0)
		return err->code;
	(void)setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &one, sizeof one);
	if (bind(fd, (const struct sockaddr *)address, size) < 0 || listen(fd, BACKLOG) < 0) {
		const int reason = errno;

		(void)close(fd);
		return pen_error_system(err, reason, "cannot listen for HTTP");
	}
	*ret_fd = fd;
	return 0;
}

uint16_t pen_listener_port(int fd)
{
	struct sockaddr_storage bound = {0};
	socklen_t size = sizeof bound;
	const struct sockaddr_in *v4 = (const struct sockaddr_in *)&bound;
	const struct sockaddr_in6 *v6 = (const struct sockaddr_in6 *)&bound;

	(void)getsockname(fd, (struct sockaddr *)&bound, &size);
	return ntohs(bound.ss_family == AF_INET6 ? v6->sin6_port : v4->sin_port);
}

/* Makes room at the path: a socket at which nobody listens goes. */
static int clear_path(const struct sockaddr_un *address, struct pen_error *err)
{
	struct stat status;
	int fd, r;

	if (lstat(address->sun_path, &status) < 0)
		return 0;
	if (!S_ISSOCK(status.st_mode))
		return pen_error_set(err, PEN_ECONFLICT,
			"%s is there and no socket: remove it, or choose another path",
			address->sun_path);
	if (open_socket(AF_UNIX, &fd, err) < 0)
		return err->code;
	r = connect(fd, (const struct sockaddr *)address, sizeof *address);
	if (r == 0 || errno != ECONNREFUSED)
		r = pen_error_set(err, PEN_ECONFLICT,
			"%s: another service listens there; stop it, or choose another path",
			address->sun_path);
	else if (unlink(address->sun_path) < 0)
		r = pen_error_system(err, errno, "%s", address->sun_path);
	else
		r = 0;
	(void)close(fd);
	return r;
}

int pen_listener_unix(const char *path, int *ret_fd, struct pen_error *err)
{
	struct sockaddr_un address = {.sun_family = AF_UNIX};
	int fd;

	if (strlen(path) >= sizeof address.sun_path)
		return pen_error_set(err, PEN_EINVALID,
			"%s: the path of a socket has at most %zu bytes", path,
			sizeof address.sun_path - 1);
	memcpy(address.sun_path, path, strlen(path) + 1);
	if (clear_path(&address, err) < 0 || open_socket(AF_UNIX, &fd, err) < 0)
		return err->code;
	if (bind(fd, (const struct sockaddr *)&address, sizeof address) < 0 ||
		chmod(path, MODE) < 0 || listen(fd, BACKLOG) < 0) {
		const int reason = errno;

		(void)close(fd);
		return pen_error_system(err, reason, "cannot listen at %s", path);
	}
	*ret_fd = fd;
	return 0;
}

void pen_listener_remove(const char *path)
{
	struct sockaddr_un address = {.sun_family = AF_UNIX};
	struct pen_error err = PEN_ERROR_INIT;

	memcpy(address.sun_path, path, strlen(path) + 1);
	(void)clear_path(&address, &err);
}

bool pen_listener_peer_is_owner(int fd)
{
	struct ucred peer;
	socklen_t size = sizeof peer;

	if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) < 0 || size != sizeof peer)
		return false;
	return peer.uid == 0 || peer.uid == geteuid();
}
