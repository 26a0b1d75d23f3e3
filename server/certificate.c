/* SPDX-License-Identifier: Apache-2.0 */
#include "server/certificate.h"

#include "core/base/limits.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <gnutls/abstract.h>
#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>
#include <gnutls/x509.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* From that of a host to that of its authority. */
enum { CHAIN_MAX = 16 };

enum { DAYS = 825, SERIAL_BYTES = 16, TEXT_MAX = 256 };

static int library_error(struct pen_error *err, int r, const char *what)
{
	return pen_error_set(err, PEN_EINVALID, "%s: %s", what, gnutls_strerror(r));
}

/* Reading */

static int read_all(int fd, const char *path, char **ret_text, struct pen_error *err)
{
	char *text = malloc(PEN_CERTIFICATE_MAX + 1);
	size_t size = 0;
	ssize_t n = 1;

	if (!text)
		return pen_error_memory(err);
	while (size <= PEN_CERTIFICATE_MAX && n > 0) {
		n = read(fd, text + size, PEN_CERTIFICATE_MAX + 1 - size);
		size += n > 0 ? (size_t)n : 0;
	}
	if (n < 0 || size > PEN_CERTIFICATE_MAX) {
		int errno_value = n < 0 ? errno : EFBIG;

		free(text);
		return pen_error_system(err, errno_value, "cannot read %s", path);
	}
	text[size] = '\0';
	*ret_text = text;
	return 0;
}

/* A group may read a key: so Debian's are, of the group ssl-cert. */
static int read_file(const char *path, bool is_key, char **ret_text, struct pen_error *err)
{
	int fd = open(path, O_RDONLY | O_CLOEXEC), r;
	struct stat status;

	if (fd < 0)
		return pen_error_system(err, errno, "cannot open %s", path);
	if (fstat(fd, &status) < 0)
		r = pen_error_system(err, errno, "cannot read %s", path);
	else if (is_key && (status.st_mode & 027) != 0)
		r = pen_error_set(err, PEN_EINVALID,
			"others may read or change the key in %s: make it its owner's alone by "
			"chmod 600",
			path);
	else
		r = read_all(fd, path, ret_text, err);
	(void)close(fd);
	return r;
}

static int add_name(struct pen_certificate *certificate, const char *name, struct pen_error *err)
{
	char **names = realloc(
		certificate->names, (certificate->name_count + 1) * sizeof *certificate->names);

	if (!names)
		return pen_error_memory(err);
	certificate->names = names;
	names[certificate->name_count] = strdup(name);
	if (!names[certificate->name_count])
		return pen_error_memory(err);
	certificate->name_count++;
	return 0;
}

static int add_address(
	struct pen_certificate *certificate, const void *bytes, size_t size, struct pen_error *err)
{
	char text[INET6_ADDRSTRLEN] = "", name[INET6_ADDRSTRLEN + 2];

	if (size == sizeof(struct in_addr) && inet_ntop(AF_INET, bytes, text, sizeof text))
		return add_name(certificate, text, err);
	if (size != sizeof(struct in6_addr) || !inet_ntop(AF_INET6, bytes, text, sizeof text))
		return 0;
	(void)snprintf(name, sizeof name, "[%s]", text);
	return add_name(certificate, name, err);
}

/* Of the names in the certificate those that stand in a URL. */
static int read_names(
	gnutls_x509_crt_t crt, struct pen_certificate *certificate, struct pen_error *err)
{
	int r = 0;

	for (unsigned i = 0; r == 0 && i < PEN_HOST_NAMES_MAX; i++) {
		char name[TEXT_MAX];
		size_t size = sizeof name - 1;
		int kind = gnutls_x509_crt_get_subject_alt_name(crt, i, name, &size, NULL);

		if (kind == GNUTLS_E_REQUESTED_DATA_NOT_AVAILABLE)
			break;
		name[size < sizeof name ? size : 0] = '\0';
		if (kind == GNUTLS_SAN_DNSNAME)
			r = add_name(certificate, name, err);
		else if (kind == GNUTLS_SAN_IPADDRESS)
			r = add_address(certificate, name, size, err);
	}
	return r;
}

/* Whether the key is the certificate's, which the library finds out by using both. */
static int check_pair(const gnutls_datum_t *cert, const gnutls_datum_t *key, struct pen_error *err)
{
	gnutls_certificate_credentials_t credentials;
	int r = gnutls_certificate_allocate_credentials(&credentials);

	if (r < 0)
		return pen_error_memory(err);
	r = gnutls_certificate_set_x509_key_mem(credentials, cert, key, GNUTLS_X509_FMT_PEM);
	gnutls_certificate_free_credentials(credentials);
	return r < 0 ? library_error(err, r, "the certificate and its key are not usable") : 0;
}

static int present_key(const struct pen_certificate *certificate, gnutls_privkey_t *ret_key)
{
	const gnutls_datum_t text = {
		(unsigned char *)certificate->key, (unsigned)strlen(certificate->key)};
	gnutls_privkey_t key;
	int r = gnutls_privkey_init(&key);

	if (r < 0)
		return r;
	r = gnutls_privkey_import_x509_raw(key, &text, GNUTLS_X509_FMT_PEM, NULL, 0);
	if (r < 0)
		gnutls_privkey_deinit(key);
	else
		*ret_key = key;
	return r;
}

