"""Histories look at what they are asked for alone, and say what a look at the whole model says, bit for bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.fdem import assignments, histories, meshes, settings
from hpcdem.commands.fdem import steps as steps_
from hpcdem.commands.fdem.project import Project
from hpcdem.physics.fdem import changes, convergence, diagnostics
from hpcdem.physics.fdem.diagnostics import QUANTITIES
from hpcdem.physics.fdem.groups import ELEMENT, JOINT, NODE, OnLayer
from hpcdem.physics.fdem.local import Local
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import jointed, model, rectangle
from tests.space.support import body, box
from tests.tables import each


@pytest.fixture(scope="module")
def broken() -> Blocks:
    """Triangles and quads, some joints broken, an element taken out, displacements counted from there on."""
    sim = jointed(model(rectangle(6, 3, 0.6, 0.3, kind="mixed")))
    x = sim.the_mesh().points[:, 0]
    sim.velocity_condition(np.flatnonzero(x == 0.0), vx=0.0, vy=0.0)
    changes.set_velocity(sim, np.flatnonzero(x > 0.25), 6.0, 0.5)
    convergence.advance(sim, 120)
    changes.null(sim, [2])
    changes.reset_displacement(sim, np.flatnonzero(x < 0.3))
    convergence.advance(sim, 30)
    assert diagnostics.joint_counts(sim)[2] > 3
    return sim


def whole(sim: Blocks, name: str) -> dict[int, float]:
    """A quantity of all objects that are there, by the columns that frames are made of."""
    columns = diagnostics.owned_values(sim, QUANTITIES[name].on, [name])
    return dict(zip(columns["number"].tolist(), columns[name].tolist()))


@pytest.fixture(scope="module")
def solid() -> Blocks:
    """Tetrahedra, some joints broken, an element taken out, displacements counted from there on."""
    sim = jointed(body(box((4, 3, 2), (0.4, 0.3, 0.2), split=5)))
    changes.set_velocity(sim, [3, 17, 18, 23], 16.0, 0.5, -2.0)
    sim.velocity_condition([0], vx=0.0, vz=0.0)
    convergence.advance(sim, 40)
    changes.null(sim, [2])
    changes.reset_displacement(sim, [1, 3])
    convergence.advance(sim, 20)
    assert diagnostics.joint_counts(sim)[2] > 3
    return sim


ROWS = [(dim, name) for dim in (2, 3) for name, quantity in QUANTITIES.items() if dim in quantity.dims]


@each(("dim", "name"), ROWS)
def test_a_few_are_what_they_are_among_all(request, dim, name):
    broken = request.getfixturevalue("broken" if dim == 2 else "solid")
    known = whole(broken, name)
    numbers = np.array([*known])[np.random.default_rng(3).permutation(len(known))[:7]]
    probe = diagnostics.probe(broken, name, numbers)
    seen = probe.values()
    assert seen.tobytes() == np.array([known[n] for n in probe.numbers.tolist()]).tobytes()
    there = seen[~np.isnan(seen)]
    if len(there):
        assert probe.reduced("maximum") == there.max() and probe.reduced("minimum") == there.min()
        assert probe.reduced("sum") == pytest.approx(there.sum(), rel=1e-12, abs=1e-300)
        assert probe.reduced("mean") == pytest.approx(there.mean(), rel=1e-12, abs=1e-300)
    one = probe.numbers[:1]
    assert np.float64(diagnostics.probe(broken, name, one).reduced("")).tobytes() == seen[:1].tobytes()


def test_what_is_not_there_is_no_number(broken):
    assert np.isnan(diagnostics.probe(broken, "stress_xx", [2]).reduced(""))
    assert np.isnan(diagnostics.probe(broken, "stress_xx", [2]).reduced("mean"))


def supported(folder: Path, dynamic: bool = True) -> Project:
    """A plate with joints, its left side held, its right side drawn away until it breaks."""
    project = Project(Blocks(outdir=folder / "data"), folder, folder / "data")
    meshes.grid(project, (0.0, 0.0), (0.4, 0.2), (8, 4))
    rock = {"density": 2700.0, "young": 20e9, "poisson_ratio": 0.2}
    assignments.element_model(project, "mech_iso_elastic", rock)
    law = {"tensile_strength": 1e6, "cohesion": 2e6, "friction": 20.0, "gf1": 1.0, "gf2": 3.0, "penalty_normal": 1e11}
    assignments.joint_model(project, "classic_intrinsic_cohesive_interface", law)
    if not dynamic:
        settings.option(project, dynamic=False)
    speed = 0.4 if dynamic else 2e-8
    assignments.velocity(project, 0.0, 0.0, where=(OnLayer("left"),))
    assignments.velocity(project, speed, 0.0, where=(OnLayer("right"),))
    for name, value, side, how, every in (
        ("a", "reaction_x", "left", "sum", 1), ("b", "reaction_y", "right", "maximum", 3),
        ("c", "reaction_x", "right", "mean", 7), ("d", "displacement_x", "right", "mean", 1),
    ):  # fmt: skip
        histories.create(project, name, NODE, value, how=how, every=every, where=(OnLayer(side),))
    histories.create(project, "e", NODE, "reaction_x", nearest=(0.0, 0.1), every=2)
    histories.create(project, "f", "model", "ratio", every=5)
    return project


@pytest.mark.parametrize("dynamic", [True, False])
def test_forces_of_supports_come_with_the_next_step(dynamic, tmp_path, monkeypatch):
    """Records within a command are those of commands of one step each; a command evaluates forces for its last record
    alone, and once for all that ask at the same step."""
    steps = 140
    one, other = (supported(tmp_path / name, dynamic) for name in "ab")
    for _ in range(steps):
        steps_.step(other, 1)
    looks = []
    evaluation = Local.evaluation

    def counted(self, *args, **kwargs):
        looks.append(self.sim.clock.step)
        return evaluation(self, *args, **kwargs)

    monkeypatch.setattr(Local, "evaluation", counted)
    steps_.step(one, steps)
    assert diagnostics.joint_counts(one.blocks)[2 if dynamic else 1] >= (3 if dynamic else 0)
    for name, history in one.histories.items():
        assert history.rows == other.histories[name].rows, name
        assert [row[0] for row in history.rows] == list(range(history.every, steps + 1, history.every))
        lines = (one.folder() / f"history_{name}.csv").read_text()
        assert lines == (other.folder() / f"history_{name}.csv").read_text()
    assert max(abs(row[2]) for row in one.histories["a"].rows) > 0.0
    between = [step for step in looks if step % 5]
    assert not between  # the ratio alone, every 5 steps, needs forces that no step has computed
    assert len(looks) <= steps // 5 + 2  # the last: what the log says


def test_a_history_of_one_node_reads_one_row(tmp_path, monkeypatch):
    project = supported(tmp_path)
    for name in [*project.histories]:
        histories.delete(project, name)
    histories.create(project, "node", NODE, "velocity_x", id=20)
    histories.create(project, "element", ELEMENT, "stress_xx", id=11)
    histories.create(project, "joint", JOINT, "opening", nearest=(0.2, 0.1))
    asked = []
    columns_of = diagnostics.columns_of

    def counted(sim, on, names, at=None):
        asked.append(None if at is None else len(at))
        return columns_of(sim, on, names, at)

    monkeypatch.setattr(diagnostics, "columns_of", counted)
    steps_.step(project, 10)
    assert asked == [1] * 30
