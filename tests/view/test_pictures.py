"""Pictures of views: the colour of each object is that of its value, and each property changes what it should."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hpcdem.cli.common import read_command_line
from hpcdem.cli.draw import draw as command
from hpcdem.cli.draw import work
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.core.picture_words import COLOURS
from hpcdem.io.axes import View
from hpcdem.io.frame import Columns
from hpcdem.io.vtkhdf import read_vtkhdf
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.physics.fdem.diagnostics import QUANTITIES
from hpcdem.post.view.model import Layer, ModelView, read_view
from hpcdem.post.view.moment import BALLS, SPOTS, Moment, Objects, of_blocks, of_particles, read_moment, unit_of
from hpcdem.post.view.paper import Paper, draw
from hpcdem.post.view.scene import STEPS, default_view, scene, shades_of, with_field
from hpcdem.post.view.screen import paint
from tests.view import frames

pytestmark = pytest.mark.figures
image = pytest.importorskip("PIL.Image")
SMALL = Paper(dpi=60.0)


@pytest.fixture
def rock(tmp_path: Path) -> Moment:
    return read_moment(frames.write_blocks(tmp_path))


@pytest.fixture
def sand(tmp_path: Path) -> Moment:
    return read_moment(frames.write_discs(tmp_path))


def pixels(moment: Moment, view: ModelView, path: Path, paper: Paper = SMALL) -> np.ndarray:
    """(height, width, 3) bytes of a picture."""
    with image.open(draw(moment, path, view, paper)) as opened:
        return np.asarray(opened.convert("RGB"))


class Usually:
    """Pictures that several tests compare theirs with, made once."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.made = folder, 0
        self.path = frames.write_blocks(folder)
        self.rock, self.sand = read_moment(self.path), read_moment(frames.write_discs(folder))
        self.pixels, self.drawn, self.commanded = cache(self._pixels), cache(self._drawn), cache(self._commanded)

    def _file(self, kind: str) -> Path:
        self.made += 1
        return self.folder / f"{self.made}.{kind}"

    def _pixels(self, view: ModelView) -> np.ndarray:
        """Of the rock."""
        return pixels(self.rock, view, self._file("png"))

    def _drawn(self, view: ModelView, kind: str) -> bytes:
        """Of the sand."""
        return draw(self.sand, self._file(kind), view, SMALL).read_bytes()

    def _commanded(self, *words: str) -> bytes:
        """By the command, of the rock."""
        file = self._file("png")
        run(self.path, "-o", file, *words)
        return file.read_bytes()


@pytest.fixture(scope="module")
def usually(tmp_path_factory: pytest.TempPathFactory) -> Usually:
    return Usually(tmp_path_factory.mktemp("usually"))


def bare(*layers: Layer, **values: Any) -> ModelView:
    """Nothing around the picture, which is 3 by 3 m."""
    return ModelView(
        layers=layers, camera=(0.0, 3.0, 0.0, 3.0), axes=False, legend=False, title="", **values
    )  # fmt: skip


def at(picture: np.ndarray, x: float, y: float, side: float = 3.0) -> np.ndarray:
    """The colour at a place [m] of a picture without margins to speak of."""
    edge = 0.15 / 17.0 * picture.shape[1]
    inner = picture.shape[1] - 0.5 / 17.0 * picture.shape[1]
    column = edge + x / side * inner
    row = picture.shape[0] - edge - y / side * inner
    return picture[int(row), int(column)].astype(int)


# ---- what a frame holds ----------------------------------------------------------------------------------------------


def test_columns_that_are_read_later_are_the_same(tmp_path: Path):
    path = frames.write_blocks(tmp_path)
    early, late = read_mesh_frame(path), read_mesh_frame(path, lazily=True)
    for table in ("of_points", "of_elements", "of_joints"):
        a, b = getattr(early, table), getattr(late, table)
        assert list(a) == list(b)
        for name in a:
            np.testing.assert_array_equal(a[name], b[name])
    path = frames.write_discs(tmp_path)
    one, other = read_vtkhdf(path), read_vtkhdf(path, lazily=True)
    for name, table in one.tables.items():
        assert list(table.columns) == list(other.tables[name].columns)
        assert len(table) == len(other.tables[name])
        for column, values in table.columns.items():
            np.testing.assert_array_equal(values, other.tables[name].columns[column])


