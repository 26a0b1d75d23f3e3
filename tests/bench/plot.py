# SPDX-License-Identifier: Apache-2.0
"""One picture of curves as SVG, both axes logarithmic."""
import math

COLORS = ["#1f6fb4", "#c8501e", "#2a8f3a"]
LEFT, TOP, WIDTH, HEIGHT = 70, 40, 400, 240


class Axis:
    """From the powers of ten around the values to pixels."""

    def __init__(self, values, start, length):
        self.first = math.floor(math.log10(min(values)))
        self.end = max(math.ceil(math.log10(max(values))), self.first + 1)
        self.start, self.length = start, length

    def place(self, value):
        share = (math.log10(value) - self.first) / (self.end - self.first)
        return self.start + share * self.length

    def ticks(self):
        return [10.0 ** power for power in range(self.first, self.end + 1)]


def grid(xs, ys):
    parts = []
    for value in xs.ticks():
        x = xs.place(value)
        parts.append(f'<path d="M{x:.1f} {TOP}V{TOP + HEIGHT}" stroke="#ddd"/><text x="{x:.1f}" '
                     f'y="{TOP + HEIGHT + 16}" text-anchor="middle">{value:g}</text>')
    for value in ys.ticks():
        y = ys.place(value)
        parts.append(f'<path d="M{LEFT} {y:.1f}H{LEFT + WIDTH}" stroke="#ddd"/>'
                     f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{value:g}</text>')
    return parts


def curve(points, xs, ys, color):
    places = [(xs.place(x), ys.place(y)) for x, y in points]
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
    return f'<polyline points="{path}" fill="none" stroke="{color}"/>' + "".join(
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{color}"/>' for x, y in places)


def plot(title, curves):
    """curves: by name, the points (x, y), all greater than 0."""
    points = [point for found in curves.values() for point in found]
    xs = Axis([x for x, _ in points], LEFT, WIDTH)
    ys = Axis([y for _, y in points], TOP + HEIGHT, -HEIGHT)
    parts = [f'<rect width="{LEFT + WIDTH + 30}" height="{TOP + HEIGHT + 30}" fill="white"/>',
             f'<text x="{LEFT}" y="24">{title}</text>', *grid(xs, ys)]
    for i, (name, found) in enumerate(curves.items()):
        parts.append(curve(found, xs, ys, COLORS[i]))
        parts.append(f'<text x="{LEFT + 8}" y="{TOP + 16 + 14 * i}" fill="{COLORS[i]}">{name}</text>')
    return (f'<svg xmlns="http://www.w3.org/2000/svg" width="{LEFT + WIDTH + 30}" '
            f'height="{TOP + HEIGHT + 30}" font-family="sans-serif" font-size="11">'
            + "\n".join(parts) + "</svg>\n")
