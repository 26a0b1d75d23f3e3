/* SPDX-License-Identifier: Apache-2.0 */
/*
 * One render from its acceptance to its end: its tiles are leased to workers, results are
 * committed, merged into the framebuffer and stored, while everything around fails.
 *
 * A lease is named by tile, round and epoch instead of by a number. The two are equally unique:
 * pen_backlog_return begins a new epoch and pen_backlog_merged a new round. Messages are bits in a
 * set, so they wait as long as they like and overtake each other, more than TCP would do to them.
 * Which worker gets which tile, when a step is taken and who is blamed is chosen freely: whatever
 * sched.c decides is among the choices.
 *
 * Spin looks at every run with at most FAULTS faults. Faults are finite in number, so no run is
 * unfair, and what is accepted must come to its end in all of them.
 *
 * For the test of the model: -DNO_LEASE_CHECK leaves out the check of pen_dispatch_result that the
 * result belongs to a live lease; -DNO_EXPIRY lets hung units live for ever.
 */
#ifndef FAULTS
#define FAULTS 2 /* in one run, of all kinds together */
#endif
#define WORKERS 3
#define TILES 2
#define ROUNDS 2
#define EPOCHS (FAULTS + 1)
#define BLAME_MAX 2 /* PEN_BLAME_MAX is 3, PEN_KILLS_MAX 20: so few faults would not reach them */
#define KILLS_MAX 1
#define NOBODY WORKERS
#define TORN 7 /* rounds in a framebuffer whose bytes fit no row */

/* Leases as bits */
#define KEY(t, r, e) (((t) * ROUNDS + (r)) * EPOCHS + (e))
#define BIT(key) (1 << (key))
#define TILE_OF(key) ((key) / (ROUNDS * EPOCHS))
#define ROUND_OF(key) ((key) / EPOCHS % ROUNDS)
#define EPOCH_OF(key) ((key) % EPOCHS)
#define LEASE_OF(t) BIT(KEY(t, round[t], epoch[t]))

/* What the coordinator knows: server/backlog.c, server/sched.c, server/run.c. */
mtype:phase = {WAITING, OUT, MERGING, WRITTEN, COMPLETE};
mtype:phase phase[TILES];
byte round[TILES], epoch[TILES], faults[TILES], kills[TILES];
byte holder[TILES]; /* the worker that holds the lease of a tile that is OUT */
mtype:job = {NONE, RENDERING, SYNCING, SYNCED, FAILING, CANCELLING, DONE, FAILED, CANCELLED};
mtype:job job = NONE;

/* What outlives it: server/store.c, server/canvas.c. */
mtype:job stored = NONE;
byte row[TILES], file[TILES]; /* rounds; a row is that of the last flush */
bool synced;

/* Of each worker: leases on their way to it, rendering, or with the result on its way back. */
int given[WORKERS];

byte left = FAULTS;
hidden byte key; /* used within a step only, so no part of the state */

#define OVER(state) (state == DONE || state == FAILED || state == CANCELLED)
#define ALL(what) (phase[0] == what && phase[1] == what)

/* A key of a set that is not empty: any. */
inline pick(set)
{
	key = 0;
	do
	:: set & BIT(key) -> break
	:: (set >> (key + 1)) != 0 -> key++
	od
}

/* drop_job of sched.c, and the canvas is halted: nothing of the job goes on. */
inline drop_job(verdict)
{
	job = verdict;
	phase[0] = WAITING;
	phase[1] = WAITING;
	holder[0] = NOBODY;
	holder[1] = NOBODY
}

/* requeue and end_lease of sched.c */
inline requeue(t)
{
	assert(phase[t] == OUT && epoch[t] + 1 < EPOCHS);
	phase[t] = WAITING;
	holder[t] = NOBODY;
	epoch[t]++
}

inline blame(t)
{
	if
	:: faults[t] == BLAME_MAX - 1 -> drop_job(FAILING)
	:: else -> faults[t]++; requeue(t)
	fi
}

/* lose_unit of sched.c, for a fault of each kind */
inline lose_unit(t)
{
	if
	:: requeue(t) /* RETURNED */
	:: kills[t] < KILLS_MAX -> kills[t]++; requeue(t) /* KILLED */
	:: kills[t] == KILLS_MAX -> blame(t)
	:: blame(t) /* OWN */
	:: drop_job(FAILING) /* SCENE */
	fi
}

/* handle_result of sched.c; asserts what is promised, whatever was let by. */
inline commit(w, t, r, e)
{
	assert(phase[t] == OUT && holder[t] == w);
	assert(round[t] == r && epoch[t] == e);
	phase[t] = MERGING;
	holder[t] = NOBODY
}

#define LIVE(w, t, r, e) (phase[t] == OUT && round[t] == r && holder[t] == w && epoch[t] == e)
#ifdef NO_LEASE_CHECK
#define ACCEPTED(w, t, r, e) (phase[t] == OUT && round[t] == r)
#else
#define ACCEPTED(w, t, r, e) LIVE(w, t, r, e)
#endif

/* pen_dispatch_result: it counts, is invalid, or comes too late. */
inline deliver(w, t, r, e)
{
	if
	:: ACCEPTED(w, t, r, e) -> commit(w, t, r, e)
	:: LIVE(w, t, r, e) && left > 0 -> left--; lose_unit(t) /* or pen_dispatch_failure */
	:: !ACCEPTED(w, t, r, e)
	fi
}

/* grant of sched.c; of workers with nothing to do, which are all the same, to the first. */
inline grant(t)
{
	if
	:: holder[t] = 0
	:: given[0] != 0 || given[1] != 0 -> holder[t] = 1
	:: given[2] != 0 || (given[0] != 0 && given[1] != 0) -> holder[t] = 2
	fi;
	phase[t] = OUT;
	given[holder[t]] = given[holder[t]] | LEASE_OF(t)
}

