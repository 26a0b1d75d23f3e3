/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/channel.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

/* Room for the descriptors and for the sender's credentials. */
union attachment {
	struct cmsghdr align;
	char bytes[CMSG_SPACE(PEN_CHANNEL_FDS_MAX * sizeof(int)) +
		   CMSG_SPACE(sizeof(struct ucred))];
};

int pen_channel_pair(int *ret_pool, int *ret_child, struct pen_error *err)
{
	const int on = 1;
	int ends[2];

	if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) < 0)
		return pen_error_system(err, errno, "socketpair");
	if (fcntl(ends[0], F_SETFL, O_NONBLOCK) < 0 ||
		setsockopt(ends[0], SOL_SOCKET, SO_PASSCRED, &on, sizeof on) < 0) {
		int r = pen_error_system(err, errno, "socketpair");

		(void)close(ends[0]);
		(void)close(ends[1]);
		return r;
	}
	*ret_pool = ends[0];
	*ret_child = ends[1];
	return 0;
}

int pen_channel_send(int fd, const void *message, size_t size, const int *fds, size_t fd_count)
{
	union attachment attachment = {0};
	struct iovec data = {(void *)(uintptr_t)message, size};
	struct msghdr header = {.msg_iov = &data, .msg_iovlen = 1};
	ssize_t sent;

	assert(fd_count <= PEN_CHANNEL_FDS_MAX);
	if (fd_count > 0) {
		attachment.align = (struct cmsghdr){
			.cmsg_len = CMSG_LEN(fd_count * sizeof *fds),
			.cmsg_level = SOL_SOCKET,
			.cmsg_type = SCM_RIGHTS,
		};
		memcpy(CMSG_DATA(&attachment.align), fds, fd_count * sizeof *fds);
		header.msg_control = &attachment;
		header.msg_controllen = CMSG_SPACE(fd_count * sizeof *fds);
	}
	do {
		sent = sendmsg(fd, &header, MSG_NOSIGNAL);
	} while (sent < 0 && errno == EINTR);
	if (sent < 0)
		return errno == EAGAIN ? PEN_EAGAIN : PEN_ECLOSED;
	return 0;
}

/* Takes the descriptors out of header; those that do not fit in fds are closed. */
static void take_fds(struct cmsghdr *part, int *fds, size_t fd_count)
{
	size_t count = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);

	for (size_t i = 0; i < count; i++) {
		int fd;

		memcpy(&fd, CMSG_DATA(part) + i * sizeof fd, sizeof fd);
		if (i < fd_count)
			fds[i] = fd;
		else
			(void)close(fd);
	}
}

int pen_channel_receive(
	int fd, void *message, size_t size, int *fds, size_t fd_count, pid_t *ret_sender)
{
	union attachment attachment;
	struct iovec data = {message, size};
	struct msghdr header = {
		.msg_iov = &data,
		.msg_iovlen = 1,
		.msg_control = &attachment,
		.msg_controllen = sizeof attachment,
	};
	struct ucred sender = {0};
	ssize_t received;

	do {
		received = recvmsg(fd, &header, MSG_CMSG_CLOEXEC);
	} while (received < 0 && errno == EINTR);
	if (received < 0)
		return errno == EAGAIN ? PEN_EAGAIN : PEN_ECLOSED;
	if (received == 0)
		return PEN_ECLOSED;
	for (size_t i = 0; i < fd_count; i++)
		fds[i] = -1;
	for (struct cmsghdr *part = CMSG_FIRSTHDR(&header); part;
		part = CMSG_NXTHDR(&header, part)) {
		if (part->cmsg_type == SCM_RIGHTS)
			take_fds(part, fds, fd_count);
		else if (part->cmsg_type == SCM_CREDENTIALS)
			memcpy(&sender, CMSG_DATA(part), sizeof sender);
	}
	if (ret_sender)
		*ret_sender = sender.pid;
	return (size_t)received == size && !(header.msg_flags & MSG_TRUNC) ? 0 : PEN_EPROTOCOL;
}
