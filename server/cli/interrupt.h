/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_CLI_INTERRUPT_H
#define PEN_SERVER_CLI_INTERRUPT_H

#include <stdbool.h>
#include <stdint.h>

/*
 * From now on SIGINT, SIGTERM and SIGHUP raise a flag instead of ending the process, so that a
 * command can cancel its render and remove its files; SIGPIPE is ignored.
 */
void pen_interrupt_catch(void);

/* Whether one of them has come. */
bool pen_interrupted(void);

/* Sleeps, or returns at once when one comes. */
void pen_interrupt_sleep(int64_t ms);

#endif
