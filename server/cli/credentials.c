/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/credentials.h"

#include "server/cli/client.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

/* NULL when it is not set, or empty. */
static const char *variable(const char *name)
{
	const char *value = getenv(name);

	return value && *value ? value : NULL;
}

static int take_token(const char *text, const char *source, char *ret_token, struct pen_error *err)
{
	size_t length = strcspn(text, "\r\n");

	for (size_t i = 0; i < length; i++)
		if (text[i] <= ' ' || text[i] > '~')
			length = 0;
	if (length == 0)
		return pen_error_set(err, PEN_EINVALID, "%s holds no token", source);
	memcpy(ret_token, text, length);
	ret_token[length] = '\0';
	return 0;
}

static int read_token(const char *path, char *ret_token, struct pen_error *err)
{
	char line[PEN_CREDENTIAL_MAX + 1] = "";
	FILE *file = fopen(path, "re");
	int r;

	if (!file)
		return pen_error_system(err, errno, "cannot open %s", path);
	/* Without a buffer of the library's, which would keep the secret. */
	(void)setvbuf(file, NULL, _IONBF, 0);
	r = fgets(line, sizeof line, file) || !ferror(file)
		    ? take_token(line, path, ret_token, err)
		    : pen_error_system(err, errno, "cannot read %s", path);
	(void)fclose(file);
	explicit_bzero(line, sizeof line);
	return r;
}

int pen_credentials_read(const char *token_file, const char *ca_file,
	struct pen_credentials *ret_credentials, struct pen_error *err)
{
	const char *path = token_file ? token_file : variable("PENUMBRA_TOKEN_FILE");
	const char *token = variable("PENUMBRA_TOKEN");

	*ret_credentials = (struct pen_credentials){
		.ca_file = ca_file ? ca_file : variable("PENUMBRA_CA_FILE")};
	if (path)
		return read_token(path, ret_credentials->token, err);
	if (!token)
		return 0;
	if (strlen(token) > PEN_CREDENTIAL_MAX)
		return pen_error_set(err, PEN_EINVALID, "$PENUMBRA_TOKEN holds no token");
	return take_token(token, "$PENUMBRA_TOKEN", ret_credentials->token, err);
}

static bool is_local(const char *host)
{
	static const char *const names[] = {"127.0.0.1", "localhost", "[::1]"};

	for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
		size_t length = strlen(names[i]);

		if (strncasecmp(host, names[i], length) == 0 &&
			(host[length] == '\0' || strchr(":/?#", host[length])))
			return true;
	}
	return false;
}

int pen_credentials_check(
	const struct pen_credentials *credentials, const char *url, struct pen_error *err)
{
	const char *host = strstr(url, "://");

	host = host ? host + strlen("://") : url;
	if (credentials->token[0] == '\0' || strncasecmp(url, "https://", 8) == 0 ||
		pen_client_socket(url) ||
		(!memchr(host, '@', strcspn(host, "/?#")) && is_local(host)))
		return 0;
	return pen_error_set(err, PEN_EINVALID,
		"the token would cross the network in the clear: name the server as https://");
}
