/* SPDX-License-Identifier: Apache-2.0 */
#include "proto/secure.h"

#include "core/base/limits.h"

#include <errno.h>
#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>
#include <stdlib.h>
#include <string.h>

enum { OUT_MAX = 16 << 20, HELLO_MAX = 16 << 10 };

struct pen_secure {
	gnutls_session_t session;
	gnutls_psk_server_credentials_t server; /* one of these two */
	gnutls_psk_client_credentials_t client;
	pen_secure_lookup lookup;
	void *user;
	const char *in; /* of the caller, what is left of it */
	size_t in_size;
	struct pen_buf out;
	bool is_open;
	char name[PEN_SECURE_NAME_MAX + 1];
};

/* One way and no other, so that there is nothing to negotiate down. */
static const char priorities[] =
	"NONE:+VERS-TLS1.3:+AES-128-GCM:+CHACHA20-POLY1305:+AEAD:+ECDHE-PSK:+GROUP-X25519:"
	"+GROUP-SECP256R1:+SIGN-ALL";

static int library_error(struct pen_error *err, int r)
{
	if (r == GNUTLS_E_MEMORY_ERROR)
		return pen_error_memory(err);
	return pen_error_set(err, PEN_EPROTOCOL, "TLS: %s", gnutls_strerror(r));
}

/* What the library reads from and writes to. */

static ssize_t pull(gnutls_transport_ptr_t user, void *data, size_t size)
{
	struct pen_secure *secure = user;

	if (secure->in_size == 0) {
		gnutls_transport_set_errno(secure->session, EAGAIN);
		return -1;
	}
	if (size > secure->in_size)
		size = secure->in_size;
	memcpy(data, secure->in, size);
	secure->in += size;
	secure->in_size -= size;
	return (ssize_t)size;
}

static int pull_timeout(gnutls_transport_ptr_t user, unsigned timeout_ms)
{
	const struct pen_secure *secure = user;

	(void)timeout_ms;
	return secure->in_size > 0;
}

static ssize_t push(gnutls_transport_ptr_t user, const void *data, size_t size)
{
	struct pen_secure *secure = user;

	if (pen_buf_append(&secure->out, data, size) == 0)
		return (ssize_t)size;
	gnutls_transport_set_errno(secure->session, ENOMEM);
	return -1;
}

/* A name that is not known gets a key that nobody has: it fails where a wrong key does. */
static int find_key(gnutls_session_t session, const char *name, gnutls_datum_t *ret_key)
{
	struct pen_secure *secure = gnutls_session_get_ptr(session);

	ret_key->data = gnutls_malloc(PEN_SECURE_KEY);
	ret_key->size = PEN_SECURE_KEY;
	if (!ret_key->data)
		return GNUTLS_E_MEMORY_ERROR;
	if (strlen(name) <= PEN_SECURE_NAME_MAX &&
		secure->lookup(secure->user, name, ret_key->data))
		return 0;
	return gnutls_rnd(GNUTLS_RND_KEY, ret_key->data, PEN_SECURE_KEY);
}

static int open_session(struct pen_secure *secure, unsigned flags)
{
	int r = gnutls_init(&secure->session, flags | GNUTLS_NO_TICKETS);

	if (r < 0)
		return r;
	gnutls_session_set_ptr(secure->session, secure);
	gnutls_transport_set_ptr(secure->session, secure);
	gnutls_transport_set_pull_function(secure->session, pull);
	gnutls_transport_set_pull_timeout_function(secure->session, pull_timeout);
	gnutls_transport_set_push_function(secure->session, push);
	gnutls_handshake_set_max_packet_length(secure->session, HELLO_MAX);
	r = gnutls_priority_set_direct(secure->session, priorities, NULL);
	if (r < 0)
		return r;
	return gnutls_credentials_set(secure->session, GNUTLS_CRD_PSK,
		secure->server ? (void *)secure->server : (void *)secure->client);
}

static struct pen_secure *allocate(void)
{
	struct pen_secure *secure = calloc(1, sizeof *secure);

	if (!secure)
		return NULL;
	pen_buf_init(&secure->out, OUT_MAX);
	return secure;
}

static int finish_create(
	struct pen_secure *secure, int r, struct pen_secure **ret_secure, struct pen_error *err)
{
	if (r < 0) {
		pen_secure_destroy(secure);
		return library_error(err, r);
	}
	*ret_secure = secure;
	return 0;
}

