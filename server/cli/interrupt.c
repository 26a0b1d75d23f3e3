/* SPDX-License-Identifier: Apache-2.0 */
#include "server/cli/interrupt.h"

#include <signal.h>
#include <time.h>

static volatile sig_atomic_t interrupted;

static void handle_signal(int number)
{
	(void)number;
	interrupted = 1;
}

void pen_interrupt_catch(void)
{
	static const int signals[] = {SIGINT, SIGTERM, SIGHUP};
	struct sigaction action = {.sa_handler = handle_signal};

	for (size_t i = 0; i < sizeof signals / sizeof *signals; i++)
		(void)sigaction(signals[i], &action, NULL);
	action.sa_handler = SIG_IGN;
	(void)sigaction(SIGPIPE, &action, NULL);
}

bool pen_interrupted(void)
{
	return interrupted;
}

void pen_interrupt_sleep(int64_t ms)
{
	struct timespec span = {.tv_sec = ms / 1000, .tv_nsec = ms % 1000 * 1000000};

	if (!interrupted)
		(void)nanosleep(&span, NULL);
}
