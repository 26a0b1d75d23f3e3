/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_WORKER_BLAME_H
#define PEN_WORKER_BLAME_H

#include "proto/msg.h"

enum { PEN_BLAME_TEXT = 128 };

/*
 * Whose fault the end of a process was, from its wait status: PEN_FAULT_KILLED when somebody
 * outside ended or stopped it, PEN_FAULT_SCENE when an image took too much of the processor, else
 * PEN_FAULT_CRASH. ret_reason (PEN_BLAME_TEXT characters) is for
 * people: "render process ended by SIGSEGV".
 */
enum pen_fault pen_blame_of(const char *process, int status, char *ret_reason);

#endif