int pen_secure_create_client(
	const char *name, const uint8_t *key, struct pen_secure **ret_secure, struct pen_error *err)
{
	const gnutls_datum_t datum = {(unsigned char *)(uintptr_t)key, PEN_SECURE_KEY};
	struct pen_secure *secure = allocate();
	int r;

	if (!secure)
		return pen_error_memory(err);
	r = gnutls_psk_allocate_client_credentials(&secure->client);
	if (r >= 0)
		r = gnutls_psk_set_client_credentials(
			secure->client, name, &datum, GNUTLS_PSK_KEY_RAW);
	if (r >= 0)
		r = open_session(secure, GNUTLS_CLIENT);
	return finish_create(secure, r, ret_secure, err);
}

int pen_secure_create_server(
	pen_secure_lookup lookup, void *user, struct pen_secure **ret_secure, struct pen_error *err)
{
	struct pen_secure *secure = allocate();
	int r;

	if (!secure)
		return pen_error_memory(err);
	secure->lookup = lookup;
	secure->user = user;
	r = gnutls_psk_allocate_server_credentials(&secure->server);
	if (r >= 0) {
		gnutls_psk_set_server_credentials_function(secure->server, find_key);
		r = open_session(secure, GNUTLS_SERVER);
	}
	return finish_create(secure, r, ret_secure, err);
}

void pen_secure_destroy(struct pen_secure *secure)
{
	if (!secure)
		return;
	if (secure->session)
		gnutls_deinit(secure->session);
	if (secure->server)
		gnutls_psk_free_server_credentials(secure->server);
	if (secure->client)
		gnutls_psk_free_client_credentials(secure->client);
	pen_buf_finish(&secure->out);
	free(secure);
}

int pen_secure_feed(struct pen_secure *secure, const void *data, size_t size, struct pen_error *err)
{
	if (secure->in_size > 0)
		return pen_error_set(err, PEN_EPROTOCOL, "TLS: more came than was read");
	secure->in = data;
	secure->in_size = size;
	return 0;
}

/* The library has seen to the key; this sees to it that it was asked to. */
static int check_peer(struct pen_secure *secure, struct pen_error *err)
{
	const char *name = secure->server ? gnutls_psk_server_get_username(secure->session) : "";

	if (gnutls_auth_get_type(secure->session) != GNUTLS_CRD_PSK ||
		gnutls_protocol_get_version(secure->session) != GNUTLS_TLS1_3 ||
		gnutls_kx_get(secure->session) != GNUTLS_KX_ECDHE_PSK || !name ||
		strlen(name) > PEN_SECURE_NAME_MAX)
		return pen_error_set(err, PEN_EPROTOCOL, "TLS: the other end shows no key");
	memcpy(secure->name, name, strlen(name) + 1);
	secure->is_open = true;
	return 1;
}

int pen_secure_shake(struct pen_secure *secure, struct pen_error *err)
{
	int r;

	if (secure->is_open)
		return 1;
	do {
		r = gnutls_handshake(secure->session);
	} while (r < 0 && r != GNUTLS_E_AGAIN && gnutls_error_is_fatal(r) == 0);
	if (r == GNUTLS_E_AGAIN)
		return 0;
	if (r >= 0)
		return check_peer(secure, err);
	(void)gnutls_alert_send_appropriate(secure->session, r);
	return library_error(err, r);
}

bool pen_secure_is_open(const struct pen_secure *secure)
{
	return secure->is_open;
}

const char *pen_secure_name(const struct pen_secure *secure)
{
	return secure->name;
}

int pen_secure_read(
	struct pen_secure *secure, void *data, size_t size, size_t *ret_size, struct pen_error *err)
{
	ssize_t r;

	do {
		r = gnutls_record_recv(secure->session, data, size);
	} while (r < 0 && r != GNUTLS_E_AGAIN && gnutls_error_is_fatal((int)r) == 0);
	if (r == 0)
		return pen_error_set(err, PEN_ECLOSED, "TLS: the other end has ended it");
	if (r < 0 && r != GNUTLS_E_AGAIN)
		return library_error(err, (int)r);
	*ret_size = r > 0 ? (size_t)r : 0;
	return 0;
}

int pen_secure_write(
	struct pen_secure *secure, const void *data, size_t size, struct pen_error *err)
{
	const char *bytes = data;

	while (size > 0) {
		ssize_t n = gnutls_record_send(secure->session, bytes, size);

		if (n < 0 && gnutls_error_is_fatal((int)n) != 0)
			return library_error(err, (int)n);
		if (n > 0) {
			bytes += n;
			size -= (size_t)n;
		}
	}
	return 0;
}

struct pen_buf *pen_secure_out(struct pen_secure *secure)
{
	return &secure->out;
}