def test_what_is_asked_of_one_object_is_read_of_it_alone(rock: Moment, sand: Moment):
    """And is what its column says, also where it is computed."""
    for moment in (rock, sand):
        for name, objects in moment.objects.items():
            early = {field: objects.value(field, objects.count - 1) for field in (*objects.fields, *objects.vectors)}
            middle = objects.centre(objects.count - 1)
            np.testing.assert_allclose(middle, objects.centres()[-1], rtol=1e-14)
            for field, value in early.items():
                assert not (isinstance(objects.fields, Columns) and field in objects.fields
                            and objects.fields.was_read(field)), (name, field)  # fmt: skip
                whole = objects.fields[field] if field in objects.fields else objects.vectors[field]
                np.testing.assert_array_equal(value, whole[-1])


def test_columns_that_nobody_asks_for_are_released():
    read = []

    def reader(name: str) -> Callable[[slice], np.ndarray]:
        return lambda rows: (read.append(name), np.arange(10.0))[1][rows]

    columns = Columns({name: reader(name) for name in "abc"}, 160.0)
    for name in "abaca":
        assert len(columns[name]) == 10
    assert read == ["a", "b", "c"] and columns.size == 160
    assert columns.was_read("a") and not columns.was_read("b")
    assert columns.part("b", slice(3, 5)).tolist() == [3.0, 4.0] and not columns.was_read("b")


def test_objects_and_fields_of_blocks(rock: Moment):
    assert {name: objects.count for name, objects in rock.objects.items()} == {
        "elements": 10, "joints": 3, "channels": 2, "bolts": 2, "liners": 1
    }  # fmt: skip
    elements = rock.of("elements")
    assert elements.known() == [
        "group_rock", "number", "stress_yy", "displacement", "displacement_x", "displacement_y", "velocity",
        "velocity_x", "velocity_y",
    ]  # fmt: skip
    np.testing.assert_array_equal(elements.values("stress_yy", ""), -1e6 * np.arange(1.0, 11.0))
    np.testing.assert_allclose(elements.values("displacement", ""), 0.1 * np.arange(10.0), atol=1e-15)
    np.testing.assert_allclose(elements.centres()[1], [0.1 + 1 / 3, 2 / 3])
    np.testing.assert_allclose(elements.centres()[9], [0.9 + 2.5, 2.5])
    assert rock.of("channels").values("aperture", "").tolist() == [1e-3, 2e-3]
    assert rock.of("bolts").values("axial_force", "").tolist() == [1e3, 2e3]
    with pytest.raises(HpcdemError, match="this frame has no particles; it has elements, joints, channels"):
        rock.of("particles")
    with pytest.raises(HpcdemError, match="joints have no field stress_yy in this frame; known:"):
        with_field(default_view(rock), rock, "stress_yy", "joints")


def test_objects_and_fields_of_particles(sand: Moment):
    assert {name: objects.count for name, objects in sand.objects.items()} == {
        "particles": 25, "walls": 1, "contacts": 20, "bonds": 5
    }  # fmt: skip
    particles = sand.of("particles")
    np.testing.assert_array_equal(particles.values("velocity", ""), np.arange(25.0))
    np.testing.assert_array_equal(particles.values("kinetic_energy", ""), np.arange(25.0) ** 2)
    np.testing.assert_array_equal(particles.values("rotation", ""), 0.01 * np.arange(25))
    np.testing.assert_array_equal(sand.of("contacts").read()[0][0], [[0.0, 0.0], [1.0, 0.0]])


