/* SPDX-License-Identifier: Apache-2.0 */
/*
 * How wrong pixels are found in one render: server/sched_audit.c with what it needs of leases. Of
 * three workers the first lies, whenever it likes, the same way or another; any may be away, leave,
 * come again (under another id, as every connection has), or be slow. LEASES are named by nothing but
 * whether they live: lease.pml shows that a coordinator can tell. Which units are audited under
 * "spot", when the liar is convicted by another render, and who gets which unit is chosen freely.
 *
 * What is promised while one machine alone lies:
 *  - no pixel counts that only one worker has seen, under "full" and with another at hand;
 *  - no honest worker is convicted, and no three disagree;
 *  - a render that is done has no wrong pixel of a worker that was convicted before;
 *  - what is accepted ends.
 *
 * For the test of the model, each leaves out a part: -DNO_LEASE_CHECK, a result counts only while
 * its lease lives; -DNO_REDO, unaudited pixels of a liar are made again; -DSAME_WORKER, the second
 * opinion is another worker's; -DSELF_IS_ANOTHER, what a worker alone has confirmed itself is
 * unaudited; -DOPINIONS_STAY, the word of one who has left counts no more; -DRESTART_FORGETS, after
 * a restart all pixels there are unaudited.
 */
#ifndef FAULTS
#define FAULTS 2 /* in one run: of leases, messages, connections, the coordinator; convictions */
#endif
#ifndef LIES
#define LIES 3 /* in one run */
#endif
#define WORKERS 3
#define LIAR 0
#define TILES 2
#define NOBODY 15
#define EARLIER 14 /* whoever it was, in an earlier life of the coordinator */
#define EVERYBODY 32767

#define RIGHT 0
#define NOTHING 3 /* 1 and 2: wrong */
#define WRONG(value) (value == 1 || value == 2)

/* An id is never used twice: a worker that comes again is another one. */
#define ID(w) ((w) + WORKERS * comings[w])
#define SLOT(id) ((id) % WORKERS)
#define BIT(id) (1 << (id))

mtype:verify = {NONE, SPOT, FULL};
mtype:verify verify;
mtype:job = {CREATED, RENDERING, DONE, FAILED};
mtype:job job = CREATED;
byte trusted = NOBODY; /* a slot: the operator's own machine */

/* Of each worker */
bool here[WORKERS];
byte comings[WORKERS];
byte live[WORKERS], stale[WORKERS]; /* leases it has, as bits: that count, that were taken away */
short convicted;		    /* ids */

/* Of each tile */
byte holder[TILES];
bool alone[TILES]; /* nobody else could have had its lease */
byte opinions[TILES], opinion0[TILES], opinion1[TILES], said0[TILES], said1[TILES];
byte ghost[TILES], ghost_said[TILES]; /* the opinion of one who has left */
byte pixels[TILES], by[TILES];

short unaudited; /* ids */
byte left = FAULTS, lies = LIES;
hidden byte value, liar, gone, other, i; /* used within a step only, so no part of the state */
hidden byte agrees, itself;

#define TAKES(w) (here[w] && !(convicted & BIT(ID(w))))
#define OTHERS(w) \
	((w != 0 && TAKES(0)) || (w != 1 && TAKES(1)) || (w != 2 && TAKES(2)))
#define HAS_OPINION(w, t) \
	((opinions[t] > 0 && opinion0[t] == ID(w)) || (opinions[t] > 1 && opinion1[t] == ID(w)))

/* pen_sched_may_opine */
#ifdef SAME_WORKER
#define MAY_OPINE(w, t) true
#else
#define MAY_OPINE(w, t) (!HAS_OPINION(w, t) || (opinions[t] == 1 && !OTHERS(w)))
#endif

/* The unit waits again; what its worker still sends comes too late. */
inline requeue(t)
{
	if
	:: holder[t] != NOBODY && (live[holder[t]] & BIT(t)) ->
		live[holder[t]] = live[holder[t]] & ~BIT(t);
		stale[holder[t]] = stale[holder[t]] | BIT(t)
	:: else
	fi;
	holder[t] = NOBODY;
	alone[t] = false
}

inline forget(t)
{
	opinions[t] = 0;
	opinion0[t] = 0; opinion1[t] = 0; said0[t] = 0; said1[t] = 0;
	ghost[t] = NOBODY;
	ghost_said[t] = 0
}

/* pen_backlog_retract */
inline retract(t, id)
{
	if
	:: opinions[t] > 1 && opinion1[t] == id ->
		opinions[t]--; opinion1[t] = 0; said1[t] = 0
	:: else
	fi;
	if
	:: opinions[t] > 0 && opinion0[t] == id ->
		opinions[t]--;
		opinion0[t] = opinion1[t]; said0[t] = said1[t];
		opinion1[t] = 0; said1[t] = 0
	:: else
	fi
}

