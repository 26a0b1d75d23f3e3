/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/client.h"

#include "core/base/buf.h"
#include "core/base/clock.h"
#include "core/base/limits.h"
#include "server/cli/credentials.h"
#include "server/cli/interrupt.h"

#include <curl/curl.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char unix_scheme[] = "unix:";

enum { CONNECT_S = 5, SILENCE_S = 60, STARTING_MS = 2000, RETRY_MS = 50 };

struct pen_client {
	CURL *curl;
	char *url;
	const struct pen_credentials *credentials; /* or NULL */
	struct pen_buf body;			   /* of an answer that is JSON, or a refusal */
	json_t *answer;
	int fd;				      /* of a download, else -1 */
	int write_errno;		      /* why a download could not be stored */
	const struct pen_client_watch *watch; /* of an upload, else NULL */
	char reason[CURL_ERROR_SIZE];
};

int pen_client_create(const char *url, const struct pen_credentials *credentials,
	struct pen_client **ret_client, struct pen_error *err)
{
	struct pen_client *client = calloc(1, sizeof *client);

	if (!client)
		return pen_error_memory(err);
	pen_buf_init(&client->body, PEN_ANSWER_BYTES_MAX);
	client->credentials = credentials;
	client->url = strdup(url);
	client->curl = curl_easy_init();
	if (!client->url || !client->curl) {
		pen_client_destroy(client);
		return pen_error_memory(err);
	}
	for (size_t end = strlen(url); end > 0 && client->url[end - 1] == '/'; end--)
		client->url[end - 1] = '\0';
	*ret_client = client;
	return 0;
}

void pen_client_destroy(struct pen_client *client)
{
	if (!client)
		return;
	curl_easy_cleanup(client->curl);
	pen_buf_finish(&client->body);
	json_decref(client->answer);
	free(client->url);
	free(client);
}

json_t *pen_client_answer(const struct pen_client *client)
{
	return client->answer;
}

static int handle_progress(
	void *user, curl_off_t total, curl_off_t now, curl_off_t up_total, curl_off_t up_now)
{
	const struct pen_client *client = user;

	(void)total;
	(void)now;
	if (client->watch && up_total > 0)
		client->watch->moved(client->watch->user, (double)up_now / (double)up_total);
	return pen_interrupted();
}

static long status_of(const struct pen_client *client)
{
	long status = 0;

	(void)curl_easy_getinfo(client->curl, CURLINFO_RESPONSE_CODE, &status);
	return status;
}

static size_t handle_bytes(char *bytes, size_t unit, size_t count, void *user)
{
	struct pen_client *client = user;
	size_t size = unit * count;

	if (client->fd < 0 || status_of(client) != 200)
		return pen_buf_append(&client->body, bytes, size) < 0 ? 0 : size;
	for (size_t done = 0; done < size;) {
		ssize_t n = write(client->fd, bytes + done, size - done);

		if (n < 0 && errno != EINTR) {
			client->write_errno = errno;
			return 0;
		}
		done += n > 0 ? (size_t)n : 0;
	}
	return size;
}

/* Both are kept for the connection; neither is sent to anybody else, for nobody is followed. */
static void show_credentials(struct pen_client *client)
{
	const struct pen_credentials *credentials = client->credentials;

	if (!credentials)
		return;
	if (credentials->token[0] != '\0') {
		curl_easy_setopt(client->curl, CURLOPT_HTTPAUTH, (long)CURLAUTH_BEARER);
		curl_easy_setopt(client->curl, CURLOPT_XOAUTH2_BEARER, credentials->token);
	}
	if (credentials->ca_file)
		curl_easy_setopt(client->curl, CURLOPT_CAINFO, credentials->ca_file);
}

const char *pen_client_socket(const char *url)
{
	const size_t length = sizeof unix_scheme - 1;

	return strncmp(url, unix_scheme, length) == 0 ? url + length : NULL;
}

static void prepare(struct pen_client *client, int fd)
{
	CURL *curl = client->curl;

	/* A reset forgets the options, not the connection. */
	curl_easy_reset(curl);
	client->fd = fd;
	client->watch = NULL;
	client->write_errno = 0;
	client->reason[0] = '\0';
	pen_buf_clear(&client->body);
	json_decref(client->answer);
	client->answer = NULL;
	curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
	curl_easy_setopt(curl, CURLOPT_NOPROXY, "localhost,127.0.0.1,::1");
	curl_easy_setopt(curl, CURLOPT_USERAGENT, "penumbra/" PEN_VERSION);
	curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
	curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, (long)CONNECT_S);
	curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, 1L);
	curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, (long)SILENCE_S);
	curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, client->reason);
	curl_easy_setopt(curl, CURLOPT_NOPROGRESS, 0L);
	curl_easy_setopt(curl, CURLOPT_XFERINFOFUNCTION, handle_progress);
	curl_easy_setopt(curl, CURLOPT_XFERINFODATA, client);
	curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, handle_bytes);
	curl_easy_setopt(curl, CURLOPT_WRITEDATA, client);
	curl_easy_setopt(curl, CURLOPT_SSLVERSION, (long)CURL_SSLVERSION_TLSv1_3);
	if (pen_client_socket(client->url))
		curl_easy_setopt(curl, CURLOPT_UNIX_SOCKET_PATH, pen_client_socket(client->url));
	show_credentials(client);
}

