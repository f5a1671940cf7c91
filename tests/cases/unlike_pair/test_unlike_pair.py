"""V12: Hertz contact of unlike balls.

Rt = 2 Ra Rb / (Ra + Rb) = 2 60 80 / 140 = 68.5714; G and nu of the contact are the means of the two (PFC's rule);
Fn = 2 G sqrt(2 Rt) / (3 (1 - nu)) U^(3/2).
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.commands.dem import particles, properties
from tests.support import force, model, only, pair, steps
from tests.tables import each

MATERIALS = [((2.9e9, 0.2), (2.9e9, 0.2)), ((2.9e9, 0.2), (1.1e9, 0.35))]


@each(("first", "second"), MATERIALS)
@each("overlap", [1e-3, 1.0, 17.0])
@each("direction", [0.0, 0.7, 2.5, -1.9])
def test_v12_force(tmp_path, first, second, overlap, direction):
    rt = 2.0 * 60.0 * 80.0 / 140.0
    assert rt == pytest.approx(68.5714, abs=5e-5)
    n = np.array([math.cos(direction), math.sin(direction)])
    sim = model(tmp_path, disk="off")
    particles.ball(sim, 0, 0.0, 0.0, 60.0)
    particles.ball(sim, 1, *((140.0 - overlap) * n), 80.0)
    for gid, (shear, nu) in enumerate((first, second)):
        properties.prop(sim, only(gid), shear=shear, poiss=nu, hertz=True)
    properties.fix(sim, ("x", "y", "spin"))
    steps(sim, 1)

    contact = pair(sim)
    g, nu = 0.5 * (first[0] + second[0]), 0.5 * (first[1] + second[1])
    k = 2.0 * g * math.sqrt(2.0 * rt) / (3.0 * (1.0 - nu))
    u = 140.0 - math.dist((0.0, 0.0), (140.0 - overlap) * n)  # the overlap that doubles can hold
    assert contact.overlap == pytest.approx(overlap, rel=1e-10)
    assert contact.fn == pytest.approx(k * u**1.5, rel=1e-10)
    assert force(sim, 0)[:2] == pytest.approx(-contact.fn * n, rel=1e-10, abs=1e-10 * contact.fn)
    assert (force(sim, 0) == -force(sim, 1)).all(), "equal and opposite to the last bit"
    assert (contact.x, contact.y) == pytest.approx(tuple((60.0 - 0.5 * u) * n), abs=1e-9)
