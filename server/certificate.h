/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CERTIFICATE_H
#define PEN_SERVER_CERTIFICATE_H

#include "core/base/error.h"

#include <stddef.h>

/* GnuTLS's own, whose headers are for one file alone. */
struct gnutls_cert_retr_st;
struct gnutls_ocsp_data_st;
struct gnutls_pcert_st;
struct gnutls_privkey_st;
struct gnutls_session_int;

/* What the HTTP interface proves with who it is: X.509 certificates and a key, both PEM. */
struct pen_certificate {
	char *cert, *key; /* text, as libraries take it */
	char **names;	  /* that it is for: "render.example", "*.example", "192.0.2.1", "[::1]" */
	size_t name_count;
};

/*
 * Reads both. PEN_EINVALID: the key may be read by everybody or changed by a group, or one of them
 * is none, or they do not belong together.
 */
int pen_certificate_load(const char *cert_path, const char *key_path,
	struct pen_certificate *ret_certificate, struct pen_error *err);
/*
 * What GnuTLS asks its retrieve function 3 for, in its own form and for one connection, which frees
 * it. 0 or an error of GnuTLS; certificate may be NULL, which is one.
 */
int pen_certificate_present(const struct pen_certificate *certificate,
	struct gnutls_pcert_st **ret_certs, unsigned *ret_count, struct gnutls_privkey_st **ret_key,
	unsigned *ret_flags);

/* What the session belongs to: libmicrohttpd's connection. */
void *pen_certificate_user(struct gnutls_session_int *session);

void pen_certificate_finish(struct pen_certificate *certificate);

enum { PEN_FINGERPRINT_TEXT = 96 }; /* 32 pairs of hex digits with colons, and a NUL */

/*
 * Makes a key and a certificate that it has signed itself, for names (hosts or addresses). Neither
 * file may be there: PEN_ECONFLICT. ret_fingerprint (of SHA-256) holds PEN_FINGERPRINT_TEXT
 * characters.
 */
int pen_certificate_make(const char *const *names, size_t count, const char *cert_path,
	const char *key_path, char *ret_fingerprint, struct pen_error *err);

#endif
