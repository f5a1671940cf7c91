"""Bodies in space: their surface, what a plane leaves of them, which element each pixel shows, and what changes it."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.cli.common import read_command_line
from hpcdem.cli.movie import movie
from hpcdem.cli.movie import work as film
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.core.picture_words import EYES
from hpcdem.io.axes import View
from hpcdem.physics.fdem import tetrahedra
from hpcdem.post.view import space
from hpcdem.post.view.model import Layer, ModelView
from hpcdem.post.view.moment import FACES, Moment, Objects, read_moment, unit_of
from hpcdem.post.view.paper import draw
from hpcdem.post.view.scene import STEPS, default_view, scene, shades_of, with_field
from hpcdem.post.view.screen import Picture, paint
from tests.conftest import Launcher
from tests.pcdc.test_plastic import run as run_script
from tests.view import frames, plain
from tests.view.test_pictures import SMALL, Silent, pixels, run

pytestmark = pytest.mark.figures
image = pytest.importorskip("PIL.Image")


@pytest.fixture
def rock(tmp_path: Path) -> Moment:
    return read_moment(frames.write_body(tmp_path))


def straight(tmp_path: Path, **values: Any) -> Moment:
    """The box as it was meshed, 4 by 3 by 2 m."""
    return read_moment(frames.write_body(tmp_path, grown=0.0, **values))


def area(skin: space.Skin, some: np.ndarray | None = None) -> float:
    points, cells = skin.points, skin.cells if some is None else skin.cells[some]
    total = 0.0
    for a, b, c in ((0, 1, 2), (0, 2, 3)):
        one = cells[cells[:, c] >= 0]
        u, w = points[one[:, b]] - points[one[:, a]], points[one[:, c]] - points[one[:, a]]
        total += 0.5 * float(np.linalg.norm(np.cross(u, w), axis=1).sum())
    return total


def skin_of(moment: Moment, view: ModelView) -> space.Skin:
    return scene(moment, view).layers[0].shape  # type: ignore[return-value]


# ---- geometry --------------------------------------------------------------------------------------------------------


def test_the_surface_of_a_box_and_of_a_part_of_it(tmp_path: Path):
    moment = straight(tmp_path)
    whole = skin_of(moment, ModelView(layers=(Layer(object="elements"),)))
    assert area(whole) == pytest.approx(52.0, rel=1e-12) and not whole.cut.any()
    a, b, c, _ = (whole.points[whole.cells[:, k]] for k in range(4))
    assert float((np.cross(b - a, c - a) * a).sum()) / 6.0 == pytest.approx(24.0, rel=1e-12)  # outwards: the volume
    base = skin_of(moment, ModelView(layers=(Layer(object="elements", filter="group(base)"),)))
    assert area(base) == pytest.approx(2.0 * (12.0 + 4.0 + 3.0), rel=1e-12)


@pytest.mark.parametrize(
    ("section", "eye", "left", "of_plane"),
    [
        ("x<2.3", "iso", 6.0 + 2.0 * 2.3 * 5.0, 6.0), ("x>2.3", "iso", 6.0 + 2.0 * 1.7 * 5.0, 6.0),
        ("x=2.3", "+x", 6.0 + 2.0 * 2.3 * 5.0, 6.0), ("x=2.3", "-x", 6.0 + 2.0 * 1.7 * 5.0, 6.0),
        ("z=0.75", "iso", 12.0 + 14.0 * 0.75, 12.0), ("y>1", "iso", 8.0 + 12.0 * 2.0, 8.0),  # y=1: between bricks
        ("2,1.5,1,1,1,0", "iso", 26.0, 6.0 * np.sqrt(2.0)), ("2,1.5,1,0,1,1", "iso", 26.0, 8.0 * np.sqrt(2.0)),
        ("9,0,0,1,0,0", "iso", 52.0, 0.0), ("9,0,0,-1,0,0", "iso", 0.0, 0.0),
    ],
)  # fmt: skip
def test_what_a_plane_leaves(tmp_path: Path, section: str, eye: str, left: float, of_plane: float):
    """Areas of the faces that stay, and of the plane in the body, by hand."""
    skin = skin_of(straight(tmp_path), ModelView(layers=(Layer(object="elements"),), section=section, eye=eye))
    assert area(skin, skin.cut) == pytest.approx(of_plane, rel=1e-9, abs=1e-12)
    assert area(skin, ~skin.cut) == pytest.approx(left, rel=1e-9, abs=1e-12)


def test_faces_along_a_crack_are_seen(tmp_path: Path):
    """Roof and base part: both get a face of 12 m2. The joints there are drawn, those that hold are not."""
    moment = straight(tmp_path, broken=True)
    shown = scene(moment, default_view(moment))
    assert [layer.layer.object for layer in shown.layers] == ["elements", "joints"]
    assert area(shown.layers[0].shape) == pytest.approx(52.0 + 24.0, rel=1e-12)  # type: ignore[arg-type]
    joints = shown.layers[1]
    assert area(joints.shape) == pytest.approx(12.0, rel=1e-12)  # type: ignore[arg-type]
    assert [word for word, _ in joints.legend] == ["shear"]
    cut = scene(moment, default_view(moment).changed(section="x<1.5")).layers[1]
    assert area(cut.shape) == pytest.approx(4.5, rel=1e-12)  # type: ignore[arg-type]


def test_eyes_are_right_handed_with_z_up():
    for eye in (*EYES.values(), (0.3, -2.0, 0.5)):
        turn = space.turn_of(eye)
        np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(turn) == pytest.approx(1.0) and turn[1, 2] >= 0.0
        np.testing.assert_allclose(turn[2], np.array(eye) / np.linalg.norm(eye), atol=1e-12)
    assert space.axes_of(space.turn_of(EYES["-y"])) == ((1.0, "x"), (1.0, "z"))
    assert space.axes_of(space.turn_of(EYES["-x"])) == ((-1.0, "y"), (1.0, "z"))
    assert space.axes_of(space.turn_of(EYES["+z"])) == ((1.0, "x"), (1.0, "y"))
    assert space.axes_of(space.turn_of(EYES["iso"])) is None


def test_the_picture_holds_the_deformed_shape(rock: Moment):
    """The upper end, 0.2 m higher, with a factor of 5 at 3 m; in the mesh at 2 m."""
    for deformed, top in ((0.0, 2.0), (1.0, 2.2), (5.0, 3.0)):
        seen = scene(rock, default_view(rock).changed(eye="-y", deformed=deformed)).seen
        assert seen.top == pytest.approx(top + 0.03 * 4.0)


# ---- pixels ----------------------------------------------------------------------------------------------------------


def test_each_pixel_shows_the_nearest_face():
    """Random triangles that cut each other, against the plain loop."""
    rng = np.random.default_rng(3)
    points = rng.uniform((0.0, 0.0, -5.0), (12.0, 8.0, 5.0), (90, 3))
    cells = np.column_stack([np.arange(90).reshape(30, 3), np.full(30, -1)])
    objects = {"joints": Objects(FACES, 30, lambda: (points, cells), {"number": np.arange(30)})}
    view = ModelView(layers=(Layer(object="joints", field="number"),), eye="+z")
    found = paint(scene(Moment(0, 0.0, objects, dim=3), view, View(0.0, 12.0, 0.0, 8.0)), 120, 80)
    pixels_ = points * (10.0, -10.0, 10.0) + (0.0, 80.0, 0.0)
    expected, _ = plain.nearest(pixels_[cells[:, :3]], 120, 80)
    assert (found.row == expected).mean() > 0.9995 and len(np.unique(expected)) > 20


@pytest.mark.some_of_each
@pytest.mark.parametrize("eye", ["-y", "+x", "iso", "0.2,-1,0.4"])
@pytest.mark.parametrize("section", ["", "1.9,1.4,0.9,1,-1,1"])
def test_a_pixel_shows_the_element_that_is_there(tmp_path: Path, eye: str, section: str):
    """The place in front at a pixel, a little inside, lies in the element that the pixel tells."""
    moment = straight(tmp_path)
    view = ModelView(layers=(Layer(object="elements"),), eye=eye, section=section)
    shown = scene(moment, view)
    assert shown.turn is not None
    skin, (points, cells, _) = shown.layers[0].shape, moment.of("elements").read()
    found = paint(shown, 90, 80)
    a, b, c, d = 90 / shown.seen.width, -90 / shown.seen.width * shown.seen.left, 0.0, 0.0
    c = -80 / shown.seen.height
    d = -c * shown.seen.top
    seen = skin.points @ shown.turn.T  # type: ignore[attr-defined]
    flat = np.column_stack([a * seen[:, 0] + b, c * seen[:, 1] + d, seen[:, 2]])
    three = np.concatenate([skin.cells[:, :3], skin.cells[skin.cells[:, 3] >= 0][:, [0, 2, 3]]])  # type: ignore[attr-defined]
    _, near = plain.nearest(flat[three], 90, 80)
    there = np.argwhere(np.isfinite(near) & (found.row >= 0))
    assert len(there) > 1000 and (np.isfinite(near) == (found.row >= 0)).mean() > 0.999
    wrong = 0
    for i, j in there[::37]:
        place = np.array([(j + 0.5 - b) / a, (i + 0.5 - d) / c, near[i, j] - 1e-3]) @ shown.turn
        wrong += tetrahedra.nearest_element(points, cells, tuple(place), np.arange(len(cells))) != found.row[i, j]
    assert wrong <= 0.02 * len(there[::37])  # a place near an edge may lie in the neighbour


def test_a_section_has_the_colours_of_its_elements(tmp_path: Path):
    moment = straight(tmp_path)
    layer = Layer(object="elements", field="stress_zz", limits=(-2e8, 0.0))
    shown = scene(moment, ModelView(layers=(layer,), section="y=1.6", eye="-y"), View(0.0, 4.0, 0.0, 2.0))
    picture = paint(shown, 80, 40)
    points, cells, _ = moment.of("elements").read()
    values = moment.of("elements").fields["stress_zz"]
    for x, z in ((0.62, 0.37), (1.87, 1.62), (3.37, 0.87)):
        element = tetrahedra.nearest_element(points, cells, (x, 1.6001, z), np.arange(len(cells)))
        shade = shades_of("viridis")[int((values[element] + 2e8) / 2e8 * STEPS)]
        np.testing.assert_allclose(picture.colours[int(20 * (2.0 - z)), int(20 * x)], 255.0 * shade, atol=1.5)


def painted(moment: Moment, **values: Any) -> Picture:
    joints = Layer(object="joints", colour="#ff0000", filter="state == 3")
    view = ModelView(layers=(Layer(object="elements", **values), joints), eye="-z")
    return paint(scene(moment, view), 60, 50)


def test_what_shines_through_hides_nothing_and_is_reported_last(tmp_path: Path):
    moment = straight(tmp_path, broken=True)
    whole, glass, none = painted(moment), painted(moment, opacity=0.3), painted(moment, filter="z > 1")
    middle = 25, 30
    assert (whole.layer[middle], glass.layer[middle], none.layer[middle]) == (0, 1, 1)
    red = none.colours[middle].astype(int)
    assert np.abs(glass.colours[middle].astype(int) - red).max() > 10  # through the glass
    assert glass.colours[middle][0] > whole.colours[middle][0]


# ---- fields ----------------------------------------------------------------------------------------------------------


def test_fields_that_are_computed(rock: Moment):
    elements = rock.of("elements")
    zz = -1e6 * (np.arange(elements.count) + 1.0)
    np.testing.assert_allclose(elements.values("stress_mean", ""), zz / 3.0, rtol=1e-12)
    np.testing.assert_allclose(elements.values("stress_mises", ""), -zz, rtol=1e-12)
    np.testing.assert_allclose(elements.values("stress_middle", ""), 0.0, atol=1e-3)
    points, cells, _ = elements.read()
    y, z = points[cells].mean(axis=1)[:, 1:].T
    np.testing.assert_allclose(elements.values("displacement", ""), 0.1 * np.hypot(y / 0.9, z / 1.1), rtol=1e-12)
    assert unit_of("strain_energy", 3) == "J" and unit_of("stress_mises", 3) == "Pa" and unit_of("volume", 3) == "m3"


def test_von_mises_in_the_plane_too():
    from hpcdem.post.view.moment import _of_stress

    given = {"stress_xx": np.array([3.0]), "stress_yy": np.array([1.0]), "stress_zz": np.array([2.0]),
             "stress_xy": np.array([5.0])}  # fmt: skip
    found = _of_stress(given, 2)
    assert set(found) == {"stress_mean", "stress_mises"}
    assert found["stress_mises"](slice(None))[0] == pytest.approx(np.sqrt(0.5 * (4.0 + 1.0 + 1.0) + 3.0 * 25.0))


# ---- each word by what it changes ------------------------------------------------------------------------------------

WORDS = [
    ("--eye=-y",), ("--eye=1,-2,0.3",), ("--section=x=2",), ("--section=2,1,1,1,1,1",), ("--section=x<1.5",),
    ("--deformed=3",), ("--camera=-2,2,-1,1",), ("--title=a",), ("--no-axes",), ("--no-legend",), ("--range=-1e8,0",),
    ("--colours=plasma",), ("--opacity=0.4",), ("--no-edges",), ("--vectors=displacement",), ("--filter=z > 1",),
    ("--page=10",), ("--font=14",), ("--dpi=70",), ("--hide=elements",),
]  # fmt: skip


@pytest.mark.slow
def test_each_option_alone_changes_the_picture(tmp_path: Path):
    path = frames.write_body(tmp_path)
    found = []
    for k, words in enumerate([(), *WORDS, ("--vectors=displacement", "--arrows=3")]):
        run(path, "--field=stress_zz", "-o", tmp_path / f"{k}.png", *words)
        found.append((tmp_path / f"{k}.png").read_bytes())
    assert len(set(found)) == len(found)
    run(path, "--field=stress_zz", "-o", tmp_path / "again.png")
    assert (tmp_path / "again.png").read_bytes() == found[0]


def test_colours_without_a_field_one_colour_and_logarithms(rock: Moment, tmp_path: Path):
    usual = default_view(rock).with_layer("elements", field="")
    views = [usual, usual.with_layer("elements", colour="#00ff00"), with_field(usual, rock, "displacement"),
             with_field(usual, rock, "displacement", log=True), with_field(usual, rock, "group_rock")]  # fmt: skip
    found = [pixels(rock, view, tmp_path / f"{k}.png") for k, view in enumerate(views)]
    for k, one in enumerate(found):
        for other in found[:k]:
            assert one.shape != other.shape or not np.array_equal(one, other)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--eye=up",), r"eye: expected \+x, -x, .*, iso, or a direction towards the eye, .* not 'up'"),
        (("--eye=0,0,0",), "eye: expected"), (("--section=x",), "section: expected x=1.5, x<1.5"),
        (("--section=q=1",), "section: expected"), (("--section=1,2,3,0,0,0",), "section: expected"),
        (("--section=x=nan",), "section: expected"), (("--field=stress_xq",), "this frame has no field stress_xq"),
        (("--filter=w > 1", "--object=elements"), "unknown field w; known: x, y, z"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_by_name(tmp_path: Path, words: tuple[str, ...], message: str):
    with pytest.raises(HpcdemError, match=message):
        run(frames.write_body(tmp_path), *words)


@pytest.mark.parametrize("word", ["--eye=-y", "--section=x=1"])
def test_words_of_space_are_refused_in_the_plane(tmp_path: Path, word: str):
    with pytest.raises(HpcdemError, match="requires three dimensions; this frame has two"):
        run(frames.write_blocks(tmp_path), word)


def test_nothing_else_is_needed_for_it(rock: Moment, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Neither a display nor VTK."""
    monkeypatch.delenv("DISPLAY", raising=False)
    for name in ("pyvista", "vtk", "vtkmodules"):
        monkeypatch.setitem(sys.modules, name, None)
    for kind in ("png", "jpg", "pdf", "svg"):
        draw(rock, tmp_path / f"a.{kind}", default_view(rock), SMALL)
    assert "step 5, 5 ms" in (tmp_path / "a.svg").read_text()


