/* SPDX-License-Identifier: Apache-2.0 */
#include "server/metrics.h"

#include "core/base/clock.h"

#include <dirent.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <sys/resource.h>
#include <unistd.h>

enum { STATES = PEN_JOB_CANCELLED + 1 };

static void head(struct pen_buf *out, const char *name, const char *type, const char *help)
{
	(void)pen_buf_printf(out, "# HELP %s %s\n# TYPE %s %s\n", name, help, name, type);
}

static void gauge(struct pen_buf *out, const char *name, const char *help, double value)
{
	head(out, name, "gauge", help);
	(void)pen_buf_printf(out, "%s %.17g\n", name, value);
}

static void counter(struct pen_buf *out, const char *name, const char *help, double value)
{
	head(out, name, "counter", help);
	(void)pen_buf_printf(out, "%s %.17g\n", name, value);
}

/* A label's value, with what would end it escaped. */
static const char *label(const char *text, char *ret_label, size_t size)
{
	size_t used = 0;

	for (; *text != '\0' && used + 3 < size; text++) {
		if (*text == '"' || *text == '\\' || *text == '\n')
			ret_label[used++] = '\\';
		ret_label[used++] = (char)(*text == '\n' ? 'n' : *text);
	}
	ret_label[used] = '\0';
	return ret_label;
}

static void write_renders(struct pen_buf *out, struct pen_jobs *jobs)
{
	uint64_t counts[STATES] = {0};

	for (struct pen_job *job = pen_jobs_older(jobs, UINT64_MAX); job;
		job = pen_jobs_older(jobs, job->number))
		counts[job->state]++;
	head(out, "penumbra_renders", "gauge", "Renders in the store, by state.");
	for (int state = 0; state < STATES; state++)
		(void)pen_buf_printf(out, "penumbra_renders{state=\"%s\"} %" PRIu64 "\n",
			pen_job_state_name((enum pen_job_state)state), counts[state]);
}

static void write_farm(struct pen_buf *out, const struct pen_farm *farm)
{
	const struct pen_farm_totals totals = pen_farm_totals(farm);
	const struct pen_worker *worker = NULL;
	uint32_t ready = 0, draining = 0, quarantined = 0, processes = 0, leases = 0;

	while ((worker = pen_farm_next(farm, worker ? worker->id : 0))) {
		*(worker->draining ? &draining : worker->quarantined ? &quarantined : &ready) += 1;
		processes += worker->processes;
		leases += worker->leases;
	}
	head(out, "penumbra_workers", "gauge", "Connected workers, by state.");
	(void)pen_buf_printf(out, "penumbra_workers{state=\"ready\"} %u\n", ready);
	(void)pen_buf_printf(out, "penumbra_workers{state=\"draining\"} %u\n", draining);
	(void)pen_buf_printf(out, "penumbra_workers{state=\"quarantined\"} %u\n", quarantined);
	gauge(out, "penumbra_render_processes", "Render processes of all workers.", processes);
	gauge(out, "penumbra_leases", "Units that workers hold.", leases);
	gauge(out, "penumbra_queue_units", "Units that could be leased now.",
		(double)pen_farm_queue_depth(farm));
	counter(out, "penumbra_units_total", "Units whose pixels were taken.",
		(double)totals.units);
	counter(out, "penumbra_units_failed_total", "Leases that ended by somebody's fault.",
		(double)totals.failures);
	counter(out, "penumbra_samples_total", "Samples whose pixels were taken.",
		(double)totals.samples);
	counter(out, "penumbra_render_seconds_total",
		"Time of render processes on units whose pixels were taken.",
		1e-6 * (double)totals.render_us);
	counter(out, "penumbra_workers_connected_total", "Workers that were welcomed.",
		(double)totals.welcomed);
}

static void write_workers(struct pen_buf *out, const struct pen_farm *farm)
{
	const struct pen_worker *worker = NULL;
	const int64_t now_ms = pen_clock_wall_ms();
	char name[2 * PEN_NAME_MAX];

	head(out, "penumbra_worker_samples_total", "counter", "Samples of each worker.");
	while ((worker = pen_farm_next(farm, worker ? worker->id : 0)))
		(void)pen_buf_printf(out,
			"penumbra_worker_samples_total{worker=\"%" PRIu64 "\",name=\"%s\"} %" PRIu64
			"\n",
			worker->id, label(worker->name, name, sizeof name), worker->samples_done);
	head(out, "penumbra_worker_strikes", "gauge", "Units that each worker has failed.");
	while ((worker = pen_farm_next(farm, worker ? worker->id : 0)))
		(void)pen_buf_printf(out,
			"penumbra_worker_strikes{worker=\"%" PRIu64 "\",name=\"%s\"} %u\n",
			worker->id, label(worker->name, name, sizeof name), worker->strikes);
	head(out, "penumbra_worker_heartbeat_age_seconds", "gauge", "Since each was heard.");
	while ((worker = pen_farm_next(farm, worker ? worker->id : 0)))
		(void)pen_buf_printf(out,
			"penumbra_worker_heartbeat_age_seconds{worker=\"%" PRIu64
			"\",name=\"%s\"} %.3f\n",
			worker->id, label(worker->name, name, sizeof name),
			(double)(now_ms - worker->heartbeat_ms) / 1000.0);
}

static unsigned count_descriptors(void)
{
	DIR *directory = opendir("/proc/self/fd");
	unsigned count = 0;

	while (directory && readdir(directory))
		count++;
	if (directory)
		(void)closedir(directory);
	/* "." and "..", and the directory's own. */
	return count > 3 ? count - 3 : 0;
}

static uint64_t resident_bytes(void)
{
	FILE *file = fopen("/proc/self/statm", "re");
	unsigned long long pages = 0;

	if (file) {
		/* The kernel's own numbers. NOLINTNEXTLINE(cert-err34-c) */
		if (fscanf(file, "%*u %llu", &pages) != 1)
			pages = 0;
		(void)fclose(file);
	}
	return pages * (uint64_t)sysconf(_SC_PAGESIZE);
}

static void write_process(struct pen_buf *out)
{
	struct rusage used;

	(void)getrusage(RUSAGE_SELF, &used);
	counter(out, "process_cpu_seconds_total", "Processor time of the coordinator.",
		(double)(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
			1e-6 * (double)(used.ru_utime.tv_usec + used.ru_stime.tv_usec));
	gauge(out, "process_resident_memory_bytes", "Resident memory of the coordinator.",
		(double)resident_bytes());
	gauge(out, "process_open_fds", "Open descriptors of the coordinator.", count_descriptors());
}

int pen_metrics_write(const struct pen_farm *farm, struct pen_jobs *jobs, struct pen_buf *out)
{
	head(out, "penumbra_build_info", "gauge", "Always 1.");
	(void)pen_buf_printf(out, "penumbra_build_info{version=\"" PEN_VERSION "\"} 1\n");
	write_renders(out, jobs);
	write_farm(out, farm);
	write_workers(out, farm);
	write_process(out);
	return out->failed ? PEN_ENOMEM : 0;
}
