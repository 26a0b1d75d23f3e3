/* SPDX-License-Identifier: Apache-2.0 */
#include "server/loop.h"

#include "server/asset_sweep.h"
#include "server/ceiling.h"
#include "server/certificate.h"
#include "server/confine.h"
#include "server/data_dir.h"
#include "server/dispatch.h"
#include "server/durable.h"
#include "server/encode.h"
#include "server/exposure.h"
#include "server/farm.h"
#include "server/guard.h"
#include "server/http.h"
#include "server/job.h"
#include "server/shelf.h"
#include "server/sibling.h"
#include "server/spawn.h"
#include "server/store.h"
#include "server/supervisor.h"

#include <arpa/inet.h>
#include <assert.h>
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/random.h>
#include <sys/resource.h>
#include <unistd.h>
#include <uv.h>

enum { SIGNALS = 3 };

struct pen_server {
	uv_loop_t loop;
	uv_signal_t signals[SIGNALS];
	struct pen_supervisor supervisor;
	const struct pen_config *config;
	struct pen_data_dir data;
	struct pen_store *store;
	struct pen_dispatch *dispatch;
	struct pen_jobs *jobs;
	struct pen_farm *farm;
	struct pen_encoders *encoders;
	struct pen_guard *guard;
	struct pen_muster *muster;
	struct pen_certificate certificate;
	enum pen_sandbox_mode sandbox;
	struct pen_http *http;
	struct pen_spawn *spawn;
	struct pen_asset_sweep *sweep;
	struct pen_shelf *shelf;
	bool stopping;
	struct pen_error failure; /* code < 0: why it had to stop */
};

/* In an order that leaves nobody calling what has gone; the loop then runs dry. */
static void stop(struct pen_server *server)
{
	if (server->stopping)
		return;
	server->stopping = true;
	pen_supervisor_stop(&server->supervisor);
	if (server->http)
		pen_http_drain(server->http);
	if (server->dispatch)
		pen_dispatch_stop(server->dispatch);
	if (server->jobs)
		pen_jobs_close(server->jobs);
	pen_farm_destroy(server->farm);
	pen_spawn_destroy(server->spawn);
	pen_asset_sweep_destroy(server->sweep);
	pen_store_destroy(server->store);
	pen_encoders_destroy(server->encoders);
	pen_http_destroy(server->http);
	pen_jobs_destroy(server->jobs);
	for (int i = 0; i < SIGNALS; i++)
		uv_unref((uv_handle_t *)&server->signals[i]);
}

/* Connections that there are keep what they were shown. */
static void renew_certificate(struct pen_server *server)
{
	const struct pen_config *config = server->config;
	struct pen_certificate certificate;
	struct pen_error err = PEN_ERROR_INIT;
	int r = pen_certificate_load(config->tls_cert, config->tls_key, &certificate, &err);

	if (r < 0) {
		pen_log(PEN_LOG_ERROR, "the certificate stays as it was: %s", err.text);
		return;
	}
	pen_certificate_finish(&server->certificate);
	server->certificate = certificate;
	pen_guard_forget_names(server->guard);
	for (size_t i = 0; r == 0 && i < certificate.name_count; i++)
		r = pen_guard_add_name(server->guard, certificate.names[i], &err);
	if (r < 0)
		pen_log(PEN_LOG_ERROR, "not all names of the certificate are known: %s", err.text);
	pen_log(PEN_LOG_INFO, "the certificate was read again");
}

/* Tokens and keys are read again by themselves. */
static void handle_hangup(uv_signal_t *handle, int number)
{
	struct pen_server *server = handle->data;

	(void)number;
	if (server->stopping || !server->http)
		return;
	if (server->config->tls_cert[0] != '\0')
		renew_certificate(server);
	else
		pen_log(PEN_LOG_INFO, "SIGHUP: there is no certificate to read again");
}

static void handle_signal(uv_signal_t *handle, int number)
{
	struct pen_server *server = handle->data;

	if (server->stopping)
		_exit(128 + number);
	pen_log(PEN_LOG_INFO, "stopping");
	stop(server);
}

static void handle_broken(void *user, const struct pen_error *err)
{
	struct pen_server *server = user;

	server->failure = *err;
	/* The store is in the middle of an answer: stop when it is out of it. */
	if (!server->stopping)
		(void)kill(getpid(), SIGTERM);
}

/* Every connection is a descriptor, and the usual soft limit of 1024 is for programs with
 * select(2). */
static void allow_descriptors(void)
{
	struct rlimit limit;

	if (getrlimit(RLIMIT_NOFILE, &limit) < 0)
		return;
	limit.rlim_cur = limit.rlim_max;
	(void)setrlimit(RLIMIT_NOFILE, &limit);
}

