# SPDX-License-Identifier: Apache-2.0
"""Curves of error over samples as SVG, both axes logarithmic: uniform in blue, adaptive in red."""
import math

COLORS = {"uniform": "#1f6fb4", "adaptive": "#c8501e"}
KEYS = {"p99": "99th percentile", "rmse": "RMSE"}
SAMPLES = [16 << 2 * i for i in range(4)]
ERRORS = [0.1, 0.01, 0.001]
LEAST = 0.0004
WIDTH, HEIGHT = 380, 250


def place(samples, error):
    """Within a panel."""
    return 60 + 46 * math.log2(samples / 16), 30 + 80 * math.log10(ERRORS[0] / error)


def curve(rows, key):
    points = [place(row["samples"], row[key]) for row in rows]
    color = COLORS[rows[0]["mode"]]
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    dots = "".join(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{color}"/>'
                   for x, y in points)
    return f'<polyline points="{path}" fill="none" stroke="{color}"/>{dots}'


def axes():
    parts = []
    for samples in SAMPLES:
        x, y = place(samples, LEAST)
        parts.append(f'<path d="M{x:.0f} 30V{y:.0f}" stroke="#ddd"/>'
                     f'<text x="{x:.0f}" y="{y + 14:.0f}" text-anchor="middle">{samples}</text>')
    for error in ERRORS:
        x, y = place(SAMPLES[-1], error)
        parts.append(f'<path d="M60 {y:.0f}H{x:.0f}" stroke="#ddd"/>'
                     f'<text x="54" y="{y + 4:.0f}" text-anchor="end">{error:g}</text>')
    return "".join(parts)


def panel(rows, name, key, at):
    """One scene's curves, moved to a place; a legend in the upper right corner."""
    parts = [f'<text x="60" y="18">{name}: {KEYS[key]} of the error over samples a pixel</text>',
             axes()]
    for i, (mode, color) in enumerate(COLORS.items()):
        parts.append(f'<text x="290" y="{46 + 14 * i}" fill="{color}">{mode}</text>')
        found = [row for row in rows if (row["scene"], row["mode"]) == (name, mode)]
        parts.append(curve(found, key))
    return f'<g transform="translate({at[0]} {at[1]})">{"".join(parts)}</g>'


def plot(rows, names):
    panels = [panel(rows, name, key, (WIDTH * column, HEIGHT * line))
              for column, name in enumerate(names) for line, key in enumerate(KEYS)]
    width, height = WIDTH * len(names), HEIGHT * len(KEYS)
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
            f'font-family="sans-serif" font-size="11"><rect width="{width}" height="{height}" '
            'fill="white"/>\n' + "\n".join(panels) + "\n</svg>\n")
