"""`hpcdem -s DIR`: from a folder of frames to sections, on any number of ranks; and what it refuses."""

from __future__ import annotations

import copy
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from hpcdem.cli.strain_stress import load_kernels
from hpcdem.cli.strain_stress import strain_stress as command
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.dat import read_dat, write_dat
from hpcdem.io.frame import Frame, Table
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.post import strain, strain_stress
from hpcdem.post.section import PARTICLE_FIELDS, UNITS, Section, read_section, write_section
from hpcdem.post.sections import survey
from tests.unit import bed

ROOT = Path(__file__).resolve().parents[2]
ALONE = SerialComm()


class Log:
    """Keeps what it is told."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def info(self, text: str) -> None:
        self.lines.append(text)

    def warn(self, text: str) -> None:
        self.lines.append(f"warning: {text}")


def write(folder: Path, frames: list[Frame], names: list[str] | None = None) -> Path:
    """Frames as VTKHDF under their steps, or under the names given (.dat or .vtkhdf)."""
    folder.mkdir(parents=True, exist_ok=True)
    for k, frame in enumerate(frames):
        path = folder / (names[k] if names else f"all_{frame.step:010d}.vtkhdf")
        (write_dat if path.suffix == ".dat" else write_vtkhdf)(path, frame, ALONE)
    return folder


def compute(folder: Path, **options: Any) -> list[Section]:
    """The sections of a folder, in the order of frames."""
    options.setdefault("addball", True)
    options.setdefault("delball", True)
    strain_stress.run(ALONE, Log(), strain_stress.Options(folder, **options))
    return sections(folder)


def sections(folder: Path) -> list[Section]:
    found = [read_section(path) for path in (folder / "ss" / "data").glob("*.npz")]
    return sorted(found, key=lambda s: (s.step, s.initial))


def moved(frame: Frame, step: int, matrix: np.ndarray) -> Frame:
    """The frame later, after x -> matrix x about its middle."""
    later = copy.deepcopy(frame)
    later.step = step
    p = later.tables["particles"].columns
    centre = np.array([3000.0, 1500.0])
    p["x"], p["y"] = (np.stack([p["x"], p["y"]], axis=1) - centre).dot(matrix.T).T + centre[:, None]
    return later


@pytest.fixture(scope="module")
def frames() -> list[Frame]:
    return list(bed.pushed())


# --- what is computed --------------------------------------------------------------------------------------------


def test_strain_adds_up_from_the_first_frame(frames: list[Frame], tmp_path: Path) -> None:
    shear, turn = np.array([[1.0, 0.3], [0.0, 1.0]]), np.array([[0.0, -1.0], [1.0, 0.0]])
    folder = write(tmp_path, [frames[0], moved(frames[0], 3500, shear), moved(frames[0], 4000, turn @ shear)])
    first, second, third = compute(folder, addball=False, delball=False)
    expected = np.sqrt(0.3**4 / 16.0 + 0.3**2 / 4.0)
    for section, f, ed in ((first, np.eye(2), 0.0), (second, shear, expected), (third, turn @ shear, expected)):
        p = section.particles
        columns = np.stack([p[n] for n in ("fxx", "fxy", "fyx", "fyy")])
        np.testing.assert_allclose(columns, f.reshape(4, 1) + 0.0 * p["x"], atol=1e-11)
        # the sense of rotation is that of all that happened, the quarter turn included
        sign = -1.0 if section is third else 1.0
        np.testing.assert_allclose(p["distortional"], sign * ed, atol=1e-11)
        for name, value in (("volumetric", 0.0), ("distortional", sign * ed)):
            values = section.fields[name]
            np.testing.assert_allclose(values[np.isfinite(values)], value, atol=1e-9)
            assert np.isfinite(values).sum() > 100
    # the pages' quantity: of the displacement since the first frame by the places of the present one
    for section, f in zip(compute(folder, volume="page"), (np.eye(2), shear, turn @ shear)):
        values = section.fields["volumetric"]
        expected = 100.0 * (np.linalg.det(2.0 * np.eye(2) - np.linalg.inv(f)) - 1.0)
        np.testing.assert_allclose(values[np.isfinite(values)], expected, atol=1e-8)
        assert section.volume == "page" and not np.abs(section.particles["volumetric"]).max() > 1e-8
    increments = compute(folder, increment=True)
    p = increments[2].particles
    np.testing.assert_allclose([p["fxx"][7], p["fxy"][7]], [0.0, -1.0], atol=1e-11)
    assert np.abs(p["distortional"]).max() < 1e-11


@pytest.mark.parametrize("threads", ["1", "3"])
def test_kernels_of_as_many_threads_as_a_run_has(monkeypatch: pytest.MonkeyPatch, threads: str) -> None:
    """Both need the same kernels."""
    asked = []
    monkeypatch.setattr("hpcdem.session.prepare", lambda comm, log, kinds, *count: asked.append((kinds, count)))
    monkeypatch.setenv("NUMBA_NUM_THREADS", threads)
    load_kernels(SerialComm())
    assert asked == [(["shared"], (int(threads),))]


def test_sections_say_what_they_hold(frames: list[Frame], tmp_path: Path) -> None:
    found = compute(write(tmp_path, frames))
    assert [s.step for s in found] == [f.step for f in frames]
    for section, frame in zip(found, frames):
        assert set(section.fields) == set(UNITS) and tuple(section.particles) == PARTICLE_FIELDS
        assert all(v.shape == (len(section.y), len(section.x)) for v in section.fields.values())
        # a part of 200 m, so that each particle, 140 m across, has a node of its own
        assert (section.time, section.size, section.average, section.smooth) == (frame.time, 100.0, 200.0, False)
        np.testing.assert_array_equal(section.particles["gid"], frame.tables["particles"].columns["gid"])
        np.testing.assert_array_equal(section.walls["p2"], frame.walls["p2"])
        mean, shear, direction = (section.fields[n] for n in ("mean", "shear", "direction"))
        sxx, sxy, syy = (section.fields[n] for n in ("sxx", "sxy", "syy"))
        np.testing.assert_allclose(mean + shear * np.cos(2 * direction), sxx, atol=1e-6 * np.nanmax(mean))
        np.testing.assert_allclose(shear * np.sin(2 * direction), sxy, atol=1e-6 * np.nanmax(mean))
        np.testing.assert_allclose(mean - shear * np.cos(2 * direction), syy, atol=1e-6 * np.nanmax(mean))
    # the wall has come in by 200 m and more: so much shorter is the bed, and so much more does it push back
    first, second = found[:2]
    way = frames[1].walls["p1"][frames[1].walls["id"] == 1][0, 0]
    assert way > 190.0
    assert np.mean(second.particles["fxx"]) - 1.0 == pytest.approx(-way / bed.WIDTH, rel=0.1)
    assert np.mean(second.particles["fyy"]) > 1.005 and np.nanmean(second.fields["volumetric"]) < 0.0
    assert np.nanmean(second.fields["sxx"]) > 1.5 * np.nanmean(first.fields["sxx"])


def test_strain_on_the_grid_is_that_of_the_nearest_particle(frames: list[Frame], tmp_path: Path) -> None:
    """As sharp as the particles; --smooth takes means around nodes, and has less extreme values."""
    folder = write(tmp_path, frames[:2])
    sharp, smooth = compute(folder, volume="nearest")[1], compute(folder, smooth=True)[1]
    assert (smooth.size, smooth.average, smooth.smooth) == (200.0, 200.0, True)
    p = sharp.particles
    x, y = np.meshgrid(sharp.x, sharp.y)
    for name in ("volumetric", "distortional"):
        field = sharp.fields[name]
        for j, i in list(zip(*np.nonzero(np.isfinite(field))))[::37]:
            nearest = np.argmin(np.hypot(p["x"] - x[j, i], p["y"] - y[j, i]))
            assert field[j, i] == p[name][nearest]
        assert np.nanstd(field) > 1.05 * np.nanstd(smooth.fields[name])
    assert np.nanstd(sharp.mean_strain()[2]) < 0.9 * np.nanstd(sharp.fields["distortional"])
    assert smooth.mean_strain()[2] is smooth.fields["distortional"]
    # the stress is one and the same, linear between the nodes of SIZE
    rows, columns = (np.isin(np.round(a), np.round(b)) for a, b in ((sharp.y, smooth.y), (sharp.x, smooth.x)))
    there = np.isin(np.round(smooth.y), np.round(sharp.y)), np.isin(np.round(smooth.x), np.round(sharp.x))
    mine, theirs = sharp.fields["mean"][np.ix_(rows, columns)], smooth.fields["mean"][np.ix_(*there)]
    both = np.isfinite(mine) & np.isfinite(theirs)
    assert both.sum() > 200
    np.testing.assert_allclose(mine[both], theirs[both], rtol=1e-12)


def test_volumetric_strain_is_the_mean_of_what_lies_around(frames: list[Frame], tmp_path: Path) -> None:
    """Less scattered than that of the nearest particles, with the same mean; the distortion stays that of the nearest;
    the particles keep their own."""
    folder = write(tmp_path, frames[:2])
    mean, nearest = compute(folder)[1], compute(folder, volume="nearest")[1]
    a, b = mean.fields["volumetric"], nearest.fields["volumetric"]
    assert (mean.volume, nearest.volume) == ("mean", "nearest")
    assert (np.isfinite(a) == np.isfinite(b)).all() and np.nanstd(a) < 0.7 * np.nanstd(b)
    assert np.nanmean(a) == pytest.approx(np.nanmean(b), abs=0.1)
    np.testing.assert_array_equal(mean.fields["distortional"], nearest.fields["distortional"])
    np.testing.assert_array_equal(mean.particles["volumetric"], nearest.particles["volumetric"])
    back = read_section(write_section(mean, tmp_path / "section.npz"))
    assert back.volume == "mean"
    for volume in ("page", "nearest"):
        with pytest.raises(UsageError, match=f"--volume {volume} cannot be combined with --smooth"):
            compute(folder, smooth=True, volume=volume)


@pytest.mark.parametrize("smooth", [False, True])
def test_no_particle_is_turned_inside_out(frames: list[Frame], tmp_path: Path, smooth: bool) -> None:
    """Neighbours that part and mix, as along a fault with much slip from frame to frame, have no negative area."""
    later = copy.deepcopy(frames[0])
    later.step += 1000
    p = later.tables["particles"].columns
    upper = p["y"] > 1200.0
    p["x"][upper] += 1500.0
    swapped = np.flatnonzero(p["y"] < 600.0)
    p["x"][swapped], p["y"][swapped] = (p[k][swapped[::-1]] for k in "xy")
    after = compute(write(tmp_path, [frames[0], later]), smooth=smooth)[1]
    known = np.isfinite(after.particles["volumetric"])
    assert 0.5 < known.mean() <= 1.0
    assert np.nanmin(after.particles["volumetric"]) > -100.0 and np.nanmin(after.fields["volumetric"]) > -100.0


def test_particles_added_and_deleted(frames: list[Frame], tmp_path: Path) -> None:
    """The added begin without strain, the deleted are left out, and the others keep what they have."""
    before, after = compute(write(tmp_path, frames[2:]))
    new = ~np.isin(after.particles["gid"], before.particles["gid"])
    assert 0 < new.sum() < 30
    f = np.stack([after.particles[n] for n in ("fxx", "fxy", "fyx", "fyy")], axis=1)
    np.testing.assert_array_equal(f[new], np.tile(strain.IDENTITY, (new.sum(), 1)))
    assert (f[~new] != strain.IDENTITY).any(axis=1).all()
    _, before, after = compute(write(tmp_path / "b", frames[:3]))
    assert len(after.particles["gid"]) < len(before.particles["gid"])
    assert np.isin(after.particles["gid"], before.particles["gid"]).all()


def test_walls_cut_the_section(frames: list[Frame], tmp_path: Path) -> None:
    whole = compute(write(tmp_path, frames[:2]))
    wall = {int(i): 0.5 * (a[0] + b[0]) for i, a, b in zip(*(frames[1].walls[k] for k in ("id", "p1", "p2")))}
    assert wall[1] > 100.0
    later = copy.deepcopy(frames[1])
    p = later.tables["particles"].columns
    out = int(np.argmin(p["x"]))
    p["x"][out] = wall[1] - 10.0  # squeezed out behind the wall
    write(tmp_path, [later])
    cut = compute(tmp_path, left_wall=1, addball=False, delball=False)
    assert len(cut[1].particles["gid"]) == len(p["gid"]) - 1 and p["gid"][out] not in cut[1].particles["gid"]
    assert p["gid"][out] in cut[0].particles["gid"]
    assert len(compute(tmp_path, right_wall=2)[1].particles["gid"]) == len(p["gid"])
    with pytest.raises(HpcdemError, match="no particle lies between the walls"):
        compute(tmp_path, right_wall=1)
    assert len(whole[1].particles["gid"]) == len(p["gid"])


def test_a_shift_moves_everything_and_changes_nothing(frames: list[Frame], tmp_path: Path) -> None:
    plain = compute(write(tmp_path, frames[:2]))[1]
    shifted = compute(tmp_path, xmove=-1000.0, ymove=400.0)[1]
    np.testing.assert_array_equal(shifted.x, plain.x - 1000.0)
    np.testing.assert_array_equal(shifted.y, plain.y + 400.0)
    np.testing.assert_allclose(shifted.walls["p1"], plain.walls["p1"] + [-1000.0, 400.0])
    np.testing.assert_allclose(shifted.surface, plain.surface + [-1000.0, 400.0], atol=1e-6)
    for name, values in plain.fields.items():
        np.testing.assert_allclose(shifted.fields[name], values, rtol=1e-6, atol=1e-7 * np.nanmax(np.abs(values)))


def test_dat_and_vtkhdf_give_the_same_section(frames: list[Frame], tmp_path: Path) -> None:
    """To the digits of the text; also with the two mixed, and where a file of ZDEM has no contact points."""
    exact = compute(write(tmp_path / "a", frames[:2]))[1]
    names = [f"all_{f.step:010d}.dat" for f in frames[:2]]
    text = compute(write(tmp_path / "b", frames[:2], names))[1]
    mixed = compute(write(tmp_path / "c", frames[:2], [names[0], f"all_{frames[1].step:010d}.vtkhdf"]))[1]
    bare = tmp_path / "d"
    write(bare, frames[:2], names)
    for name in names:
        lines = (bare / name).read_text()
        for table in ("wall_id", "id1"):  # as if x and y were called something else
            lines = re.sub(rf"(\n +{table} .*globalFy.*? +)x( +)y(?=\s)", r"\1q\2p", lines)
        (bare / name).write_text(lines)
    assert "x" not in read_dat(bare / names[0]).tables["contacts"].columns
    for other in (text, mixed, compute(bare)[1]):
        for name, values in exact.fields.items():
            if name != "direction":
                np.testing.assert_allclose(
                    other.fields[name], values, atol=1e-6 * np.nanmax(np.abs(values)), err_msg=name
                )
        for name, values in exact.particles.items():
            np.testing.assert_allclose(
                other.particles[name], values, atol=1e-6 * np.nanmax(np.abs(values)), err_msg=name
            )
        np.testing.assert_allclose(other.surface, exact.surface, atol=1e-6)


def test_a_file_as_zdem_writes_it(tmp_path: Path) -> None:
    """Its walls have ids of their own and its contacts no places: particle 4 on the floor, y = 10, and its two contacts
    are enough for its stress."""
    text = (ROOT / "tests" / "unit" / "io_zdem_2.2.dat").read_text()
    path = tmp_path / "all_0000000100.dat"
    path.write_text(text)
    seen = strain_stress.read_snapshot(path, strain_stress.Options(tmp_path, size=110.0))
    assert seen.gid.tolist() == [0, 4, 7] and seen.held.all()
    centre = {0: (100.5, 61.25), 4: (61.0, 148.0), 7: (190.125, 80.0)}

    def place(a: int, b: int, ra: float, rb: float) -> np.ndarray:
        way = np.subtract(centre[b], centre[a])
        d = np.hypot(*way)
        return way * (ra - 0.5 * (ra + rb - d)) / d

    # on 4: the opposite of what it does to 7, what 0 does to it, and the floor from half the overlap below its face
    expected = -np.outer(place(4, 7, 50.0, 60.0), (-3e9, 2e9)) - np.outer(place(4, 0, 50.0, 50.0), (-4e9, 9e9))
    floor = np.array([0.0, -0.5 * (50.0 + 138.0)])
    expected -= np.outer(floor, (0.0, 250.5))
    np.testing.assert_allclose(seen.moments[1], expected.ravel(), rtol=1e-9)


# --- rows that stand for walls, flying bits, groups ----------------------------------------------------------------


def behind_a_row(frames: list[Frame], far: float = 0.0) -> list[Frame]:
    """The first frame and the same after a shear, with a row of fixed discs of 12 km before it that moves by 1 km, and
    two discs that have escaped `far` metres to the left."""
    found = []
    for step, k in ((0, 0.0), (500, 0.3)):
        frame = moved(frames[0], step, np.array([[1.0, k], [0.0, 1.0]]))
        p = frame.tables["particles"].columns
        n, height = len(p["gid"]), np.arange(60.0, 12000.0, 120.0)
        more = {name: np.repeat(values[:1], len(height) + 2, axis=0) for name, values in p.items()}
        more["gid"] = np.arange(len(height) + 2) + p["gid"].max() + 1
        more["x"] = np.append(np.full(len(height), -400.0 + 1000.0 * (step > 0) - 1200.0), [-far, -far - 150.0])
        more["y"] = np.append(height, [900.0, 900.0])
        more["radius"][:], more["fix"] = 20.0, np.append(np.full(len(height), 3), [0, 0]).astype(p["fix"].dtype)
        columns = {name: np.concatenate([values, more[name]]) for name, values in p.items()}
        frame.tables["particles"] = Table(columns, 0, n + len(height) + 2)
        found.append(frame)
    return found


@pytest.mark.parametrize("smooth", [False, True])
def test_rows_that_represent_walls_are_in_no_field_and_carry_no_surface(
    frames: list[Frame], tmp_path: Path, smooth: bool
) -> None:
    plain = [moved(frames[0], step, np.array([[1.0, k], [0.0, 1.0]])) for step, k in ((0, 0.0), (500, 0.3))]
    found = {
        name: compute(write(tmp_path / name, some), smooth=smooth, addball=False, delball=False)[1]
        for name, some in {"bed": plain, "row": behind_a_row(frames, 8000.0)}.items()
    }
    bed, row = found["bed"], found["row"]
    assert row.surface[:, 1].max() < 4000.0 and row.x.min() > -2000.0
    np.testing.assert_array_equal(row.surface, bed.surface)
    for name, values in bed.fields.items():
        np.testing.assert_allclose(row.fields[name], values, rtol=1e-9, atol=1e-9, err_msg=name)
    fixed = row.particles["fixed"]
    assert fixed.sum() == 100 and not bed.particles["fixed"].any()
    assert not row.particles["distortional"][fixed].any()  # it is still listed, and drawn
    log = Log()
    strain_stress.run(ALONE, log, strain_stress.Options(tmp_path / "row", smooth=smooth))
    assert any("100 particles fixed along x and y" in line and "and 2 detached ones" in line for line in log.lines)
    outlines = [survey.outline(row), survey.outline(bed)]
    assert outlines[0].extent == outlines[1].extent


def test_where_everything_is_fixed_it_counts(frames: list[Frame], tmp_path: Path) -> None:
    held = copy.deepcopy(frames[0])
    held.tables["particles"].columns["fix"][:] = 3
    ours, free = (compute(write(tmp_path / name, [frame]))[0] for name, frame in (("held", held), ("free", frames[0])))
    np.testing.assert_array_equal(ours.surface, free.surface)
    np.testing.assert_array_equal(ours.fields["mean"], free.fields["mean"])


def test_only_particles_of_some_groups(frames: list[Frame], tmp_path: Path) -> None:
    named = []
    for frame in (copy.deepcopy(f) for f in frames[:2]):
        p = frame.tables["particles"].columns
        p["group"] = np.where(p["y"] < 1500.0, 1, 0).astype(np.int32)
        frame.group_names[:] = ["top", "base"]
        named.append(frame)
    folder = write(tmp_path, named)
    section = compute(folder, groups=("base",))[0]
    assert (section.particles["y"] < 1500.0).all() and section.y.max() < 1700.0
    assert len(section.particles["y"]) == (named[0].tables["particles"].columns["group"] == 1).sum()
    with pytest.raises(HpcdemError, match=r"has no group bottom; its groups: top, base"):
        compute(folder, groups=("bottom",))


# --- files -------------------------------------------------------------------------------------------------------


def test_the_text_has_one_row_per_particle(frames: list[Frame], tmp_path: Path) -> None:
    section = compute(write(tmp_path, frames[:2]))[1]
    path = tmp_path / "ss" / "data" / f"{section.name}.out"
    head, words = path.read_text().splitlines()[:2]
    assert section.name in head and f"step {section.step}" in head and "200 m" in head and "since all_" in head
    names = words.removeprefix("#").split()
    assert names == "id x[m] y[m] rad[m] color pxx[Pa] pxy[Pa] pyy[Pa] Fxx Fxy Fyx Fyy ev[%] ed".split()
    rows = np.loadtxt(path)
    for column, values in zip(rows.T, (section.particles[n] for n in PARTICLE_FIELDS if n != "fixed")):
        np.testing.assert_allclose(column, values, rtol=1e-8)


def test_paraview_reads_the_grid(frames: list[Frame], tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    section = compute(write(tmp_path, frames[:2]))[1]
    mesh = pyvista.read(tmp_path / "ss" / "data" / f"{section.name}.vtkhdf")
    assert isinstance(mesh, pyvista.ImageData)
    assert mesh.dimensions == (len(section.x), len(section.y), 1)
    assert mesh.origin == (section.x[0], section.y[0], 0.0) and mesh.spacing == (100.0, 100.0, 100.0)
    for name, values in section.fields.items():
        np.testing.assert_array_equal(mesh.point_data[name].reshape(values.shape), values)
    assert np.isnan(mesh.point_data["mean"]).any()
    np.testing.assert_array_equal(mesh.field_data["TimeValue"], [section.time])


def test_sections_come_back(frames: list[Frame], tmp_path: Path) -> None:
    section = compute(write(tmp_path, frames[:1]))[0]
    path = tmp_path / "ss" / "data" / f"{section.name}.npz"
    again = read_section(write_section(section, tmp_path / "b.npz"))
    assert (tmp_path / "b.npz").read_bytes() == path.read_bytes()
    for mine, theirs in ((section.fields, again.fields), (section.particles, again.particles)):
        assert list(mine) == list(theirs)
        for name, values in mine.items():
            np.testing.assert_array_equal(values, theirs[name])
    whole = path.read_bytes()
    for damaged in (b"", b"text", whole[: len(whole) // 2], whole[:-30]):
        path.write_bytes(damaged)
        with pytest.raises(HpcdemError, match=r"\.npz is not a section written by hpcdem -s"):
            read_section(path)
    np.savez(path, other=np.zeros(3))
    with pytest.raises(HpcdemError, match="not a section"):
        read_section(path)


def test_results_are_replaced_only_by_complete_ones(frames: list[Frame], tmp_path: Path) -> None:
    compute(write(tmp_path, frames[:2]))
    results = tmp_path / "ss" / "data"
    (results / "notes.txt").write_text("mine")
    old = {p.name: p.read_bytes() for p in results.iterdir()}
    write(tmp_path, frames[2:3])
    with pytest.raises(HpcdemError, match=r"\d+ particles were deleted between .*: use --delball"):
        compute(tmp_path, delball=False)
    assert {p.name: p.read_bytes() for p in results.iterdir()} == old
    assert [p.name for p in results.parent.iterdir()] == ["data"]
    for path in tmp_path.glob("all_*"):
        path.unlink()
    compute(write(tmp_path, frames[3:]))
    name = f"all_{frames[3].step:010d}"
    assert {p.name for p in results.iterdir()} == {"notes.txt", f"{name}.npz", f"{name}.out", f"{name}.vtkhdf"}


def test_ini_frames_come_after_the_others_of_their_step(frames: list[Frame], tmp_path: Path) -> None:
    later = copy.deepcopy(frames[1])
    later.step = frames[0].step
    names = [f"all_{later.step:010d}{ini}.vtkhdf" for ini in ("", "_ini")]
    first, second = compute(write(tmp_path, [frames[0], later], names))
    assert second.initial and not first.initial and not first.particles["distortional"].any()
    assert np.nanmax(np.abs(second.particles["distortional"])) > 0.02


PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
from mpi4py import MPI
from hpcdem.cli.strain_stress import strain_stress, work
from hpcdem.halo.comm import MpiComm
from hpcdem.core.errors import HpcdemError
from hpcdem.runtime.progress import Log

comm = MpiComm(MPI.COMM_WORLD)
try:
    work(comm, Log(comm.rank), strain_stress.make_context("hpcdem", sys.argv[2:]).params)
except HpcdemError as error:
    comm.barrier()
    print(f"rank {comm.rank}: {error}\\n", end="")
"""


