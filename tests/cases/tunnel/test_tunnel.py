"""A tunnel: convergence and stress of a circular one against Lame and Kirsch; cracks around a jointed one."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.cases import Tunnel
from tests.cases.kirsch import exact
from tests.cases.ready import results

FIELDS = """
for name in ('stress-xx', 'stress-yy', 'stress-xy', 'element-position-x', 'element-position-y', 'area'):
    values = pcdc.values('element', name)
    more[name.replace('-', '_')] = [float(v) for v in values[np.isfinite(pcdc.values('element', 'stress-xx'))]] \\
        if len(values) else []
"""


@pytest.mark.parametrize("elements", ["tri", pytest.param("quad", marks=pytest.mark.slow)])
def test_convergence_of_a_circular_tunnel(resident, tmp_path, elements):
    """Hydrostatic stress p: u = (1 + nu)/E p a. 2 %: the sides, 12 a away, where p stays, add 2 (1 - nu)(a/R)2 = 1 %,
    linear elements are too stiff by about as much."""
    case = Tunnel(elements=elements, stress_xx=-15e6, stress_yy=-15e6, size=0.3)
    done = results(resident, tmp_path, case)
    closed = (1 + case.poisson) / case.young * 15e6 * case.radius
    assert done.convergence == pytest.approx(closed, rel=0.02)
    for way in (done.crown, done.floor, done.left, done.right):
        assert way == pytest.approx(closed, rel=0.03)
    assert done.ratio < 1e-5


@pytest.mark.slow
def test_convergence_with_unequal_stress(resident, tmp_path):
    """Kirsch: the part of the displacement that the excavation brings is, at the wall, (1 + nu)/E a ((P1 + P2)/2 +
    (3 - 4 nu)(P1 - P2)/2 cos 2t), P1 along x: at the crown 2.0833 mm, at the sides 0.4167 mm. 3 % of the larger."""
    case = Tunnel(size=0.25)
    done = results(resident, tmp_path, case)
    unit = (1 + case.poisson) / case.young * case.radius
    crown, side = unit * (15e6 + 2 * 5e6), unit * (15e6 - 2 * 5e6)
    assert crown == pytest.approx(2.08333e-3, rel=1e-5)
    assert np.array([done.crown, done.floor]) == pytest.approx(crown, abs=0.03 * crown)
    assert np.array([done.left, done.right]) == pytest.approx(side, abs=0.03 * crown)


@pytest.mark.slow
@pytest.mark.parametrize("elements", ["tri", "quad"])
def test_stress_around_the_tunnel(resident, tmp_path, elements):
    """Kirsch's solution with P1 = -20, P2 = -10 MPa from 1.05 to 5 radii, after the stress of the core has died down:
    mean squares over the area within 2 % of 20 MPa."""
    case = Tunnel(
        elements=elements, radius=1.0, size=0.08, coarse=2.0, reach=20, stress_xx=exact.P1, stress_yy=exact.P2
    )
    done = results(resident, tmp_path, case, more=FIELDS)
    xx, yy, xy = (np.array(getattr(done, f"stress_{c}")) for c in ("xx", "yy", "xy"))
    x, y = np.array(done.element_position_x), np.array(done.element_position_y)
    x, y = x[np.isfinite(x)], y[np.isfinite(y)]
    r, t = np.hypot(x, y), np.arctan2(y, x)
    near = (r > 1.05) & (r < 5.0)
    assert near.sum() > 500
    for a, b in zip(exact.turned(xx, yy, xy, t), exact.polar(r, t), strict=True):
        assert math.sqrt(np.average((a - b)[near] ** 2, weights=np.array(done.area)[near])) < 0.02 * 20e6


@pytest.mark.slow
def test_a_horseshoe_yields_most_in_its_level_floor(resident, tmp_path):
    done = results(resident, tmp_path, Tunnel(shape="horseshoe", size=0.4))
    assert done.floor > 1.1 * done.crown > 0.0
    assert done.left == pytest.approx(done.right, rel=0.05) and done.left > 0.0
    assert done.hoop_most > 50e6 > 5e6 > done.hoop_least


@pytest.mark.slow
def test_a_jointed_tunnel_cracks_where_the_stress_is_largest(resident, tmp_path):
    """Vertical stress twice the horizontal one: the walls carry 50 MPa, twice the strength of the rock, the crown
    10."""
    more = """
state = pcdc.values('joint', 'state')
for axis in 'xy':
    more['crack_' + axis] = [float(v) for v in pcdc.values('joint', 'joint-position-' + axis)[state == 3]]
"""
    case = Tunnel(joints=True)
    done = results(resident, tmp_path, case, more=more)
    assert done.tension + done.mixed + done.shear > 20
    x, y = np.abs(done.crack_x), np.abs(done.crack_y)
    assert (x > y).mean() > 0.8
    assert (np.hypot(x, y) < case.zone * case.radius + case.size).all()
    elastic = (1 + case.poisson) / case.young * case.radius * (15e6 - 2 * 5e6)
    assert done.left > 2 * elastic and done.right > 2 * elastic
    assert done.energy_error < 0.01
