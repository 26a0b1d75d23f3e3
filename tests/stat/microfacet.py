# SPDX-License-Identifier: Apache-2.0
"""Directional albedo of GGX surfaces by plain quadrature, independent of the renderer.

For a direction i to the viewer the share of light that a rough surface scatters is the integral
over half vectors h (Walter, Marschner, Li, Torrance 2007, equations 20, 21 and 39)

    integral D(h) G2(i, o) |i.h| / |i.n| dh

for reflection, times F or 1 - F for a dielectric; G2 is the separable form, as in Cycles 3.4. With
tan^2(theta) = a^2 u / (1 - u) the measure D(h) (h.n) dh is du dphi / (2 pi). u = 1 - t^2 takes away
the pole 1 / (h.n) at u = 1, so that a midpoint rule over t and phi is all that is needed; by
symmetry half of all phi are enough.
"""
import numpy as np


def _half_vectors(alpha, steps):
    """Half vectors h (x, y, z with z along n), and D(h) (h.n) dh of each times their number."""
    t = (np.arange(steps) + 0.5) / steps
    phi = np.pi * (np.arange(steps) + 0.5) / steps
    t, phi = np.meshgrid(t, phi, indexing="ij")
    tangent = alpha * np.sqrt(1 - t ** 2) / t
    cosine = 1 / np.sqrt(1 + tangent ** 2)
    sine = tangent * cosine
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), cosine]), 2 * t


def _lambda(z, alpha):
    """Smith's Lambda of a direction with cosine z to the normal."""
    tangent2 = (1 - z ** 2) / np.maximum(z ** 2, 1e-20)
    return (np.sqrt(1 + alpha ** 2 * tangent2) - 1) / 2


def _masking(i, o, alpha):
    """G2, separable: G1 of both directions, on either side of the surface."""
    return 1 / ((1 + _lambda(abs(i[2]), alpha)) * (1 + _lambda(np.abs(o[2]), alpha)))


def fresnel(cosine, eta):
    """Reflectance of a dielectric; eta = index behind the surface over index before it."""
    sine2 = (1 - cosine ** 2) / eta ** 2
    inside = np.sqrt(np.maximum(1 - sine2, 0))
    perpendicular = (cosine - eta * inside) / (cosine + eta * inside)
    parallel = (eta * cosine - inside) / (eta * cosine + inside)
    return np.where(sine2 >= 1, 1.0, (perpendicular ** 2 + parallel ** 2) / 2)


def _view(angle):
    return np.array([np.sin(np.radians(angle)), 0, np.cos(np.radians(angle))])


def _integrate(weight, i, h, measure):
    along = np.maximum(np.tensordot(i, h, axes=1), 0)
    return float((weight * measure * along / (i[2] * h[2])).mean())


def _reflected(i, h):
    return 2 * np.tensordot(i, h, axes=1) * h - i[:, None, None]


def glossy(alpha, angle, steps=400):
    """Albedo of a reflector without Fresnel, seen at an angle in degrees from the normal."""
    i, (h, measure) = _view(angle), _half_vectors(alpha, steps)
    o = _reflected(i, h)
    weight = np.where(o[2] > 0, _masking(i, o, alpha), 0)
    return _integrate(weight, i, h, measure)


def glass(alpha, angle, eta, steps=400):
    """Reflection and transmission together of one rough interface."""
    i, (h, measure) = _view(angle), _half_vectors(alpha, steps)
    cosine = np.maximum(np.tensordot(i, h, axes=1), 1e-9)
    share = fresnel(cosine, eta)
    up = _reflected(i, h)
    reflection = np.where(up[2] > 0, share * _masking(i, up, alpha), 0)
    inside = np.sqrt(np.maximum(1 - (1 - cosine ** 2) / eta ** 2, 0))
    down = (cosine / eta - inside) * h - i[:, None, None] / eta
    transmission = np.where(down[2] < 0, (1 - share) * _masking(i, down, alpha), 0)
    return _integrate(reflection + transmission, i, h, measure)
