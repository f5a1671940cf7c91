"""What is shown when nothing was said: what has happened to elements, one choice for all frames; vectors as fields."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import HpcdemError
from hpcdem.io.frames import frame_name
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.io.vtkhdf_mesh import MeshFrame, write_mesh_frame
from hpcdem.page.sources import Sources
from hpcdem.page.viewer import Viewer
from hpcdem.post.view.model import Layer, ModelView, read_view
from hpcdem.post.view.moment import Moment, of_particles, read_moment
from hpcdem.post.view.paper import figure_of
from hpcdem.post.view.scene import PALE, Scene, chosen_rows, default_view, rgb, scene, shared
from tests.view import frames
from tests.view.test_bars import told
from tests.view.test_pictures import run

pytestmark = pytest.mark.figures


def texts_of(shown: Scene) -> list[str]:
    """All that is written on its page."""
    from matplotlib.text import Text

    return [text.get_text() for text in figure_of(shown).findobj(Text)]


def unmoved(frame: MeshFrame, **columns: float) -> MeshFrame:
    """The same before anything has happened; columns: values of all elements."""
    corners = frame.corners.columns
    for axis in "xyz":
        if f"displacement_{axis}" in corners:
            corners[axis] = corners[axis] - corners[f"displacement_{axis}"]
            corners[f"displacement_{axis}"] = 0.0 * corners[axis]
    elements = frame.elements.columns
    for name in list(elements):
        if name.startswith("stress_"):
            elements[name] = np.zeros(len(elements[name]))
    for name, value in columns.items():
        elements[name] = value + np.arange(float(len(elements["number"])))
    return frame


def moment_of(frame: MeshFrame, folder: Path, step: int = 7) -> Moment:
    path = folder / f"rock_{step:010d}.vtkhdf"
    write_mesh_frame(path, replace(frame, step=step), SerialComm())  # type: ignore[arg-type]
    return read_moment(path)


@pytest.mark.parametrize("make", [frames.blocks, frames.body])
def test_elements_are_coloured_by_what_has_happened_to_them(make, tmp_path: Path):
    def field(frame: MeshFrame) -> str:
        layer = default_view(moment_of(frame, tmp_path)).layer("elements")
        assert layer is not None
        return layer.field

    assert field(make()) == "displacement"
    still = unmoved(make())
    still.corners.columns["displacement_x"] += 1e-12  # rounding is no motion
    assert field(still) == ""
    stressed = unmoved(make(), stress_yy=-1e6)
    assert field(stressed) == ("stress_mises" if make is frames.body else "stress_yy")
    warm = unmoved(make())
    warm.corners.columns["temperature"] = 300.0 + np.arange(float(len(warm.corners.columns["x"])))
    assert field(warm) == "temperature"
    warm.corners.columns["temperature"][:] = 300.0
    assert field(warm) == ""


def test_groups_of_a_mesh_have_colours_that_differ_and_names(tmp_path: Path):
    moment = moment_of(unmoved(frames.blocks()), tmp_path)
    view = default_view(moment)
    layer = scene(moment, view).layers[0]
    assert layer.legend == [("base", PALE[0]), ("roof", PALE[1])] and layer.layer.edges
    shades = np.unique(layer.shades[layer.kind], axis=0)
    assert len(shades) == 2 and (np.abs(shades[0] - shades[1]).max() > 0.3)
    assert (rgb(PALE).max(axis=1) - rgb(PALE).min(axis=1) > 0.2).all()  # none is a shade of beige or grey


def test_channels_show_their_pressure_where_it_differs(tmp_path: Path):
    frame = frames.blocks()
    assert default_view(moment_of(frame, tmp_path)).layer("channels").field == ""  # type: ignore[union-attr]
    frame.joints.columns["fluid_pressure"] = np.array([1e6, 2e6, np.nan])
    assert default_view(moment_of(frame, tmp_path)).layer("channels").field == "fluid_pressure"  # type: ignore[union-attr]


def test_all_frames_of_a_folder_are_shown_by_the_same_field(tmp_path: Path):
    """The first frame has not moved, the last one has."""
    moment_of(unmoved(frames.blocks()), tmp_path, 0)
    moment_of(frames.blocks(), tmp_path, 10)
    run(tmp_path, "--save-view", tmp_path / "a.mv")
    layer = read_view(tmp_path / "a.mv").layer("elements")
    assert layer is not None and layer.field == "displacement" and layer.limits == pytest.approx((0.0, 0.9))
    viewer = Viewer(Sources([tmp_path]))
    assert viewer.about({"frame": -1})["view"]["layers"][0]["field"] == "displacement"


def test_one_colour_takes_the_place_of_the_field_of_the_default_view(tmp_path: Path):
    run(frames.write_blocks(tmp_path), "--object=elements", "--colour=#00ff00", "--save-view", tmp_path / "a.mv")
    layer = read_view(tmp_path / "a.mv").layer("elements")
    assert layer is not None and (layer.field, layer.colour) == ("", "#00ff00")


@pytest.mark.parametrize("dim", [2, 3])
def test_vectors_are_fields_by_length_and_component(dim: int, tmp_path: Path, capsys: pytest.CaptureFixture):
    path = frames.write_blocks(tmp_path, grown=0.3) if dim == 2 else frames.write_body(tmp_path)
    moment = read_moment(path)
    elements, axes = moment.of("elements"), "xyz"[:dim]
    names = [f"{vector}{end}" for vector in ("displacement", "velocity") for end in ("", *(f"_{a}" for a in axes))]
    assert [name for name in elements.known() if name in names] == names
    u = elements.vectors["displacement"]
    for k, axis in enumerate(axes):
        np.testing.assert_array_equal(elements.values(f"displacement_{axis}", ""), u[:, k])
    np.testing.assert_allclose(elements.values("displacement", ""), np.linalg.norm(u, axis=1), rtol=1e-14)
    with pytest.raises(HpcdemError, match="elements have no field displacement_w"):
        elements.values("displacement_w", "elements")
    run(path, "--list")
    said = capsys.readouterr().out
    assert "displacement_x           m" in said and "velocity_y               m/s" in said
    fields = Viewer(Sources([path])).fields({"object": "elements"})["fields"]
    assert ["displacement", "m"] in fields and ["velocity_x", "m/s"] in fields
    layer = Layer(object="elements", field="displacement_x", filter="displacement_x > 0.2 and velocity_y > 0")
    rows = chosen_rows(moment, layer)
    assert rows.tolist() == np.flatnonzero((u[:, 0] > 0.2) & (elements.vectors["velocity"][:, 1] > 0)).tolist()
    assert scene(moment, ModelView(layers=(layer,))).layers[0].scale.title.startswith("displacement x")  # type: ignore


def test_vectors_of_discs_and_walls_too(tmp_path: Path):
    moment = read_moment(frames.write_discs(tmp_path))
    assert {"velocity", "velocity_x", "force", "force_y"} <= set(moment.of("particles").known())
    assert moment.of("walls").values("force_y", "").tolist() == [2.0]
    np.testing.assert_array_equal(moment.of("particles").values("velocity_x", ""), np.arange(25.0))


def test_what_a_click_shows_has_units_by_size(tmp_path: Path):
    viewer = Viewer(Sources([frames.write_blocks(tmp_path, grown=0.3)]))
    view = ModelView(layers=(Layer(object="elements"),), camera=(3.0, 3.6, 2.6, 3.0)).model_dump()
    found = viewer.pick({"view": view, "width": 20, "height": 20, "column": 10, "row": 10})
    said = {name: text for name, _, _, text in found["values"]}
    assert said["stress_yy"] == "-10 MPa" and said["displacement"] == "948.683 mm (900, 300)"
    assert said["group_rock"] == "roof" and said["number"] == "9"


def test_an_arrow_says_how_long_a_value_is(tmp_path: Path):
    """Of velocities up to 9 m/s in the picture, a twentieth of it, 5 m/s; on the page a part of its width;
    of many frames the longest of all."""
    path = frames.write_blocks(tmp_path, grown=0.3)
    layer = Layer(object="elements", vectors="velocity", colour="#cccccc")
    view = ModelView(layers=(layer,), camera=(0.0, 3.0, 0.0, 3.0))
    shown = scene(read_moment(path), view)
    longest = max(np.hypot(*read_moment(path).of("elements").vectors["velocity"][:9].T))
    reference = shown.layers[0].reference
    assert reference is not None and reference.text == "velocity 5 m/s" and longest == pytest.approx(9.0)
    assert reference.length == pytest.approx(5.0 / 9.0 * 0.05 * 3.0)
    texts = texts_of(shown)
    assert "velocity 5 m/s" in texts
    assert "velocity 5 m/s" not in texts_of(scene(shown.moment, view.changed(legend=False)))
    legend = told(Viewer(Sources([path])), {"view": view.model_dump(), "width": 60, "height": 60})
    assert legend["arrow"] == "velocity 5 m/s" and legend["part"] == pytest.approx(reference.length / 3.0)
    both = shared(view, [read_moment(path), read_moment(path)])
    assert both.layers[0].longest == pytest.approx(10.0)
    faster = scene(read_moment(path), view.with_layer("elements", longest=100.0)).layers[0]
    assert faster.reference is not None and faster.reference.text == "velocity 100 m/s"
    assert faster.arrows is not None and np.hypot(*faster.arrows[1].T).max() == pytest.approx(0.09 * 0.15, rel=1e-6)


def test_beds_have_a_legend_by_group(tmp_path: Path):
    """From the highest to the lowest, with the colours that each has."""
    frame = frames.discs()
    particles = frame.tables["particles"].columns
    particles["group"] = np.where(particles["y"] > 2.5, 0, 1).astype(np.int32)
    particles["color"] = np.where(particles["y"] > 2.5, 3, np.where(particles["y"] > 1.5, 1, 2)).astype(np.int32)
    moment = of_particles(frame)
    shown = scene(moment, default_view(moment))
    assert shown.layers[0].legend == [("odd", "#ff0000"), ("even", "#00ff00 #ffff00")]
    texts = texts_of(shown)
    assert "odd" in texts and "even" in texts
    particles["color"][:], particles["group"][:] = 3, 1
    one = of_particles(frame)
    assert scene(one, default_view(one)).layers[0].legend == []


def test_vectors_of_bolts_are_means_of_their_ends(tmp_path: Path):
    frame = frames.blocks()
    nodes = frame.supports["bolts"]["nodes"]
    nodes |= {"displacement_x": np.array([0.0, 2.0, 4.0]), "displacement_y": np.array([1.0, 1.0, 3.0])}
    bolts = moment_of(frame, tmp_path).of("bolts")
    assert bolts.values("displacement_x", "").tolist() == [1.0, 3.0]
    assert bolts.values("displacement", "").tolist() == pytest.approx([2.0**0.5, 13.0**0.5])
    assert not moment_of(frame, tmp_path).of("liners").has("displacement")


def test_discs_have_moved_since_the_command_began(tmp_path: Path):
    """The last `_ini` frame before counts, whatever comes after; a disc that was not there yet has no displacement."""
    for step, ini, shift in ((0, True, 0.0), (10, False, 0.5), (10, True, 1.0), (20, False, 3.0), (20, True, 9.0)):
        frame = frames.discs(step, 25 if ini else 36)
        columns = frame.tables["particles"].columns
        columns["x"] = columns["x"] + shift
        write_vtkhdf(tmp_path / frame_name(step, ".vtkhdf", ini), frame, SerialComm())
    for step, far in ((10, 0.5), (20, 2.0)):
        discs = read_moment(tmp_path / frame_name(step, ".vtkhdf")).of("particles")
        moved = discs.values("displacement_x", "")
        # Discs are numbered along rows of 5 and of 6: the first row has the same places.
        np.testing.assert_allclose(moved[:5], far)
        assert np.isnan(moved[25:]).all() and np.isfinite(moved[:25]).all()
        assert discs.value("displacement", 0).tolist() == pytest.approx([far, 0.0])
    first = read_moment(tmp_path / frame_name(0, ".vtkhdf", True)).of("particles")
    assert not first.has("displacement")
    view = ModelView(layers=(Layer(object="particles", field="displacement", vectors="displacement"),))
    layer = scene(read_moment(tmp_path / frame_name(20, ".vtkhdf")), view).layers[0]
    assert layer.scale is not None and layer.scale.title == "displacement (m)"
