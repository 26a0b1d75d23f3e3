/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CONFINE_H
#define PEN_SERVER_CONFINE_H

#include "core/base/error.h"
#include "core/base/sandbox.h"
#include "server/config.h"

/*
 * How strictly this coordinator's encoders and its own worker are confined: as --sandbox says, or
 * else PEN_SANDBOX_REQUIRE once others can reach HTTP, which listens at http, or the port for
 * workers, and PEN_SANDBOX_BEST_EFFORT before.
 */
enum pen_sandbox_mode pen_confine_mode(
	const struct pen_config *config, const struct sockaddr_storage *http);

/*
 * Tries out the sandbox. What this machine lacks is an error, PEN_EUNSUPPORTED with the cure, when
 * mode requires it, and else a warning in the log.
 */
int pen_confine_check(enum pen_sandbox_mode mode, struct pen_error *err);

#endif
