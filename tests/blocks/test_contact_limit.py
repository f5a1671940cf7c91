"""The largest normal stress of contact, T: that of both surfaces together, though each of them presses by itself."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, diagnostics
from hpcdem.physics.fdem.simulation import Blocks
from tests.blocks.support import joined, near, rectangle
from tests.space import support as space

SOFT = {"density": 2700.0, "young": 1e9, "poisson_ratio": 0.25, "damp_factor": 1.0}
WIDTH, LIMIT, PENALTY = 0.6, 4e7, 1e10


def pressed_in(kind: str, layers: int, x0: float, faces: tuple[float, float], **law: float) -> np.ndarray:
    """Normal force [N/m] between a block 0.6 m wide and a plate, whose nodes are moved into each other by 10 um a step,
    0.5 mm in all. layers: of elements in the plate, 0.1 m thick; faces: T of the block and of the plate [Pa]."""
    block = rectangle(6, 1, WIDTH, 0.1, x0=x0, y0=1e-6, kind=kind)
    mesh = joined(block, rectangle(10, layers, 1.0, 0.1, y0=-0.1, kind=kind))
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", SOFT)
    sim.face_model(None, "contact_mohr_coulomb", {"penalty_normal": PENALTY, "damping_t": faces[0], **law})
    sim.face_property(near(mesh, 1, 0.0)[near(mesh, 1, 0.0) // 4 >= len(block.cells)], {"damping_t": faces[1]})
    points = np.arange(len(block.points))
    sim.velocity_condition(np.arange(len(points), len(mesh.points)), vx=0.0, vy=0.0)
    sim.velocity_condition(points, vx=0.0, vy=-10.0)
    sim.time_step(value=1e-6)
    out = []
    for _ in range(50):
        sim.step()
        out.append(diagnostics.contacts(sim)["force_y"].sum())
    return np.array(out)


@pytest.mark.parametrize("kind, layers, x0", [("cross", 1, 0.2), ("cross", 3, 0.213), ("quad", 2, 0.213)])
def test_both_surfaces_together_carry_t(kind, layers, x0):
    """Up to T as without it, then T over the width, whatever the altitudes on both sides are and however elements lie
    on each other. (Ends: below 1 %.)"""
    found, free = (pressed_in(kind, layers, x0, (most, most)) for most in (LIMIT, 1e30))
    early = free < 0.97 * LIMIT * WIDTH
    assert early.sum() > 0 and found[early] == pytest.approx(free[early], rel=0.02)
    assert free.max() > 5.0 * LIMIT * WIDTH
    assert found[-20:] == pytest.approx(LIMIT * WIDTH, rel=0.01)


def test_the_smaller_t_of_both_surfaces_counts():
    """Also where the elements have faces of several kinds, so that edges choose theirs."""
    for faces in ((LIMIT, 2.0 * LIMIT), (2.0 * LIMIT, LIMIT)):
        assert pressed_in("cross", 2, 0.213, faces)[-20:] == pytest.approx(LIMIT * WIDTH, rel=0.01)


def test_friction_is_that_of_t():
    """tan(phi) T, not twice that."""
    block = rectangle(6, 1, WIDTH, 0.1, x0=0.213, y0=1e-6)
    mesh = joined(block, rectangle(20, 1, 2.0, 0.1, y0=-0.1))
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", SOFT)
    law = {"penalty_normal": PENALTY, "penalty_shear": 1e12, "damping_t": LIMIT, "friction": 30.0}
    sim.face_model(None, "contact_mohr_coulomb", law)
    points = np.arange(len(block.points))
    sim.velocity_condition(np.arange(len(points), len(mesh.points)), vx=0.0, vy=0.0)
    sim.time_step(value=1e-6)
    for steps, vx, vy in ((40, 0.0, -10.0), (20, 1.0, 0.0)):
        sim.velocity_condition(points, vx=vx, vy=vy)
        for _ in range(steps):
            sim.step()
    found = diagnostics.contacts(sim)
    assert abs(found["force_x"].sum()) == pytest.approx(np.tan(np.radians(30.0)) * LIMIT * WIDTH, rel=0.02)


def falls(sim: Blocks, block: np.ndarray, axis: str, area: float) -> tuple[np.ndarray, float]:
    """Mean normal stress [Pa] between a block and what it falls onto, and what the account of energy lacks."""
    diagnostics.account_energy(sim)
    out = []
    for _ in range(4000):
        sim.step()
        if sim.clock.step % 4 == 0:
            out.append(np.abs(diagnostics.contacts(sim)[f"force_{axis}"]).sum() / area)
            if out[-1] == 0.0 and max(out) > 0.0:
                break
    return np.array(out), diagnostics.energies(sim)["relative"]


def test_a_falling_block_is_stopped_by_t_and_the_account_follows():
    mesh = joined(rectangle(1, 1, 0.2, 0.2, x0=0.4, y0=1e-4), rectangle(5, 1, 1.0, 0.2, y0=-0.2))
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", {**SOFT, "damp_factor": 0.0})
    sim.face_model(None, "contact_mohr_coulomb", {"penalty_normal": 1e9, "damping_t": 1e6})
    sim.velocity_condition(np.arange(4, len(mesh.points)), vx=0.0, vy=0.0)
    changes.set_velocity(sim, np.arange(4), 0.0, -2.0)
    stress, lacks = falls(sim, np.arange(4), "y", 0.2)
    assert stress.max() == pytest.approx(1e6, rel=0.01)
    assert (stress > 0.99e6).sum() > 3
    assert abs(lacks) < 1e-5


@pytest.mark.parametrize("potential", ["distance", "munjiza"])
def test_in_space(potential):
    """A box that falls flat onto a plate with elements of another size: T as well, for both potentials."""
    plate, box = space.box((4, 4, 1), (0.4, 0.4, 0.1)), space.box((2, 2, 2), (0.2, 0.2, 0.1))
    sim = Blocks()
    sim.take_mesh(joined_in_space(plate, box, (0.1, 0.1, 0.1001)))
    changes.element_model(sim, None, "mech_iso_elastic", {**SOFT, "damp_factor": 0.0})
    sim.option(potential=potential)
    sim.face_model(None, "contact_mohr_coulomb", {"penalty_normal": 5e8, "damping_t": 2e5})
    sim.velocity_condition(np.arange(len(plate.points)), vx=0.0, vy=0.0, vz=0.0)
    points = np.arange(len(plate.points), len(plate.points) + len(box.points))
    changes.set_velocity(sim, points, 0.0, 0.0, -0.5)
    stress, lacks = falls(sim, points, "z", 0.04)
    assert stress.max() == pytest.approx(2e5, rel=0.03)
    assert abs(lacks) < 1e-5


def joined_in_space(one, other, away):
    return type(one).of(
        np.concatenate([one.points, other.points + np.array(away)]),
        np.concatenate([one.cells, other.cells + len(one.points)]),
    )
