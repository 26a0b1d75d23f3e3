/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/session.h"

#include "server/cli/cli.h"
#include "server/cli/interrupt.h"

#include <string.h>

bool pen_session_open(struct pen_session *session, const struct pen_usage *usage, int argc,
	char **argv, int *ret_exit)
{
	int r;

	*session = (struct pen_session){.err = PEN_ERROR_INIT};
	if (!pen_options_parse(&session->options, usage, argc, argv, ret_exit))
		return false;
	pen_interrupt_catch();
	r = pen_credentials_read(session->options.token_file, session->options.ca_file,
		&session->credentials, &session->err);
	if (r == 0)
		r = pen_credentials_check(
			&session->credentials, session->options.server, &session->err);
	if (r == 0)
		r = pen_client_create(session->options.server, &session->credentials,
			&session->client, &session->err);
	if (r == 0)
		return true;
	*ret_exit = pen_session_close(session, r);
	return false;
}

int pen_session_close(struct pen_session *session, int r)
{
	int code = r < 0 ? pen_cli_fail(session->client, &session->err) : PEN_EXIT_OK;

	pen_client_destroy(session->client);
	explicit_bzero(&session->credentials, sizeof session->credentials);
	pen_options_finish(&session->options);
	return code;
}
