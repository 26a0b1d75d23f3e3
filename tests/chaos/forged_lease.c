/* SPDX-License-Identifier: Apache-2.0 */
/*
 * For the test of the simulation: a coordinator that takes every lease it has ever known for live.
 * The linker puts it in front of the real pen_sched_find_lease.
 */
#include "server/sched.h"

enum { REMEMBERED = 4096 };

const struct pen_sched_lease *__real_pen_sched_find_lease(
	const struct pen_sched *sched, uint64_t worker, uint64_t lease);
const struct pen_sched_lease *__wrap_pen_sched_find_lease(
	const struct pen_sched *sched, uint64_t worker, uint64_t lease);

const struct pen_sched_lease *__wrap_pen_sched_find_lease(
	const struct pen_sched *sched, uint64_t worker, uint64_t lease)
{
	static struct pen_sched_lease remembered[REMEMBERED];
	const struct pen_sched_lease *found = __real_pen_sched_find_lease(sched, worker, lease);
	struct pen_sched_lease *old = &remembered[lease % REMEMBERED];

	if (found)
		*old = *found;
	return found || old->id != lease ? found : old;
}