static int code_of_status(long status)
{
	switch (status) {
	case 400:
	case 422: return PEN_EINVALID;
	case 404:
	case 410: return PEN_ENOTFOUND;
	case 409: return PEN_ECONFLICT;
	case 413: return PEN_ELIMIT;
	case 429:
	case 503: return PEN_EAGAIN;
	default: return PEN_EIO;
	}
}

static bool is_refused(const struct pen_client *client, CURLcode code)
{
	long reason = 0;

	return code == CURLE_COULDNT_CONNECT &&
	       curl_easy_getinfo(client->curl, CURLINFO_OS_ERRNO, &reason) == CURLE_OK &&
	       (reason == ECONNREFUSED || (reason == ENOENT && pen_client_socket(client->url)));
}

static int transfer_failure(struct pen_client *client, CURLcode code, struct pen_error *err)
{
	const char *reason = client->reason[0] ? client->reason : curl_easy_strerror(code);

	if (client->write_errno)
		return pen_error_system(err, client->write_errno, "write the image");
	if (client->body.failed)
		return pen_error_set(err, PEN_EPROTOCOL, "%s: the answer is too long", client->url);
	if (is_refused(client, code))
		reason = "nothing listens there; \"penumbra serve\" starts a coordinator";
	return pen_error_set(err, PEN_ECLOSED, "cannot reach %s: %s", client->url, reason);
}

/* What an answer that is no success says. */
static int refusal(struct pen_client *client, struct pen_error *err)
{
	const char *detail = json_string_value(json_object_get(client->answer, "detail"));
	const char *title = json_string_value(json_object_get(client->answer, "title"));
	long status = status_of(client);

	if (!detail)
		detail = title ? title : "no reason given";
	return pen_error_set(err, code_of_status(status), "%s (%ld)", detail, status);
}

/* A coordinator that was started just before is given the time to listen. */
static CURLcode transfer(struct pen_client *client)
{
	const int64_t deadline_ms = pen_clock_ms() + STARTING_MS;
	CURLcode code = curl_easy_perform(client->curl);

	while (is_refused(client, code) && pen_clock_ms() < deadline_ms && !pen_interrupted()) {
		pen_interrupt_sleep(RETRY_MS);
		code = curl_easy_perform(client->curl);
	}
	return code;
}

static int perform(
	struct pen_client *client, const char *method, const char *path, struct pen_error *err)
{
	struct pen_buf url;
	CURLcode code;

	pen_buf_init(&url, PEN_URL_BYTES_MAX);
	if (pen_buf_printf(&url, "%s%s",
		    pen_client_socket(client->url) ? "http://localhost" : client->url, path) < 0) {
		pen_buf_finish(&url);
		return pen_error_set(err, PEN_EIO, "the address is too long");
	}
	curl_easy_setopt(client->curl, CURLOPT_URL, url.data);
	curl_easy_setopt(client->curl, CURLOPT_CUSTOMREQUEST, method);
	code = transfer(client);
	pen_buf_finish(&url);
	if (code != CURLE_OK)
		return transfer_failure(client, code, err);
	client->answer = json_loadb(client->body.size ? client->body.data : "", client->body.size,
		JSON_REJECT_DUPLICATES, NULL);
	return status_of(client) / 100 == 2 ? 0 : refusal(client, err);
}

/* perform with a body of a media type. */
static int send_body(struct pen_client *client, const char *method, const char *path,
	const char *content_type, const void *body, size_t size, struct pen_error *err)
{
	struct curl_slist *headers = curl_slist_append(NULL, content_type);
	int r;

	if (!headers)
		return pen_error_memory(err);
	curl_easy_setopt(client->curl, CURLOPT_HTTPHEADER, headers);
	curl_easy_setopt(client->curl, CURLOPT_POSTFIELDS, body);
	curl_easy_setopt(client->curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)size);
	r = perform(client, method, path, err);
	curl_slist_free_all(headers);
	return r;
}

int pen_client_call(struct pen_client *client, const char *method, const char *path,
	const char *body, size_t size, struct pen_error *err)
{
	int r;

	prepare(client, -1);
	r = body ? send_body(
			   client, method, path, "Content-Type: application/json", body, size, err)
		 : perform(client, method, path, err);
	if (r == 0 && !json_is_object(client->answer))
		return pen_error_set(
			err, PEN_EPROTOCOL, "%s: the answer is not a JSON object", client->url);
	return r;
}

int pen_client_upload(struct pen_client *client, const char *path, const void *data, size_t size,
	const struct pen_client_watch *watch, struct pen_error *err)
{
	prepare(client, -1);
	client->watch = watch;
	return send_body(
		client, "PUT", path, "Content-Type: application/octet-stream", data, size, err);
}

int pen_client_download(struct pen_client *client, const char *path, int fd, struct pen_error *err)
{
	if (lseek(fd, 0, SEEK_SET) < 0 || ftruncate(fd, 0) < 0)
		return pen_error_system(err, errno, "rewind the image");
	prepare(client, fd);
	return perform(client, "GET", path, err);
}
