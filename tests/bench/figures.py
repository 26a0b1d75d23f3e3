# SPDX-License-Identifier: Apache-2.0
"""Lines of figures: a median, what it lies between, and what is promised of it."""
import math
import statistics

HEAD = f"{'':44}{'median':>9}  between            of  promised"


def interval(values):
    """Where the true median lies with 95 %, by the signs; of few values, the least and greatest."""
    found, count = sorted(values), len(values)
    rank, tail = 0, 0.5 ** count
    while tail + math.comb(count, rank + 1) * 0.5 ** count <= 0.025:
        rank += 1
        tail += math.comb(count, rank) * 0.5 ** count
    return found[rank], found[-1 - rank]


class Page:
    """What has been printed, and whether all that is promised holds."""

    def __init__(self):
        self.holds = True
        print(HEAD, flush=True)

    def line(self, name, values, least=None, most=None):
        median, (low, high) = statistics.median(values), interval(values)
        promised = f">= {least:g}" if least is not None else f"<= {most:g}" if most is not None else ""
        holds = (least is None or median >= least) and (most is None or median <= most)
        self.holds &= holds
        print(f"{name:44}{median:9.4g}  {f'{low:.4g} to {high:.4g}':18}{len(values):3}"
              f"  {promised}{'' if holds else '  MISSED'}".rstrip(), flush=True)
