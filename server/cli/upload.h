/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_UPLOAD_H
#define PEN_SERVER_CLI_UPLOAD_H

#include "server/cli/client.h"
#include "server/cli/progress.h"
#include "server/cli/source.h"

/* Uploads the files of source that the server does not have yet. */
int pen_upload_missing(struct pen_client *client, const struct pen_source *source,
	struct pen_progress *progress, struct pen_error *err);

#endif
