"""Packs that hold a fracture open."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow.coupled import Coupled
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.proppant.model import Proppant
from tests.blocks.support import JOINT, model, rectangle
from tests.flow.space import on_plane
from tests.flow.support import at, over, run
from tests.flow.test_coupling import CRACK, split
from tests.proppant.support import SAND
from tests.space.support import body, box

FINE = {**SAND, "proppant_size": 1e-5}
STIFF = 50e9 * 0.75 / (1.25 * 0.5)
"""Of rock between rollers [Pa]."""


def closed(closure: float, c: float = 0.6, **changed: float) -> tuple[Blocks, Flow, Proppant]:
    """A broken joint of 0.1 mm, full of sand and of a fluid that gives way, that is closed by its upper wall [m]."""
    sim, flow = split(fluid_bulk=1e3)
    joints = flow.network.channels
    changes.crack(sim, joints)
    sim.flow_clock(dt=1e-7)
    flow.fill(None, saturation=1.0)
    proppant = Proppant.of(sim)
    proppant.assign(joints, {**FINE, **changed})
    proppant.fill(None, c)
    run(sim, 1)
    steps = 400
    sim.velocity_condition(at(sim, y=0.5), vy=-closure / (steps * sim.clock.dt))
    run(sim, steps)
    sim.velocity_condition(at(sim, y=0.5), vy=0.0)
    return sim, flow, proppant


@pytest.mark.parametrize(
    ("modulus", "limit"),
    [(1e7, 0.6), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((4e7, 0.6), (1e7, 0.5)))],
)
def test_a_pack_carries_its_walls(modulus: float, limit: float) -> None:
    """(137): modulus times the strain of the pack; the rest of what closes is taken by the rock."""
    sim, flow, proppant = closed(6e-5, limit, proppant_modulus=modulus, proppant_concentration_limit=limit)
    convergence.solve(sim, ratio=1e-6)
    delta = flow.values("flow-channel", "aperture")
    p = modulus * (1.0 - delta / 1e-4)
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(-p.mean(), rel=1e-3)
    assert 6e-5 - p.mean() / STIFF * 0.5 == pytest.approx(1e-4 - delta.mean(), rel=5e-3)
    assert flow.values("flow-channel", "pack_pressure") == pytest.approx(p, rel=1e-6) and p.min() > 1e6
    assert proppant.account()["relative"] < 1e-12


def test_sand_that_is_no_pack_yet_carries_nothing() -> None:
    """Half as much as makes a pack: until the fracture is closed to a half; and without a modulus never."""
    sim, flow, _ = closed(4e-5, 0.3, proppant_modulus=1e7)
    run(sim, 2000)
    assert np.abs(diagnostics.values(sim, "stress_yy")).max() < 3e3
    assert flow.values("flow-channel", "concentration") == pytest.approx(0.5, rel=0.02)
    sim, flow, _ = closed(7e-5, 0.3, proppant_modulus=1e7)
    convergence.solve(sim, ratio=1e-6)
    p = 1e7 * (1.0 - flow.values("flow-channel", "aperture") / 5e-5)
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(-p.mean(), rel=0.01) and p.min() > 1e6
    sim, flow, _ = closed(6e-5, 0.6)
    run(sim, 2000)
    assert np.abs(diagnostics.values(sim, "stress_yy")).max() < 3e3


def test_fluid_that_does_not_push_leaves_the_pack_where_it_is() -> None:
    """One way: nothing of either pushes. Fluid that is switched off stays as it is, and the pack pushes, the less the
    farther its walls go, as beside fluid that flows."""
    found = {}
    for one_way, on in ((True, True), (False, True), (False, False)):
        sim, flow, proppant = closed(0.0, 0.6, proppant_modulus=1e7, proppant_concentration_limit=0.6)
        proppant.adjust({"proppant_concentration_limit": 0.5})
        sim.parts(one_way=one_way, hydraulic=on)
        if one_way:
            run(sim, 50)
            assert np.abs(diagnostics.values(sim, "stress_yy")).max() == 0.0
        else:
            convergence.solve(sim, ratio=1e-6)
            found[on] = diagnostics.values(sim, "stress_yy")
    assert found[False] == pytest.approx(found[True], rel=1e-3) and np.abs(found[True]).max() > 5e5


def test_what_a_pack_does_is_work_from_outside() -> None:
    """A pack that becomes too thick for its room throws its walls apart; the budget of energy closes."""
    sim, flow = split(dynamic=True, fluid_bulk=1e3)
    changes.crack(sim, flow.network.channels)
    flow.fill(None, saturation=1.0)
    proppant = Proppant.of(sim)
    proppant.assign(flow.network.channels, {**FINE, "proppant_modulus": 1e7})
    proppant.fill(None, 0.6)
    diagnostics.account_energy(sim)
    run(sim, 10)
    assert diagnostics.energies(sim)["kinetic"] < 1e-6
    proppant.adjust({"proppant_concentration_limit": 0.5})
    run(sim, 500)
    energies = diagnostics.energies(sim)
    assert energies["kinetic"] > 0.1 and energies["work_outside"] > 0.1 and energies["relative"] < 0.02


STRESS, PORE = 2e6, 5e5
LEAKS = {
    "leak_off": 1.0, "matrix_permeability": 1e-15, "matrix_porosity": 0.2, "matrix_porosity_compressibility": 1e-9,
    "matrix_pore_pressure": PORE, "fluid_bulk": 2.2e9, "aperature_minumum": 1e-6,
}  # fmt: skip


SOFT = 1e8 * 0.75 / (1.25 * 0.5)
"""Of rock of 100 MPa between rollers [Pa]."""


def leaking(dim: int, modulus: float) -> tuple[Blocks, Flow, Proppant]:
    """A column of soft rock on rollers under a stress of 2 MPa, cut by a fracture of 0.1 mm that slurry of this
    pressure, a fifth of it sand, holds open; its fluid goes into the rock."""
    if dim == 2:
        sim = model(rectangle(4, 2, 1.0, 0.5))
        edges = sim.mesh.edges()
        cut = np.abs(sim.mesh.points[edges.points][:, :, 1] - 0.25) < 1e-9
        joints = edges.faces[edges.inner & cut.all(axis=1), 0]
    else:
        sim = body(box((2, 2, 2), (1.0, 1.0, 0.5), 6))
        joints = on_plane(sim.mesh, 2, 0.25)
    sim.element_property(None, {"young": 1e8})
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface", JOINT)
    flow = Flow.of(sim)
    flow.assign(joints, {**CRACK, **LEAKS})
    sim.option(dynamic=False, collision=False, large_strain=False)
    for axis, name in enumerate("xyz"[:dim]):
        for side in (0.0, 0.5 if axis == dim - 1 else 1.0):
            at_side = np.flatnonzero(np.abs(sim.mesh.points[:, axis] - side) < 1e-9)
            sim.velocity_condition(at_side, **{f"v{name}": 0.0})
    sim.initial_stress(None, **{2 * name: -STRESS for name in "xyz"})
    sim.flow_clock(dt=1e-9)
    changes.crack(sim, joints)
    flow.fill(None, pressure=STRESS)
    proppant = Proppant.of(sim)
    proppant.assign(joints, {**FINE, "proppant_size": 1e-7, "proppant_modulus": modulus})
    proppant.fill(None, 0.2)
    return sim, flow, proppant


@pytest.mark.some_of_each
@pytest.mark.some_of_each
@pytest.mark.parametrize("dim", [2, 3])
@pytest.mark.parametrize("modulus", [1e7, 1e9])
def test_a_fracture_closes_on_its_pack(dim: int, modulus: float) -> None:
    """After Carter the slurry loses 4 sqrt(k s / (pi mu)) (p - p0) sqrt(t) of its width through both walls, at the
    pressure of the stress, until the sand is a pack, a third as wide; then the pack takes over what the fluid gives up,
    and is squeezed by the effective stress over its modulus. Implicit steps with blocks in equilibrium."""
    sim, flow, proppant = leaking(dim, modulus)
    w0, pack = 1e-4, 1e-4 / 3.0
    carter = 4.0 * np.sqrt(1e-15 * 0.2 * (1.0 / 2.2e9 + 1e-9) / (np.pi * 1e-3)) * (STRESS - PORE)
    closes = ((w0 - pack) / carter) ** 2
    over(sim, 0.5 * closes, 40)
    assert flow.values("flow-channel", "aperture") == pytest.approx(w0 - carter * np.sqrt(0.5 * closes), rel=0.01)
    count = over(sim, closes, 40).count
    assert count.iterations < 5 * count.steps and count.cut <= 2  # with the derivatives of the pack Newton is quick
    p, delta = (flow.values("flow-channel", name) for name in ("pressure", "aperture"))
    borne = STRESS - SOFT * (w0 - delta) / 0.5 - p
    assert borne.min() > 0.3 * (STRESS - PORE)
    assert delta == pytest.approx(pack * (1.0 - borne / modulus), rel=1e-6)
    assert flow.values("flow-channel", "pack_pressure") == pytest.approx(borne, rel=1e-6)
    found = proppant.account()
    assert found["relative"] < 1e-12 and found["packed"] == pytest.approx(found["stored"], rel=1e-12)
    assert flow.account()["relative"] < 1e-9


def test_the_static_solve_refuses_a_pack_that_carries_load() -> None:
    sim, flow, proppant = closed(0.0, proppant_modulus=1e7)
    sim.option(large_strain=False)
    with pytest.raises(CommandError, match="the static solve does not support proppant"):
        equilibrium.solve_elastic(sim)
    proppant.adjust({"proppant_modulus": 0.0})
    equilibrium.solve_elastic(sim)
    with Coupled(sim, 1.0) as steps:
        steps.advance(1.0)
