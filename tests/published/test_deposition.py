"""How thick a layer becomes that is poured by GEN.

Published (ZDEM manual, 5.2 and the reference of GEN): a rule of thumb, 2 km filled with loose particles settle to about
1 km, 1 km to about 0.5 km; in the published figure of push_add_del.py 2 km have become 1.0 km. Ours are 1.14 and 0.56
km: GEN fills 0.48 of the space, and settled rough particles under little load cover 0.84. Without friction they are
1.03 and 0.50 km (docs/physics.md).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.published import measure
from tests.published.conftest import program

DECK = """\
START
SET disk off
SET seed 5
BOX left 0.0 right 12000.0 bottom 0.0 height 9000.0
WALL id 0 nodes (0.0, 1000.0) (12000.0, 1000.0) fric 0.3
WALL id 1 nodes (0.0, 9000.0) (0.0, 1000.0)
WALL id 2 nodes (12000.0, 1000.0) (12000.0, 9000.0)
SET dt 0.05
SET gravity 0.0 -9.8
SET print 3000
GEN num 40000 rad discrete 60.0 80.0 x (0.0, 12000.0) y (1000.0, 3000.0) group first
PROP density 2500.0 shear 2.9e9 poiss 0.2 fric 0.3 damp 0.4 hertz
CYC 3000
GEN num 40000 rad discrete 60.0 80.0 x (0.0, 12000.0) y ({top}, {top}+1000.0) group second
PROP density 2500.0 shear 2.9e9 poiss 0.2 fric 0.3 damp 0.4 hertz range group second
CYC 3000
STOP
"""


def level(g: measure.Grains, inside: np.ndarray) -> float:
    """Mean height of the surface of some of the grains, 1 km at either wall left out [m]."""
    xs, ys = measure.surface(g.x[inside], (g.y + g.r)[inside], 200.0)
    return float(ys[(xs > 1000.0) & (xs < 11000.0)].mean())


def test_two_kilometres_of_fill_settle_to_about_one(tmp_path: Path) -> None:
    one, two = measure.series(program(tmp_path, "deposition", DECK))
    first = level(one, one.group == "first") - 1000.0
    second = level(two, two.group != "") - first - 1000.0
    print(f"2 km settle to {first:.0f} m, 1 km to {second:.0f} m")
    assert first == pytest.approx(1070.0, abs=100.0)
    assert second == pytest.approx(first / 2.0, rel=0.15)