/* handle_merged of sched.c; after the last unit PEN_SCHED_RENDERED. */
inline merged(t)
{
	round[t]++;
	epoch[t] = 0; /* the round tells the leases apart */
	faults[t] = 0;
	kills[t] = 0;
	phase[t] = (round[t] < ROUNDS -> WAITING : COMPLETE);
	if
	:: ALL(COMPLETE) -> job = SYNCING
	:: else
	fi
}

/* handle_leave of sched.c; the worker is back at once: being away is being slow. */
inline leave(w)
{
	given[w] = 0;
	if
	:: job == RENDERING && holder[0] == w -> lose_unit(0)
	:: else
	fi;
	if
	:: job == RENDERING && holder[1] == w -> lose_unit(1)
	:: else
	fi
}

/* check_file of canvas.c: what does not fit its row starts again; after a power cut, anything. */
inline recover_tile(t)
{
	if
	:: file[t] == row[t] -> round[t] = row[t]
	:: file[t] != row[t] || !synced -> round[t] = 0; file[t] = TORN
	fi;
	phase[t] = (round[t] < ROUNDS -> WAITING : COMPLETE);
	epoch[t] = 0;
	faults[t] = 0;
	kills[t] = 0;
	holder[t] = NOBODY
}

/* load_job of job.c, pen_run_begin and handle_opened of run.c; no connection outlives the old one */
inline restart()
{
	job = stored;
	if
	:: job == RENDERING ->
		recover_tile(0);
		recover_tile(1);
		if
		:: ALL(COMPLETE) -> job = SYNCING
		:: else
		fi
	:: else
	fi;
	given[0] = 0;
	given[1] = 0;
	given[2] = 0
}

/* The end is stored, then shown; late messages change nothing any more. */
inline end_job(state)
{
	stored = state;
	job = state;
	round[0] = 0; round[1] = 0;
	row[0] = 0; row[1] = 0;
	file[0] = 0; file[1] = 0;
	phase[0] = WAITING; phase[1] = WAITING;
	epoch[0] = 0; epoch[1] = 0;
	faults[0] = 0; faults[1] = 0;
	kills[0] = 0; kills[1] = 0;
	given[0] = 0; given[1] = 0; given[2] = 0;
	left = 0;
	synced = false
}

active [WORKERS] proctype worker()
{
end:
	do
	:: atomic { given[_pid] != 0 ->
		pick(given[_pid]);
		if
		:: given[_pid] = given[_pid] & ~BIT(key)
		:: left > 0 -> left-- /* and comes again */
		fi;
		deliver(_pid, TILE_OF(key), ROUND_OF(key), EPOCH_OF(key)) }
	:: atomic { given[_pid] != 0 && left > 0 -> /* it hangs, or the message is lost */
		left--;
		pick(given[_pid]);
		given[_pid] = given[_pid] & ~BIT(key) }
	:: atomic { given[_pid] != 0 && left > 0 -> left--; leave(_pid) }
	od
}

#define t (_pid - WORKERS)
active [TILES] proctype tile()
{
end:
	do
	:: atomic { job == RENDERING && phase[t] == WAITING -> grant(t) }
#ifndef NO_EXPIRY
	:: atomic { job == RENDERING && phase[t] == OUT && !(given[holder[t]] & LEASE_OF(t)) -> lose_unit(t) } /* expire */
#endif
	:: atomic { job == RENDERING && phase[t] == OUT && left > 0 -> /* it was only slow */
		left--; lose_unit(t) }
	:: d_step { job == RENDERING && phase[t] == MERGING -> /* pen_framebuf_merge */
		assert(round[t] == 0 || file[t] == round[t]);
		file[t] = round[t] + 1;
		synced = false;
		phase[t] = WRITTEN }
	:: atomic { job == RENDERING && phase[t] == WRITTEN -> merged(t) }
	:: d_step { (job == RENDERING || job == SYNCING) && round[t] > 0 && row[t] != round[t] ->
		row[t] = round[t] } /* pen_tiles_flush */
	od
}

#undef t

active proctype render()
{
end:
	do
	:: d_step { job == NONE -> job = RENDERING; stored = RENDERING; /* 202 Accepted */
		holder[0] = NOBODY; holder[1] = NOBODY; phase[0] = WAITING; phase[1] = WAITING }
	:: d_step { job == SYNCING -> synced = true; job = SYNCED } /* pen_canvas_sync */
	:: d_step { job == SYNCED -> /* pen_run_store_state and its answer */
		assert(file[0] == ROUNDS && file[1] == ROUNDS && synced);
		end_job(DONE) }
	:: d_step { job == FAILING -> end_job(FAILED) }
	:: d_step { job == CANCELLING -> end_job(CANCELLED) }
	:: atomic { (job == RENDERING || job == SYNCING) && left > 0 ->
		left--; drop_job(CANCELLING) } /* pen_jobs_set_state */
	:: atomic { job == RENDERING && left > 0 && (phase[0] == OUT || phase[1] == OUT) ->
		left--; /* paused and resumed: revoke_all */
		if
		:: phase[0] == OUT -> requeue(0)
		:: else
		fi;
		if
		:: phase[1] == OUT -> requeue(1)
		:: else
		fi }
	:: atomic { stored != NONE && left > 0 -> left--; restart() }
	od
}

/* What is accepted comes to an end, and what has ended stays ended. */
#define accepted (stored != NONE)
#define over OVER(stored)
ltl ends { [] (accepted -> <> [] over) }