static void drop_chain(gnutls_pcert_st *certs, unsigned count)
{
	for (unsigned i = 0; i < count; i++)
		gnutls_pcert_deinit(&certs[i]);
	gnutls_free(certs);
}

int pen_certificate_present(const struct pen_certificate *certificate,
	struct gnutls_pcert_st **ret_certs, unsigned *ret_count, struct gnutls_privkey_st **ret_key,
	unsigned *ret_flags)
{
	gnutls_pcert_st *certs = certificate ? gnutls_calloc(CHAIN_MAX, sizeof *certs) : NULL;
	unsigned count = CHAIN_MAX;
	gnutls_datum_t text;
	int r;

	if (!certs)
		return GNUTLS_E_MEMORY_ERROR;
	text.data = (unsigned char *)certificate->cert;
	text.size = (unsigned)strlen(certificate->cert);
	r = gnutls_pcert_list_import_x509_raw(certs, &count, &text, GNUTLS_X509_FMT_PEM, 0);
	if (r < 0)
		count = 0;
	else
		r = present_key(certificate, ret_key);
	if (r < 0) {
		drop_chain(certs, count);
		return r;
	}
	*ret_certs = certs;
	*ret_count = count;
	*ret_flags = GNUTLS_CERT_RETR_DEINIT_ALL;
	return 0;
}

void *pen_certificate_user(struct gnutls_session_int *session)
{
	return gnutls_session_get_ptr(session);
}

/* Whether it can be shown as it will be. */
static int check_present(const struct pen_certificate *certificate, struct pen_error *err)
{
	gnutls_pcert_st *certs;
	gnutls_privkey_t key;
	unsigned count, flags;
	int r = pen_certificate_present(certificate, &certs, &count, &key, &flags);

	if (r < 0)
		return library_error(err, r, "the certificate and its key are not usable");
	drop_chain(certs, count);
	gnutls_privkey_deinit(key);
	return 0;
}

static int inspect(struct pen_certificate *certificate, struct pen_error *err)
{
	const gnutls_datum_t cert = {
		(unsigned char *)certificate->cert, (unsigned)strlen(certificate->cert)};
	const gnutls_datum_t key = {
		(unsigned char *)certificate->key, (unsigned)strlen(certificate->key)};
	gnutls_x509_crt_t crt;
	int r = check_pair(&cert, &key, err);

	if (r == 0)
		r = check_present(certificate, err);
	if (r < 0)
		return r;
	if (gnutls_x509_crt_init(&crt) < 0)
		return pen_error_memory(err);
	r = gnutls_x509_crt_import(crt, &cert, GNUTLS_X509_FMT_PEM);
	r = r < 0 ? library_error(err, r, "the certificate cannot be read")
		  : read_names(crt, certificate, err);
	gnutls_x509_crt_deinit(crt);
	return r;
}

int pen_certificate_load(const char *cert_path, const char *key_path,
	struct pen_certificate *ret_certificate, struct pen_error *err)
{
	struct pen_certificate certificate = {0};
	int r = read_file(cert_path, false, &certificate.cert, err);

	if (r == 0)
		r = read_file(key_path, true, &certificate.key, err);
	if (r == 0)
		r = inspect(&certificate, err);
	if (r < 0)
		pen_certificate_finish(&certificate);
	else
		*ret_certificate = certificate;
	return r;
}

void pen_certificate_finish(struct pen_certificate *certificate)
{
	for (size_t i = 0; i < certificate->name_count; i++)
		free(certificate->names[i]);
	if (certificate->key)
		explicit_bzero(certificate->key, strlen(certificate->key));
	free(certificate->names);
	free(certificate->key);
	free(certificate->cert);
	*certificate = (struct pen_certificate){0};
}

/* Making */

static int set_name(gnutls_x509_crt_t crt, const char *name)
{
	struct in6_addr ip6;
	struct in_addr ip4;

	if (inet_pton(AF_INET, name, &ip4) == 1)
		return gnutls_x509_crt_set_subject_alt_name(
			crt, GNUTLS_SAN_IPADDRESS, &ip4, sizeof ip4, GNUTLS_FSAN_APPEND);
	if (inet_pton(AF_INET6, name, &ip6) == 1)
		return gnutls_x509_crt_set_subject_alt_name(
			crt, GNUTLS_SAN_IPADDRESS, &ip6, sizeof ip6, GNUTLS_FSAN_APPEND);
	return gnutls_x509_crt_set_subject_alt_name(
		crt, GNUTLS_SAN_DNSNAME, name, (unsigned)strlen(name), GNUTLS_FSAN_APPEND);
}

/*
 * It is its own authority, so that clients may trust it by name, but no other's. Its subject says
 * nothing: what it is for stands in its names.
 */
