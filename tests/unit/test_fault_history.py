"""`hpcdem measure faults --over-time` on rigid blocks that slide along known planes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.frame import Table
from hpcdem.io.vtkhdf_mesh import MeshFrame, write_mesh_frame
from hpcdem.post.measure import fault_history, faults
from hpcdem.post.measure.fault_history import Seen, track
from hpcdem.post.measure.grains import Grains
from hpcdem.post.measure.scene import Request, make_plan
from hpcdem.post.view.moment import read_moment
from hpcdem.post.view.scene import default_view, scene
from hpcdem.sweep import tables
from tests.unit.measured import R, frame, lattice, ramp, write
from tests.unit.test_measure_folder import PROGRAM, column, run, table

LENGTH, DEPTH = 14000.0, 3000.0
FIRST, SECOND = (3500.0, 30.0), (8000.0, 40.0)
"""Foot [m] and dip [degrees] of two thrusts to the right."""
SLIPS = ((0.0, 0.0), (150.0, 0.0), (300.0, 0.0), (450.0, 200.0), (450.0, 400.0), (450.0, 600.0))
"""Of both in each frame: the first one ends when the second one has begun."""


def moved(k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Places before, places in frame k, shortening."""
    x, y = lattice(LENGTH, DEPTH)
    u = sum(np.array(ramp(x, y, *plane, slip)) for plane, slip in zip((FIRST, SECOND), SLIPS[k]))
    heave = sum(slip * np.cos(np.radians(dip)) for (_, dip), slip in zip((FIRST, SECOND), SLIPS[k]))
    return np.column_stack([x, y]), np.column_stack([x, y]) + np.transpose(u), y, float(heave)


