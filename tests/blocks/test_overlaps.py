"""Bodies that overlap before the first step are refused, with places and depths; what legitimate models need is not."""

from __future__ import annotations

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.physics.fdem import changes, convergence, diagnostics, overlaps, saved_state
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import joined, jointed, model, near, rectangle
from tests.space import support as space


def two(depth: float, kind: str = "cross", x0: float = 0.213) -> Blocks:
    """A block 0.4 m wide that is `depth` deep in a plate, elements of 0.1 m."""
    sim = model(joined(rectangle(4, 2, 0.4, 0.2, x0=x0, y0=-depth, kind=kind), rectangle(10, 2, 1.0, 0.2, y0=-0.2)))
    sim.element_property(None, {"damp_factor": 1.0})
    return sim


def deepest(sim: Blocks) -> np.ndarray:
    sim.close_model()
    return overlaps.deepest(sim, sim.local)


def test_the_deepest_pair_comes_first_and_of_equal_ones_that_of_the_lower_elements():
    rows = np.array([[1.0, 0.1, 7, 8], [1.0, 0.9, 5, 6], [2.0, 0.5, 9, 3], [0.5, 0.0, 5, 6], [1.0, 0.2, 5, 9]])
    found = overlaps._gathered(SimpleNamespace(comm=SerialComm()), rows)
    assert found[:, [0, 2, 3]].tolist() == [[2.0, 9, 3], [1.0, 5, 6], [1.0, 5, 9], [1.0, 7, 8]]


@pytest.mark.some_of_each
@pytest.mark.parametrize("kind", ["cross", "quad"])
@pytest.mark.parametrize("dynamic", [True, False])
def test_an_overlap_is_refused_and_the_model_stays(kind, dynamic):
    sim = two(1.6e-3, kind)
    sim.option(dynamic=dynamic)
    before = diagnostics.values(sim, "position_y")
    with pytest.raises(CommandError, match=r"pairs of elements overlap .*elements \d+ and \d+ by 0\.0016 m at \("):
        sim.step()
    assert sim.clock.step == 0 and np.array_equal(diagnostics.values(sim, "position_y"), before)
    found = deepest(sim)
    assert found[0, 0] == pytest.approx(1.6e-3, rel=1e-6)
    assert (np.abs(found[:, 2]) <= 1.7e-3).all() and found[:, 1].min() > 0.2 and found[:, 1].max() < 0.62
    n = 16 if kind == "cross" else 8
    assert (found[:, 3] < n).all() and (found[:, 4] >= n).all()


def test_kept_it_starts_as_it_is():
    """On request: the energy that was said to come of it comes."""
    sim = two(1.6e-3)
    sim.option(overlap="keep")
    convergence.advance(sim, 100)
    assert diagnostics.total(sim, "kinetic_energy") > 1e3


def test_relaxed_a_static_stage_moves_them_apart():
    """relax needs the static stage; what is left afterwards throws nothing: below 1e-6 of the energy there was."""
    sim = two(1.6e-3)
    sim.option(overlap="relax")
    with pytest.raises(CommandError, match="model option dynamic off"):
        sim.step()
    sim.option(dynamic=False)
    convergence.solve(sim, ratio=1e-6, cycles=5000)
    assert not len(deepest(sim))
    sim.option(dynamic=True)
    convergence.advance(sim, 200)
    assert diagnostics.total(sim, "kinetic_energy") < 1e-2
    with pytest.raises(CommandError, match="overlap is one of refuse, relax, keep"):
        sim.option(overlap="maybe")


@pytest.mark.parametrize("depth", [0.0, 5e-7, -1e-4])
def test_bodies_that_touch_or_are_rounded_go(depth):
    """Up to 1e-5 of an element is rounding of coordinates."""
    two(depth).step()


def test_faces_of_joints_and_cracks_that_touch_go():
    sim = jointed(model(rectangle(4, 4, 0.4, 0.4)))
    changes.crack(sim, near(sim.mesh, 0, 0.2, inner=True)[::2])
    changes.null(sim, [0])
    sim.step()


def test_a_body_deep_inside_another_is_found():
    """No element that it overlaps touches the surface."""
    mesh = joined(rectangle(1, 1, 0.05, 0.05, x0=0.477, y0=0.477), rectangle(10, 10, 1.0, 1.0))
    sim = model(mesh)
    with pytest.raises(CommandError, match="overlap before the first step"):
        sim.step()
    found = deepest(sim)
    assert (np.hypot(found[:, 1] - 0.5, found[:, 2] - 0.5) < 0.05).all()


def test_a_run_that_is_under_way_is_not_asked(tmp_path):
    """Contact that a run has made, also after a restart, after excavation, and with collision off at first."""
    sim = two(-1e-6)
    sim.gravity(0.0, -9.81e4)
    sim.velocity_condition(np.flatnonzero(sim.mesh.points[:, 1] < -0.19), vx=0.0, vy=0.0)
    while not len(deepest(sim)):
        convergence.advance(sim, 50)
    saved_state.save(sim, tmp_path / "a.sav")
    again = Blocks()
    saved_state.restore(again, tmp_path / "a.sav")
    changes.null(again, [0])
    again.step()
    other = two(1.6e-3)
    other.option(collision=False)
    other.step()
    assert math.isfinite(float(diagnostics.values(other, "position_x").sum()))


