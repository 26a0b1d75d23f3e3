/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_BASE_SANDBOX_PROBE_H
#define PEN_BASE_SANDBOX_PROBE_H

#include "core/base/sandbox.h"

/*
 * Shows, before anything from outside is read, that the sandbox confines on this machine: children
 * enter it as pen_sandbox_enter does with REQUIRE, and each then tries one thing that must fail
 * (open, socket, execve, ptrace, kill, memory to execute, io_uring). The kernel may log their ends
 * by SIGSYS, as of "pen-probe".
 *
 * PEN_EUNSUPPORTED tells what the kernel lacks, or what was possible inside. Takes no longer than
 * PEN_SANDBOX_PROBE_MS; waits for its own children alone. In builds with a sanitizer, which have no
 * sandbox, it does nothing.
 */
int pen_sandbox_probe(enum pen_sandbox_profile profile, struct pen_error *err);

#endif
