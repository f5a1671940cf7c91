"""Closed forms of a plane hydraulic fracture for tests, besides those of the case (kgd_solutions.py)."""

from __future__ import annotations

import math


def lag_time(young: float, viscosity: float, confinement: float) -> float:
    """E'^2 mu' / sigma_0^3 [s]: long after it the fluid reaches the tip. confinement: sigma_0 across the fracture, as a
    positive number [Pa]."""
    return 12.0 * viscosity * young * young / confinement**3


def leaking_length(rate: float, leak: float, time: float) -> float:
    """Half length [m] when all fluid goes into the rock, C / sqrt(t) per wall: Q = 4 C times the integral of
    (t - x^2 / a^2)^(-1/2) to L = a sqrt(t), so L = Q sqrt(t) / (2 pi C). leak: C [m / s^1/2]."""
    return rate * math.sqrt(time) / (2.0 * math.pi * leak)


def process_length(young: float, energy: float, strength: float) -> float:
    """E' G / T^2 [m]: about the length over which joints soften before the tip."""
    return young * energy / strength**2


def false_energy(edge: float, strength: float, penalty: float) -> float:
    """What joints take besides G before their peak [N/m]: 2 / 3 T o_p with o_p = 2 h T / P."""
    return 4.0 / 3.0 * edge * strength**2 / penalty
