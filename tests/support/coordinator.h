/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_TESTS_SUPPORT_COORDINATOR_H
#define PEN_TESTS_SUPPORT_COORDINATOR_H

#include "proto/msg.h"

#include <stdbool.h>
#include <sys/types.h>

/*
 * A coordinator of one worker for tests: speaks the frames over a blocking socket, knows scenes
 * that differ by seed, and fails the running cmocka test when something due does not come.
 */
struct coordinator {
	int listener;
	int fd; /* of the worker's connection */
	uint16_t port;
	pid_t worker;
	struct pen_frame_reader reader;
	struct pen_arena arena;
	uint32_t sequence;
	struct pen_msg msg;	  /* received last */
	uint32_t scenes_served;	  /* number of SCENE_GETs answered */
	bool missing;		  /* answer SCENE_GET with "missing" */
	uint32_t frame;		  /* of leases; 1 at first */
	uint64_t heartbeat_lease; /* the first one of the last heartbeat; 0 = none */
};

enum { COORDINATOR_SEED_BROKEN = 666050, COORDINATOR_SEED_FRAMES };

/* Starts worker-fake with processes render processes, and awaits its Hello. */
void coordinator_init(struct coordinator *c, const char *processes);

/* Ends the worker by SIGTERM and fails when it does not end with 0. */
void coordinator_finish(struct coordinator *c);

/* Frees everything; the worker has ended. */
void coordinator_close(struct coordinator *c);

/* Accepts the worker's next connection, welcomes it. */
void coordinator_accept(struct coordinator *c);
void coordinator_hang_up(struct coordinator *c);

void coordinator_send(struct coordinator *c, const struct pen_msg *msg);

/* The next message of type; heartbeats are skipped and scenes served on the way. */
const struct pen_msg *coordinator_expect(struct coordinator *c, enum pen_frame_type type);

/* Whether a message other than a heartbeat or SCENE_GET is there within ms; it stays in c->msg. */
bool coordinator_receive(struct coordinator *c, int ms);

/* Waits until a heartbeat says that lease is being rendered; nothing else may be told meanwhile. */
void coordinator_await_running(struct coordinator *c, uint64_t lease);

/* A lease on a 16x16 tile at x0 = 16 * (lease % 8) of the scene with this seed. */
void coordinator_lease(struct coordinator *c, uint64_t lease, uint32_t seed, uint32_t deadline_ms);

/* Expects lease's result, with the pattern of fake_render.c. */
void coordinator_expect_result(struct coordinator *c, uint64_t lease, uint32_t seed);

/* Expects lease's failure of this kind; its reason must contain text. */
void coordinator_expect_failure(
	struct coordinator *c, uint64_t lease, enum pen_fault fault, const char *text);

/*
 * The worker's processes of this name ("pen-zygote", "pen-scene", "pen-render"; NULL: those that
 * have ended and that nobody waits for): their number, and at most max ids.
 */
size_t coordinator_processes(
	const struct coordinator *c, const char *name, pid_t *ret_pids, size_t max);

pid_t coordinator_parent(pid_t pid);

/* Whether a process runs; one that nobody has waited for yet does not. */
bool coordinator_lives(pid_t pid);

/* Waits until there are count processes of this name; nothing else may be told meanwhile. */
void coordinator_await_processes(struct coordinator *c, const char *name, size_t count);

#endif