/* Its word stays to be held against it, and counts no more: it may be who comes next. */
inline depart(t, id)
{
#ifndef OPINIONS_STAY
	if
	:: opinions[t] > 0 && opinion0[t] == id -> ghost[t] = id; ghost_said[t] = said0[t]
	:: opinions[t] > 1 && opinion1[t] == id -> ghost[t] = id; ghost_said[t] = said1[t]
	:: else
	fi;
	retract(t, id)
#else
	skip
#endif
}

inline start_again()
{
	requeue(0); requeue(1);
	forget(0); forget(1);
	pixels[0] = NOTHING; pixels[1] = NOTHING;
	by[0] = NOBODY; by[1] = NOBODY;
	unaudited = 0
}

/* punish; of one that contradicts itself the last strike of three is the conviction. */
inline punish(id)
{
	assert(SLOT(id) == LIAR);
	retract(0, id);
	retract(1, id);
	if
	:: itself
	:: true ->
		convicted = convicted | BIT(id);
		if
		:: holder[0] == SLOT(id) && ID(LIAR) == id -> requeue(0)
		:: else
		fi;
		if
		:: holder[1] == SLOT(id) && ID(LIAR) == id -> requeue(1)
		:: else
		fi
	fi;
#ifndef NO_REDO
	if
	:: unaudited & BIT(id) -> start_again()
	:: else
	fi
#else
	skip
#endif
}

inline commit(w, t, is_checked)
{
	assert(holder[t] == w && !(convicted & BIT(ID(w))));
	assert(!(is_checked && WRONG(value)));
	assert(verify != FULL || is_checked || alone[t]);
	pixels[t] = value;
	by[t] = ID(w);
	holder[t] = NOBODY;
	alone[t] = false
}

/* judge and pen_sched_take_result */
inline take_result(w, t)
{
	liar = NOBODY;
	gone = NOBODY;
	itself = false;
	agrees = (opinions[t] > 0 && said0[t] == value) || (opinions[t] > 1 && said1[t] == value);
	if
	:: agrees ->
		other = (opinions[t] > 0 && said0[t] == value -> opinion0[t] : opinion1[t]);
		if
		:: opinions[t] == 2 -> liar = (other == opinion0[t] -> opinion1[t] : opinion0[t])
		:: else
		fi;
		if
		:: other != ID(w) && ghost[t] != NOBODY && ghost_said[t] != value -> gone = ghost[t]
		:: else
		fi;
#ifdef SELF_IS_ANOTHER
		commit(w, t, other != ID(w));
#else
		if
		:: other == ID(w) -> unaudited = unaudited | BIT(other)
		:: else
		fi;
		commit(w, t, other != ID(w));
#endif
		forget(t)
	:: opinions[t] == 0 && ghost[t] == NOBODY && verify != FULL -> /* not wants_audit */
		unaudited = unaudited | BIT(ID(w));
		commit(w, t, false)
	:: opinions[t] == 0 && verify != NONE -> /* ASK_ANOTHER */
		opinions[t] = 1;
		opinion0[t] = ID(w);
		said0[t] = value;
		requeue(t)
	:: !agrees && opinions[t] == 1 -> /* judge_two */
		other = SLOT(opinion0[t]);
		if
		:: opinion0[t] == ID(w) -> liar = ID(w); itself = true; requeue(t)
		:: opinion0[t] != ID(w) && ID(other) == opinion0[t] && here[other] && other == trusted ->
			liar = ID(w);
			requeue(t)
		:: opinion0[t] != ID(w) && w == trusted ->
			liar = opinion0[t];
			if
			:: ghost[t] != NOBODY && ghost_said[t] != value -> gone = ghost[t]
			:: else
			fi;
			commit(w, t, true);
			forget(t)
		:: else ->
			opinions[t] = 2;
			opinion1[t] = ID(w);
			said1[t] = value;
			requeue(t)
		fi
	:: !agrees && opinions[t] == 2 -> assert(false) /* GIVE_UP: three disagree */
	fi;
	if
	:: liar != NOBODY -> punish(liar)
	:: else
	fi;
	if
	:: gone != NOBODY -> itself = false; punish(gone)
	:: else
	fi;
	value = 0; gone = 0; liar = 0; other = 0; agrees = false; itself = false
}

#define WAITING(t) (job == RENDERING && pixels[t] == NOTHING && holder[t] == NOBODY)

#define MAY_HAVE(w, t) (TAKES(w) && WAITING(t) && MAY_OPINE(w, t))

