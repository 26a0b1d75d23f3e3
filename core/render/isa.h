/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_RENDER_ISA_H
#define PEN_RENDER_ISA_H

#include "core/render/render.h"

/* What Embree's device is told, so that it runs the same code on every machine of a class. */
const char *pen_isa_embree_config(enum pen_isa isa);

/*
 * Flushes denormal results and operands to zero in this thread and returns the floating-point
 * state to give to pen_isa_denormals_restore.
 */
unsigned int pen_isa_denormals_flush(void);
void pen_isa_denormals_restore(unsigned int state);

#endif