def test_films(tmp_path: Path):
    for step, grown in ((0, 0.0), (10, 0.2)):
        frames.write_body(tmp_path, step, grown=grown)
    run(tmp_path, "--field=displacement", "--eye=-y", "-o", tmp_path / "a.gif")
    options = read_command_line(movie, "hpcdem movie", [str(tmp_path), "--format=gif", "--size=200", "--max_workers=1"])
    film(SerialComm(), Silent(), options)  # type: ignore[arg-type]
    for name in ("a.gif", "movie.gif"):
        with image.open(tmp_path / name) as opened:
            assert opened.n_frames == 2, name
    for words in (["--show=stress"], ["--xmax=3"]):
        options = read_command_line(movie, "hpcdem movie", [str(tmp_path), "--format=gif", *words])
        with pytest.raises(HpcdemError, match=f"{words[0].partition('=')[0]} is for two dimensions"):
            film(SerialComm(), Silent(), options)  # type: ignore[arg-type]


# ---- scripts ---------------------------------------------------------------------------------------------------------

MODEL = (
    "pcdc model new dim 3\npcdc model option collision off\n"
    "pcdc mesh structured (0,0,0) (2,1,1) cells 4 2 2 group 'rock'\n"
    "pcdc element group 'left' set 'side' range x 0 1\n"
    "pcdc element c-model mech-iso-elastic property density 2500 young 20e9 p-r 0.2\n"
    "pcdc element initial stress-zz -2e6 gradient (1e6,0,0)\npcdc model step 20\n"
)


