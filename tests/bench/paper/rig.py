# SPDX-License-Identifier: Apache-2.0
"""What the parts share: renders with their cost, errors, tables and pictures."""
import collections
import copy
import json
import os
import pathlib
import statistics

import image
import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[3]
PICTURES = ROOT / "tests/reference/papers"
TICKS = os.sysconf("SC_CLK_TCK")

# samples: a pixel, on average.
Render = collections.namedtuple("Render", "pixels seconds samples")
Spread = collections.namedtuple("Spread", "median least greatest")


def scene(name, **more):
    """A reference scene, with members of its parts replaced: image={"width": 100}."""
    found = json.loads((ROOT / "tests/reference/scenes" / f"{name}.json").read_text())
    return changed(found, **more)


def changed(given, **more):
    found = copy.deepcopy(given)
    for part, members in more.items():
        if isinstance(members, dict):
            found.setdefault(part, {}).update(members)
        else:
            found[part] = members
    return found


def processor_seconds(pids):
    """{pid: seconds that it has used}, of those that live."""
    found = {}
    for pid in pids:
        try:
            fields = pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        found[pid] = (int(fields[11]) + int(fields[12])) / TICKS
    return found


class Rig:
    def __init__(self, service, scratch):
        self.service, self.scratch = service, pathlib.Path(scratch)

    def render(self, wanted):
        """The linear pixels of a scene, and the processor seconds of the render processes."""
        before = processor_seconds(self.service.renders())
        render = self.service.submit(wanted)
        found = self.service.wait(render, 900)
        after = processor_seconds(self.service.renders())
        seconds = sum(used - before.get(pid, 0) for pid, used in after.items())
        path = self.scratch / "image.exr"
        path.write_bytes(self.service.image(render))
        samples = found["samples_done"] / (found["width"] * found["height"])
        return Render(image.read_file(path), seconds, samples)

    def counts(self, wanted):
        """The samples of each pixel over the most that one has, as grey pixels."""
        path = self.scratch / "image.exr"
        path.write_bytes(self.service.render(changed(wanted, image={"aovs": ["samples"]}), 900))
        found = image.read_file(path, ["samples.X"])
        return (found / found.max()).repeat(3, axis=2)

    def in_turn(self, scenes, runs=3):
        """{key: Spread of the processor seconds} of {key: scene}, rendered in turn runs times."""
        times = {key: [] for key in scenes}
        for _ in range(runs):
            for key, wanted in scenes.items():
                times[key].append(self.render(wanted).seconds)
        return {key: spread(found) for key, found in times.items()}


def load():
    """How busy the machine was in the last minute, as a sentence's part."""
    return f"a load of {os.getloadavg()[0]:.0f} on {os.cpu_count()} cores"


def spread(values):
    return Spread(statistics.median(values), min(values), max(values))


def rmse(pixels, reference):
    return float(np.sqrt(((pixels - reference) ** 2).mean()))


def squeezed(pixels):
    """v / (1 + v): what adaptive sampling's error is of."""
    return pixels / (1 + np.maximum(pixels, 0))


def at_error(error, errors, costs):
    """The cost at which a power law between neighbouring measurements reaches an error."""
    order = np.argsort(errors)
    return float(np.exp(np.interp(np.log(error), np.log(np.array(errors)[order]),
                                  np.log(np.array(costs)[order]))))


def exponent(sizes, costs):
    """p of the power law cost = c size^p that fits best."""
    return float(np.polyfit(np.log(sizes), np.log(costs), 1)[0])


def cell(value):
    if isinstance(value, Spread):
        return f"{value.median:.3g} ({value.least:.3g}–{value.greatest:.3g})"
    if isinstance(value, float):
        return f"{value:.0f}" if 1000 <= abs(value) < 1e6 else f"{value:.3g}"
    return str(value)


def table(head, rows):
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(map(cell, line)) + " |" for line in lines)


def encoded(pixels):
    """sRGB, clamped: what a screen shows."""
    clamped = np.clip(pixels, 0, 1)
    return np.where(clamped <= 0.0031308, 12.92 * clamped,
                    1.055 * np.maximum(clamped, 1e-9) ** (1 / 2.4) - 0.055)


def picture(name, panels, columns=4, magnify=1, caption=""):
    """Writes panels of equal size side by side to papers/NAME.png; tells how the page shows it."""
    height, width = panels[0].shape[:2]
    gap, rows = 4, -(-len(panels) // columns)
    columns = min(columns, len(panels))
    step_y, step_x = height * magnify + gap, width * magnify + gap
    sheet = np.ones((rows * step_y - gap, columns * step_x - gap, 3), dtype=np.float32)
    for k, panel in enumerate(panels):
        y, x = k // columns * step_y, k % columns * step_x
        sheet[y:y + height * magnify, x:x + width * magnify] = (
            encoded(panel).repeat(magnify, axis=0).repeat(magnify, axis=1))
    image.write_file(PICTURES / f"{name}.png", sheet, "uint8")
    return f"![{caption}](papers/{name}.png)"