def test_clumps_are_their_members():
    frame = frames.discs()
    k = np.arange(25)
    frame.tables["particles"].columns["clump"] = np.select([k < 4, k > 22], [10, 33], -1)
    moment = of_particles(frame)
    clumps = moment.of("clumps")
    assert clumps.count == 6 and clumps.fields["members"].tolist() == [4, 4, 4, 4, 2, 2]
    assert clumps.value("clump", 4) == 33 and clumps.value("gid", 4) == 33 and clumps.vectors["velocity"][4, 0] == 23.0
    layer = default_view(moment).layer("clumps")
    assert layer is not None and not layer.visible and "clumps" not in of_particles(frames.discs()).objects
    painted = scene(moment, bare(Layer(object="clumps", filter="members < 3"))).layers[0]
    assert painted.rows.tolist() == [4, 5] and painted.kind.tolist() == [3, 3]  # each clump in one colour
    np.testing.assert_array_equal(painted.shape[0], [[3.0, 4.0], [4.0, 4.0]])


@pytest.mark.parametrize("dim", [2, 3])
def test_points_are_as_large_on_paper_whatever_the_scale(dim: int):
    """Of 3 points times 4: discs, in space octahedra, from the front a square on its corner."""
    at = np.full((1, dim), 0.5)
    objects = {"flow-nodes": Objects(SPOTS if dim == 2 else BALLS, 1, lambda: (at,), {})}
    for width in (1.0, 1e4):
        seen = View(*(0.5 + 0.5 * width * side for side in (-1, 1, -1, 1)))
        view = ModelView(layers=(Layer(object="flow-nodes", size=4.0),), eye="-y" if dim == 3 else "iso")
        picture = paint(scene(Moment(0, 0.0, objects, dim=dim), view, seen), 960, 960)
        assert (picture.row >= 0).sum() == pytest.approx(np.pi * 144.0 if dim == 2 else 2 * 144.0, rel=0.12)
        assert picture.row[480, 480] == 0


def test_stress_of_a_particle_is_that_of_its_contacts():
    """A sphere (SET disk off) between two others that push it with 3 N: s_xx is 2 x 3 N x 0.5 m over its volume,
    compression positive."""
    frame = frames.discs(n=9)
    table = frame.tables["contacts"].columns
    table["fx"][:], table["fy"][:] = -3.0, 0.0  # on the first particle, the left one
    frame.tables["bonds"].columns = {name: values[:0] for name, values in frame.tables["bonds"].columns.items()}
    particles = of_particles(frame).of("particles")
    volume = 4.0 / 3.0 * np.pi * 0.45**3
    assert particles.values("stress_xx", "")[4] == pytest.approx(2 * 3.0 * 0.5 / volume, rel=1e-12)
    assert particles.values("stress", "")[4] == pytest.approx(3.0 * 0.5 / volume, rel=1e-12)
    assert particles.values("stress_deviator", "")[4] == pytest.approx(3.0 * 0.5 / volume, rel=1e-12)
    assert particles.values("stress_yy", "")[4] == 0.0


def test_units_are_those_of_the_quantities():
    """What frames of blocks hold has the unit that the solver says."""
    for name, quantity in QUANTITIES.items():
        if quantity.framed and quantity.on in ("element", "joint"):
            assert unit_of(name) == (quantity.unit if quantity.unit != "1" else ""), name
    for name, unit in {"vx": "m/s", "velocity": "m/s", "radius": "m", "spin": "rad/s", "fx": "N", "torque": "N m",
                       "rotation": "rad", "density": "kg/m3", "kinetic_energy": "J/m", "fluid_pressure": "Pa",
                       "axial_force": "N", "flow_rate": "m2/s", "gid": "", "color": ""}.items():  # fmt: skip
        assert unit_of(name) == unit, name


# ---- what is drawn ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "colours", [pytest.param(c, marks=[pytest.mark.slow] * (k > 1)) for k, c in enumerate(COLOURS)]
)
def test_each_element_has_the_colour_of_its_value(rock: Moment, tmp_path: Path, colours: str):
    view = bare(Layer(object="elements", field="stress_yy", limits=(-1e7, 0.0), colours=colours), deformed=0.0)
    picture = pixels(rock, view, tmp_path / "a.png")
    shades = shades_of(colours)
    for element, place in ((2, (1.5, 0.5)), (6, (2.5, 1.5)), (9, (2.5, 2.5)), (0, (0.7, 0.2)), (1, (0.2, 0.7))):
        step = min(int((1.0 - 0.1 * (element + 1)) * STEPS), STEPS - 1)
        np.testing.assert_allclose(at(picture, *place), 255.0 * shades[step], atol=2.0)


