"""Periodic sides: closed forms, of a metre of thickness.

A closed chain of N discs of radius R in a length L: its bonds are open by L/N - 2R, each pulls with E A / (2R) times
that, A = 2R, and the chain breaks at the gap 2R T / E.

A layer at rest under gravity g: the force across a horizontal line is the weight of the centres above it, so that the
mean of syy from y0 to y1 is sum of m g w(y) / L, w the part of these heights below the centre; that on a slope has
sxy/syy = -tan of its angle where all forces are in equilibrium.

Heat in the chain, conductance H of a contact, capacity C of a disc: a wave once around, T_k = cos(2 pi k / N), decays
by 1 - 4 H dt / C sin^2(pi / N) per step.
"""

from __future__ import annotations

import math

import numpy as np


def tension(modulus: float, radius: float, gap: float) -> float:
    """Force in the bonds of the chain [N]."""
    return modulus * gap


def breaking_gap(modulus: float, strength: float, radius: float) -> float:
    """Gap [m] at which they break."""
    return 2.0 * radius * strength / modulus


def weight_stress(weight: np.ndarray, y: np.ndarray, low: float, high: float, length: float) -> float:
    """Mean of syy [Pa] of particles of weight (n,) [N] at heights y (n,) [m]."""
    return math.fsum(weight * (np.clip(y, low, high) - low)) / ((high - low) * length)


def decay(conductance: float, capacity: float, dt: float, number: int) -> float:
    """Factor per step of the heat wave."""
    return 1.0 - 4.0 * conductance * dt / capacity * math.sin(math.pi / number) ** 2
