"""Moduli of elements as stress and strain of a model have them: the one place where plane stress and plane strain part.

In space and in plane strain three normal stresses count, in plane stress the two of the plane: the stress across it is
0 and the strain there whatever that takes. With n of them, their mean per volume strain (sum of their strains) is K_n,
and

    lambda = K_n - 2 G / n,     K_3 = K,     K_2 = 9 K G / (3 K + 4 G) = E / (2 (1 - nu)),

so lambda is lambda' = 2 lambda G / (lambda + 2 G) in plane stress, and lambda + 2 G = E / (1 - nu^2) the modulus of the
fastest wave. The laws of elements take lambda and 2 G of here and are given by a column of their tables,
`elements.FREE`, that the strain across the plane is free.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from hpcdem.physics.fdem.properties import Rows


class Moduli(NamedTuple):
    """Moduli of the rows of element models [Pa]: K_n, G, lambda, lambda + 2 G; normal: columns of the normal stresses
    that count."""

    bulk: np.ndarray
    shear: np.ndarray
    lame: np.ndarray
    wave: np.ndarray
    normal: list[int]


def moduli(rows: Rows, plane_stress: bool) -> Moduli:
    """Compute the moduli of the models of elements; zero where a model is missing."""
    bulk, shear = (np.array(rows.column(name)) for name in ("bulk", "shear"))
    if not plane_stress:
        return Moduli(bulk, shear, bulk - 2.0 / 3.0 * shear, bulk + 4.0 / 3.0 * shear, [0, 1, 3])
    stiff = 3.0 * bulk + 4.0 * shear
    plane = np.divide(9.0 * bulk * shear, stiff, out=np.zeros_like(bulk), where=stiff > 0.0)
    return Moduli(plane, shear, plane - shear, plane + shear, [0, 1])


def element_table(sim: Any) -> np.ndarray:
    """The table of element models (rows, 5) of build.py."""
    of = moduli(sim.element_rows, sim.options.plane_stress)
    density, young, damp = map(sim.element_rows.column, ("density", "young", "damp_factor"))
    return np.column_stack([density, of.lame, 2.0 * of.shear, young, damp])
