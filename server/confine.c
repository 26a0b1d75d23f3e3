/* SPDX-License-Identifier: Apache-2.0 */
#include "server/confine.h"

#include "core/base/log.h"
#include "core/base/sandbox_probe.h"

enum pen_sandbox_mode pen_confine_mode(
	const struct pen_config *config, const struct sockaddr_storage *http)
{
	if (config->has_sandbox)
		return config->sandbox;
	return pen_config_is_loopback(http) && pen_config_is_loopback(&config->worker_listen)
		       ? PEN_SANDBOX_BEST_EFFORT
		       : PEN_SANDBOX_REQUIRE;
}

int pen_confine_check(enum pen_sandbox_mode mode, struct pen_error *err)
{
	struct pen_error fault = PEN_ERROR_INIT;

	if (mode == PEN_SANDBOX_OFF) {
		pen_log(PEN_LOG_WARNING, "--sandbox off: scenes and images are read with this "
					 "user's rights");
		return 0;
	}
	if (pen_sandbox_probe(PEN_SANDBOX_ENCODER, &fault) == 0)
		return 0;
	if (mode == PEN_SANDBOX_REQUIRE)
		return pen_error_set(err, fault.code,
			"%.300s; without it nothing is rendered for others, unless --sandbox "
			"best-effort says that this is meant",
			fault.text);
	pen_log(PEN_LOG_WARNING, "%s; going on with what there is", fault.text);
	return 0;
}
