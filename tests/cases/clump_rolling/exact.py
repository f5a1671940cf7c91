"""A body with a round outline of radius R rolls down a plane inclined by alpha without slipping.

Along the plane  M s'' = M g sin(alpha) - F,  about the centre  I s'' / p = F p,  hence

    s'' = g sin(alpha) / (1 + I / (M p^2)),     F = M g sin(alpha) / (1 + M p^2 / I)

p being the lever arm of the friction: R less half the overlap u = M g cos(alpha) / k of the contact. F is borne by a
shear spring k that is not strained at the start: the rim moves against the plane at up to F / sqrt(k m), m being the
mass that a push along the plane moves there, 1/m = 1/M + p^2/I. It needs
F <= mu M g cos(alpha), that is tan(alpha) <= mu (1 + M p^2 / I); beyond that the body slides, and

    s'' = g (sin(alpha) - mu cos(alpha)),     spin' = mu M g cos(alpha) p / I
"""

from __future__ import annotations

import math

G = 9.8


def overlap(mass: float, alpha: float, k: float) -> float:
    """Of the contact with the plane at rest [m]."""
    return mass * G * math.cos(alpha) / k


def rolling(alpha: float, gyration2: float, p: float) -> float:
    """Acceleration down the plane [m/s2]; gyration2: I / M [m2]."""
    return G * math.sin(alpha) / (1.0 + gyration2 / p**2)


def swing(mass: float, alpha: float, gyration2: float, p: float, k: float) -> float:
    """Largest speed of the rim against the plane [m/s]."""
    force = mass * G * math.sin(alpha) / (1.0 + p**2 / gyration2)
    return force / math.sqrt(k * mass / (1.0 + p**2 / gyration2))


def sliding(alpha: float, mu: float, gyration2: float, p: float) -> tuple[float, float]:
    """Acceleration down the plane [m/s2] and angular acceleration [rad/s2]."""
    return G * (math.sin(alpha) - mu * math.cos(alpha)), mu * G * math.cos(alpha) * p / gyration2
