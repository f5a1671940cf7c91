"""Moisture of soil against closed forms: what is that of any field on elements, and suction, shrinkage, strength."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import erfc

from hpcdem.core.errors import CommandError
from hpcdem.physics.fdem import changes, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.fdem.tables import AXES, Over
from hpcdem.physics.moisture.model import Moisture
from hpcdem.physics.moisture.properties import _order
from tests.blocks.support import rectangle, shaken
from tests.flow.support import at
from tests.space.support import box, hexes

DENSITY, D = 1600.0, 1e-8
SOIL = {"density": DENSITY, "young": 1e7, "poisson_ratio": 0.3}
CLAY = {"diffusivity": D}
OVER = AXES.index("moisture")


def test_the_residual_moisture_is_below_that_of_saturation() -> None:
    for residual in (0.3, 0.4):
        with pytest.raises(CommandError, match="moisture_residual must be below"):
            _order({"moisture_residual": residual, "moisture_saturated": 0.3})
    _order({"moisture_residual": np.array([0.1, 0.2]), "moisture_saturated": 0.3})


def test_each_element_conducts_by_its_own_density() -> None:
    sim = Blocks()
    sim.take_mesh(rectangle(2, 1, 1.0, 0.5))
    density = 1000.0 + 100.0 * np.arange(len(sim.mesh.cells))
    for element, value in enumerate(density):
        changes.element_model(sim, [element], "mech_iso_elastic", {**SOIL, "density": value})
    moisture = Moisture.of(sim)
    moisture.assign(None, CLAY)
    found = moisture._conductivities(np.arange(len(density)))
    assert found[:, 0] == pytest.approx(D * density) and (found[:, [0, 1, 3]] == found[:, :1]).all()


def bar(kind: str) -> Mesh:
    """A metre along x."""
    if kind == "tetrahedra":
        return box((20, 1, 1), (1.0, 0.05, 0.05))
    return hexes((20, 1, 1), (1.0, 0.05, 0.05)) if kind == "hexahedra" else rectangle(20, 1, 1.0, 0.05, kind=kind)


def faces_at(mesh: Mesh, x: float) -> np.ndarray:
    """Faces of the surface in the plane of this x."""
    edges = mesh.edges()
    on = ~edges.inner & (np.abs(mesh.points[edges.points][:, :, 0] - x) < 1e-9).all(axis=1)
    return edges.faces[on, 0]


def soil(mesh: Mesh, **clay: float) -> tuple[Blocks, Moisture]:
    sim = Blocks()
    sim.take_mesh(mesh)
    changes.element_model(sim, None, "mech_iso_elastic", SOIL)
    moisture = Moisture.of(sim)
    moisture.assign(None, {**CLAY, **clay})
    sim.parts(mechanical=False)
    return sim, moisture


def steps(sim: Blocks, moisture: Moisture, time: float) -> None:
    """So much longer, in equal sub-steps that are stable."""
    sim.close_model()
    count = math.ceil(time / (0.5 * moisture.limit()))
    moisture.clock(dt=time / count)
    for _ in range(count):
        sim.step()


KINDS = ("tri", "quad", "tetrahedra", "hexahedra")


@pytest.mark.parametrize("kind", KINDS)
def test_a_half_space_dries(kind: str) -> None:
    """w0 + (w1 - w0) erfc(x / (2 sqrt(D t))); linear elements of an eighth of the depth: 1 % of the difference."""
    sim, moisture = soil(bar(kind))
    moisture.initial(None, 0.3)
    moisture.prescribe(np.flatnonzero(sim.mesh.points[:, 0] == 0.0), 0.05)
    time = 0.2**2 / (4.0 * D)
    steps(sim, moisture, time)
    exact = 0.3 - 0.25 * erfc(sim.mesh.points[:, 0] / 0.2)
    assert diagnostics.values(sim, "moisture") == pytest.approx(exact, abs=0.01 * 0.25)
    assert moisture.time == pytest.approx(time) and moisture.account()["relative"] < 1e-12


@pytest.mark.parametrize("kind", KINDS)
def test_a_gradient_that_is_steady(kind: str) -> None:
    """J = rho D dw/dx: what comes in at the wet end leaves at the dry one; nothing changes."""
    sim, moisture = soil(bar(kind))
    x = sim.mesh.points[:, 0]
    for place in np.unique(x):
        moisture.initial(np.flatnonzero(x == place), 0.1 + 0.2 * place)
    moisture.prescribe(np.flatnonzero(x == 0.0), 0.1)
    flux = DENSITY * D * 0.2
    right = faces_at(sim.mesh, 1.0)
    moisture.expose(right, flux=flux)
    before = moisture.account()
    steps(sim, moisture, 1e5)
    assert diagnostics.values(sim, "moisture") == pytest.approx(0.1 + 0.2 * x, abs=1e-12)
    found = moisture.account()
    assert found["stored"] == pytest.approx(before["stored"], rel=1e-12)
    assert abs(found["given"] - before["given"]) < 1e-9 * flux * 1e5 and found["relative"] < 1e-12


@pytest.mark.parametrize("kind", ["mixed", "tetrahedra"])
def test_no_water_is_lost(kind: str) -> None:
    """Rain, evaporation, a side that is held, soil that is taken out: the account closes to rounding."""
    mesh = box((4, 3, 3), (0.4, 0.3, 0.3), shaken=0.2) if kind == "tetrahedra" else shaken(
        rectangle(8, 6, 0.8, 0.6, kind=kind), 0.2)  # fmt: skip
    sim, moisture = soil(mesh, evaporation=1e-6)
    moisture.initial(None, 0.2)
    top = np.flatnonzero(mesh.points[:, -1] > mesh.points[:, -1].max() - 1e-9)
    sim.table("seasons", [(0.0, 0.1), (1e5, 0.4), (3e5, 0.05)])
    moisture.expose(None, environment="seasons")
    moisture.expose(faces_at(mesh, mesh.points[:, 0].max()), flux=1e-6, environment=None)
    moisture.prescribe(top, "seasons")
    assert moisture.uses_table("seasons")
    steps(sim, moisture, 1e5)
    changes.null(sim, np.arange(3, 9))
    moisture.remove_conditions(top[:2])
    steps(sim, moisture, 1e5)
    found = moisture.account()
    assert found["relative"] < 1e-12 and found["removed"] > 0.0 and abs(found["given"]) > 1e-3 * found["stored"]


def test_what_is_refused() -> None:
    sim, moisture = soil(bar("tri"))
    with pytest.raises(CommandError, match="the moisture of a node must not be negative, got -1"):
        moisture.prescribe(None, -1.0)
    with pytest.raises(CommandError, match="environment-moisture needs a transfer coefficient"):
        moisture.expose(None, environment=0.1)
    with pytest.raises(CommandError, match="moisture_residual must be below moisture_saturated"):
        moisture.adjust(None, {"moisture_residual": 0.5})
    moisture.clock(on=False)
    with pytest.raises(CommandError, match="nothing to compute"):
        sim.step()


def test_suction_is_that_of_van_genuchten() -> None:
    sim, moisture = soil(bar("tri"), moisture_saturated=0.4, moisture_residual=0.1, air_entry=2e4, pore_index=2.0)
    for value, part in ((0.4, 1.0), (0.5, 1.0), (0.25, 0.5), (0.175, 0.25)):
        moisture.initial(None, value)
        expected = 2e4 * math.sqrt(part**-2.0 - 1.0)
        assert diagnostics.values(sim, "suction") == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("dim", [2, 3])
def test_soil_that_is_held_is_drawn_as_it_dries(dim: int) -> None:
    """Held along x (in the plane along z too): shrinkage * E * loss, in the plane over 1 - nu."""
    sim, moisture = soil(bar("mixed" if dim == 2 else "tetrahedra"), shrinkage=0.05)
    moisture.initial(None, 0.3)
    moisture.clock(dt=1.0)
    moisture.prescribe(None, 0.28)
    sim.step()
    sim.parts(mechanical=True)
    sim.option(dynamic=False)
    moisture.clock(on=False)
    x = sim.mesh.points
    sim.velocity_condition(np.flatnonzero((x[:, 0] == 0.0) | (x[:, 0] == x[:, 0].max())), vx=0.0)
    sim.velocity_condition(np.flatnonzero(x[:, 1] == 0.0), vy=0.0)
    if dim == 3:
        sim.velocity_condition(np.flatnonzero(x[:, 2] == 0.0), vz=0.0)
    equilibrium.solve_elastic(sim)
    expected = 0.05 * 1e7 * 0.02 / (1.0 - 0.3 if dim == 2 else 1.0)
    assert diagnostics.values(sim, "stress_xx") == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("loss", [0.0, 0.1, 0.2])
def test_a_column_is_the_stronger_the_drier_it_is(loss: float) -> None:
    """Without friction it bears 2 c; cohesion is a table over moisture."""
    sim = Blocks()
    sim.take_mesh(rectangle(2, 4, 0.1, 0.2, kind="mixed"))
    sim.table("drier", [(0.1, 40e3), (0.3, 10e3)])
    changes.element_model(
        sim, None, "mech_mohr_coulomb",
        {**SOIL, "friction": 0.0, "cohesion": Over("drier", OVER), "tensile": 1e6},
    )  # fmt: skip
    with pytest.raises(CommandError, match="over moisture, but there is no moisture: element c-model moisture-diff"):
        sim.close_model()
        sim.step()
    moisture = Moisture.of(sim)
    moisture.assign(None, CLAY)
    moisture.initial(None, 0.3)
    sim.parts(mechanical=False)
    moisture.clock(dt=1.0)
    moisture.prescribe(None, 0.3 - loss)
    sim.step()
    sim.parts(mechanical=True)
    sim.option(dynamic=False, collision=False)
    moisture.clock(on=False)
    sim.velocity_condition(at(sim, y=0.0), vy=0.0)
    sim.velocity_condition(at(sim, x=0.0), vx=0.0)
    sim.velocity_condition(at(sim, y=0.2), vy=-2e-3)
    equilibrium.solve_elastic(sim, cycles=1, steps=4)
    cohesion = 10e3 + 30e3 * loss / 0.2
    assert diagnostics.values(sim, "stress_yy") == pytest.approx(-2.0 * cohesion, rel=1e-6)


def test_it_continues_from_a_checkpoint(tmp_path) -> None:
    """With its conditions, clock and tables: the same bits."""
    sims = []
    for cut in (False, True):
        sim, moisture = soil(shaken(rectangle(8, 6, 0.8, 0.6, kind="mixed"), 0.2), evaporation=1e-6)
        moisture.initial(None, 0.3)
        moisture.expose(None, environment=0.05)
        moisture.clock(steps=2, dt=500.0)
        for step in range(20):
            if cut and step == 9:
                saved_state.save(sim, tmp_path / "half.sav")
                sim = Blocks()
                saved_state.restore(sim, tmp_path / "half.sav")
            sim.step()
        sims.append(sim)
    one, other = (diagnostics.values(sim, "moisture") for sim in sims)
    assert one.tobytes() == other.tobytes() and one.max() < 0.3
    assert Moisture.of(sims[0]).account() == Moisture.of(sims[1]).account()
