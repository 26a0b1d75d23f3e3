/* SPDX-License-Identifier: Apache-2.0 */
#include "server/sched_state.h"

/* What becomes of a result. */
enum verdict {
	COMMIT,	     /* unseen by any other */
	CONFIRM,     /* it counts, and another has found the same, or trust decides */
	ASK_ANOTHER, /* its digest is remembered */
	REJECT,	     /* it is wrong */
	GIVE_UP	     /* three disagree */
};

/* A bit for each worker, or for a few of a very large farm. */
static uint64_t bit_of(uint64_t worker)
{
	return 1ull << worker % 64;
}

/* splitmix64 (Steele, Lea, Flood 2014) */
static uint64_t scramble(uint64_t x)
{
	x += 0x9e3779b97f4a7c15u;
	x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
	x = (x ^ x >> 27) * 0x94d049bb133111ebu;
	return x ^ x >> 31;
}

/* Whether a unit is to be rendered once more. Nobody who does not know the secret can tell. */
static bool wants_audit(const struct pen_sched *sched, const struct pen_sched_turn *job,
	const struct pen_sched_hand *worker, uint64_t lease)
{
	const uint32_t interval =
		worker->audits < PEN_AUDIT_INTERVAL ? worker->audits : PEN_AUDIT_INTERVAL;

	if (job->verify == PEN_VERIFY_NONE)
		return false;
	return job->verify == PEN_VERIFY_FULL || worker->audits < PEN_AUDITS_FIRST ||
	       scramble(sched->secret ^ scramble(lease)) % interval == 0;
}

static void credit(struct pen_sched *sched, uint64_t id, const struct pen_sched_hand *other)
{
	struct pen_sched_hand *worker = pen_sched_find_worker(sched, id);

	if (worker && worker != other && worker->audits < UINT32_MAX)
		worker->audits++;
}

/* Renders that hold anything of the worker's that nobody has checked start again. */
static void redo_unaudited(struct pen_sched *sched, uint64_t worker)
{
	for (size_t i = sched->job_count; i-- > 0;) {
		struct pen_sched_turn *job = sched->jobs[i];

		if (!(job->unaudited & bit_of(worker)))
			continue;
		pen_sched_drop_job(sched, job);
		(void)pen_sched_act(sched, PEN_SCHED_TAINTED, job);
	}
}

/* Of each frame in flight where workers have opinions. */
static void for_opinions(struct pen_sched *sched, uint64_t worker,
	void (*call)(struct pen_backlog *backlog, uint64_t worker))
{
	for (size_t i = 0; i < sched->job_count; i++) {
		const struct pen_reel *reel = &sched->jobs[i]->reel;

		for (uint32_t frame = reel->first;
			sched->jobs[i]->verify != PEN_VERIFY_NONE && frame < reel->open; frame++)
			call(pen_reel_backlog(reel, frame), worker);
	}
}

/*
 * Nothing it has said counts any more. One that contradicts itself alone may have had bad luck;
 * what it did before is as doubtful.
 */
static void punish(struct pen_sched *sched, uint64_t liar, bool itself)
{
	struct pen_sched_hand *worker = pen_sched_find_worker(sched, liar);

	for_opinions(sched, liar, pen_backlog_retract);
	if (worker) {
		worker->audits = 0;
		if (itself)
			pen_sched_strike(sched, worker);
		else
			pen_sched_quarantine(sched, worker, true);
	}
	redo_unaudited(sched, liar);
}

/* Two do not agree, and the one that is trusted more, if either is, has it right. */
static enum verdict judge_two(struct pen_sched *sched, const struct pen_sched_hand *worker,
	struct pen_backlog *backlog, uint32_t tile, uint64_t digest, uint64_t *ret_liar)
{
	const uint64_t first = pen_backlog_opinion(backlog, tile, 0)->worker;
	const struct pen_sched_hand *other = pen_sched_find_worker(sched, first);

	if (first == worker->id || (other && other->trusted && !worker->trusted)) {
		*ret_liar = worker->id;
		return REJECT;
	}
	if (worker->trusted && (!other || !other->trusted)) {
		*ret_liar = first;
		return CONFIRM;
	}
	pen_backlog_opine(backlog, tile, worker->id, digest);
	return ASK_ANOTHER;
}

/* *ret_liar: who is to be punished when that is done; 0 = nobody. */
static enum verdict judge(struct pen_sched *sched, const struct pen_sched_turn *job,
	const struct pen_sched_hand *worker, const struct pen_sched_lease *lease, uint64_t digest,
	uint64_t *ret_liar)
{
	struct pen_backlog *backlog = pen_reel_backlog(&job->reel, lease->frame);
	const uint32_t count = pen_backlog_opinions(backlog, lease->tile);

	*ret_liar = 0;
	if (count == 0 && !pen_backlog_ghost(backlog, lease->tile) &&
		!wants_audit(sched, job, worker, lease->id))
		return COMMIT;
	for (uint32_t i = 0; i < count; i++) {
		const struct pen_backlog_opinion *opinion =
			pen_backlog_opinion(backlog, lease->tile, i);

		if (opinion->digest != digest)
			continue;
		if (count == 2)
			*ret_liar = pen_backlog_opinion(backlog, lease->tile, 1 - i)->worker;
		credit(sched, opinion->worker, worker);
		if (opinion->worker == worker->id)
			return COMMIT;
		credit(sched, worker->id, NULL);
		return CONFIRM;
	}
	if (count == 0) {
		pen_backlog_opine(backlog, lease->tile, worker->id, digest);
		return ASK_ANOTHER;
	}
	return count == 1 ? judge_two(sched, worker, backlog, lease->tile, digest, ret_liar)
			  : GIVE_UP;
}

