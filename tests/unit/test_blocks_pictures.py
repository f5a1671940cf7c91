"""Pictures of blocks: what is read back, what is averaged, and that each crack has the colour of its kind."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.axes import View
from hpcdem.io.frame import Table
from hpcdem.io.frames import list_mesh_frames
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.io.vtkhdf_mesh import MeshFrame, MeshState, is_mesh_frame, read_mesh_frame, whole, write_mesh_frame
from hpcdem.post import blocks, inventory, saved
from tests.unit.io_synthetic import make_frame
from tests.unit.test_io_vtkhdf_mesh import made_frame


def strip(n: int = 6, step: int = 0, broken: tuple[tuple[int, float], ...] = (), tear: float = 0.0) -> MeshFrame:
    """A row of n unit squares of two triangles each, a joint on every inner edge. broken: number and mode of joints;
    from x = 3 on everything has moved to the right by `tear`. Compression is 1 MPa in the left half, 3 MPa in the right
    one."""
    corners: list[tuple[float, float]] = []
    stress, ends = [], []
    for k in range(n):
        x = k + tear * (k >= 3)
        corners += [(x, 0), (x + 1, 0), (x + 1, 1), (x, 0), (x + 1, 1), (x, 1)]
        stress += 2 * [-1e6 if k < n // 2 else -3e6]
        ends.append((6 * k, 6 * k + 2))  # the diagonal
        if k < n - 1:
            ends.append((6 * k + 1, 6 * k + 2))  # the right side
    place = np.array(corners, float)
    numbers = np.array([4 * (i // 3) + i % 3 for i in range(len(place))])
    joints = np.array(ends)
    state, mode = np.ones(len(joints)), np.zeros(len(joints))
    for number, kind in broken:
        state[number], mode[number] = 3.0, kind
    zero = np.zeros(2 * n)
    return MeshFrame(
        step, 1e-3 * step, 1e-6,
        Table({"number": numbers, "x": place[:, 0], "y": place[:, 1], "velocity_x": place[:, 0],
               "velocity_y": place[:, 1]}, 0, len(place)),
        Table({"number": np.arange(2 * n), "corners": np.full(2 * n, 3), "stress_xx": zero,
               "stress_yy": np.array(stress), "stress_xy": zero, "group_rock": np.zeros(2 * n, np.int32)}, 0, 2 * n),
        Table({"number": np.arange(len(joints)), "first": numbers[joints[:, 0]], "last": numbers[joints[:, 1]],
               "state": state, "mode": mode}, 0, len(joints)),
        {"group_rock": ["granite"]},
    )  # fmt: skip


def state_of(frame: MeshFrame) -> MeshState:
    found = whole(frame, SerialComm())
    assert found is not None
    return found


@pytest.mark.parametrize("make", [lambda: made_frame(SerialComm()), lambda: strip(broken=((1, 1.0),))])
def test_what_is_read_is_what_was_written(tmp_path, make):
    write_mesh_frame(tmp_path / "a_0000000000.vtkhdf", make(), SerialComm())
    one, other = state_of(make()), read_mesh_frame(tmp_path / "a_0000000000.vtkhdf")
    assert (one.step, one.time, one.dt, dict(one.group_names)) == (
        other.step, other.time, other.dt, dict(other.group_names)
    )  # fmt: skip
    for name in ("points", "cells", "joints"):
        assert (getattr(one, name) == getattr(other, name)).all() and len(getattr(one, name))
    for name in ("of_points", "of_elements", "of_joints"):
        mine, its = getattr(one, name), getattr(other, name)
        assert set(mine) <= set(its)
        for column, values in mine.items():
            assert (values == its[column]).all(), column


def test_foreign_and_damaged_files_are_reported(tmp_path):
    particles = tmp_path / "all_0000000001.vtkhdf"
    write_vtkhdf(particles, make_frame(5), SerialComm())
    assert not is_mesh_frame(particles) and not is_mesh_frame(tmp_path / "none.vtkhdf")
    (tmp_path / "text_0000000000.vtkhdf").write_text("no HDF5")
    assert not is_mesh_frame(tmp_path / "text_0000000000.vtkhdf")
    path = tmp_path / "a_0000000000.vtkhdf"
    write_mesh_frame(path, strip(), SerialComm())
    assert is_mesh_frame(path)
    for damage in ("VTKHDF/Connectivity", "VTKHDF/CellData/cell", "VTKHDF/Points"):
        broken = tmp_path / "b_0000000000.vtkhdf"
        shutil.copy(path, broken)
        with h5py.File(broken, "a") as file:
            values = file[damage][...]
            del file[damage]
            file[damage] = values[:-3]
        with pytest.raises(HpcdemError, match=r"b_0000000000.vtkhdf is not a frame of blocks, or is damaged"):
            read_mesh_frame(broken)
        assert not inventory.of_file(broken)["whole"]
    with pytest.raises(HpcdemError, match="is not a frame of blocks"):
        read_mesh_frame(particles)


def test_frames_of_a_folder(tmp_path):
    for stem, steps in (("blast", (200, 100, 10**10)), ("last", (5,))):
        for step in steps:
            write_mesh_frame(tmp_path / f"{stem}_{step:010d}.vtkhdf", strip(2, step), SerialComm())
    write_vtkhdf(tmp_path / "all_0000000001.vtkhdf", make_frame(5), SerialComm())
    assert [f.step for f in list_mesh_frames(tmp_path)] == [100, 200, 10**10]
    assert [f.step for f in list_mesh_frames(tmp_path, "last")] == [5]
    with pytest.raises(HpcdemError, match="no frame first_"):
        list_mesh_frames(tmp_path, "first")
    with pytest.raises(HpcdemError, match="cannot read the folder"):
        list_mesh_frames(tmp_path / "nowhere")
    facts = inventory.of_file(tmp_path / "last_0000000005.vtkhdf")
    assert facts["whole"] and (facts["elements"], facts["joints"], facts["broken"]) == (4, 3, 0)
    assert facts["groups"] == {"rock": ["granite"]} and facts["step"] == 5


def test_compression_is_the_principal_stress():
    """Stress s1 along 30 degrees, s2 across: whatever the axes, the more compressive of both counts."""
    for s1, s2 in ((-5e6, -1e6), (2e6, -3e6), (1e6, 4e6)):
        c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
        state = state_of(strip(1))
        state.of_elements |= {
            "stress_xx": np.full(2, s1 * c * c + s2 * s * s), "stress_yy": np.full(2, s1 * s * s + s2 * c * c),
            "stress_xy": np.full(2, (s1 - s2) * s * c),
        }  # fmt: skip
        assert blocks.compression(state) == pytest.approx(-min(s1, s2), rel=1e-12)


def test_stress_is_averaged_over_what_hangs_together():
    state = state_of(strip())
    points, triangles, values = blocks.smoothed(state, blocks.compression(state))
    assert len(points) == 14 and len(triangles) == 12  # 7 x 2 points, each once
    at = {(float(x), float(y)): v for (x, y), v in zip(points.round(9), values)}
    # Around (3, 0): one triangle of 1 MPa on the left, two of 3 MPa on the right; around (3, 1) the other way round.
    assert at[3.0, 0.0] == pytest.approx((1 + 2 * 3) / 3 * 1e6) and at[3.0, 1.0] == pytest.approx((2 + 3) / 3 * 1e6)
    assert at[1.0, 0.0] == pytest.approx(1e6) and at[5.0, 1.0] == pytest.approx(3e6)
    state = state_of(strip(tear=0.1))
    points, _, values = blocks.smoothed(state, blocks.compression(state))
    assert len(points) == 16 and set(np.round(values / 1e6, 6)) == {1.0, 3.0}  # nothing goes across the gap


def test_null_elements_and_no_elements():
    frame = strip(2)
    for table in (frame.corners, frame.elements, frame.joints):
        table.columns = {name: values[:0] for name, values in table.columns.items()}
        table.total = 0
    state = state_of(frame)
    still = state_of(strip())
    for name in ("stress_xx", "stress_yy", "stress_xy"):
        still.of_elements[name] = np.zeros(12)
    blocks.draw(still)
    still.of_elements["stress_yy"] = np.full(12, np.nan)
    blocks.draw(still)
    assert blocks.view(state) == View(0.0, 1.0, 0.0, 1.0) and blocks.stress_range(state) == (0.0, 1.0)
    blocks.draw(state)


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 1.0), (-3.2, 47.0), (1e-7, 2e-7), (5.0, 5.0), (0.0, 0.0), (-9e4, -1e2)]
)
def test_levels_are_round_and_hold_the_range(low, high):
    levels = blocks.nice_levels(low, high)
    steps = np.diff(levels)
    assert levels[0] <= low + 1e-9 * abs(low) and levels[-1] >= high - 1e-9 * abs(high)
    assert len(levels) >= 2
    if high > low:
        assert 4 <= len(steps) <= blocks.LEVELS + 2 and steps == pytest.approx(steps[0])
        assert f"{steps[0]:.3e}"[:4] in ("1.00", "2.00", "2.50", "5.00")


def test_units_of_stress():
    stress, state = blocks.CONTOURS["stress"], SimpleNamespace(units="")
    assert [blocks.unit_of(stress, (0, v), state)[1] for v in (2e9, 5e6, -3e4, 7.0, 0.0)] == [
        "GPa",
        "MPa",
        "kPa",
        "Pa",
        "Pa",
    ]


@pytest.mark.figures
class TestPictures:
    """Pixels of pictures."""

    image = None

    @staticmethod
    def pixels(path: Path) -> np.ndarray:
        image = pytest.importorskip("PIL.Image")
        with image.open(path) as file:
            return np.asarray(file.convert("RGB")).astype(int)

    @staticmethod
    def near(pixels: np.ndarray, colour: str) -> np.ndarray:
        wanted = [int(colour[k : k + 2], 16) for k in (1, 3, 5)]
        return np.abs(pixels - wanted).max(axis=2) < 25

    def test_each_crack_has_the_colour_of_its_kind(self, tmp_path):
        broken = ((1, 1.0), (5, 1.5), (9, 2.0))  # right sides of the squares 0, 2 and 4
        appearance = blocks.Appearance(panels=("cracks",), dpi=150)
        path = blocks.plot(state_of(strip(broken=broken)), tmp_path / "a.png", appearance, View(0.0, 6.0, 0.0, 1.0))
        seen = self.pixels(path)
        # The axes are the widest dark rectangle; cracks stand at 1, 3 and 5 sixths of it.
        inside = seen[seen.shape[0] // 2]
        places = []
        for colour in (blocks.TENSION, blocks.MIXED, blocks.SHEAR):
            hit = np.flatnonzero(self.near(seen, colour)[seen.shape[0] // 2])
            assert 2 <= len(hit) < 20, colour
            places.append(hit.mean())
        dark = np.flatnonzero((inside < 60).all(axis=1))
        left, right = dark.min(), dark.max()
        assert (np.array(places) - left) / (right - left) == pytest.approx([1 / 6, 3 / 6, 5 / 6], abs=0.01)

    @pytest.mark.slow
    def test_same_frame_same_bytes_in_every_format(self, tmp_path):
        state = state_of(strip(broken=((1, 1.0),)))
        for suffix in saved.FORMATS:
            one = blocks.plot(state, tmp_path / f"a{suffix}", blocks.Appearance(dpi=60)).read_bytes()
            assert blocks.plot(state, tmp_path / f"b{suffix}", blocks.Appearance(dpi=60)).read_bytes() == one, suffix
        with pytest.raises(HpcdemError, match="pictures end in"):
            blocks.plot(state, tmp_path / "a.bmp")
        with pytest.raises(UsageError, match="too small"):
            blocks.plot(state, tmp_path / "a.png", blocks.Appearance(page=2.0))
        assert not (tmp_path / "a.bmp").exists()

    def test_stress_is_shaded_by_its_amount(self, tmp_path):
        appearance = blocks.Appearance(panels=("stress",), dpi=100, ranges={"stress": (0.0, 4e6)})
        seen = self.pixels(blocks.plot(state_of(strip()), tmp_path / "a.png", appearance, View(0.0, 6.0, 0.0, 1.0)))
        width = seen.shape[1]
        row = seen[seen.shape[0] // 2].sum(axis=1)
        assert row[int(0.25 * width)] > row[int(0.7 * width)] + 60  # 1 MPa is paler than 3

    def test_plastic_strain_has_a_panel_where_there_is_some(self, tmp_path):
        state = state_of(strip())
        assert blocks.panels_of(state) == ("cracks", "stress")
        state.of_elements["plastic_shear_strain"] = np.where(np.arange(12) < 6, 0.0, 0.02)
        assert blocks.panels_of(state) == ("cracks", "stress", "plastic") and blocks.plastic_range(state) == (0.0, 0.02)
        assert len(blocks.draw(state).axes) == 5  # three panels, two of them with a bar of colours
        appearance = blocks.Appearance(panels=("plastic",), dpi=100)
        seen = self.pixels(blocks.plot(state, tmp_path / "a.png", appearance, View(0.0, 6.0, 0.0, 1.0)))
        row = seen[seen.shape[0] // 2].sum(axis=1)
        assert row[int(0.25 * seen.shape[1])] > row[int(0.7 * seen.shape[1])] + 60

    def test_a_film_keeps_the_colours_of_thin_lines(self, tmp_path, monkeypatch):
        from hpcdem.cli.common import read_command_line
        from hpcdem.cli.movie import movie, work
        from hpcdem.post import movie as films
        from tests.unit.test_zdem2jpg import Silent

        monkeypatch.setattr(films, "ffmpeg", lambda: None)
        for step in range(3):
            broken = ((1, 1.0), (9, 2.0))[: step + 1]
            path = tmp_path / f"a_{step:010d}.vtkhdf"
            write_mesh_frame(path, strip(step=step, broken=broken, tear=0.1 * step), SerialComm())
        log = Silent()
        words = [str(tmp_path), "--max_workers=1", "--size=600", "--showlable=true"]
        work(SerialComm(), log, read_command_line(movie, "hpcdem movie", words))  # type: ignore[arg-type]
        assert "3 frames" in log.lines[-1]
        image = pytest.importorskip("PIL.Image")
        with image.open(tmp_path / "movie.gif") as film:
            assert film.n_frames == 3 and film.size[0] == 600
            film.seek(2)
            last = np.asarray(film.convert("RGB")).astype(int)
        for colour in (blocks.TENSION, blocks.SHEAR):
            assert self.near(last, colour).sum() > 20, colour
        with pytest.raises(HpcdemError, match="no frame b_"):
            work(SerialComm(), log, read_command_line(movie, "hpcdem movie", [*words, "--name=b"]))  # type: ignore[arg-type]
