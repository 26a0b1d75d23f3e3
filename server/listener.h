/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_LISTENER_H
#define PEN_SERVER_LISTENER_H

#include "core/base/error.h"

#include <stdbool.h>
#include <stdint.h>
#include <sys/socket.h>

/* The sockets at which HTTP comes in. All are non-blocking and closed in programs that we start. */

int pen_listener_tcp(const struct sockaddr_storage *address, int *ret_fd, struct pen_error *err);

/* The port of a socket that listens for TCP. */
uint16_t pen_listener_port(int fd);

/*
 * A socket in the file system, for this user and its group (mode 0660). One that a coordinator has
 * left behind is replaced; PEN_ECONFLICT when another one listens at it, or it is something else.
 */
int pen_listener_unix(const char *path, int *ret_fd, struct pen_error *err);

/* Removes the path once its socket is closed, unless another one listens there by now. */
void pen_listener_remove(const char *path);

/* Whether the other end of a connection is a process of this one's user, or of root. */
bool pen_listener_peer_is_owner(int fd);

#endif
