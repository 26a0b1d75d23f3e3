/* SPDX-License-Identifier: Apache-2.0 */
#include "worker/blame.h"

#include "core/base/limits.h"

#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>

static enum pen_fault fault_of(int signal_number)
{
	switch (signal_number) {
	case SIGHUP:
	case SIGINT:
	case SIGKILL:
	case SIGQUIT:
	case SIGTERM: return PEN_FAULT_KILLED;
	default: return PEN_FAULT_CRASH;
	}
}

enum pen_fault pen_blame_of(const char *process, int status, char *ret_reason)
{
	if (WIFSTOPPED(status)) {
		(void)snprintf(ret_reason, PEN_BLAME_TEXT, "%s stopped from outside", process);
		return PEN_FAULT_KILLED;
	}
	if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) {
		(void)snprintf(ret_reason, PEN_BLAME_TEXT,
			"an image of the scene took more than %u s to decode", PEN_PICTURE_CPU_S);
		return PEN_FAULT_SCENE;
	}
	if (WIFSIGNALED(status)) {
		const char *name = sigabbrev_np(WTERMSIG(status));

		(void)snprintf(ret_reason, PEN_BLAME_TEXT, "%s ended by SIG%s", process,
			name ? name : "?");
		return fault_of(WTERMSIG(status));
	}
	(void)snprintf(ret_reason, PEN_BLAME_TEXT, "%s ended with status %d", process,
		WEXITSTATUS(status));
	return PEN_FAULT_CRASH;
}
