/* SPDX-License-Identifier: Apache-2.0 */
#include "core/render/isa.h"

#include "core/render/trace.h"

#include <cpuid.h>
#include <immintrin.h>
#include <stdio.h>
#include <string.h>

struct isa_names {
	const char *name, *embree_config;
};

/* No "start_threads": with it a device made in a forked process hangs. */
static const struct isa_names isa_table[PEN_ISA_COUNT] = {
	[PEN_ISA_V2] = {"x86-64-v2", "isa=sse4.2"},
	[PEN_ISA_V3] = {"x86-64-v3", "isa=avx2"},
	[PEN_ISA_V4] = {"x86-64-v4", "isa=avx512"},
};

const char *pen_isa_name(enum pen_isa isa)
{
	return isa_table[isa].name;
}

const char *pen_isa_embree_config(enum pen_isa isa)
{
	return isa_table[isa].embree_config;
}

int pen_isa_parse(const char *name, enum pen_isa *ret_isa, struct pen_error *err)
{
	for (enum pen_isa isa = 0; isa < PEN_ISA_COUNT; isa++) {
		if (strcmp(name, isa_table[isa].name) != 0 &&
			strcmp(name, isa_table[isa].name + strlen("x86-64-")) != 0)
			continue;
		*ret_isa = isa;
		return 0;
	}
	return pen_error_set(
		err, PEN_EINVALID, "the instruction set must be x86-64-v2, x86-64-v3 or x86-64-v4");
}

int pen_isa_supported(enum pen_isa isa)
{
	__builtin_cpu_init();
	switch (isa) {
	case PEN_ISA_V2:
		return __builtin_cpu_supports("sse4.2") && __builtin_cpu_supports("popcnt");
	case PEN_ISA_V3:
		return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
		       __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
	case PEN_ISA_V4:
		return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
		       __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
		       __builtin_cpu_supports("avx512vl");
	case PEN_ISA_COUNT: break;
	}
	return 0;
}

enum pen_isa pen_isa_best(void)
{
	enum pen_isa best = PEN_ISA_V2;

	for (enum pen_isa isa = PEN_ISA_V2; isa < PEN_ISA_COUNT; isa++)
		if (pen_isa_supported(isa))
			best = isa;
	return best;
}

void pen_class_format(enum pen_isa isa, char *ret_text)
{
	unsigned int leaf_max, vendor[3] = {0};

	(void)__get_cpuid(0, &leaf_max, &vendor[0], &vendor[2], &vendor[1]);
	(void)snprintf(ret_text, PEN_CLASS_TEXT, "%d/%s/embree-%s/%.12s", PEN_RENDER_ABI,
		pen_isa_name(isa), pen_trace_version(), (const char *)vendor);
}

unsigned int pen_isa_denormals_flush(void)
{
	const unsigned int state = _mm_getcsr();
	const unsigned int denormals_are_zero = 0x0040;

	_mm_setcsr(state | _MM_FLUSH_ZERO_ON | denormals_are_zero);
	return state;
}

void pen_isa_denormals_restore(unsigned int state)
{
	_mm_setcsr(state);
}
