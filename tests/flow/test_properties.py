"""Hydraulic properties: changed by name, drawn from fields, from tables over places; apertures that grow with slip;
what makes no sense."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem import changes
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.flow import kernels
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.properties import POROUS
from tests.blocks.support import JOINT, model, rectangle
from tests.flow.support import WATER, at, inner, line, run
from tests.pcdc.fake import Bench

SCRIPT = """
pcdc model new
pcdc mesh structured (0,0) (4,2) cells 4 2
pcdc element c-model mech-iso-e property density 2500 young 50e9 poisson-ratio 0.25
pcdc face-joint c-model hydr-p-m property f-den 1000 f-bulk 1e6 vis 1e-6 a-initial 1e-5 a-min 1e-6 range y 1 1
pcdc model option mechanical off
"""


def bench(tmp_path: Path, more: str) -> Bench:
    return Bench(tmp_path, blocks=Blocks(SerialComm()))(f"{SCRIPT}{more}\n")


def apertures(tmp_path: Path, more: str) -> np.ndarray:
    found = bench(tmp_path, more + "\nfound = pcdc.values('flow-channel', 'aperture')")["found"]
    assert len(found) == 4
    return found


def test_properties_of_channels_are_changed_by_name(tmp_path: Path) -> None:
    assert apertures(tmp_path, "pcdc face-joint property aperature-initial 3e-5") == pytest.approx(3e-5)
    two = apertures(tmp_path, "pcdc face-joint property aperature-initial 3e-5 range x 0 2 y 1 1")
    assert np.sort(two) == pytest.approx([1e-5, 1e-5, 3e-5, 3e-5])
    least = "pcdc face-joint property aperature-minumum 2e-5"
    assert apertures(tmp_path, least) == pytest.approx(2e-5)
    both = "pcdc face-joint c-model c-i-c-i property cohesion 1e6 tensile-strength 1e6 gf1 10 gf2 10 range y 1 1\n"
    found = bench(tmp_path, both + "pcdc face-joint property friction 20 aperature-initial 4e-5 range y 1 1")
    blocks = found.project.blocks
    channels = Flow.of(blocks).network.channels
    assert Flow.of(blocks).values("flow-channel", "aperture") == pytest.approx(4e-5)
    assert blocks.joint_rows.column("friction")[blocks.joint_row[channels]] == pytest.approx(20.0)


def test_the_fluid_is_changed_everywhere_or_not_at_all(tmp_path: Path) -> None:
    found = bench(tmp_path, "pcdc face-joint property viscosity 3e-6")
    assert Flow.of(found.project.blocks).viscosity == pytest.approx(3e-3)
    with pytest.raises(HpcdemError, match="all channels have the same fluid, but viscosity is 1e-06 and 3e-06"):
        bench(tmp_path, "pcdc face-joint property viscosity 3e-6 range x 0 2 y 1 1")


def test_apertures_follow_fields_and_tables(tmp_path: Path) -> None:
    ramp = "pcdc table create 'a' values (0,1e-5) (4,5e-5)\n"
    first = "c-model hydr-p-m property f-den 1000 f-bulk 1e6 vis 1e-6 a-initial table 'a' over x a-min 1e-6 range y 1 1"
    for how in ("property aperature-initial table 'a' over x", first):
        found = np.sort(apertures(tmp_path, f"{ramp}pcdc face-joint {how}"))
        assert found == pytest.approx([1.5e-5, 2.5e-5, 3.5e-5, 4.5e-5])
    field = "pcdc field create 'f' lognormal 2e-5 5e-6 seed 3\npcdc face-joint property aperature-initial field 'f'"
    found = apertures(tmp_path, field)
    assert len(set(found.tolist())) == 4 and (found > 1e-6).all() and np.array_equal(found, apertures(tmp_path, field))
    with pytest.raises(HpcdemError, match=r"face-joint [0-9]+: aperature-minumum must be > 0"):
        bench(tmp_path, "pcdc table create 'a' values (0,-1) (4,1)\npcdc face-joint property a-min table 'a' over x")


def test_leak_off_can_be_switched_on_later(tmp_path: Path) -> None:
    on = "pcdc face-joint property leak-off on matrix-permeability 1e-15 matrix-porosity 0.2 m-p-c 1e-9"
    flow = Flow.of(bench(tmp_path, on).project.blocks)
    assert (flow.laws()[flow.row[flow.network.channels] - 1][:, kernels.LEAK] > 0.0).all()
    for more, said in (("leak-off on", "leak-off needs matrix-permeability"),
                       ("leak-off on matrix-permeability 1e-15", "leak-off needs matrix-porosity"),
                       ("matrix-porosity 0.2", "matrix-porosity needs leak-off, which is off")):  # fmt: skip
        with pytest.raises(HpcdemError, match=said):
            bench(tmp_path, f"pcdc face-joint property {more}")


# ---- slip that opens -------------------------------------------------------------------------------------------------


def sheared(slip: float, **changed: float) -> np.ndarray:
    """Apertures of a joint along x whose upper side has been moved by so much."""
    sim = model(rectangle(2, 2, 1.0, 1.0))
    edges = sim.mesh.edges()
    on = edges.inner & (np.abs(sim.mesh.points[edges.points][:, :, 1] - 0.5) < 1e-9).all(axis=1)
    joints = edges.faces[on, 0]
    sim.joint_model(joints, "classic_intrinsic_cohesive_interface", JOINT)
    flow = Flow.of(sim)
    flow.assign(joints, {**WATER, **changed})
    changes.crack(sim, joints)
    sim.option(collision=False)
    upper = np.flatnonzero(sim.mesh.centroids()[:, 1] > 0.5)
    sim.close_model()
    moved = np.zeros_like(sim.x)
    moved[sim.where[upper], 0::2] = slip
    sim.x += moved
    flow.find_geometry()
    return flow.channel_table[:, kernels.APERTURE]


def test_slip_opens_by_the_tangent_of_the_angle() -> None:
    for slip in (2e-4, -2e-4):
        assert sheared(slip) == pytest.approx(1e-5, rel=1e-9)  # off by itself
        assert sheared(slip, shear_dilation=10.0) == pytest.approx(1e-5 + math.tan(math.radians(10.0)) * 2e-4, rel=1e-6)
        found = sheared(slip, shear_dilation=10.0, shear_dilation_limit=2e-5)
        assert found == pytest.approx(3e-5, rel=1e-6)
        assert sheared(slip, shear_dilation=45.0, aperature_maximum=5e-5) == pytest.approx(5e-5)


# ---- what makes no sense ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"aperature_initial": -1e-5}, "aperature_initial must be >= 0"),
        ({"aperature_minumum": 0.0}, "aperature_minumum must be > 0"),
        ({"aperature_minumum": -1e-6}, "aperature_minumum must be > 0"),
        ({"aperature_maximum": -1.0}, "aperature_maximum must be > 0"),
        ({"aperature_maximum": 1e-7}, "aperature_minumum must not be above aperature_maximum"),
        ({"fluid_bulk": math.inf}, "fluid_bulk must be finite"),
        ({"fluid_bulk": 0.0}, "fluid_bulk must be > 0"),
        ({"viscosity": 0.0}, "viscosity must be > 0"),
        ({"shear_dilation": 81.0}, "shear_dilation must be >= 0 and <= 80"),
        ({"shear_dilation_limit": 1e-4}, "shear_dilation_limit needs shear_dilation, which is 0"),
        ({"leak_off": 1.0, "matrix_permeability": 0.0, "matrix_porosity": 0.2, "matrix_porosity_compressibility": 0.0},
         "leak_off needs matrix_permeability"),
    ],
)  # fmt: skip
def test_what_a_channel_cannot_have(given: dict[str, float], said: str) -> None:
    with pytest.raises(CommandError, match=said):
        POROUS.complete({**WATER, **given})


def test_nearly_incompressible_fluid_without_an_outlet() -> None:
    """Pumped into a closed channel its pressure rises by K dV / V, whatever K; a fluid so stiff that flow needs more
    sub-steps than make sense is refused with their number when rock moves."""
    sim, flow = line(4, 1.0, fluid_bulk=2.2e15)
    flow.fill(None, saturation=1.0)
    flow.drill("w", at(sim, 0.0, 0.0))
    flow.stage("w", "rate", 1e-9, math.inf, math.inf)
    run(sim, 4000)
    account = flow.account()
    room = flow.nodes[:, kernels.V].sum()
    assert flow.values("flow-node", "pressure").mean() == pytest.approx(2.2e15 * 1e-9 * flow.time / room, rel=0.02)
    assert account["relative"] < 1e-12 and np.isfinite(flow.state).all()
    sim = model(rectangle(4, 2, 1.0, 0.5))
    flow = Flow.of(sim)
    flow.assign(inner(sim.mesh), {**WATER, "fluid_bulk": 1e22})
    sim.flow_clock(every=1000)
    with pytest.raises(CommandError, match=r"flow would need \d+ sub-steps"):
        sim.step()


def test_a_channel_that_is_none_has_no_properties() -> None:
    _, flow = line(4, 1.0)
    others = np.setdiff1d(inner(flow.blocks.mesh), flow.network.channels)
    with pytest.raises(CommandError, match=rf"face-joint {others[0]} has no hydraulic model"):
        flow.adjust(others[:1], {"aperature_initial": 1e-4})