SCRIPT = """\
pcdc model new
pcdc mesh structured (0,0) (1,1) cells 4 4 group 'low' set 'body'
pcdc mesh structured (0.3,0.9984) (0.8,1.5) cells 2 2 group 'high' set 'body'
pcdc element c-model mech-iso-e property density 2600 young 1e9 poisson-r 0.25
{option}
pcdc model step 5
print('went')
"""


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [1, 2])
def test_a_script_is_reported_the_line(resident, tmp_path, ranks):
    for option, code in (("", 2), ("pcdc model option overlap keep", 0)):
        (tmp_path / "over.sc").write_text(SCRIPT.format(option=option))
        done = resident(ranks, "over.sc", cwd=tmp_path)
        assert done.returncode == code, done.stdout + done.stderr
        assert ("over.sc:6: " in done.stderr and "by 0.0016 m at" in done.stderr) == (code == 2)
        assert ("went" in done.stdout) == (code == 0)


def sinks(depth: float, **options: str) -> tuple[Blocks, list[str]]:
    """A block of 1 m on a held one, pressed in by its weight as far as a penalty lets it [m]; what the log says."""
    mesh = joined(rectangle(2, 2, 1.0, 1.0), rectangle(2, 2, 1.0, 1.0, y0=1.0 + 1e-6))
    sim, said = Blocks(), []
    sim.log = Log(said)
    sim.take_mesh(mesh)
    changes.element_model(
        sim, None, "mech_iso_elastic", {"density": 2700.0, "young": 1e9, "poisson_ratio": 0.25, "damp_factor": 1.0}
    )
    # 3 P d (1/h + 1/h), h = 0.5 m
    penalty = 2700.0 * 9.81 / (12.0 * depth)
    sim.face_model(None, "contact_mohr_coulomb", {"friction": 30.0, "penalty_normal": penalty})
    sim.velocity_condition(np.arange(9), vx=0.0, vy=0.0)
    sim.gravity(0.0, -9.81)
    if options:
        sim.option(**options)
    convergence.solve(sim, time=math.pi * math.sqrt(depth / 9.81))  # it swings to twice that depth
    return sim, said


class Log:
    def __init__(self, said: list[str]) -> None:
        self.said = said

    def warn(self, text: str) -> None:
        self.said.append(text)

    def info(self, text: str) -> None:
        pass

    def warn_once(self, key: str, text: str) -> None:
        self.said.append(text)


def test_a_deep_overlap_is_reported_with_its_place():
    """Twice 0.035 m of an altitude of 0.5 m: where, how deep, how many; twice 0.02 m: nothing is said."""
    assert not sinks(0.02)[1]
    sim, said = sinks(0.035)
    found = re.search(
        r"step \d+: (\d+) pairs of elements overlap by more than 0.1 of an altitude: elements (\d+) and (\d+) by (\S+) "
        r"m at \((\S+), (\S+)\), (\S+) of the altitude",
        said[0],
    )
    assert found is not None, said
    pairs, one, other, depth, x, y, part = map(float, found.groups())
    assert pairs >= 2 and one < 8 <= other and 0.0 <= x <= 1.0 and 0.9 < y <= 1.0
    assert 0.05 < depth < 0.07 and part == pytest.approx(depth / 0.5, rel=0.05)


def test_a_deep_overlap_stops_a_run_on_request():
    with pytest.raises(PhysicsError, match=r"pairs of elements overlap .* stopped by model option deep-overlap stop"):
        sinks(0.035, deep_overlap="stop")
    sinks(0.02, deep_overlap="stop")
    with pytest.raises(CommandError, match="deep-overlap is one of warn, stop, got maybe"):
        Blocks().option(deep_overlap="maybe")


def test_a_deep_overlap_in_space():
    """A box that a soft contact lets into a plate, at most a quarter of an altitude."""
    plate, box = space.box((3, 3, 1), (0.6, 0.6, 0.2)), space.box((1, 1, 1), (0.2, 0.2, 0.2))
    mesh = type(plate).of(
        np.concatenate([plate.points, box.points + np.array([0.2, 0.2, 0.200001])]),
        np.concatenate([plate.cells, box.cells + len(plate.points)]),
    )
    for penalty, deep in ((1e7, False), (2e4, True)):
        sim, said = Blocks(), []
        sim.log = Log(said)
        sim.take_mesh(mesh)
        changes.element_model(sim, None, "mech_iso_elastic", {"density": 2700.0, "young": 1e8, "poisson_ratio": 0.25})
        sim.face_model(None, "contact_mohr_coulomb", {"penalty_normal": penalty})
        sim.velocity_condition(np.arange(len(plate.points)), vx=0.0, vy=0.0, vz=0.0)
        changes.set_velocity(sim, np.arange(len(plate.points), len(mesh.points)), 0.0, 0.0, -1.0)
        convergence.solve(sim, time=0.05)
        assert bool(said) == deep
        if deep:
            assert re.search(r"elements \d+ and \d+ by \S+ m at \(\S+, \S+, \S+\), 0\.\d+ of the altitude", said[0])
