"""The energy budget in cases that can be worked out.

**Bounce, linear.** A ball of mass m touches a spring k; x(n) is its way into it at step n. Leap-frog conserves
m v(n-1/2) v(n+1/2) / 2 + k x(n)^2 / 2 exactly, and this is what the budget takes for the energy at a whole step: from n
to n+1 the force does (k x(n) + k x(n+1))/2 (x(n+1) - x(n)) in it, the difference of the k x^2 / 2. In the step in which
the ball leaves by a gap g there is no k x(n+1): the work is k x (x + g) / 2, of which k x^2 / 2 was stored.

**Bounce, Hertz.** Fn = K U^(3/2), E = 2/5 Fn U. At the deepest point all is elastic:
U_max = (5 m v0^2 / (4 K))^(2/5).

**Sliding block.** A disc that cannot turn is pressed on a floor by N and launched with v0. Its shear spring takes
d0 = mu N / ks to be strained and holds mu N d0 / 2 from then on; friction takes mu N (s - d0) on a way s.

**Lattice-solid damping.** v(n+1/2) = r v(n-1/2), r = 1 - eta dt / m; the motion at a whole step is m r v(n-1/2)^2 / 2.
From n = 0 to N it loses m/2 r v(-1/2)^2 (1 - r^(2N)).

**Row between two walls.** Springs in series: the energy of a row compressed by s is s^2 / (2 sum 1/k).

**Stiffness.** A pair is sheared at the overlap U1 to Fs, then pressed to U2 with Fs kept: the spring stiffens from ks1
to ks2 and Fs^2/2 (1/ks1 - 1/ks2) is lost; on the way back it is gained.

**Bond.** A bond of stiffness S pulled apart breaks at the gap g: S g^2 / 2 is released.
"""

from __future__ import annotations

import math


def hertz_factor(shear: float, nu: float, two_rt: float) -> float:
    """K of Fn = K U^(3/2)."""
    return 2.0 * shear * math.sqrt(two_rt) / (3.0 * (1.0 - nu))


def mindlin(shear: float, nu: float, two_rt: float, u: float) -> float:
    """Shear stiffness ks at overlap u."""
    return 2.0 * shear * math.sqrt(two_rt * u) / (2.0 - nu)


def deepest(mass: float, v0: float, k: float) -> float:
    """Largest overlap of a Hertz impact."""
    return (5.0 * mass * v0**2 / (4.0 * k)) ** 0.4


def lattice_loss(mass: float, v0: float, eta: float, dt: float, n: int) -> float:
    """What lattice-solid damping takes in n steps."""
    r = 1.0 - eta * dt / mass
    return 0.5 * mass * r * v0**2 * (1.0 - r ** (2 * n))
