/* SPDX-License-Identifier: Apache-2.0 */
#ifndef PEN_SERVER_DECIDE_H
#define PEN_SERVER_DECIDE_H

#include "core/base/error.h"
#include "server/quota.h"

/*
 * Decides from the sums of a whole frame which pixels get another round; every tile has what it
 * shall have so far. Raises quota->decided. A function of the sums and the request alone: no tile
 * border counts, and nothing of the C library's mathematics.
 *
 * Edge (the course paper): both pixels of each pair of left or upper neighbours whose colours,
 * sRGB-encoded and clamped, are further apart than the threshold get all rounds.
 *
 * Adaptive (Lee, Redner, Uselton 1985): a pixel stops when its estimated error, at the asked
 * confidence, is below the asked error in every channel. The variance of a block of sixteen samples
 * is averaged over 3x3 pixels, and at least half of the largest such mean of the 3x3 pixels around
 * counts, so that a pixel does not stop by the luck of its first samples where its neighbours know
 * better. As in the paper, the estimate is taken for as far below the truth as chi-squared allows
 * at the confidence; since a pixel is tested again and again, each test gets a fifth of the chance
 * that is left.
 *
 * fd: the framebuffer. May block on disk: for the thread pool. PEN_EIO, PEN_ENOMEM.
 */
int pen_decide(struct pen_quota *quota, int fd, struct pen_error *err);

/* How many standard deviations a normal variable stays within at this confidence, 0 < c < 1. */
double pen_decide_deviations(double confidence);

/*
 * How much of the true variance an estimate from so many blocks shows at least, at this confidence,
 * over 1/2: the lower quantile of chi-squared over its degrees of freedom. A block counts for two,
 * one of the pixel's own and one of its neighbours, whose variances are not quite the same.
 */
double pen_decide_least_share(uint32_t blocks, double confidence);

/* The sRGB transfer curve (IEC 61966-2-1) of a value clamped to 0..1. */
double pen_decide_encode(double linear);

#endif
