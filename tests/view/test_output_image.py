"""`output image` of a real model of blocks: the same picture on any number of ranks, each word by what it changes."""

from __future__ import annotations

from pathlib import Path

import pytest

from hpcdem.commands import present
from hpcdem.core.errors import HpcdemError
from hpcdem.post.view.moment import read_moment
from hpcdem.post.view.scene import default_view
from tests.conftest import Launcher
from tests.pcdc.test_plastic import run

pytestmark = pytest.mark.figures
MODEL = (
    "pcdc mesh structured (0,0) (2,1) cells 4 2 diagonal both group 'rock'\n"
    "pcdc element group 'left' set 'side' range x 0 1\n"
    "pcdc element c-model mech-iso-elastic property density 2500 young 20e9 p-r 0.2\n"
    "pcdc face-joint c-model c-i-c-i property cohesion 8e6 tensile-s 3e6 gf1 100 gf2 500 friction 30\n"
    "pcdc element-face c-model contact-m-c property friction 30\n"
    "pcdc element initial stress-yy -2e6 gradient (1e6,0)\n"
)
PLAIN = "field 'stress-yy' object elements"


@pytest.mark.slow
def test_each_word_alone_changes_the_picture(tmp_path: Path) -> None:
    (tmp_path / "a.mv").write_text('{"view": 1, "layers": [{"object": "joints", "field": "state"}]}')
    words = [
        "", "limits -3e6 0", "colours plasma", "opacity 0.5", "edges", "vectors 'displacement'", "filter 'x > 1'",
        "deformed 1e3", "camera (0,0) (1,1)", "title 'a'", "range group 'left' set 'side'", "range x 1 1.5",
    ]  # fmt: skip
    text = "pcdc model step 20\n" + "".join(f"pcdc output image 'p{k}.svg' {PLAIN} {w}\n" for k, w in enumerate(words))
    text += "pcdc output image 'view.svg' view 'a.mv'\npcdc output image 'size.svg' view 'a.mv' object joints size 3\n"
    text += "pcdc output image 'usual'\npcdc output image 'log.svg' field 'length' log\n"
    text += "pcdc output image 'linear.svg' field 'length'\n"
    run(tmp_path, MODEL + text)
    data = tmp_path / "data"
    pictures = [path.read_bytes() for path in data.glob("*_0000000020.svg")]
    assert len(pictures) == len(words) + 4 and len(set(pictures)) == len(pictures)
    assert (data / "usual_0000000020.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("dim", [2, 3])
def test_a_mesh_is_seen_before_it_has_a_model(tmp_path: Path, dim: int) -> None:
    """Its groups, by picture, by frame and for the page; to look at it says nothing of the model."""
    mesh = ["(0,0) (2,1) cells 4 2", "(0,0,0) (2,1,1) cells 4 2 2"][dim - 2]
    text = (
        f"pcdc model new dim {dim}\npcdc mesh structured {mesh} group 'rock'\n"
        "pcdc element group 'left' set 'side' range x 0 1\npcdc output image 'mesh.svg'\npcdc output vtk 'rock'\n"
        "pcdc mesh structured " + mesh.replace("(0,", "(3,").replace("(2,", "(5,") + " group 'more'\n"
        "pcdc output image 'both.svg' object elements range group 'more'\n"
    )
    project = run(tmp_path, text).project
    data = tmp_path / "data"
    first, both = ((data / f"{name}_0000000000.svg").read_text() for name in ("mesh", "both"))
    assert "left" in first and "in no group" in first and first != both
    moment = read_moment(data / "rock_0000000000.vtkhdf")
    assert moment.of("elements").count == len(project.whole_mesh().cells) / 2
    assert default_view(moment).layer("elements").field == ""  # type: ignore[union-attr]
    path = present.blocks(project)
    assert path is not None and read_moment(path).of("elements").count == len(project.whole_mesh().cells)
    assert not project.in_use


def test_cracks_of_a_mesh_are_seen_with_it(tmp_path: Path) -> None:
    text = (
        "pcdc mesh structured (0,0) (1,1) cells 4 4\npcdc geometry create polyline (0.25,0.5) (0.75,0.5) as-layer 'c'\n"
        "pcdc mesh intersect layer 'c'\npcdc output image 'mesh.svg'\n"
    )
    run(tmp_path, text)
    assert "initial" in (tmp_path / "data" / "mesh_0000000000.svg").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("field 'stres'", "this frame has no field stres; did you mean 'stress_zz'? It has elements: "),
        ("object bolts", "this frame has no bolts; it has elements, joints"),
        ("field 'stress-yy' object joints", "joints have no field stress_yy in this frame"),
        ("object elements filter 'nix > 1'", "filter 'nix > 1': unknown field nix"),
        ("object elements filter '__import__(1) > 1'", "unknown function __import__"),
        ("view 'none.mv'", "none.mv"), ("object elements opacity 3", "opacity"),
        ("field 'stress-yy' range x 0 1", "range needs object, one of elements, joints, channels"),
        ("edges", "edges requires field or object"), ("object walls", "this frame has no walls"),
        ("field 'aperture'", "this frame has no field aperture"), ("object spheres", "expected one of elements"),
        ("camera (1,0) (0,1)", "left < right"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_its_line(tmp_path: Path, words: str, message: str) -> None:
    with pytest.raises(HpcdemError) as caught:
        run(tmp_path, MODEL + f"pcdc model step 1\npcdc output image 'a' {words}\n")
    assert message in str(caught.value) and "output image" in str(caught.value)
    assert not list((tmp_path / "data").glob("a_*"))


@pytest.mark.slow
@pytest.mark.mpi
def test_the_same_picture_on_two_ranks(launch: Launcher, tmp_path: Path) -> None:
    mesh, rest = MODEL.split("pcdc element c-model")
    script = (
        mesh
        + "pcdc output image 'mesh'\npcdc element c-model"
        + rest
        + "pcdc model step 20\npcdc output image 'a' field 'displacement' vectors 'velocity'\n"
    )
    found = []
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        folder.mkdir()
        (folder / "a.sc").write_text(script)
        done = launch(ranks, "a.sc", "--no-figure", cwd=folder, env={"DISPLAY": ""})
        assert done.returncode == 0, done.stderr
        found.append([(folder / "data" / name).read_bytes() for name in ("mesh_0000000000.png", "a_0000000020.png")])
    assert found[0] == found[1]
