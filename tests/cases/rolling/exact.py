"""A disc that rolls without sliding on a plane, against a rolling resistance of at most M = mu_r R N (Ai et al. 2011).

About the point of contact, with the plane inclined by beta, I = m R^2/2 (disc) and N = m g cos(beta):

    (I + m R^2) dw/dt = m g R sin(beta) - mu_r R m g cos(beta)     while it rolls down
    a = 2/3 g (sin(beta) - mu_r cos(beta))

It stays if tan(beta) <= mu_r. On the level the deceleration is a = 2/3 mu_r g, and v0^2/(2 a) is the distance to rest.
Sphere (I = 2/5 m R^2): 5/7 in the place of 2/3. Numbers: mu_r = 0.1, g = 9.8: 0.65333 m/s2; v0 = 0.5 m/s: 0.19133 m.

Type C: the spring kr = 3 kn mu_r^2 R^2 turns the disc back with omega^2 = kr/(I + m R^2) when it stops; with damping
eta_r the amplitude falls as a damped oscillator's, and at eta_r = 1 it does not swing at all.
"""

from __future__ import annotations

import math

MU, G, R, KN, V0 = 0.1, 9.8, 0.5, 1e8, 0.5
"""Rolling friction, gravity [m/s2], radius [m], stiffness of disc and wall in series [N/m], first speed [m/s]."""


def acceleration(beta: float, arm: float = R, mu: float = MU, sphere: bool = False) -> float:
    """Along the slope, downwards [m/s2], of a disc that rolls down; arm: from its centre to the contact [m]."""
    inertia = (0.4 if sphere else 0.5) * R * R
    return arm * G * (math.sin(beta) * arm - mu * R * math.cos(beta)) / (inertia + arm * arm)