def test_logarithms_and_limits(rock: Moment):
    view = bare(Layer(object="channels", field="aperture", log=True, limits=(1e-4, 1e-2)))
    layer = scene(rock, view).layers[0]
    assert layer.kind.tolist() == [int(0.5 * STEPS), int((np.log10(2e-3) + 4.0) / 2.0 * STEPS)]
    assert layer.scale is not None and (layer.scale.low, layer.scale.high) == (1e-4, 1e-2)
    usual = scene(rock, bare(Layer(object="channels", field="aperture"))).layers[0]
    assert usual.kind.tolist() == [0, STEPS - 1] and usual.scale is not None
    assert (usual.scale.low, usual.scale.high, usual.scale.title) == (1e-3, 2e-3, "aperture (mm)")
    with pytest.raises(HpcdemError, match="log: no value of stress_yy is above 0"):
        scene(rock, bare(Layer(object="elements", field="stress_yy", log=True)))


def test_groups_have_a_legend_of_names(rock: Moment):
    layer = scene(rock, with_field(default_view(rock), rock, "group_rock")).layers[0]
    assert [word for word, _ in layer.legend] == ["base", "roof"] and layer.scale is None
    assert layer.kind.tolist() == [0] * 7 + [1] * 3


def test_joints_have_the_colours_of_the_mode(rock: Moment):
    layer = scene(rock, bare(Layer(object="joints"))).layers[0]
    assert layer.rows.tolist() == [2] and layer.legend == [("tension", "#c81e1e")]


