/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_METRICS_H
#define PEN_SERVER_METRICS_H

#include "core/base/buf.h"
#include "server/farm.h"
#include "server/job.h"

/*
 * Appends how the coordinator, its renders and its workers are, in Prometheus' text format 0.0.4:
 * names as the field's conventions have them, base units, counters that end in _total. PEN_ENOMEM
 * when out could not take all of it.
 */
int pen_metrics_write(const struct pen_farm *farm, struct pen_jobs *jobs, struct pen_buf *out);

#endif
