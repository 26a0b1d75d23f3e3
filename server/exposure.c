/* SPDX-License-Identifier: Apache-2.0 */
#include "server/exposure.h"

#include "server/config.h"

#include <stddef.h>

int pen_exposure_check_http(const struct sockaddr_storage *address, bool has_tls, uint32_t tokens,
	struct pen_error *err)
{
	static const char *const missing[2][2] = {
		{"TLS (penumbra cert HOST makes a certificate; then --tls-cert and --tls-key) and "
		 "a token (penumbra token add NAME)",
			"TLS: penumbra cert HOST makes a certificate; then --tls-cert and "
			"--tls-key"},
		{"a token: penumbra token add NAME", NULL},
	};

	if (pen_config_is_loopback(address) || (has_tls && tokens > 0))
		return 0;
	return pen_error_set(err, PEN_EINVALID, "HTTP on an address that others can reach needs %s",
		missing[has_tls][tokens > 0]);
}

int pen_exposure_check_workers(
	const struct sockaddr_storage *address, uint32_t keys, struct pen_error *err)
{
	if (pen_config_is_loopback(address) || keys > 0)
		return 0;
	return pen_error_set(err, PEN_EINVALID,
		"--worker-listen on an address that others can reach needs a key for each worker: "
		"penumbra worker add NAME");
}