/* is_disputed: a third is needed, and nobody is there who could be it. */
#define DISPUTED(t) \
	(WAITING(t) && opinions[t] == 2 && !MAY_HAVE(0, t) && !MAY_HAVE(1, t) && !MAY_HAVE(2, t))

inline leave(w)
{
	if
	:: holder[0] == w -> requeue(0)
	:: else
	fi;
	if
	:: holder[1] == w -> requeue(1)
	:: else
	fi;
	depart(0, ID(w));
	depart(1, ID(w));
	here[w] = false;
	live[w] = 0;
	stale[w] = 0;
	comings[w]++
}

inline end_job(state)
{
	job = state;
	left = 0; lies = 0;
	start_again();
	live[0] = 0; live[1] = 0; live[2] = 0;
	stale[0] = 0; stale[1] = 0; stale[2] = 0;
	here[0] = true; here[1] = true; here[2] = true;
	comings[0] = 0; comings[1] = 0; comings[2] = 0;
	convicted = 0;
	trusted = NOBODY
}

#define w _pid
active [WORKERS] proctype worker()
{
	byte t;
end:
	do
	:: atomic { job == RENDERING && !here[w] -> here[w] = true }
	:: atomic { MAY_HAVE(w, 0) || MAY_HAVE(w, 1) ->
		if
		:: MAY_HAVE(w, 0) -> t = 0
		:: MAY_HAVE(w, 1) -> t = 1
		fi;
		holder[t] = w;
		alone[t] = !OTHERS(w);
		live[w] = live[w] | BIT(t);
		t = 0 }
	:: atomic { job == RENDERING && (live[w] | stale[w]) ->
		if
		:: live[w] & BIT(0) -> t = 0
		:: live[w] & BIT(1) -> t = 1
		:: stale[w] & BIT(0) -> t = 2
		:: stale[w] & BIT(1) -> t = 3
		fi;
		value = RIGHT;
		if
		:: true
		:: w == LIAR && lies > 0 -> lies--; value = 1
		:: w == LIAR && lies > 0 -> lies--; value = 2
		fi;
		if
		:: t < 2 ->
			live[w] = live[w] & ~BIT(t);
			if
			:: left > 0 -> left--; stale[w] = stale[w] | BIT(t) /* and comes again */
			:: true
			fi;
			take_result(w, t)
		:: else ->
			t = t - 2;
			stale[w] = stale[w] & ~BIT(t);
#ifdef NO_LEASE_CHECK
			if
			:: pixels[t] == NOTHING && holder[t] != NOBODY -> take_result(w, t)
			:: else
			fi
#endif
		fi;
		value = 0;
		t = 0 }
	:: atomic { job == RENDERING && here[w] && left > 0 -> left--; leave(w) }
	:: atomic { job == RENDERING && here[w] && left > 0 && (holder[0] == w || holder[1] == w) ->
		left--; /* it is slow, and its leases run out */
		if
		:: holder[0] == w -> requeue(0)
		:: holder[1] == w -> requeue(1)
		fi }
	:: atomic { job == RENDERING && w == LIAR && TAKES(w) && lies < LIES && left > 0 ->
		left--; punish(ID(LIAR)) } /* by another render */
	od
}

active proctype coordinator()
{
	atomic {
		start_again();
		if
		:: verify = NONE
		:: verify = SPOT
		:: verify = FULL
		fi;
		if
		:: trusted = 1
		:: true
		fi;
		job = RENDERING
	}
end:
	do
	:: atomic { job == RENDERING && pixels[0] != NOTHING && pixels[1] != NOTHING ->
		i = 0;
		do
		:: i < TILES ->
			assert(!WRONG(pixels[i]) || (by[i] == EARLIER -> convicted == 0 :
				!(convicted & BIT(by[i]))));
			i++
		:: else -> break
		od;
		i = 0;
		end_job(DONE) }
	:: atomic { DISPUTED(0) || DISPUTED(1) -> end_job(FAILED) }
	:: atomic { job == RENDERING && left > 0 -> /* kill -9, and what is merged is on the disk */
		left--;
		requeue(0); requeue(1);
		forget(0); forget(1);
		live[0] = 0; live[1] = 0; live[2] = 0;
		stale[0] = 0; stale[1] = 0; stale[2] = 0;
		here[0] = false; here[1] = false; here[2] = false;
		comings[0] = 0; comings[1] = 0; comings[2] = 0;
		convicted = 0;
		unaudited = 0;
		i = 0;
		do
		:: i < TILES && pixels[i] != NOTHING ->
			by[i] = EARLIER;
#ifndef RESTART_FORGETS
			unaudited = EVERYBODY;
#endif
			i++
		:: i < TILES && pixels[i] == NOTHING -> i++
		:: else -> break
		od;
		i = 0 }
	od
}

ltl ends { <> (job == DONE || job == FAILED) }
