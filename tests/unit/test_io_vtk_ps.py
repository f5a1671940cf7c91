"""`SET vtk` and `SET ps`: legacy VTK files that VTK reads, and pictures that PostScript draws."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.io import colours
from hpcdem.io.axes import View, view
from hpcdem.io.ps import write_ps
from hpcdem.io.vtk import write_vtk
from tests.unit.io_synthetic import make_frame


def test_vtk_reads_the_particles(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    frame = make_frame(100)
    write_vtk(tmp_path / "all_0000046000.vtk", frame, SerialComm())
    mesh = pyvista.read(tmp_path / "all_0000046000.vtk")
    columns = frame.tables["particles"].columns
    assert (mesh.n_points, mesh.n_verts) == (100, 100)
    np.testing.assert_allclose(mesh.points[:, :2], np.stack([columns["x"], columns["y"]], axis=1), rtol=1e-12)
    for name, column in (("id", "gid"), ("color", "color"), ("group", "group")):
        np.testing.assert_array_equal(mesh[name], columns[column])
    np.testing.assert_allclose(mesh["radius"], columns["radius"], rtol=1e-8)
    np.testing.assert_allclose(mesh["velocity"][:, 0], columns["vx"], rtol=1e-8)


def test_vtk_reads_the_walls(tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    frame = make_frame(5)
    write_vtk(tmp_path / "all_0000046000.vtk", frame, SerialComm())
    mesh = pyvista.read(tmp_path / "wall_0000046000.vtk")
    assert (mesh.n_points, mesh.n_lines) == (14, 7)
    np.testing.assert_array_equal(mesh["id"], frame.walls["id"])
    np.testing.assert_allclose(mesh["force"][:, :2], frame.walls["force"], rtol=1e-8)
    np.testing.assert_allclose(mesh.points[::2, :2], frame.walls["p1"], rtol=1e-12)


def test_the_picture_has_a_box_and_a_line_per_particle(tmp_path: Path) -> None:
    write_ps(tmp_path / "a.ps", make_frame(50), SerialComm())
    text = (tmp_path / "a.ps").read_text()
    assert text.startswith("%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 ") and text.endswith("showpage\n%%EOF\n")
    assert len(re.findall(r" b\n", text)) == 50
    assert len(re.findall(r" w\n", text)) == 7
    assert "(40)" in text and r"(x \(km\))" in text
    # Nothing that has left the model makes the page larger.
    frame = make_frame(50)
    frame.tables["particles"].columns["x"][3] = 1e30
    write_ps(tmp_path / "b.ps", frame, SerialComm())
    assert (tmp_path / "b.ps").read_text().splitlines()[1] == text.splitlines()[1]


def test_ghostscript_draws_particles_where_they_are(tmp_path: Path) -> None:
    gs = shutil.which("gs")
    image = pytest.importorskip("PIL.Image")
    if gs is None:
        pytest.skip("no ghostscript here")
    frame = make_frame(60)
    write_ps(tmp_path / "a.ps", frame, SerialComm())
    command = [gs, "-q", "-dSAFER", "-dBATCH", "-dNOPAUSE", "-dEPSCrop", "-sDEVICE=png16m", "-r144"]
    subprocess.run([*command, f"-sOutputFile={tmp_path / 'a.png'}", str(tmp_path / "a.ps")], check=True, timeout=60)
    picture = np.asarray(image.open(tmp_path / "a.png").convert("RGB"))
    box = re.search(r"(\S+) (\S+) (\S+) (\S+) rectstroke", (tmp_path / "a.ps").read_text())
    assert box
    left, bottom, width, height = (2.0 * float(v) for v in box.groups())  # pixels: 144 dots per inch
    assert width / height == pytest.approx(41.0 / 11.0, rel=1e-4)
    columns = frame.tables["particles"].columns
    for x, y, color in zip(columns["x"], columns["y"], columns["color"]):
        pixel = picture[int(picture.shape[0] - bottom - y * height / 11000.0), int(left + x * width / 41000.0)]
        assert np.abs(pixel / 255.0 - colours.RGB[color]).max() < 0.02


@pytest.mark.parametrize(
    ("longer", "unit"),
    [(41000.0, "km"), (1000.0, "km"), (999.0, "m"), (1.0, "m"), (0.6, "cm"), (0.05, "cm"), (0.01, "mm")],
)
def test_axes_take_the_unit_that_fits(longer: float, unit: str) -> None:
    seen = View(0.0, longer, 0.0, longer / 4)
    assert seen.unit[1] == unit
    x, y = seen.ticks()
    assert 3 <= len(x.major) <= 11 and len(y.major) >= 2
    assert np.diff(x.major).min() == pytest.approx(np.diff(y.major).max())
    assert set(np.round(x.major, 9)) <= set(np.round(x.minor, 9))


def test_ticks_are_those_of_the_manual_for_its_models() -> None:
    x, y = View(0.0, 41000.0, 0.0, 11000.0).ticks()
    assert x.labels == ["0", "10", "20", "30", "40"] and y.labels == ["0", "10"]
    np.testing.assert_allclose(x.minor, np.arange(42))


@pytest.mark.parametrize(
    ("high", "first", "along", "up"),
    [
        (7000.0, 0.0, 5.0, ["0", "5"]),  # two numbers are to be had
        (3000.0, 0.0, 10.0, ["0"]),  # they would crowd the other axis: one will do
        (1000.0, 5200.0, 10.0, ["5.5", "6"]),  # none will not
    ],
)
def test_both_axes_go_in_the_same_steps(high: float, first: float, along: float, up: list[str]) -> None:
    x, y = View(0.0, 40000.0, first, first + high).ticks()
    assert np.diff(x.major) == pytest.approx(along)
    assert y.labels == up
    if first == 0.0:
        assert np.diff(y.major) == pytest.approx(along)
        assert np.diff(y.minor) == pytest.approx(x.minor[1] - x.minor[0])


def test_what_is_seen() -> None:
    frame = make_frame(100)
    assert view(frame) == View(0.0, 41000.0, 0.0, 11000.0)
    frame.settings["right"] = np.nan  # no BOX: walls and particles
    frame.walls = {k: v[4:] for k, v in frame.walls.items()}
    p = frame.tables["particles"].columns
    p["radius"] = 0.5 * p["radius"]
    assert view(frame) == View(0.0, 40010.0, 10.0, 10000.0)
    assert view(frame, (-500.0, 100.0, -5.0, 20000.0)) == View(-500.0, 40010.0, -5.0, 20000.0)
    frame.walls = {k: v[:0] for k, v in frame.walls.items()}
    seen = view(frame)
    assert seen.left < (p["x"] - p["radius"]).min() and seen.top > (p["y"] + p["radius"]).max()
    for name in p:
        p[name] = p[name][:0]
    assert view(frame) == View(0.0, 1.0, 0.0, 1.0)  # nothing at all


def test_steps_of_ticks_that_are_asked_for() -> None:
    """Kilometres: major ticks every 2 km, minor ones every 500 m, or a tenth of the major ones."""
    view = View(0.0, 10000.0, 1000.0, 5000.0)
    assert view.unit == (1000.0, "km")
    x, y = view.ticks(2000.0, 500.0)
    assert x.major == [0.0, 2.0, 4.0, 6.0, 8.0, 10.0] and y.major == [2.0, 4.0]
    assert y.minor == [1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0]
    assert len(view.ticks(2000.0)[1].minor) == 21 and len(view.ticks(None, 500.0)[1].minor) == 9
