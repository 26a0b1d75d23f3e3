/* SPDX-License-Identifier: Apache-2.0 */
/*
 * simulate [--first S] [--seeds N] [--seconds T]: runs the seeds from S on, until N are run or T
 * seconds are spent. Prints the seed of each violation, and what has struck.
 */
#include "tests/chaos/simulation.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* Of so many seeds one runs twice, to see whether the same is decided. */
enum { SEEDS_PER_REPLAY = 16 };

struct options {
	uint64_t first, seeds, seconds;
};

static int parse_options(int argc, char **argv, struct options *ret_options)
{
	for (int i = 1; i < argc; i += 2) {
		uint64_t *value = strcmp(argv[i], "--first") == 0     ? &ret_options->first
				  : strcmp(argv[i], "--seeds") == 0   ? &ret_options->seeds
				  : strcmp(argv[i], "--seconds") == 0 ? &ret_options->seconds
								      : NULL;

		if (!value || i + 1 == argc)
			return -1;
		*value = strtoull(argv[i + 1], NULL, 10);
	}
	return 0;
}

static void add(struct sim_result *total, const struct sim_result *result)
{
	for (int i = 0; i < SIM_FAULTS; i++)
		total->fired[i] += result->fired[i];
	total->steps += result->steps;
	total->commits += result->commits;
	total->stale += result->stale;
	total->doubled += result->doubled;
	total->quarantines += result->quarantines;
	total->convictions += result->convictions;
	total->escapes += result->escapes;
	total->done += result->done;
	total->failed += result->failed;
	total->cancelled += result->cancelled;
	total->log ^= result->log;
}

/* Whether the seed keeps every promise. */
static int run_seed(uint64_t seed, struct sim_result *total)
{
	struct sim_result result, again;

	sim_run(seed, &result);
	add(total, &result);
	if (result.violation[0] != '\0') {
		printf("seed %" PRIu64 ": %s\n", seed, result.violation);
		return 0;
	}
	if (seed % SEEDS_PER_REPLAY != 0)
		return 1;
	sim_run(seed, &again);
	if (again.log == result.log)
		return 1;
	printf("seed %" PRIu64 ": decided otherwise the second time\n", seed);
	return 0;
}

static void report(const struct sim_result *total)
{
	printf("renders: %" PRIu32 " done, %" PRIu32 " failed, %" PRIu32 " cancelled\n",
		total->done, total->failed, total->cancelled);
	printf("steps: %" PRIu64 ", commits: %" PRIu64 ", results refused: %" PRIu64
	       ", doubled: %" PRIu64 ", quarantines: %" PRIu64 ", convictions: %" PRIu64
	       ", escapes: %" PRIu64 ", log %016" PRIx64 "\nfaults:",
		total->steps, total->commits, total->stale, total->doubled, total->quarantines,
		total->convictions, total->escapes, total->log);
	for (int i = 0; i < SIM_FAULTS; i++)
		printf(" %s %" PRIu64, sim_fault_names[i], total->fired[i]);
	printf("\n");
}

int main(int argc, char **argv)
{
	struct options options = {.first = 1, .seeds = 100, .seconds = UINT32_MAX};
	struct sim_result total = {0};
	uint64_t run = 0, failed = 0;
	time_t start = time(NULL);

	if (parse_options(argc, argv, &options) < 0) {
		(void)fprintf(stderr, "usage: simulate [--first S] [--seeds N] [--seconds T]\n");
		return 2;
	}
	while (run < options.seeds && (uint64_t)(time(NULL) - start) < options.seconds)
		failed += !run_seed(options.first + run++, &total);
	report(&total);
	printf("%" PRIu64 " seeds from %" PRIu64 ": %" PRIu64 " failed\n", run, options.first,
		failed);
	return failed > 0 || run == 0;
}