bool pen_sched_may_opine(const struct pen_sched *sched, const struct pen_sched_turn *job,
	const struct pen_backlog *backlog, uint32_t tile, const struct pen_sched_hand *worker)
{
	const uint32_t count = pen_backlog_opinions(backlog, tile);

	if (count == 0 || !pen_backlog_has_opinion(backlog, tile, worker->id))
		return true;
	/*
	 * Better the same worker again than never: that finds what chance does to its memory. Nor
	 * is one that failed at the tile another: it would go on until the job fails.
	 */
	for (size_t i = 0; count == 1 && i < sched->worker_count; i++)
		if (pen_sched_serves(sched->workers[i], job) && sched->workers[i] != worker &&
			!pen_backlog_failed_on(backlog, tile, sched->workers[i]->id))
			return false;
	return count == 1;
}

/* Three workers had three opinions of a unit, or two had two and there is no third. */
static void fail_disputed(
	struct pen_sched *sched, struct pen_sched_turn *job, uint32_t frame, uint32_t tile)
{
	const struct pen_backlog *backlog = pen_reel_backlog(&job->reel, frame);

	(void)pen_error_set(&job->reason, PEN_EIO,
		"workers %llu and %llu disagree about tile %u of frame %u, and no third one agrees "
		"with either: look at these machines, or add others",
		(unsigned long long)pen_backlog_opinion(backlog, tile, 0)->worker,
		(unsigned long long)pen_backlog_opinion(backlog, tile, 1)->worker, tile, frame);
	pen_sched_fail_job(sched, job);
}

void pen_sched_take_result(struct pen_sched *sched, struct pen_sched_hand *worker,
	struct pen_sched_lease *lease, uint64_t digest)
{
	struct pen_sched_turn *job = pen_sched_job_of(sched, lease);
	const struct pen_backlog *backlog = pen_reel_backlog(&job->reel, lease->frame);
	const uint32_t frame = lease->frame, tile = lease->tile;
	const struct pen_backlog_opinion *ghost = pen_backlog_ghost(backlog, tile);
	uint64_t liar;
	const enum verdict verdict = judge(sched, job, worker, lease, digest, &liar);
	const bool itself = liar == worker->id && pen_backlog_has_opinion(backlog, tile, liar);
	const uint64_t past_liar =
		verdict == CONFIRM && ghost && ghost->digest != digest ? ghost->worker : 0;

	if (verdict == COMMIT)
		job->unaudited |= bit_of(worker->id);
	if (verdict == COMMIT || verdict == CONFIRM)
		pen_sched_win(sched, worker, lease);
	else
		pen_sched_defer(sched, worker, lease);
	if (verdict == GIVE_UP)
		fail_disputed(sched, job, frame, tile);
	if (liar != 0)
		punish(sched, liar, itself);
	if (past_liar != 0)
		punish(sched, past_liar, false);
}

void pen_sched_take_leave(struct pen_sched *sched, uint64_t worker)
{
	for_opinions(sched, worker, pen_backlog_depart);
}

/* Whether a tile waits for a third opinion that nobody who is there can give. */
static bool is_disputed(const struct pen_sched *sched, const struct pen_sched_turn *job,
	const struct pen_backlog *backlog, uint32_t tile)
{
	if (pen_backlog_opinions(backlog, tile) < PEN_BACKLOG_OPINIONS)
		return false;
	for (size_t i = 0; i < sched->worker_count; i++)
		if (pen_sched_serves(sched->workers[i], job) &&
			pen_sched_may_opine(sched, job, backlog, tile, sched->workers[i]))
			return false;
	return true;
}

static bool find_disputed(const struct pen_sched *sched, const struct pen_sched_turn *job,
	uint32_t *ret_frame, uint32_t *ret_tile)
{
	for (uint32_t frame = job->reel.first; frame < job->reel.open; frame++) {
		const struct pen_backlog *backlog = pen_reel_backlog(&job->reel, frame);

		for (uint32_t i = 0; i < backlog->waiting.count; i++) {
			const uint32_t tile = pen_tile_queue_at(&backlog->waiting, i);

			if (!is_disputed(sched, job, backlog, tile))
				continue;
			*ret_frame = frame;
			*ret_tile = tile;
			return true;
		}
	}
	return false;
}

void pen_sched_check_disputes(struct pen_sched *sched)
{
	uint32_t frame, tile;

	for (size_t i = sched->job_count; i-- > 0;) {
		struct pen_sched_turn *job = sched->jobs[i];

		if (job->verify == PEN_VERIFY_NONE || !find_disputed(sched, job, &frame, &tile))
			job->disputed_ms = -1;
		else if (job->disputed_ms < 0)
			job->disputed_ms = sched->now_ms;
		else if (sched->now_ms - job->disputed_ms >= PEN_CLASS_ABSENT_MS)
			fail_disputed(sched, job, frame, tile);
	}
}