static void start_signals(struct pen_server *server)
{
	static const int numbers[SIGNALS] = {SIGTERM, SIGINT, SIGHUP};
	/* Else a terminal that goes ends this too. */
	const bool takes_hangup = server->config->tls_cert[0] != '\0' || pen_supervisor_is_there();

	(void)signal(SIGPIPE, SIG_IGN);
	for (int i = 0; i < SIGNALS; i++) {
		(void)uv_signal_init(&server->loop, &server->signals[i]);
		server->signals[i].data = server;
		if (numbers[i] != SIGHUP)
			(void)uv_signal_start(&server->signals[i], handle_signal, numbers[i]);
		else if (takes_hangup)
			(void)uv_signal_start(&server->signals[i], handle_hangup, numbers[i]);
	}
}

static int create_dispatch(struct pen_server *server, struct pen_error *err)
{
	uint64_t secret;

	if (getrandom(&secret, sizeof secret, 0) != sizeof secret)
		return pen_error_system(err, errno, "no random bits");
	return pen_dispatch_create(secret, &server->dispatch, err);
}

static int start_jobs(struct pen_server *server, struct pen_error *err)
{
	const struct pen_config *config = server->config;
	struct pen_jobs_options jobs = {
		.data_dir = server->data.path,
		.processes = config->processes,
		.tile_px = config->tile_px,
		.keep_renders_s = config->keep_renders_s,
		.keep_bytes = config->keep_bytes,
		.waiting_max = config->waiting_max,
		.broken = handle_broken,
		.user = server,
	};
	struct pen_farm_options farm = {
		.address = config->worker_listen,
		.scenes_dir = server->data.scenes,
		.assets_dir = server->data.assets,
	};
	int r = pen_store_create(&server->loop, server->data.path, &server->store, err);

	if (r == 0)
		r = create_dispatch(server, err);
	if (r == 0)
		r = pen_muster_create(config->worker_keys,
			!pen_config_is_loopback(&config->worker_listen), &server->muster, err);
	if (r == 0)
		r = pen_exposure_check_workers(
			&config->worker_listen, pen_muster_count(server->muster), err);
	farm.muster = server->muster;
	jobs.store = server->store;
	jobs.dispatch = farm.dispatch = server->dispatch;
	if (r == 0)
		r = pen_farm_create(&server->loop, &farm, &server->farm, err);
	if (r == 0)
		r = pen_jobs_create(&server->loop, &jobs, &server->jobs, err);
	return r;
}

/* Where HTTP will listen: the service manager's socket, if there is one, or --listen. */
static int find_listener(
	const struct pen_config *config, struct pen_http_options *options, struct pen_error *err)
{
	socklen_t size = sizeof options->address;

	options->address = config->listen;
	options->socket = pen_supervisor_socket("http");
	if (options->socket >= 0 &&
		getsockname(options->socket, (struct sockaddr *)&options->address, &size) < 0)
		return pen_error_system(err, errno, "the service manager's socket \"http\"");
	return 0;
}

/* Before threads exist, and before anything is opened for others. */
static int choose_sandbox(struct pen_server *server, struct pen_error *err)
{
	struct pen_http_options options = {0};
	int r = find_listener(server->config, &options, err);

	if (r < 0)
		return r;
	server->sandbox = pen_confine_mode(server->config, &options.address);
	return pen_confine_check(server->sandbox, err);
}

/* Who may come in, and by which names this service is known. */
static int start_guard(
	struct pen_server *server, struct pen_http_options *options, struct pen_error *err)
{
	const struct pen_config *config = server->config;
	const bool is_open = pen_config_is_loopback(&options->address);
	int r = pen_guard_create(config->tokens, !is_open, &server->guard, err);

	options->guard = server->guard;
	if (r == 0 && config->tls_cert[0] != '\0') {
		r = pen_certificate_load(
			config->tls_cert, config->tls_key, &server->certificate, err);
		options->certificate = &server->certificate;
	}
	if (r == 0)
		r = pen_exposure_check_http(&options->address, options->certificate != NULL,
			pen_guard_tokens(server->guard), err);
	for (size_t i = 0; r == 0 && i < server->certificate.name_count; i++)
		r = pen_guard_add_name(server->guard, server->certificate.names[i], err);
	return r;
}