static int fill(
	gnutls_x509_crt_t crt, gnutls_x509_privkey_t key, const char *const *names, size_t count)
{
	unsigned char serial[SERIAL_BYTES], id[64];
	const time_t now = time(NULL);
	size_t id_size = sizeof id;
	int r = gnutls_rnd(GNUTLS_RND_NONCE, serial, sizeof serial);

	serial[0] = (serial[0] & 0x3f) | 0x40; /* positive, and of full length */
	if (r >= 0)
		r = gnutls_x509_crt_set_version(crt, 3);
	if (r >= 0)
		r = gnutls_x509_crt_set_serial(crt, serial, sizeof serial);
	if (r >= 0)
		r = gnutls_x509_crt_set_activation_time(crt, now - 3600);
	if (r >= 0)
		r = gnutls_x509_crt_set_expiration_time(crt, now + (time_t)DAYS * 24 * 3600);
	if (r >= 0)
		r = gnutls_x509_crt_set_dn(crt, "CN=penumbra", NULL);
	for (size_t i = 0; r >= 0 && i < count; i++)
		r = set_name(crt, names[i]);
	if (r >= 0)
		r = gnutls_x509_crt_set_key(crt, key);
	if (r >= 0)
		r = gnutls_x509_crt_set_basic_constraints(crt, 1, 0);
	if (r >= 0)
		r = gnutls_x509_crt_set_key_usage(
			crt, GNUTLS_KEY_DIGITAL_SIGNATURE | GNUTLS_KEY_KEY_CERT_SIGN);
	if (r >= 0)
		r = gnutls_x509_crt_set_key_purpose_oid(crt, GNUTLS_KP_TLS_WWW_SERVER, 0);
	if (r >= 0)
		r = gnutls_x509_crt_get_key_id(crt, 0, id, &id_size);
	if (r >= 0)
		r = gnutls_x509_crt_set_subject_key_id(crt, id, id_size);
	if (r >= 0)
		r = gnutls_x509_crt_sign2(crt, crt, key, GNUTLS_DIG_SHA256, 0);
	return r;
}

static int tell_fingerprint(gnutls_x509_crt_t crt, char *ret_text)
{
	unsigned char digest[32];
	size_t size = sizeof digest;
	int r = gnutls_x509_crt_get_fingerprint(crt, GNUTLS_DIG_SHA256, digest, &size);

	for (size_t i = 0; r >= 0 && i < sizeof digest; i++)
		(void)snprintf(
			ret_text + 3 * i, 4, "%02X%s", digest[i], i + 1 < sizeof digest ? ":" : "");
	return r;
}

static int write_new(
	const char *path, mode_t mode, const gnutls_datum_t *data, struct pen_error *err)
{
	int fd = open(path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
	bool whole;

	if (fd < 0 && errno == EEXIST)
		return pen_error_set(err, PEN_ECONFLICT, "%s is there already", path);
	if (fd < 0)
		return pen_error_system(err, errno, "cannot make %s", path);
	whole = write(fd, data->data, data->size) == (ssize_t)data->size && fsync(fd) == 0;
	if (!whole)
		(void)pen_error_system(err, errno, "cannot write %s", path);
	(void)close(fd);
	return whole ? 0 : PEN_EIO;
}

static int write_pair(gnutls_x509_crt_t crt, gnutls_x509_privkey_t key, const char *cert_path,
	const char *key_path, struct pen_error *err)
{
	gnutls_datum_t cert_text = {NULL, 0}, key_text = {NULL, 0};
	int r = gnutls_x509_crt_export2(crt, GNUTLS_X509_FMT_PEM, &cert_text);

	if (r >= 0)
		r = gnutls_x509_privkey_export2(key, GNUTLS_X509_FMT_PEM, &key_text);
	if (r < 0)
		r = library_error(err, r, "cannot write a certificate");
	else
		r = write_new(key_path, 0600, &key_text, err);
	if (r == 0 && (r = write_new(cert_path, 0644, &cert_text, err)) < 0)
		(void)unlink(key_path);
	if (key_text.data)
		explicit_bzero(key_text.data, key_text.size);
	gnutls_free(cert_text.data);
	gnutls_free(key_text.data);
	return r;
}

int pen_certificate_make(const char *const *names, size_t count, const char *cert_path,
	const char *key_path, char *ret_fingerprint, struct pen_error *err)
{
	gnutls_x509_privkey_t key = NULL;
	gnutls_x509_crt_t crt = NULL;
	int r = gnutls_x509_crt_init(&crt);

	if (r >= 0)
		r = gnutls_x509_privkey_init(&key);
	if (r >= 0)
		r = gnutls_x509_privkey_generate(
			key, GNUTLS_PK_ECDSA, GNUTLS_CURVE_TO_BITS(GNUTLS_ECC_CURVE_SECP256R1), 0);
	if (r >= 0)
		r = fill(crt, key, names, count);
	if (r >= 0)
		r = tell_fingerprint(crt, ret_fingerprint);
	r = r < 0 ? library_error(err, r, "cannot make a certificate")
		  : write_pair(crt, key, cert_path, key_path, err);
	if (key)
		gnutls_x509_privkey_deinit(key);
	if (crt)
		gnutls_x509_crt_deinit(crt);
	return r;
}