LOOKS = [
    ({"visible": False}, "elements"), ({"field": "stress_yy"}, "elements"),
    ({"colour": "#ff00ff", "field": ""}, "elements"),
    ({"opacity": 0.3}, "elements"), ({"edges": True}, "elements"), ({"filter": "x > 1.5"}, "elements"),
    ({"filter": "group(roof)"}, "elements"), ({"vectors": "velocity"}, "elements"), ({"size": 4.0}, "joints"),
    ({"opacity": 0.3}, "joints"), ({"field": "number"}, "joints"), ({"visible": False}, "bolts"),
    ({"field": "axial_force"}, "bolts"), ({"visible": False}, "liners"), ({"colour": "#00ff00"}, "liners"),
    ({"field": "aperture"}, "channels"), ({"name": "rock"}, "elements"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("values", "kind"), [pytest.param(*one, marks=[pytest.mark.slow] * (k % 3 > 0)) for k, one in enumerate(LOOKS)]
)
def test_each_property_alone_changes_the_picture(usually: Usually, values: dict, kind: str):
    rock = usually.rock
    usual = default_view(rock).changed(camera=(0.0, 4.0, 0.0, 3.2))
    a, b = usually.pixels(usual), usually.pixels(usual.with_layer(kind, **values))
    same = a.shape == b.shape and np.array_equal(a, b)
    assert same == (values == {"name": "rock"})  # a name is for the tree alone


@pytest.mark.some_of_each
@pytest.mark.parametrize(
    "values",
    [{"size": 0.5}, {"opacity": 0.4}, {"edges": True}, {"filter": "x > 1.5"}, {"vectors": "force"}, {"field": "vx"},
     {"colour": "#ff00ff"}, {"field": "stress"}, {"field": "group"}],
)  # fmt: skip
@pytest.mark.parametrize("kind", ["png", "svg"])
def test_the_same_of_particles(usually: Usually, values: dict, kind: str):
    usual = default_view(usually.sand)
    assert usually.drawn(usual, kind) != usually.drawn(usual.with_layer("particles", **values), kind)


@pytest.mark.parametrize("kind", ["png", "svg"])
def test_a_picture_is_the_same_again(sand: Moment, tmp_path: Path, kind: str):
    one, again = (draw(sand, tmp_path / f"{name}.{kind}", default_view(sand), SMALL) for name in "ab")
    assert one.read_bytes() == again.read_bytes()


@pytest.mark.parametrize(
    "values",
    [{"deformed": 0.0}, {"camera": (0.0, 2.0, 0.0, 1.0)}, {"title": "a"}, {"axes": False}, {"legend": False}],
)
def test_each_property_of_a_view_alone_changes_the_picture(usually: Usually, values: dict):
    usual = with_field(default_view(usually.rock), usually.rock, "stress_yy")
    a, b = usually.pixels(usual), usually.pixels(usual.changed(**values))
    assert a.shape != b.shape or not np.array_equal(a, b)


def test_deformed_shapes(rock: Moment, sand: Moment):
    """Factor 0 is the mesh, 1 the place of now, 2 once more as far."""
    view = bare(Layer(object="elements"))
    mesh = scene(rock, view.changed(deformed=0.0)).layers[0].shape[0]
    now, far = (scene(rock, view.changed(deformed=f)).layers[0].shape[0] for f in (1.0, 2.0))
    np.testing.assert_allclose(mesh[-1], [2.0, 3.0], atol=1e-12)
    np.testing.assert_allclose(far - now, now - mesh, atol=1e-12)
    with pytest.raises(HpcdemError, match="deformed: this frame has no displacements"):
        scene(sand, default_view(sand).changed(deformed=2.0))


def test_arrows_are_as_long_as_they_say(rock: Moment):
    layer = Layer(object="elements", vectors="velocity", arrows=2.0)
    arrows = scene(rock, bare(layer)).layers[0].arrows
    assert arrows is not None
    assert np.hypot(*arrows[1].T).max() == pytest.approx(2.0 * 0.05 * 3.0)  # two twentieths of 3 m
    with pytest.raises(HpcdemError, match="elements have no vectors force in this frame; known: displacement, vel"):
        scene(rock, bare(Layer(object="elements", vectors="force")))


def test_only_some_numbers(rock: Moment):
    shown = scene(rock, bare(Layer(object="elements"), Layer(object="joints", field="state")),
                  only={"elements": np.array([3, 5])})  # fmt: skip
    assert shown.layers[0].rows.tolist() == [3, 5] and len(shown.layers[1].rows) == 3
    with pytest.raises(HpcdemError, match="range: bolts have no numbers"):
        scene(rock, bare(Layer(object="bolts")), only={"bolts": np.array([0])})


def test_true_vectors(sand: Moment, tmp_path: Path):
    text = draw(sand, tmp_path / "a.svg", default_view(sand), SMALL).read_text()
    assert "<image" not in text and text.count("<use") > 25 and "step 3, 1.5 s" in text
    assert draw(sand, tmp_path / "a.pdf", default_view(sand), SMALL).read_bytes().startswith(b"%PDF")


def test_a_frame_in_memory_gives_the_same(tmp_path: Path):
    path = frames.write_blocks(tmp_path)
    view = with_field(default_view(read_moment(path)), read_moment(path), "stress_yy")
    a = draw(path, tmp_path / "a.png", view, SMALL).read_bytes()
    assert a == draw(of_blocks(read_mesh_frame(path)), tmp_path / "b.png", view, SMALL).read_bytes()


# ---- the command line ------------------------------------------------------------------------------------------------


class Silent:
    """A log that keeps its lines."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def info(self, text: str) -> None:
        self.lines.append(text)

    warn = info


def run(*words: object) -> list[str]:
    options = read_command_line(command, "hpcdem draw", ["--max_workers=1", "--dpi=60", *map(str, words)])
    log = Silent()
    work(SerialComm(), log, options)  # type: ignore[arg-type]
    return log.lines


def test_a_folder_is_drawn_at_one_place_with_one_range(tmp_path: Path):
    for step, grown in ((0, 0.0), (10, 5.0)):
        frames.write_blocks(tmp_path, step, grown=grown)
    run(tmp_path, "--field", "displacement", "--save-view", tmp_path / "a.mv")
    made = sorted(tmp_path.glob("*.png"))
    assert [path.name for path in made] == ["rock_0000000000.png", "rock_0000000010.png"]
    layer = read_view(tmp_path / "a.mv").layer("elements")
    assert layer is not None and layer.limits is not None
    assert layer.limits == pytest.approx((0.0, float(np.hypot(0.9, 5.0))))
    with image.open(made[0]) as a, image.open(made[1]) as b:
        assert a.size == b.size
    run(tmp_path, "--field", "displacement", "-o", tmp_path / "film.gif", "--fps", 5)
    with image.open(tmp_path / "film.gif") as film:
        assert film.n_frames == 2 and film.info["duration"] == 200
    assert not list(tmp_path.glob(".draw_*"))


WORDS = [
    ("--field=stress_yy",), ("--field=stress_yy", "--range=-2e6,0"), ("--field=stress_yy", "--colours=plasma"),
    ("--object=elements", "--opacity=0.4"), ("--object=elements", "--edges"), ("--object=joints", "--size=5"),
    ("--object=elements", "--colour=#00ff00"), ("--object=elements", "--vectors=velocity"),
    ("--object=elements", "--vectors=velocity", "--arrows=3"), ("--object=elements", "--filter=x > 1"),
    ("--hide=joints",), ("--deformed=0",), ("--camera=0,1,0,1",), ("--title=a",), ("--no-axes",), ("--no-legend",),
    ("--page=10",), ("--font=14",), ("--dpi=70",), ("--field=aperture",), ("--field=aperture", "--log"),
]  # fmt: skip


@pytest.mark.parametrize(
    "words", [pytest.param(one, marks=[pytest.mark.slow] * (k % 3 > 0)) for k, one in enumerate(WORDS)]
)
def test_each_option_alone_changes_the_picture(usually: Usually, words: tuple[str, ...]):
    assert usually.commanded(*words) != usually.commanded(*words[:-1])


def test_a_view_of_a_file_is_drawn(tmp_path: Path):
    path = frames.write_discs(tmp_path)
    run(path, "--field=vx", "--show=contacts", "--save-view", tmp_path / "a.mv", "-o", tmp_path / "a.png")
    run(path, "--view", tmp_path / "a.mv", "-o", tmp_path / "b.png")
    run(path, "-o", tmp_path / "c.png")
    a, b, c = ((tmp_path / f"{name}.png").read_bytes() for name in "abc")
    assert a == b != c


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--field=nix",), "this frame has no field nix; it has elements: group_rock, number, stress_yy"),
        (("--field=state", "--object=elements"), "elements have no field state in this frame"),
        (("--object=particles",), "this frame has no particles"), (("--log",), "log requires field or object"),
        (("--hide=walls",), "this frame has no walls"), (("--colours=jet", "--field=stress_yy"), "colours"),
        (("--object=elements", "--colour=red"), "colour"), (("--object=elements", "--opacity=3"), "opacity"),
        (("--fps=3",), "--fps requires a film"), (("--step=3",), "--step selects frames of a folder"),
        (("--format=png", "-o", "a.png"), "--format cannot be used with --output"),
        (("-o", "a.bmp"), "pictures end in"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_by_name(tmp_path: Path, words: tuple[str, ...], message: str):
    with pytest.raises(HpcdemError, match=message):
        run(frames.write_blocks(tmp_path), *words)


def test_what_a_frame_holds_is_listed(tmp_path: Path, capsys: pytest.CaptureFixture):
    run(frames.write_blocks(tmp_path), "--list")
    said = capsys.readouterr().out
    assert "elements (10)" in said and "stress_yy                Pa" in said and "base, roof" in said
    assert not list(tmp_path.glob("*.png"))


def test_foreign_and_half_frames_are_reported(tmp_path: Path):
    path = frames.write_blocks(tmp_path)
    path.write_bytes(path.read_bytes()[:3000])
    with pytest.raises(HpcdemError, match=path.name):
        run(path)
    with pytest.raises(HpcdemError, match="no frame"):
        (tmp_path / "other").mkdir()
        run(tmp_path / "other")