@pytest.mark.slow
@pytest.mark.mpi
def test_any_number_of_ranks_writes_the_same_bytes(launch: Any, frames: list[Frame], tmp_path: Path) -> None:
    """Three frames: shared in rounds by 1 rank, each shared by 4."""
    (tmp_path / "program.py").write_text(PROGRAM)
    folder = write(tmp_path / "data", frames[1:])
    results = folder / "ss" / "data"
    files = {}
    for ranks in (1, 4):
        shutil.rmtree(folder / "ss", ignore_errors=True)
        done = launch.python(
            ranks, "program.py", ROOT, "-s", folder, "--addball", "--delball", "--xmove", "-10", "--leftwallid", "1",
            cwd=tmp_path, timeout=200,
        )  # fmt: skip
        assert done.returncode == 0 and "3 frames in" in done.stdout, done.stderr
        assert ("share each frame" in done.stdout) == (ranks > 3)
        files[ranks] = {p.name: p.read_bytes() for p in results.iterdir()}
        assert len(files[ranks]) == 9
    assert files[4] == files[1]


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, pytest.param(4, marks=pytest.mark.slow)])
def test_a_refusal_reaches_all_ranks(launch: Any, frames: list[Frame], tmp_path: Path, ranks: int) -> None:
    (tmp_path / "program.py").write_text(PROGRAM)
    folder = write(tmp_path / "data", frames[1:])
    done = launch.python(ranks, "program.py", ROOT, "-s", folder, cwd=tmp_path, timeout=200)
    assert done.returncode == 0, done.stderr
    assert sorted(re.findall(r"rank (\d): \d+ particles were deleted between all_0000005000 and all_0000006000",
                             done.stdout)) == [str(r) for r in range(ranks)]  # fmt: skip
    assert list((folder / "ss").iterdir()) == []


