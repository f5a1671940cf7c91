"""Direct tension: a bar breaks at the strength of its joints, a dog-bone at its neck."""

from __future__ import annotations

import pytest

from hpcdem.cases import DirectTension
from tests.cases.ready import results
from tests.conftest import Launcher

BRITTLE = {"tensile_strength": 2e6, "gf1": 1e-4, "gf2": 0.2}
"""Fracture energies of the manual's example: 0.1 and 200 uN/mm."""


def test_strength_of_a_bar(launch, tmp_path):
    """Rows of joints across the load, the same stress everywhere: force over section is the strength. 1 %: a viscosity
    of 2 L sqrt(rho E) times the strain rate is 0.2 % of it; the regular mesh breaks in one row or in several."""
    done = results(launch, tmp_path, DirectTension(shape="bar", length=0.04, size=0.005, transits=10, **BRITTLE))
    assert done.peak == pytest.approx(2e6, rel=0.01)
    assert done.peak_joint == pytest.approx(2e6, rel=0.01)
    assert done.tension >= 6 and done.shear == 0
    assert done.energy_error < 0.01


@pytest.mark.slow
@pytest.mark.mpi
def test_ranks_find_the_same(launch, tmp_path):
    """Peak, cracks, energies and every point of the curve, to the last bit."""
    case = DirectTension(shape="bar", length=0.04, size=0.005, transits=5, **BRITTLE)
    one, *more = (results(launch, tmp_path / str(n), case, n) for n in (1, 2, 3, 4))
    assert one.tension > 0
    assert all(other == one for other in more)


@pytest.mark.slow
def test_strength_of_a_bar_of_fine_elements(launch, tmp_path):
    done = results(launch, tmp_path, DirectTension(shape="bar", length=0.06, **BRITTLE))
    assert done.peak == pytest.approx(2e6, rel=0.01) and done.peak_joint == pytest.approx(2e6, rel=0.01)
    assert done.energy_error < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("path", ["free", "line"])
def test_dog_bone(launch, tmp_path, path):
    """The edge of the neck has 1.065 times the mean stress (Neuber's deep hyperbolic notch, half width over radius
    0.1): a brittle neck breaks at 2/1.065 = 1.88 MPa or, as it is elements that carry the gradient, a little earlier;
    along inclined edges later. What is recorded of a joint is the mean of its three points: it stays 3 % behind, as
    with this fracture energy the outermost point is gone before the others have come up; in the bar all come up
    together."""
    done = results(launch, tmp_path, DirectTension(path=path, **BRITTLE))
    assert (1.70e6 if path == "line" else 1.80e6) < done.peak < 2.02e6
    assert 1.92e6 < done.peak_joint < 2.002e6
    # 8 mm from the neck the section is 1.4 % wider; an edge that is inclined by 7 degrees bears as much more. So the
    # mesh decides within this length, unless a line of edges does.
    reach = 0.005 if path == "line" else 0.008
    assert -reach < done.crack_low <= done.crack_high < reach
    assert done.crack_high - done.crack_low < 0.005
    assert done.tension >= 10 and done.shear == 0
    assert done.energy_error < 0.01


@pytest.fixture(scope="module")
def free_bone(tmp_path_factory):
    """The dog-bone on an irregular mesh, run once."""
    return results(Launcher(), tmp_path_factory.mktemp("bone"), DirectTension(**BRITTLE))


@pytest.mark.slow
@pytest.mark.xfail(strict=True, reason="the mean of the three points of a joint stays 2.5 % below the strength")
def test_dog_bone_breaks_at_the_strength_of_its_joints(free_bone):
    """What is asked of it: the largest stress of a joint is the strength, to 1 %. Not reached (docs/validation.md)."""
    assert free_bone.peak_joint == pytest.approx(2e6, rel=0.01)


@pytest.mark.slow
@pytest.mark.xfail(strict=True, reason="the crack lies up to 5.7 mm from the neck, where the mesh has a weaker path")
def test_dog_bone_breaks_at_its_neck(free_bone):
    """What is asked of it: the whole crack within 5 mm of the neck. Not reached (docs/validation.md)."""
    assert -0.005 < free_bone.crack_low <= free_bone.crack_high < 0.005
