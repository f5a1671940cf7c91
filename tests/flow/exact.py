"""Closed forms of flow in channels. Nothing of hpcdem is imported."""

from __future__ import annotations

import math

import numpy as np


def transient(xi: float, t: float, terms: int = 60) -> float:
    """p / p_A in a channel whose far end is closed, at the distance xi of that end over its length, T = D t / L^2
    (Carslaw and Jaeger 1959; 91 with C-34)."""
    n = np.arange(terms)
    odd = 2 * n + 1
    parts = np.exp(-(odd**2) * math.pi**2 * t / 4.0) * np.cos(odd * math.pi / 2.0 * xi) * (-1.0) ** (n + 1) / odd
    return 1.0 + 4.0 / math.pi * float(parts.sum())


def radial(r: np.ndarray, inner: tuple[float, float], outer: tuple[float, float]) -> np.ndarray:
    """Steady pressure around a hole between (radius, pressure) and (radius, pressure) (89)."""
    (a, p), (b, q) = inner, outer
    return p + (q - p) / math.log(b / a) * np.log(r / a)


def dupuit(x: float, left: float, right: float, length: float) -> float:
    """Height of a free surface between two levels (90 with C-33)."""
    return math.sqrt(left**2 - (left**2 - right**2) * x / length)


def charny(conductivity: float, left: float, right: float, length: float) -> float:
    """Discharge through a dam with upright sides, exact with its seepage face [m2/s]."""
    return conductivity * (left**2 - right**2) / (2.0 * length)


def lattice(aperture: float, edge: float) -> float:
    """Permeability of a triangular lattice of channels [m2]: conduct a unit gradient along its edges and across, and
    both give sqrt(3) / (12 l) delta^3 per unit of thickness."""
    return math.sqrt(3.0) * aperture**3 / (12.0 * edge)


def front(over: float, time: float, length: float, matrix: tuple[float, float, float], mu: float) -> float:
    """Volume that both walls take up at a constant pressure over that at a sharp front [m2] (Green & Ampt 1911,
    without gravity): the flux k over / (mu X) fills the empty pores n (1 - S) at the front X, so that X^2 = 2 k over
    t / (mu n (1 - S)); matrix: permeability, porosity, saturation before."""
    k, porosity, saturation = matrix
    empty = porosity * (1.0 - saturation)
    return 2.0 * length * empty * math.sqrt(2.0 * k * over * time / (mu * empty))


def carter(
    over: float, time: float, length: float, matrix: tuple[float, float, float], bulk: float, mu: float
) -> float:
    """Volume that both walls take up at a constant pressure over that of the pores (86, 87 with C-31) [m2];
    matrix: permeability, porosity, compressibility."""
    k, porosity, compressibility = matrix
    c = over * math.sqrt(k * porosity * (1.0 / bulk + compressibility) / (math.pi * mu))
    return 2.0 * 2.0 * c * length * math.sqrt(time)
