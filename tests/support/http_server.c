/* SPDX-License-Identifier: Apache-2.0 */
/*
 * http-server ENCODER DIRECTORY: the real HTTP interface and encoders over fake renders. Prints
 * its port. SIGUSR1 advances the renders, SIGUSR2 refuses new ones, SIGTERM ends it with code 0
 * if nothing is left open.
 */
#include "server/encode.h"
#include "server/http.h"
#include "server/shelf.h"
#include "tests/support/fake_jobs.h"

#include <netinet/in.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>

struct server {
	struct pen_jobs *jobs;
	struct pen_encoders *encoders;
	struct pen_http *http;
	struct pen_shelf *shelf;
	uv_signal_t signals[3];
};

static void close_signals(struct server *server)
{
	for (unsigned i = 0; i < 3; i++)
		uv_close((uv_handle_t *)&server->signals[i], NULL);
}

static void signal_came(uv_signal_t *handle, int number)
{
	struct server *server = handle->data;

	if (number == SIGUSR1) {
		fake_jobs_advance(server->jobs);
	} else if (number == SIGUSR2) {
		pen_http_drain(server->http);
	} else {
		pen_http_destroy(server->http);
		pen_encoders_destroy(server->encoders);
		close_signals(server);
	}
}

static int start(struct server *server, uv_loop_t *loop, char **argv, struct pen_error *err)
{
	static const int numbers[] = {SIGUSR1, SIGUSR2, SIGTERM};
	struct pen_http_options options = {
		.socket = -1, .assets_dir = argv[2], .scenes_dir = argv[2], .jobs = server->jobs};
	struct sockaddr_in *address = (struct sockaddr_in *)&options.address;
	int r = pen_encoders_create(
		loop, argv[1], PEN_SANDBOX_REQUIRE, argv[2], &server->encoders, err);

	if (r == 0)
		r = pen_shelf_create(argv[2], &server->shelf, err);
	if (r < 0)
		return r;
	options.shelf = server->shelf;
	options.encoders = server->encoders;
	address->sin_family = AF_INET;
	address->sin_addr.s_addr = htonl(INADDR_LOOPBACK);
	r = pen_http_create(loop, &options, &server->http, err);
	for (unsigned i = 0; r == 0 && i < 3; i++) {
		(void)uv_signal_init(loop, &server->signals[i]);
		server->signals[i].data = server;
		(void)uv_signal_start(&server->signals[i], signal_came, numbers[i]);
	}
	return r;
}

int main(int argc, char **argv)
{
	struct pen_error err = PEN_ERROR_INIT;
	struct server server = {0};
	uv_loop_t loop;

	if (argc != 3 || uv_loop_init(&loop) < 0)
		return 2;
	(void)signal(SIGPIPE, SIG_IGN);
	server.jobs = fake_jobs_create(&loop);
	if (start(&server, &loop, argv, &err) < 0) {
		(void)fprintf(stderr, "http-server: %s\n", err.text);
		return 1;
	}
	(void)printf("%u\n", pen_http_port(server.http));
	(void)fflush(stdout);
	(void)uv_run(&loop, UV_RUN_DEFAULT);
	pen_shelf_destroy(server.shelf);
	fake_jobs_destroy(server.jobs);
	return uv_loop_close(&loop) == 0 ? 0 : 3;
}
