"""Frames of models that declared units other than SI: pictures, lists and the page call their values by these."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.io.vtkhdf import write_vtkhdf
from hpcdem.io.vtkhdf_mesh import read_mesh_frame, write_mesh_frame
from hpcdem.page.sources import Sources
from hpcdem.page.viewer import Viewer
from hpcdem.post import blocks, plots
from hpcdem.post.view.model import Layer, ModelView
from hpcdem.post.view.moment import read_moment
from hpcdem.post.view.paper import figure_of
from hpcdem.post.view.scene import scene
from tests.pcdc.test_plastic import run
from tests.view import frames

pytestmark = pytest.mark.figures


def said(figure) -> set[str]:
    from matplotlib.text import Text

    return {text.get_text() for text in figure.findobj(Text)}


def test_blocks(tmp_path: Path) -> None:
    """In mm, t and s stresses are in MPa: -10 is no small number of Pa."""
    frame = replace(frames.blocks(), units="mm-mpa-s")
    frame.elements.columns["stress_yy"] = frame.elements.columns["stress_yy"] / 1e6
    frame.elements.columns["stress_xx"] = frame.elements.columns["stress_xy"] = (
        0.0 * frame.elements.columns["stress_yy"]
    )
    path = tmp_path / "rock_0000000007.vtkhdf"
    write_mesh_frame(path, frame, SerialComm())  # type: ignore[arg-type]
    moment = read_moment(path)
    view = ModelView(layers=(Layer(object="elements", field="stress_yy", vectors="velocity"),))
    assert {"stress yy (MPa)", "x (mm)", "y (mm)", "velocity 10 mm/s"} <= said(figure_of(scene(moment, view)))
    state = replace(read_mesh_frame(path), supports={})
    assert {"compressive stress (MPa)", "x (mm)"} <= said(blocks.draw(state, blocks.Appearance(panels=("stress",))))
    viewer = Viewer(Sources([path]))
    assert ["displacement", "mm"] in viewer.fields({"object": "elements"})["fields"]
    assert viewer.about({})["lengths"] == [(0.0, 1.0, "mm")]
    found = viewer.pick({"view": view.model_copy(update={"camera": (3.0, 3.6, 2.6, 3.0)}).model_dump(), "width": 20,
                         "height": 20, "column": 10, "row": 10})  # fmt: skip
    assert {name: text for name, *_, text in found["values"]}["stress_yy"] == "-10 MPa"


def test_discs(tmp_path: Path) -> None:
    frame = frames.discs()
    frame.settings["units"] = "km-mpa-s"
    path = tmp_path / "all_0000000003.vtkhdf"
    write_vtkhdf(path, frame, SerialComm())
    moment = read_moment(path)
    view = ModelView(layers=(Layer(object="particles", field="velocity"),))
    assert {"velocity (km/s)", "x (km)"} <= said(figure_of(scene(moment, view)))
    assert "x (km)" in said(plots.frame_figure(frame))


def test_scripts_say_it(tmp_path: Path) -> None:
    """And a script in SI, said or not, leaves the same file."""
    text = (
        "pcdc mesh structured (0,0) (2,1) cells 2 1\n{}"
        "pcdc element c-model mech-iso-elastic property density {} young {} p-r 0.2\npcdc output vtk 'rock'\n"
    )
    data = {}
    for name, words, values in (("", "", ("2500", "20e9")), ("si", "pcdc model units si\n", ("2500", "20e9")),
                                ("mm", "pcdc model units mm-MPa-s\n", ("2.5e-9", "20e3"))):  # fmt: skip
        folder = tmp_path / f"of_{name}"
        folder.mkdir()
        run(folder, text.format(words, *values))
        data[name] = folder / "data" / "rock_0000000000.vtkhdf"
    assert data[""].read_bytes() == data["si"].read_bytes()
    assert (
        read_moment(data["mm"]).unit_of("stress_yy") == "MPa" and read_moment(data["si"]).unit_of("stress_yy") == "Pa"
    )
