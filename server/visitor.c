/* SPDX-License-Identifier: Apache-2.0 */
#include "server/visitor.h"

#include "core/base/limits.h"

#include <assert.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { TICK_MS = 1000, BUCKETS = 256 };

/* How many connections an address has. */
struct peer {
	struct peer *next; /* in its bucket */
	uint64_t key[2];
	unsigned count;
};

enum doing { RESTS, ASKS, SENDS, WAITS, TAKES, GOES };

struct pen_visitor {
	struct pen_visitors *visitors;
	struct pen_visitor *previous, *next;
	struct peer *peer; /* NULL: not counted */
	int fd;
	enum doing doing;
	bool marked;
	uint64_t mark;	/* the socket's count of bytes when it was first looked at */
	uint64_t seen;	/* the same when pen_visitors_get_on was asked */
	uint64_t since; /* ms */
	uint64_t bytes; /* of the body or the answer, until now */
};

struct pen_visitors {
	uv_loop_t *loop;
	void *user;
	uv_timer_t timer; /* runs while there are visitors */
	uint64_t looked;  /* ms */
	struct pen_visitor *first;
	struct peer *peers[BUCKETS];
};

/* Addresses */

/* False for one that is not counted. */
static bool key_of(const struct sockaddr *address, uint64_t ret_key[2])
{
	struct in6_addr in6;
	uint32_t v4;

	if (address && address->sa_family == AF_INET) {
		v4 = ((const struct sockaddr_in *)address)->sin_addr.s_addr;
	} else if (address && address->sa_family == AF_INET6) {
		in6 = ((const struct sockaddr_in6 *)address)->sin6_addr;
		if (IN6_IS_ADDR_LOOPBACK(&in6))
			return false;
		ret_key[1] = 6;
		memcpy(&ret_key[0], &in6, sizeof ret_key[0]);
		if (!IN6_IS_ADDR_V4MAPPED(&in6))
			return true;
		memcpy(&v4, &in6.s6_addr[12], sizeof v4);
	} else {
		return false;
	}
	ret_key[0] = v4;
	ret_key[1] = 4;
	return ntohl(v4) >> 24 != 127;
}

static struct peer *const *find_peer(const struct pen_visitors *visitors, const uint64_t key[2])
{
	uint64_t hash = (key[0] ^ key[1]) * 0x9e3779b97f4a7c15u;
	struct peer *const *at = &visitors->peers[hash >> 56];

	while (*at && ((*at)->key[0] != key[0] || (*at)->key[1] != key[1]))
		at = &(*at)->next;
	return at;
}

bool pen_visitors_welcome(const struct pen_visitors *visitors, const struct sockaddr *address)
{
	const struct peer *peer;
	uint64_t key[2];

	if (!key_of(address, key))
		return true;
	peer = *find_peer(visitors, key);
	return !peer || peer->count < PEN_HTTP_ADDRESS_MAX;
}

/* NULL for one that is not counted, and without memory. */
static struct peer *peer_enter(struct pen_visitors *visitors, const struct sockaddr *address)
{
	uint64_t key[2];
	struct peer **at;

	if (!key_of(address, key))
		return NULL;
	at = (struct peer **)(uintptr_t)find_peer(visitors, key);
	if (!*at) {
		*at = calloc(1, sizeof **at);
		if (!*at)
			return NULL;
		memcpy((*at)->key, key, sizeof key);
	}
	(*at)->count++;
	return *at;
}

static void peer_leave(struct pen_visitors *visitors, struct peer *peer)
{
	struct peer **at;

	assert(peer->count > 0);
	if (--peer->count > 0)
		return;
	at = (struct peer **)(uintptr_t)find_peer(visitors, peer->key);
	assert(*at == peer);
	*at = peer->next;
	free(peer);
}

/* Time */

/* linux/tcp.h's structure since Linux 4.1, of which glibc's ends earlier. */
struct socket_info {
	struct tcp_info known;
	uint64_t pacing_rate, pacing_rate_max;
	uint64_t bytes_acked, bytes_received;
};

_Static_assert(offsetof(struct socket_info, bytes_acked) == 120, "laid out as by Linux");

/* What a socket has received, or what its other end has taken; false where that is not told. */
static bool socket_bytes(const struct pen_visitor *visitor, uint64_t *ret_bytes)
{
	struct socket_info info = {0};
	socklen_t size = sizeof info;

	if (getsockopt(visitor->fd, IPPROTO_TCP, TCP_INFO, &info, &size) < 0 || size < sizeof info)
		return false;
	*ret_bytes = visitor->doing == TAKES ? info.bytes_acked : info.bytes_received;
	return true;
}

/* Bytes since the first look; a socket that tells nothing has its clients' trust. */
static uint64_t socket_progress(struct pen_visitor *visitor, uint64_t otherwise)
{
	uint64_t bytes;

	if (!socket_bytes(visitor, &bytes))
		return otherwise;
	if (!visitor->marked)
		visitor->mark = bytes;
	visitor->marked = true;
	return bytes - visitor->mark;
}

