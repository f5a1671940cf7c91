"""A bolt of length L in rock that does not move, pulled with P at its head.

Axial force N(x) = E A u'(x) of the displacement u into the direction of the pull, x from the toe; the grout gives the
shear flow K u up to S per length.

Elastic: E A u'' = K u, beta^2 = K / (E A), N = 0 at the toe: u = u0 cosh(beta x), so at the head
P = E A beta tanh(beta L) u_head.

Slip begins at the head where K u = S: P = (S / beta) tanh(beta L). Beyond, a length a at the head slips with S, and the
rest L - a is at that limit itself: P = S a + (S / beta) tanh(beta (L - a)). The most is S L.

Displacement of the head then: u = S / K at the end of the elastic part; in the slipping part N grows by S per length:
u_head = S / K + (N1 a + S a^2 / 2) / (E A), N1 = (S / beta) tanh(beta (L - a)).
"""

from __future__ import annotations

import math


def axial_stiffness(young: float, diameter: float) -> float:
    """E A [N]."""
    return young * 0.25 * math.pi * diameter**2


def head_stiffness(ea: float, k: float, length: float) -> float:
    """P / u at the head [N/m]."""
    beta = math.sqrt(k / ea)
    return ea * beta * math.tanh(beta * length)


def pull(slipping: float, ea: float, k: float, strength: float, length: float) -> tuple[float, float]:
    """Force [N] and displacement of the head [m] when a length `slipping` [m] at it slips, from 0: slip begins."""
    beta = math.sqrt(k / ea)
    rest = strength / beta * math.tanh(beta * (length - slipping))
    force = strength * slipping + rest
    return force, strength / k + (rest * slipping + 0.5 * strength * slipping**2) / ea
