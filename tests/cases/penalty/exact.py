"""Stiffness of a mesh with a joint on every inner edge, under a uniform stress.

A joint of length h before its peak is a spring: traction t makes the jump h t / P, for opening and for sliding with
the same penalty P (slope of T (2 r - r^2) at r = 0, o_p = 2 h T / P). Let the stress be uniform, S. A joint with the
normal n then carries S n and jumps by h S n / P; the elements stay as they are and move apart as rigid bodies. This is
possible if the jumps around every inner point add up to zero:

    sum h S n / P = S / P  sum h n = 0,

h n being the edges that leave the point, turned by 90 degrees: they must add up to zero, as in every lattice in which
each edge goes on beyond the point. Averaging the gradient of the displacement over an area A that holds the joints j,

    strain = C S + 1/(A P)  sum_j h_j^2 sym((S n_j) n_j^T).

For squares, for squares with both diagonals and for equilateral triangles sum h^2 n n^T / A is k times the unit matrix:

    squares            2 edges of length d per d^2                        k = 1
    both diagonals     the same, and 4 halves of diagonals, h^2 = d^2/2   k = 2
    equilateral        2/sqrt(3)/L^2 edges of each of 3 directions        k = 3/2 * 2/sqrt(3) = sqrt(3)

so strain = C S + k S / P: under uniaxial stress, plane strain, with E' = E/(1 - nu^2), stiffness E' / (1 + k E'/P) and
lateral strain -nu/(1 - nu) S/E' as without joints.
"""

from __future__ import annotations

import math

FACTORS = {"squares": 1.0, "both": 2.0, "equilateral": math.sqrt(3.0)}


def stiffness(young: float, poisson: float, penalty: float, lattice: str) -> float:
    """Stress over strain along the load [Pa]."""
    plane = young / (1.0 - poisson**2)
    return plane / (1.0 + FACTORS[lattice] * plane / penalty)


def lateral(young: float, poisson: float) -> float:
    """Strain across over stress [1/Pa]."""
    return -poisson * (1.0 + poisson) / young