# --- what is refused ---------------------------------------------------------------------------------------------


def test_one_frame_has_stress_only(frames: list[Frame], tmp_path: Path) -> None:
    log = Log()
    folder = write(tmp_path, frames[:1])
    strain_stress.run(ALONE, log, strain_stress.Options(folder))
    assert any("only frame: its strain is zero" in line for line in log.lines)
    (section,) = sections(folder)
    assert not section.particles["volumetric"].any() and np.nanmax(section.fields["mean"]) > 1e7


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": 0.0}, r"-g 0: .* larger than 0"),
        ({"size": -5.0}, r"-g -5: .* larger than 0"),
        ({"size": float("nan")}, r"-g nan: .* larger than 0"),
        ({"size": 100.0}, r"-g 100: smaller than a particle \(1\d\d"),
        ({"size": 7000.0}, r"-g 7000: larger than the model in .*\.vtkhdf, 6\d\d\d m wide"),
        ({"left_wall": 17}, r"all_0000003000.vtkhdf has no wall 17; its walls: 0, 1, 2"),
        ({"addball": False, "delball": True}, r"20 .* added between all_0000006000 and all_0000006500: use --addball"),
        ({"delball": False}, r"\d+ .* deleted between all_0000005000 and all_0000006000: use --delball"),
    ],
)
def test_what_makes_no_sense_is_named(frames: list[Frame], tmp_path: Path, options: dict, message: str) -> None:
    with pytest.raises(HpcdemError, match=message):
        compute(write(tmp_path, frames), **options)


