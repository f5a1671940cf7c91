"""Measurements of frames with periodic sides do not depend on where the sides are."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem import bonds, cycles, output, particles, properties, walls
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.post.measure import report
from hpcdem.post.measure.scene import Request
from hpcdem.runtime.progress import Log
from tests.support import model

RADIUS, ACROSS, ROWS = 0.5, 60, 24
LENGTH, RISE = 2.0 * RADIUS * ACROSS, RADIUS * math.sqrt(3.0)
HEIGHT = (ROWS - 1) * RISE
DIP, SLIP = math.radians(50.0), 3.0


def slid(x: np.ndarray, y: np.ndarray, at: float) -> tuple[np.ndarray, np.ndarray]:
    """Displacement along a fault that leaves the base at x = `at`: SLIP within three diameters, and back slowly around
    the model."""
    s = np.mod(x - at - y / math.tan(DIP), LENGTH)
    wide = 6.0 * RADIUS
    amount = SLIP * np.where(s < wide, s / wide, (LENGTH - s) / (LENGTH - wide))
    return -amount * math.cos(DIP), -amount * math.sin(DIP)


def frames(folder: Path, shift: float, approach: float = 0.0) -> Path:
    """Two frames of a hexagonal packing that is cut by a fault, everything moved by `shift` around the model; the sides
    approach each other by so much between them."""
    sim = model(folder, 1e-3)
    walls.box(sim, 0.0, LENGTH, -RADIUS, 3.0 * HEIGHT, kn=1e6, ks=1e6)
    walls.periodic(sim, (0.0, LENGTH))
    column, row = (v.ravel() for v in np.meshgrid(np.arange(ACROSS), np.arange(ROWS)))
    x, y = 2.0 * RADIUS * (column + 0.5 * (row % 2)) + 0.01, RISE * row
    particles.add(sim, np.column_stack([np.mod(x + shift, LENGTH), y, np.full(len(x), RADIUS)]), 0, 0)
    properties.prop(sim, density=2000.0, kn=0.0, ks=0.0)
    cycles.prepare(sim)
    output.Snapshot(sim, initial=True).write_print()
    du, dv = slid(x, y, LENGTH - 0.5 * HEIGHT / math.tan(DIP))
    squeeze = 1.0 - approach / LENGTH
    now = (np.mod(x + shift, LENGTH) + du) * squeeze
    sim.open_model()
    at = np.argsort(np.argsort(sim.particles["gid"]))
    sim.particles["x"][:], sim.particles["y"][:] = now[at], (y + dv)[at]
    sim.settings.period = LENGTH * squeeze
    sim.clock.step, sim.clock.time = 100, 1.0
    cycles.prepare(sim)
    output.Snapshot(sim).write_print()
    return folder


def measured(folder: Path, *what: str, **more) -> dict[str, list[dict[str, str]]]:
    report.run(SerialComm(), Log(), Request(folder, what, formats=(), first=0, width=1.5 * RADIUS, **more))
    return {path.stem: list(csv.DictReader(path.open())) for path in (folder / "measure").glob("*.csv")}


@pytest.fixture(scope="module")
def at(tmp_path_factory):
    """Tables of the model in which the fault crosses the sides, and of that in which it does not."""
    return [
        measured(frames(tmp_path_factory.mktemp("frames"), shift), "surface", "faults", "layers", "tracks", number=3)
        for shift in (0.0, 0.5 * LENGTH)
    ]


def test_a_fault_across_the_sides_is_one_fault(at):
    """Length, dip, strain and sense as inside; its centre is that of the fault, once around."""
    (one,), (other,) = ([row for row in tables["faults"] if row["step"] == "100"] for tables in at)
    for name, tolerance in (("length[m]", 0.8), ("dip[deg]", 1.0), ("mean_strain", 0.03), ("area[m2]", 8.0)):
        assert float(one[name]) == pytest.approx(float(other[name]), abs=tolerance)
    assert float(one["dip[deg]"]) == pytest.approx(50.0, abs=3.0)
    assert float(one["length[m]"]) == pytest.approx(HEIGHT / math.sin(DIP), rel=0.15)
    assert (one["sense"], one["vergence"]) == (other["sense"], other["vergence"])
    apart = (float(one["x[m]"]) - float(other["x[m]"]) + 0.5 * LENGTH) % LENGTH
    assert min(apart, LENGTH - apart) < 0.6
    assert max(float(one["x1[m]"]), float(one["x2[m]"])) > LENGTH or min(float(one["x1[m]"]), float(one["x2[m]"])) < 0.0


def test_surface_porosity_and_tracks_go_around(at):
    """The porosity of the packing is that of the closed form: no strip at the sides is lost or counted twice."""
    solid = ACROSS * ROWS * math.pi * RADIUS**2
    for tables in at:
        row = next(r for r in tables["layers"] if r["step"] == "0" and r["kind"] == "all")
        assert float(row["envelope_area[m2]"]) == pytest.approx(LENGTH * (HEIGHT + 2.0 * RADIUS), rel=1e-9)
        assert float(row["porosity"]) == pytest.approx(1.0 - solid / (LENGTH * (HEIGHT + 2.0 * RADIUS)), rel=1e-9)
        moved = [float(r["dx[m]"]) for r in tables["tracks"] if r["step"] == "100"]
        assert len(moved) > 10 and max(map(abs, moved)) <= SLIP * math.cos(DIP) + 1e-9
    flat = [sorted(float(r["height[m]"]) for r in tables["surface"] if r["step"] == "0") for tables in at]
    assert flat[0] == pytest.approx(flat[1], abs=1e-9) and len(flat[0]) == 80  # of the two upper rows
    tops = [sorted(float(r["height[m]"]) for r in tables["surface"] if r["step"] == "100") for tables in at]
    assert np.mean(tops[0]) == pytest.approx(np.mean(tops[1]), abs=0.02)


def envelopes(tables) -> list[float]:
    """Areas of the section, pores included, in both frames [m2]."""
    return [float(row["envelope_area[m2]"]) for row in tables["layers"] if row["kind"] == "all"]


def test_sides_that_approach_strain_the_section(at, tmp_path):
    """The homogeneous shortening of a tenth makes no band, and the area smaller by a tenth."""
    tables = measured(frames(tmp_path, 0.0, 6.0), "faults", "layers")
    (row,) = [r for r in tables["faults"] if r["step"] == "100"]
    assert float(row["dip[deg]"]) == pytest.approx(50.0, abs=5.0)
    slid_only, both = (b / a for a, b in (envelopes(at[0]), envelopes(tables)))
    assert both / slid_only == pytest.approx(0.9, abs=0.01)


def test_a_bond_that_breaks_across_the_sides_breaks_there(tmp_path):
    sim = model(tmp_path, 1e-4)
    walls.periodic(sim, (0.0, 4.0))
    for gid, x in enumerate((3.93, 0.11, 2.0)):
        particles.ball(sim, gid, x, 0.0, 0.1)
    properties.prop(sim, density=1000.0, kn=1e5, ks=1e5)
    assert bonds.bond(sim, ebmod=1e5, gbmod=1e5, tstrength=1e9, sstrength=1e9, tolerate=0.02) == 1
    cycles.prepare(sim)
    output.Snapshot(sim, initial=True).write_print()
    bonds.break_bonds(sim)
    sim.clock.step = 10
    cycles.prepare(sim)
    output.Snapshot(sim).write_print()
    (row,) = measured(tmp_path, "cracks")["cracks_bonds"]
    assert float(row["x[m]"]) == pytest.approx(0.02, abs=1e-9)


def test_what_a_periodic_model_does_not_have_is_refused_by_name(tmp_path):
    folder = frames(tmp_path, 0.0)
    for what, more, message in (
        (
            ("wedge",),
            {},
            r"wedge: the sides of this model are periodic .PERIODIC.: nothing pushes, and there is no toe",
        ),
        (("faults",), {"over_time": True}, "faults --over-time: .* not followed across them; measure faults"),
    ):
        with pytest.raises(HpcdemError, match=message):
            measured(folder, *what, **more)
    assert "wedge" not in measured(folder)
