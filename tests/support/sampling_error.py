# SPDX-License-Identifier: Apache-2.0
"""Errors of pixels, of v / (1 + v), against a render of many samples; what uniform sampling costs.

Of each pixel the error is that of its worst channel.
"""
import math

import image
import numpy as np
import scene


def compress(pixels):
    pixels = np.maximum(pixels.astype(np.float64), 0)
    return pixels / (1 + pixels)


class Subject:
    """Renders of one scene, compared with one of so many samples and another seed."""

    def __init__(self, service, scene, samples):
        self.service, self.scene = service, scene
        self.reference = compress(self.render({"samples": samples, "seed": 1 << 20})[0])

    def render(self, sampling, seconds=3600):
        """The pixels, and the mean samples of one."""
        render = self.service.submit({**self.scene, "sampling": sampling})
        done = self.service.wait(render, seconds)
        pixels = image.read(self.service.image(render))
        self.service.request("DELETE", f"/v1/renders/{render}")
        return pixels, done["samples_done"] / (pixels.shape[0] * pixels.shape[1])

    def errors(self, sampling):
        """Of each pixel, and the mean samples of one."""
        pixels, samples = self.render(sampling)
        return np.abs(compress(pixels) - self.reference).max(axis=2), samples

    def uniform(self, samples):
        errors, mean = self.errors({"mode": "uniform", "samples": samples})
        return {"mode": "uniform", "samples": mean, **figures(errors)}

    def adaptive(self, error, samples):
        errors, mean = self.errors({"mode": "adaptive", "samples": samples, "error": error})
        return {"mode": "adaptive", "error": error, "samples": mean, **figures(errors),
                "beyond": (errors > error).mean(), "beyond_4": (errors > 4 * error).mean()}


def figures(errors):
    """The 99th percentile and the root mean square."""
    return {"p99": np.percentile(errors, 99), "rmse": math.sqrt((errors ** 2).mean())}


def interpolate(at, xs, ys):
    """On straight lines between logarithms."""
    order = np.argsort(xs)
    return math.exp(np.interp(math.log(at), np.log(xs)[order], np.log(ys)[order]))


def compare(uniform, adaptive):
    """How many times as many samples uniform sampling needs for the same 99th percentile, and its
    RMSE at as many samples over that of adaptive."""
    samples, p99, rmse = ([row[key] for row in uniform] for key in ("samples", "p99", "rmse"))
    return (interpolate(adaptive["p99"], p99, samples) / adaptive["samples"],
            interpolate(adaptive["samples"], samples, rmse) / adaptive["rmse"])


def small_scene():
    """A lens, a soft shadow, edges and gloss on 24x16 pixels."""
    return scene.build(
        24, 16, 1,
        [scene.floor(half=30, material="grey"), scene.sphere([-0.7, 1, 0], material="satin"),
         scene.sphere([1.2, 0.7, 1.5], 0.7, material="grey")],
        camera=scene.look([0, 2, 7], [0, 0.8, 0], aperture_radius=0.15, focus_distance=7),
        materials={"grey": scene.matte(0.6), "satin": scene.glossy(0.4, 0.8)},
        lights=[scene.panel([-2, 5, 0], [2, 0, 0], [0, 0, 2], 8)], background=0.3)


def seeds_beyond(subject, error, confidence, seeds):
    """The shares of pixels off by more than error, and by more than four times as much."""
    errors = np.stack([subject.errors({"mode": "adaptive", "samples": 2048, "error": error,
                                       "confidence": confidence, "seed": seed})[0]
                       for seed in range(seeds)])
    return float((errors > error).mean()), float((errors > 4 * error).mean())