static int start_http(struct pen_server *server, struct pen_error *err)
{
	struct pen_http_options options = {
		.jobs = server->jobs,
		.farm = server->farm,
		.assets_dir = server->data.assets,
		.scenes_dir = server->data.scenes,
		.path = server->config->listen_unix[0] ? server->config->listen_unix : NULL,
	};
	char encoder[PATH_MAX];
	int r = find_listener(server->config, &options, err);

	if (r == 0)
		r = start_guard(server, &options, err);
	if (r < 0)
		return r;
	r = pen_shelf_create(server->data.kept, &server->shelf, err);
	if (r < 0)
		return r;
	options.shelf = server->shelf;
	pen_sibling_path("penumbra-encoder", encoder, sizeof encoder);
	r = pen_encoders_create(&server->loop, encoder, server->sandbox, server->data.cache,
		&server->encoders, err);
	if (r < 0)
		return r;
	options.encoders = server->encoders;
	return pen_http_create(&server->loop, &options, &server->http, err);
}

/* The address as one writes it before ":PORT". */
static const char *host_of(const struct sockaddr_storage *address, char *ret_host, size_t size)
{
	char name[INET6_ADDRSTRLEN] = "";

	(void)uv_ip_name((const struct sockaddr *)address, name, sizeof name);
	(void)snprintf(ret_host, size, address->ss_family == AF_INET6 ? "[%s]" : "%s", name);
	return ret_host;
}

static int start_worker(struct pen_server *server, const char *host, struct pen_error *err)
{
	struct pen_spawn_options options = {
		.farm = server->farm,
		.host = host,
		.processes = server->config->processes,
		.isa = server->config->isa,
		.log_level = server->config->log_level,
		.log_format = server->config->log_format,
		.sandbox = server->sandbox,
	};

	if (options.processes == 0)
		return 0;
	return pen_spawn_create(&server->loop, &options, &server->spawn, err);
}

static int announce(struct pen_server *server, const char *worker_host, struct pen_error *err)
{
	unsigned http = pen_http_port(server->http), workers = pen_farm_port(server->farm);
	char ports[64], host[INET6_ADDRSTRLEN + 2], memory[PEN_CEILING_TEXT];
	struct pen_ceiling ceiling;
	int size =
		snprintf(ports, sizeof ports, "{\"http\": %u, \"workers\": %u}\n", http, workers);
	int r = pen_durable_write(server->data.path, "ports", ports, (size_t)size, err);

	if (r < 0)
		return r;
	pen_ceiling_compute(server->config->waiting_max, &ceiling);
	pen_ceiling_format(&ceiling, memory);
	pen_log(PEN_LOG_INFO, "%s", memory);
	pen_supervisor_ready(&server->supervisor, "serving");
	(void)printf("penumbra: %s://%s:%u, workers %s:%u\n",
		server->certificate.cert ? "https" : "http",
		host_of(&server->config->listen, host, sizeof host), http, worker_host, workers);
	if (server->config->listen_unix[0] != '\0')
		(void)printf("penumbra: unix:%s\n", server->config->listen_unix);
	(void)printf("penumbra: ready\n");
	(void)fflush(stdout);
	return 0;
}

int pen_server_run(const struct pen_config *config, struct pen_error *err)
{
	struct pen_server server = {.config = config, .failure = PEN_ERROR_INIT};
	char worker_host[INET6_ADDRSTRLEN + 2];
	int r = pen_data_dir_open(&server.data, config->data_dir, err), closed;

	if (r < 0)
		return r;
	r = uv_loop_init(&server.loop);
	if (r < 0) {
		pen_data_dir_close(&server.data);
		return pen_error_set(err, PEN_EIO, "no event loop: %s", uv_strerror(r));
	}
	allow_descriptors();
	pen_supervisor_init(&server.supervisor, &server.loop);
	start_signals(&server);
	(void)host_of(&config->worker_listen, worker_host, sizeof worker_host);
	r = choose_sandbox(&server, err);
	if (r == 0)
		r = start_jobs(&server, err);
	if (r == 0)
		r = start_http(&server, err);
	if (r == 0)
		r = start_worker(&server, worker_host, err);
	if (r == 0)
		r = pen_asset_sweep_create(&server.loop, server.data.assets, server.data.scenes,
			server.data.kept, config->keep_assets_s, &server.sweep, err);
	if (r == 0)
		r = announce(&server, worker_host, err);
	if (r < 0)
		stop(&server);
	(void)uv_run(&server.loop, UV_RUN_DEFAULT);

	/* Only the signals are left. */
	for (int i = 0; i < SIGNALS; i++)
		uv_close((uv_handle_t *)&server.signals[i], NULL);
	(void)uv_run(&server.loop, UV_RUN_DEFAULT);
	closed = uv_loop_close(&server.loop);
	assert(closed == 0); /* no handle is left */
	pen_dispatch_destroy(server.dispatch);
	pen_shelf_destroy(server.shelf);
	pen_guard_destroy(server.guard);
	pen_muster_destroy(server.muster);
	pen_certificate_finish(&server.certificate);
	pen_data_dir_close(&server.data);
	if (r == 0 && server.failure.code < 0) {
		*err = server.failure;
		r = err->code;
	}
	return r;
}