@pytest.mark.slow
def test_each_word_of_a_script_alone_changes_the_picture(tmp_path: Path):
    (tmp_path / "a.mv").write_text('{"view": 1, "layers": [{"object": "elements"}], "eye": "+y", "section": "z=0.3"}')
    words = ["", "eye '-y'", "section 'x=1.2'", "camera (0,0) (1,1)", "deformed 1e3", "range x 0 1", "title 'a'"]
    text = "".join(f"pcdc output image 'p{k}' field 'stress-zz' {w}\n" for k, w in enumerate(words) if "range" not in w)
    text += "pcdc output image 'p5' field 'stress-zz' object elements range x 0 1\n"
    text += "pcdc output image 'view' view 'a.mv'\npcdc output image 'other' view 'a.mv' section 'z=0.6'\n"
    run_script(tmp_path, MODEL + text)
    pictures = [path.read_bytes() for path in (tmp_path / "data").glob("*_0000000020.png")]
    assert len(pictures) == len(words) + 2 == len(set(pictures))


@pytest.mark.parametrize("words", ["eye 'up'", "section 'x'", "section 'x=1' eye 'no'"])
def test_scripts_are_refused_before_they_run(tmp_path: Path, words: str):
    with pytest.raises(HpcdemError, match="output image"):
        run_script(tmp_path, MODEL + f"pcdc output image 'a' {words}\n")
    assert not (tmp_path / "data").exists() or not list((tmp_path / "data").iterdir())


@pytest.mark.slow
@pytest.mark.mpi
def test_the_same_picture_on_two_ranks(launch: Launcher, tmp_path: Path):
    script = MODEL + "pcdc output image 'a' field 'displacement' vectors 'velocity' section 'y=0.4'\n"
    found = []
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        folder.mkdir()
        (folder / "a.sc").write_text(script)
        done = launch(ranks, "a.sc", cwd=folder, env={"DISPLAY": ""})
        assert done.returncode == 0, done.stderr
        data = folder / "data"
        found.append([(data / name).read_bytes() for name in ("a_0000000020.png", "all_0000000020.jpg")])
    assert found[0] == found[1]
