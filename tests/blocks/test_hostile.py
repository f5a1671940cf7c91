"""What makes no sense is refused with a sentence that names it, and leaves the model as it was."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, PhysicsError
from hpcdem.physics.fdem import changes, convergence, diagnostics, saved_state
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.properties import CONTACT_MOHR_COULOMB, MECH_ISO_ELASTIC
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import JOINT, ROCK, jointed, model, rectangle


@pytest.mark.parametrize(
    "values, said",
    [
        ({"young": 1e9, "poisson_ratio": 0.2}, "needs density"),
        ({"density": 2700.0}, "two of young, poisson_ratio, shear, bulk"),
        ({"density": 2700.0, "young": 1e9}, "got young"),
        ({"density": 2700.0, "young": 1e9, "shear": 1e9, "bulk": 1e9}, "got young, shear, bulk"),
        ({"density": -1.0, "young": 1e9, "poisson_ratio": 0.2}, "density must be > 0"),
        ({"density": 2700.0, "young": 1e9, "poisson_ratio": 0.5}, "poisson_ratio must be"),
        ({"density": 2700.0, "young": 1e9, "shear": 0.3e9}, "Poisson's ratio 0.666667"),
        ({"density": float("nan"), "young": 1e9, "poisson_ratio": 0.2}, "density must be"),
        ({"density": "heavy", "young": 1e9, "poisson_ratio": 0.2}, "must be a number"),
        ({"density": 2700.0, "young": 1e9, "poisson_ratio": 0.2, "colour": 3.0}, "has no property colour"),
        ({"density": 2700.0, "young": float("inf"), "poisson_ratio": 0.2}, "young must be finite"),
        (
            {"density": 2700.0, "young": 1e308, "poisson_ratio": 0.2},
            r"young must be at most 1e\+60 \(Pa\), got 1e\+308",
        ),
    ],
)
def test_wrong_element_properties_are_refused(values, said):
    sim = model(rectangle(1, 1, 1.0, 1.0))
    with pytest.raises(CommandError, match=said):
        changes.element_model(sim, None, "mech_iso_elastic", values)
    assert sim.element_rows.values(int(sim.element_row[0]))["young"] == ROCK["young"]


@pytest.mark.parametrize(
    "values, said",
    [
        ({**JOINT, "gf1": 0.0}, "gf1 must be > 0"),
        ({**JOINT, "gf2": 0.0}, "gf2 must be > 0"),
        ({**JOINT, "penalty_normal": 0.0}, "penalty_normal must be > 0"),
        ({**JOINT, "friction": 95.0}, "friction must be"),
        ({k: v for k, v in JOINT.items() if k != "tensile_strength"}, "needs tensile_strength"),
    ],
)
def test_wrong_joint_properties_are_refused(values, said):
    sim = model(rectangle(1, 1, 1.0, 1.0))
    with pytest.raises(CommandError, match=said):
        sim.joint_model(None, "classic_intrinsic_cohesive_interface", values)


def test_moduli_follow_from_any_two():
    full = MECH_ISO_ELASTIC.complete(ROCK)
    names = ("young", "poisson_ratio", "shear", "bulk")
    for i in range(4):
        for j in range(i + 1, 4):
            two = {"density": 2700.0, names[i]: full[names[i]], names[j]: full[names[j]]}
            assert MECH_ISO_ELASTIC.complete(two) == pytest.approx(full)
    assert CONTACT_MOHR_COULOMB.complete({"penalty_normal": 1e9})["penalty_shear"] == 1e9


def test_numbers_that_are_not_there_are_refused():
    sim = model(rectangle(2, 2, 1.0, 1.0))
    for call, said in (
        (lambda: sim.element_property([99], {"young": 1e9}), "no element 99"),
        (lambda: sim.velocity_condition([-1], vx=0.0), "no node -1"),
        (lambda: sim.stress_condition([3], xx=1.0), "no face 3"),
        (lambda: sim.joint_model([0.5], "classic_intrinsic_cohesive_interface", JOINT), "must be integers"),
        (lambda: changes.crack(sim, [10**6]), "no joint"),
        (lambda: diagnostics.values(sim, "stress_xx", [99]), "no element 99"),
        (lambda: diagnostics.values(sim, "colour"), "no quantity colour"),
        (lambda: sim.face_property(None, {"friction": 1.0}), "has a model whose properties could be changed"),
        (lambda: changes.element_model(sim, None, "granite", {}), "no model granite for an element"),
    ):
        with pytest.raises(CommandError, match=said):
            call()


def test_wrong_conditions_and_options_are_refused():
    sim = model(rectangle(2, 2, 1.0, 1.0))
    for call, said in (
        (lambda: sim.velocity_condition(None), "needs a velocity"),
        (lambda: sim.velocity_condition(None, vx=1.0, ax=1.0), "cannot both"),
        (lambda: sim.velocity_condition(None, vx="load"), "no table 'load'"),
        (lambda: sim.velocity_condition(None, vx=float("nan")), "must be finite"),
        (lambda: sim.move_constraint(None, 2), "not zero"),
        (lambda: sim.move_constraint(None, 7), "got 7"),
        (lambda: sim.table("load", [(0.0, 1.0), (0.0, 2.0)]), "times must ascend"),
        (lambda: sim.table("load", []), "has no pairs"),
        (lambda: sim.table("load", [(0.0, float("inf"))]), "is not finite"),
        (lambda: sim.time_step(value=-1.0), "must not be negative"),
        (lambda: sim.time_step(safety=2.0), "safety"),
        (lambda: sim.gravity(0.0, float("inf")), "must be finite"),
        (lambda: changes.null(sim, None), "all remaining elements"),
        (lambda: changes.null(sim, [0], relax=-1.0), "relax"),
        (lambda: convergence.solve(sim, ratio=-1.0), "ratio must be positive"),
        (lambda: convergence.advance(sim, -1), "negative"),
        (lambda: diagnostics.energies(sim), "no energy budget"),
    ):
        with pytest.raises(CommandError, match=said):
            call()
    sim.option(dynamic=False)
    with pytest.raises(CommandError, match="time does not pass"):
        convergence.solve(sim, time=1.0)
    with pytest.raises(CommandError, match="dynamic mode"):
        diagnostics.account_energy(sim)


def test_a_table_in_use_stays():
    sim = model(rectangle(2, 2, 1.0, 1.0))
    sim.table("load", [(0.0, 1.0)])
    sim.velocity_condition([0], vx="load")
    with pytest.raises(CommandError, match="is used"):
        sim.remove_table("load")
    sim.remove_conditions([0])
    sim.remove_table("load")
    with pytest.raises(CommandError, match="no table"):
        sim.remove_table("load")


def test_steps_continue_without_a_table_that_conditions_had():
    sim = model(rectangle(2, 2, 1.0, 1.0))
    sim.table("load", [(0.0, 1.0)])
    faces = sim.mesh.edges().faces[~sim.mesh.edges().inner][:, 0]
    sim.velocity_condition([0], vx="load")
    sim.force_condition([1], fx="load")
    sim.stress_condition(faces[:1], xx="load")
    sim.stress_condition(faces[1:2], xx=-1.0)
    convergence.advance(sim, 1)
    sim.remove_conditions([0, 1])
    sim.remove_stress_conditions(faces[:1])
    sim.remove_table("load")
    convergence.advance(sim, 1)
    assert sim.clock.step == 2


def test_nothing_runs_without_mesh_or_models():
    sim = Blocks()
    for call in (
        sim.step,
        lambda: changes.element_model(sim, None, "mech_iso_elastic", ROCK),
        lambda: diagnostics.values(sim, "stress_xx"),
    ):
        with pytest.raises(CommandError, match="no mesh"):
            call()
    sim.take_mesh(rectangle(2, 2, 1.0, 1.0))
    changes.element_model(sim, [0, 1], "mech_iso_elastic", ROCK)
    with pytest.raises(CommandError, match="element 2 has no model"):
        sim.step()


def test_a_bad_mesh_is_refused_and_the_old_one_stays():
    sim = model(rectangle(2, 2, 1.0, 1.0))
    with pytest.raises(CommandError, match="inverted"):
        sim.take_mesh(Mesh.of([[0, 0], [1, 0], [0, 1]], [[0, 2, 1]]))
    assert len(sim.mesh.cells) == 8
    sim.step()


def test_a_run_that_blows_up_names_its_elements():
    sim = jointed(model(rectangle(4, 4, 1.0, 1.0)))
    sim.time_step(value=1e-3)
    rng = np.random.default_rng(1)
    sim.close_model()
    sim.v[:] = rng.normal(size=sim.v.shape)
    with pytest.raises(PhysicsError, match=r"(?s)time step 0.001 s is probably too large.*element \d+ at"):
        convergence.advance(sim, 1000)


class Heard:
    """A log that keeps what it is told."""

    def __init__(self) -> None:
        self.said: dict[str, str] = {}

    def info(self, text: str) -> None:
        self.said.setdefault("info", text)

    def warn_once(self, key: str, text: str) -> None:
        self.said.setdefault(key, text)


def test_joints_too_brittle_for_their_mesh_are_reported():
    """o_t = gf1 / (0.386 T) below a tenth of o_p = 2 h T / P; ordinary ones are not named."""
    for gf1, told in ((50.0, False), (1e-3, True)):
        heard = Heard()
        sim = jointed(model(rectangle(2, 2, 1.0, 1.0), log=heard), gf1=gf1)
        sim.step()
        warnings = [text for key, text in heard.said.items() if key.startswith("snap back")]
        assert bool(warnings) == told
        if told:
            assert "gf1 0.001 N/m" in warnings[0] and "edge of 0.707 m" in warnings[0]


def test_a_damaged_or_foreign_file_is_refused(tmp_path):
    sim = model(rectangle(2, 2, 1.0, 1.0))
    saved_state.save(sim, tmp_path / "a.sav")
    data = bytearray((tmp_path / "a.sav").read_bytes())
    for name, content in (("cut.sav", bytes(data[: len(data) // 2])), ("text.sav", b"hello")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(CommandError):
            saved_state.restore(sim, tmp_path / name)
        assert len(sim.mesh.cells) == 8
    with pytest.raises(CommandError, match="no such file"):
        saved_state.restore(sim, tmp_path / "missing.sav")


def test_a_mesh_is_stored_by_rows_whatever_was_given():
    points = np.asfortranarray([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    for cells in (np.asfortranarray([[0, 1, 2], [0, 2, 3]]), np.asfortranarray([[0, 1, 2, 3]])):
        mesh = Mesh.of(points, cells)
        assert mesh.points.flags.c_contiguous and mesh.cells.flags.c_contiguous