def test_folders_without_frames(frames: list[Frame], tmp_path: Path) -> None:
    with pytest.raises(HpcdemError, match="cannot read the folder"):
        compute(tmp_path / "none")
    (tmp_path / "letter.txt").write_text("not a frame")
    with pytest.raises(HpcdemError, match="contains no frames"):
        compute(tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["letter.txt"]
    empty = copy.deepcopy(frames[0])
    for table in empty.tables.values():
        table.columns, table.total = {k: v[:0] for k, v in table.columns.items()}, 0
    with pytest.raises(HpcdemError, match="has no particles: remove it"):
        compute(write(tmp_path / "b", [empty]))
    broken = copy.deepcopy(frames[0])
    broken.tables["particles"].columns["x"][3] = np.nan
    with pytest.raises(HpcdemError, match="the position of particle 3 is not a number"):
        compute(write(tmp_path / "c", [broken]))
    (tmp_path / "d").mkdir()
    (tmp_path / "d" / "all_0000000001.dat").write_text("rubbish")
    with pytest.raises(HpcdemError, match="not a frame of ZDEM or hpcdem"):
        compute(tmp_path / "d")


def test_the_command_line_is_that_of_the_manual() -> None:
    words = "--xmove -1000.0 --ymove -1000.0 -j 12 --addball --delball -s ./datass".split()
    values = command.make_context("zdem", words).params
    assert values == {
        "folder": Path("datass"), "size": 200.0, "addball": True, "delball": True, "leftwallid": None,
        "rightwallid": None, "xmove": -1000.0, "ymove": -1000.0, "increment": False, "smooth": False, "threads": 12,
        "groups": [], "volume": None,
    }  # fmt: skip
    for name in ("--strin-stres", "--strain-stress"):
        assert command.make_context("zdem", [name, "a", "--grid", "50", "--leftwallid", "0"]).params["leftwallid"] == 0
    shown = CliRunner().invoke(command, ["--hlep"]).output
    assert "--delball" in shown and "DIR/ss/data" in shown
    with pytest.raises(UsageError, match="-g 0"):
        strain_stress.run(ALONE, Log(), strain_stress.Options(Path("."), size=0.0))