def blocks(folder: Path, k: int, places: np.ndarray, y: np.ndarray) -> None:
    """The same as squares of blocks, the layers as groups."""
    n = len(y)
    corner = R * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    at = (places[:, None] + corner).reshape(-1, 2)
    of_corners = {"number": np.arange(4 * n), "x": at[:, 0], "y": at[:, 1]}
    of_corners |= {"displacement_x": 0.0 * at[:, 0], "displacement_y": 0.0 * at[:, 0], "node": np.arange(4 * n)}
    of_elements = {"number": np.arange(n), "corners": np.full(n, 4), "area": np.full(n, 4.0 * R * R)}
    of_elements["group_layer"] = (y // 1000.0).astype(np.int32)
    none = {"number": np.zeros(0, int), "first": np.zeros(0, int), "last": np.zeros(0, int), "state": np.zeros(0)}
    parts = (Table(c, 0, len(c["number"])) for c in (of_corners, of_elements, none))
    names = {"group_layer": ["low", "middle", "high"]}
    folder.mkdir(parents=True, exist_ok=True)
    frame = MeshFrame(1000 * k, 50.0 * k, 0.05, *parts, names)
    write_mesh_frame(folder / f"blocks_{frame.step:010d}.vtkhdf", frame, SerialComm())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("sliding") / "data"
    for k in range(len(SLIPS)):
        _, now, y, heave = moved(k)
        write(folder, frame(1000 * k, *now.T, heave, color=(y // 1000.0).astype(np.int32)))
        blocks(folder.parent / "blocks", k, now, y)
    run(folder, "faults", "--over-time", "--strain", 0.1, figures=True)
    return folder


def test_slip_throw_and_heave_of_rigid_blocks_are_exact(folder: Path) -> None:
    """In each frame, of both faults, to a micrometre; dip to 1.5 degrees, which is what the cells of a band give."""
    rows = table(folder / "measure", "faults")
    for number, (_, dip), which in ((1, FIRST, 0), (2, SECOND, 1)):
        mine = [row for row in rows if row["fault"] == str(number)]
        slips = [s[which] for k, s in enumerate(SLIPS) if 1000 * k >= int(mine[0]["step"])]
        assert column(mine, "throw[m]") == pytest.approx(np.sin(np.radians(dip)) * np.array(slips), abs=1e-6)
        assert column(mine, "heave[m]") == pytest.approx(np.cos(np.radians(dip)) * np.array(slips), abs=1e-6)
        off = np.radians(column(mine, "dip[deg]") - dip)
        assert np.abs(np.degrees(off)).max() < 1.5
        assert column(mine, "slip[m]") == pytest.approx(slips * np.cos(off), abs=1e-6)
        assert column(mine, "mean_slip[m]") == pytest.approx(column(mine, "slip[m]"), abs=1e-6)
        assert column(mine, "opening[m]") == pytest.approx(slips * np.sin(-off), abs=1e-6)
        length = DEPTH / np.sin(np.radians(dip))
        assert column(mine, "length[m]") == pytest.approx(length, rel=0.2)
        assert {(row["dips_to"], row["vergence"], row["sense"]) for row in mine} == {("left", "right", "reverse")}


def test_identity_is_kept_while_another_one_is_born(folder: Path) -> None:
    rows = table(folder / "measure", "faults")
    states = {n: [row["state"] for row in rows if row["fault"] == n] for n in "12"}
    assert {row["fault"] for row in rows} == {"1", "2"}
    assert states == {"1": ["active"] * 3 + ["inactive"] * 2, "2": ["active"] * 3}
    first, second = table(folder / "measure", "faults_summary")
    assert (first["born_step"], first["last_active_step"], first["end"]) == ("1000", "3000", "inactive")
    assert (second["born_step"], second["last_active_step"], second["end"]) == ("3000", "5000", "active")
    assert float(first["share_of_shortening"]) + float(second["share_of_shortening"]) > 1.0  # each since its birth
    one = [row for row in rows if row["fault"] == "1"]
    assert column(one, "slip_per_shortening")[:2] == pytest.approx(1.0 / np.cos(np.radians(30.0)), rel=1e-3)
    assert column(one, "slip_per_shortening")[-1] == pytest.approx(0.0, abs=1e-9)
    assert column(one, "slip_rate[m/s]")[:3] == pytest.approx(150.0 / 50.0, rel=1e-3)
    assert (folder / "measure" / "faults.png").stat().st_size > 20000


def test_horizons_are_offset_by_the_slip(folder: Path) -> None:
    rows = [row for row in table(folder / "measure", "faults_horizons") if row["step"] == "5000"]
    names = {"green over lg", "yellow over green"}
    assert {(row["fault"], row["horizon"]) for row in rows} == {(n, name) for n in "12" for name in names}
    for row in rows:
        slip, dip = (450.0, 30.0) if row["fault"] == "1" else (600.0, 40.0)
        assert float(row["throw[m]"]) == pytest.approx(slip * np.sin(np.radians(dip)), abs=1e-6)
        assert float(row["heave[m]"]) == pytest.approx(slip * np.cos(np.radians(dip)), abs=1e-6)
    middle = {row["horizon"]: float(row["y[m]"]) for row in rows if row["fault"] == "2"}
    assert sorted(middle.values()) == pytest.approx([1000.0, 2000.0], abs=R)


def test_the_frames_of_blocks_end_at_the_last_step_asked_for(folder: Path) -> None:
    for last, steps in ((0, [0]), (2000, [0, 1000, 2000])):
        plan, _ = make_plan(Request(folder.parent / "blocks", ("faults",), last=last), ["faults"])
        assert [file.step for file in plan.frames] == steps


def test_blocks_give_the_same_numbers(folder: Path) -> None:
    """Elements at their centroids; time in place of the shortening, since no wall moves."""
    data = folder.parent / "blocks"
    run(data, "faults", "--over-time", "--strain", 0.1)
    here, there = table(data / "measure", "faults"), table(folder / "measure", "faults")
    assert len(here) == len(there) and {row["shortening[m]"] for row in here} == {""}
    for name in ("throw[m]", "heave[m]"):
        assert column(here, name) == pytest.approx(column(there, name), abs=1e-6)
    run(data, "faults", "--strain", 0.1)
    assert len(table(data / "measure", "faults")) == 6  # bands of each frame
    with pytest.raises(UsageError, match=r"--over-time requires faults"):
        run(data, "--over-time")
    with pytest.raises(HpcdemError, match="contains no frames"):
        run(data, "wedge")


@pytest.mark.parametrize(("slip", "turned", "opened"), [(300.0, 0.0, 0.0), (-300.0, 0.0, 0.0), (300.0, 25.0, 40.0)])
def test_normal_faults_rotation_and_opening(slip: float, turned: float, opened: float) -> None:
    """A thrust and a normal fault of 50 degrees; one that opens while the whole model rotates: slip and opening are
    those of the plane as it lies now."""
    x, y = lattice(10000.0, 3000.0, disturbed=0.0)
    dip = np.radians(50.0)
    dx, dy = ramp(x, y, 4000.0, 50.0, slip)
    above = dx != 0.0
    places = np.column_stack([x + dx - above * opened * np.sin(dip), y + dy + above * opened * np.cos(dip)])
    c, s = np.cos(np.radians(turned)), np.sin(np.radians(turned))
    places = places @ np.array([[c, s], [-s, c]])
    before, after = (
        Grains(0, np.arange(len(x)), *p.T, np.full(len(x), R), (y // 1000).astype(int), np.full(len(x), ""), {})
        for p in (np.column_stack([x, y]), places)
    )
    t = np.array([np.cos(dip), np.sin(dip)])
    foot = np.array([4000.0, 0.0])
    ends = tuple(map(tuple, (foot + 200.0 * t, foot + 3600.0 * t)))
    band = faults.Band(tuple(foot + 1900.0 * t), 3400.0, 50.0, 1 if slip > 0 else -1, 1.0, 1.0, ends, 3400.0 * 400.0)
    fault = fault_history.Fault(1, band.vergence, {1: [Seen(band, fault_history.members(band, before, 200.0))]})
    plane = fault_history.plane(fault, before, 200.0, np.array([str(c) for c in before.color], object))
    assert plane is not None
    found = fault_history.measure(plane, after, 1)
    off = np.arctan2(plane.along[1], plane.along[0]) - dip
    assert np.degrees(abs(off)) < 1.0
    assert found.dip == pytest.approx(50.0 + turned + np.degrees(off), abs=1e-9)
    assert found.slip == pytest.approx(slip * np.cos(off) + opened * np.sin(off), abs=1e-6)
    assert found.opening == pytest.approx(-slip * np.sin(off) + opened * np.cos(off), abs=1e-6)
    assert found.slid(fault.vergence) == pytest.approx(abs(slip), abs=2.0)


def seen(low: int, high: int, dip: float = 30.0, vergence: int = 1) -> Seen:
    """A band along a line that holds the particles low to high."""
    ends = ((float(low), 0.0), (float(high), 0.0))
    band = faults.Band((0.5 * (low + high), 0.0), float(high - low), dip, vergence, 1.0, 1.0, ends, float(high - low))
    return Seen(band, np.arange(low, high))


def test_birth_growth_merging_and_death() -> None:
    """Two segments grow towards each other until one band covers both: the larger one goes on, the other one has merged
    into it. A fault that rests keeps its number. Another dip, or sense, at the same place is another fault."""
    frames = [
        [],
        [seen(0, 60)],
        [seen(0, 80), seen(150, 190)],
        [seen(0, 100), seen(140, 190)],
        [seen(0, 190)],
        [],
        [seen(90, 190), seen(20, 60, dip=75.0)],
        [seen(20, 60, dip=75.0), seen(100, 130, vergence=-1)],
        [seen(100, 130, vergence=-1), seen(300, 330)],
    ]
    found, brief = track(frames)
    assert brief == 1  # 300 to 330 in one frame only
    assert [(f.number, f.born, f.last, f.merged) for f in found] == [
        (1, 1, 6, None), (2, 2, 3, (1, 4)), (3, 6, 7, None), (4, 7, 8, None),
    ]  # fmt: skip
    assert sorted(found[0].seen) == [1, 2, 3, 4, 6] and found[0].seen[4][0].band.length == 190.0


def test_members_of_a_sweep_have_their_faults_beside_each_other(folder: Path) -> None:
    series, _, single = tables.measured(folder / "measure", folder)
    assert series["faults_total", "faults"].y.tolist() == [0, 1, 1, 2, 2, 2]
    assert series["faults_total", "active"].y.tolist() == [0, 1, 1, 2, 1, 1]
    assert series["faults_total", "slip[m]"].y == pytest.approx([0, 150, 300, 650, 850, 1050], rel=1e-3)
    assert series["faults_total", "share_of_shortening"].y[1:] == pytest.approx(1.0, abs=1e-6)
    assert series["faults_total", "heave[m]"].axis == "shortening[m]" and ("faults", "bands") not in series
    assert single["fault 1.slip[m]"] == pytest.approx(450.0, rel=1e-3)
    assert single["fault 2.born_shortening[m]"] == pytest.approx(moved(3)[3], abs=1e-6)


@pytest.mark.slow
@pytest.mark.mpi
def test_three_ranks_follow_the_same_faults(folder: Path, tmp_path: Path, needs_mpi: None, launch) -> None:
    (tmp_path / "measure.py").write_text(PROGRAM)
    words = ["faults", "--over-time", "--strain", "0.1", "--format", "none", "-o", tmp_path / "3"]
    ended = launch.python(3, tmp_path / "measure.py", folder, *words)
    assert ended.returncode == 0, ended.stdout + ended.stderr
    for path in sorted((tmp_path / "3").iterdir()):
        assert path.read_bytes() == (folder / "measure" / path.name).read_bytes(), path.name


def test_views_show_the_faults_of_a_frame(folder: Path, tmp_path: Path) -> None:
    for path in folder.glob("all_*.vtkhdf"):
        (tmp_path / path.name).symlink_to(path)
    frames = sorted(tmp_path.glob("all_*.vtkhdf"))
    assert "faults" not in read_moment(frames[-1]).objects
    run(tmp_path, "faults", "--over-time")
    rows = [row for row in table(tmp_path / "measure", "faults") if row["step"] == "5000"]
    moment = read_moment(frames[-1])
    found = moment.of("faults")
    assert found.count == len(rows) == 2 and found.fields["fault"].tolist() == [1, 2]
    assert found.fields["slip"].tolist() == [float(row["slip[m]"]) for row in rows] and moment.unit_of("heave") == "m"
    assert found.fields["active"].tolist() == [0, 1]
    ends = [[float(row[name]) for name in ("x1[m]", "y1[m]", "x2[m]", "y2[m]")] for row in rows]
    assert found.read()[0].reshape(2, 4).tolist() == ends
    view = default_view(moment)
    assert not view.layer("faults").visible
    layer = scene(moment, view.with_layer("faults", visible=True)).layers[-1]
    assert [name for name, _ in layer.legend] == ["fault 1", "fault 2"] and len(set(layer.kind.tolist())) == 2
    assert "faults" not in read_moment(frames[0]).objects and read_moment(frames[1]).of("faults").count == 1
    damaged = (tmp_path / "measure/faults.csv").read_text().replace("slip[m]", "slp[m]", 1)
    (tmp_path / "measure/faults.csv").write_text(damaged)
    with pytest.raises(HpcdemError, match=r"faults.csv is damaged"):
        read_moment(frames[-1])
