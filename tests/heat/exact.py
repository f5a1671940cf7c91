"""Closed forms of heat conduction and thermal stress. Imports nothing of hpcdem."""

from __future__ import annotations

import math

import numpy as np
from scipy import special


def slab(x: np.ndarray, t: float, length: float, a: float) -> np.ndarray:
    """Share of the way of a slab, adiabatic at x = length, to the temperature that its face x = 0 takes at t = 0;
    diffusivity a [m2/s]. Carslaw & Jaeger 1959, 3.3: 1 - sum 2 / b sin(b x / L) exp(-b^2 a t / L^2),
    b = (n + 1/2) pi."""
    out = np.ones_like(x)
    for n in range(400):
        b = (n + 0.5) * math.pi
        out -= 2.0 / b * np.sin(b * x / length) * math.exp(-b * b * a * t / length**2)
    return out


def convective_slab(x: np.ndarray, t: float, length: float, a: float, biot: float) -> np.ndarray:
    """Share of the temperature of the beginning, above the environment, in a slab adiabatic at x = 0 and with transfer
    at x = length, biot = h L / k. Carslaw & Jaeger 1959, 3.11: sum 2 sin b / (b + sin b cos b) cos(b x / L)
    exp(-b^2 a t / L^2), b tan b = biot."""
    from scipy.optimize import brentq

    out = np.zeros_like(x)
    for n in range(60):
        b = brentq(lambda b: b * math.sin(b) - biot * math.cos(b), n * math.pi + 1e-12, (n + 0.5) * math.pi)
        out += (
            2.0 * math.sin(b) / (b + math.sin(b) * math.cos(b)) * np.cos(b * x / length)
            * math.exp(-b * b * a * t / length**2)
        )  # fmt: skip
    return out


def cylinder(r: np.ndarray, t: float, radius: float, a: float) -> np.ndarray:
    """Share of the way of a full cylinder to the temperature that its surface takes at t = 0. Carslaw & Jaeger 1959,
    7.6: 1 - sum 2 J0(b r / R) / (b J1(b)) exp(-b^2 a t / R^2), J0(b) = 0."""
    out = np.ones_like(r)
    for b in special.jn_zeros(0, 200):
        out -= 2.0 * special.j0(b * r / radius) / (b * special.j1(b)) * math.exp(-b * b * a * t / radius**2)
    return out


def sphere(r: np.ndarray, t: float, radius: float, a: float) -> np.ndarray:
    """Share of the way of a full sphere to the temperature that its surface takes at t = 0. Carslaw & Jaeger 1959, 9.3:
    1 + 2 R / (pi r) sum (-1)^n / n sin(n pi r / R) exp(-n^2 pi^2 a t / R^2)."""
    x = math.pi * np.maximum(r / radius, 1e-9)
    out = np.ones_like(x)
    for n in range(1, 200):
        out += 2.0 * (-1.0) ** n / (n * x) * np.sin(n * x) * math.exp(-((n * math.pi) ** 2) * a * t / radius**2)
    return out


def hollow_sphere(r: np.ndarray, inner: float, outer: float) -> np.ndarray:
    """Steady temperature, 1 at the inner and 0 at the outer surface: a (b / r - 1) / (b - a)."""
    return inner * (outer / r - 1.0) / (outer - inner)


def hollow_sphere_stress(r: np.ndarray, inner: float, outer: float) -> tuple[np.ndarray, np.ndarray]:
    """Its radial and tangential stress over alpha E T / (1 - nu), free surfaces. Timoshenko & Goodier 1970, 152."""
    a, b = inner, outer
    part = a * b / (b**3 - a**3)
    middle, cube = (a * a + a * b + b * b) / r, a * a * b * b / r**3
    return part * (a + b - middle + cube), part * (a + b - 0.5 * middle - 0.5 * cube)