static bool is_slow(uint64_t elapsed_ms, uint64_t bytes)
{
	return elapsed_ms > PEN_HTTP_TRANSFER_MS ||
	       (elapsed_ms > PEN_HTTP_GRACE_MS &&
		       (elapsed_ms - PEN_HTTP_GRACE_MS) * PEN_HTTP_RATE / 1000 > bytes);
}

static bool is_late(struct pen_visitor *visitor, uint64_t now)
{
	uint64_t elapsed_ms = now - visitor->since;

	switch (visitor->doing) {
	case RESTS:
		if (socket_progress(visitor, 0) > 0) {
			visitor->doing = ASKS;
			visitor->since = now;
		}
		return false;
	case ASKS: return elapsed_ms > PEN_HTTP_HEADER_MS;
	case SENDS: return is_slow(elapsed_ms, visitor->bytes);
	case TAKES: return is_slow(elapsed_ms, socket_progress(visitor, UINT64_MAX));
	default: return false;
	}
}

bool pen_visitors_get_on(struct pen_visitors *visitors)
{
	bool gets_on = false;
	uint64_t bytes;

	for (struct pen_visitor *visitor = visitors->first; visitor; visitor = visitor->next) {
		if (visitor->doing != TAKES)
			continue;
		if (!socket_bytes(visitor, &bytes))
			return true; /* as far as can be told */
		gets_on = gets_on || bytes != visitor->seen;
		visitor->seen = bytes;
	}
	return gets_on;
}

/* What its client has not taken is thrown away when the socket is closed, rather than kept. */
static void send_away(struct pen_visitor *visitor)
{
	const struct linger at_once = {.l_onoff = 1};

	(void)setsockopt(visitor->fd, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
	(void)shutdown(visitor->fd, SHUT_RDWR);
	visitor->doing = GOES;
}

static void look(uv_timer_t *timer)
{
	struct pen_visitors *visitors = timer->data;
	uint64_t now = uv_now(visitors->loop);
	uint64_t lost = now - visitors->looked > 2 * TICK_MS ? now - visitors->looked - TICK_MS : 0;

	visitors->looked = now;
	for (struct pen_visitor *visitor = visitors->first; visitor; visitor = visitor->next) {
		visitor->since += lost < now - visitor->since ? lost : now - visitor->since;
		if (is_late(visitor, now))
			send_away(visitor);
	}
}

static void do_now(struct pen_visitor *visitor, enum doing doing)
{
	if (!visitor || visitor->doing == GOES)
		return;
	visitor->doing = doing;
	visitor->since = uv_now(visitor->visitors->loop);
	visitor->bytes = 0;
	visitor->marked = false;
}

void pen_visitor_sends(struct pen_visitor *visitor)
{
	do_now(visitor, SENDS);
}

void pen_visitor_sent(struct pen_visitor *visitor, size_t size)
{
	if (visitor)
		visitor->bytes += size;
}

void pen_visitor_waits(struct pen_visitor *visitor)
{
	do_now(visitor, WAITS);
}

void pen_visitor_takes(struct pen_visitor *visitor)
{
	do_now(visitor, TAKES);
}

void pen_visitor_rests(struct pen_visitor *visitor)
{
	do_now(visitor, RESTS);
}

/* Lifetimes */

int pen_visitors_create(
	uv_loop_t *loop, void *user, struct pen_visitors **ret_visitors, struct pen_error *err)
{
	struct pen_visitors *visitors = calloc(1, sizeof *visitors);

	if (!visitors)
		return pen_error_memory(err);
	visitors->loop = loop;
	visitors->user = user;
	(void)uv_timer_init(loop, &visitors->timer);
	visitors->timer.data = visitors;
	*ret_visitors = visitors;
	return 0;
}

void *pen_visitor_user(const struct pen_visitor *visitor)
{
	return visitor->visitors->user;
}

static void timer_closed(uv_handle_t *handle)
{
	free(handle->data);
}

void pen_visitors_destroy(struct pen_visitors *visitors)
{
	if (!visitors)
		return;
	assert(!visitors->first);
	uv_close((uv_handle_t *)&visitors->timer, timer_closed);
}

struct pen_visitor *pen_visitor_enter(
	struct pen_visitors *visitors, int fd, const struct sockaddr *address)
{
	struct pen_visitor *visitor = calloc(1, sizeof *visitor);

	if (!visitor)
		return NULL;
	visitor->visitors = visitors;
	visitor->fd = fd;
	visitor->peer = peer_enter(visitors, address);
	do_now(visitor, ASKS);
	visitor->next = visitors->first;
	if (visitor->next)
		visitor->next->previous = visitor;
	visitors->first = visitor;
	if (!visitor->next) {
		visitors->looked = uv_now(visitors->loop);
		(void)uv_timer_start(&visitors->timer, look, TICK_MS, TICK_MS);
	}
	return visitor;
}

void pen_visitor_leave(struct pen_visitor *visitor)
{
	struct pen_visitors *visitors;

	if (!visitor)
		return;
	visitors = visitor->visitors;
	if (visitor->previous)
		visitor->previous->next = visitor->next;
	else
		visitors->first = visitor->next;
	if (visitor->next)
		visitor->next->previous = visitor->previous;
	if (visitor->peer)
		peer_leave(visitors, visitor->peer);
	if (!visitors->first)
		(void)uv_timer_stop(&visitors->timer);
	free(visitor);
}
