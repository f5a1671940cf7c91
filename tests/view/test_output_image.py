"""`output image` of a real model of blocks: the same picture on any number of ranks, each word by what it changes."""

from __future__ import annotations

from pathlib import Path

import pytest

from hpcdem.core.errors import HpcdemError
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


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("field 'stres'", "this frame has no field stres; it has elements: "),
        ("object bolts", "this frame has no bolts; it has elements, joints"),
        ("field 'stress-yy' object joints", "joints have no field stress_yy in this frame"),
        ("object elements filter 'nix > 1'", "filter 'nix > 1': there is no field nix"),
        ("object elements filter '__import__(1) > 1'", "there is no function __import__"),
        ("view 'none.mv'", "none.mv"), ("object elements opacity 3", "opacity"),
        ("field 'stress-yy' range x 0 1", "range goes with object, one of elements, joints, channels"),
        ("edges", "edges goes with field or object"), ("object walls", "this frame has no walls"),
        ("field 'aperture'", "this frame has no field aperture"), ("object spheres", "expected one of elements"),
        ("camera (1,0) (0,1)", "left below right"),
    ],
)  # fmt: skip
def test_what_cannot_be_is_refused_with_its_line(tmp_path: Path, words: str, message: str) -> None:
    with pytest.raises(HpcdemError) as caught:
        run(tmp_path, MODEL + f"pcdc model step 1\npcdc output image 'a' {words}\n")
    assert message in str(caught.value) and "output image" in str(caught.value)
    assert not list((tmp_path / "data").glob("a_*"))


@pytest.mark.mpi
def test_the_same_picture_on_two_ranks(launch: Launcher, tmp_path: Path) -> None:
    script = MODEL + "pcdc model step 20\npcdc output image 'a' field 'displacement' vectors 'velocity'\n"
    found = []
    for ranks in (1, 2):
        folder = tmp_path / str(ranks)
        folder.mkdir()
        (folder / "a.sc").write_text(script)
        done = launch(ranks, "a.sc", "--no-figure", cwd=folder, env={"DISPLAY": ""})
        assert done.returncode == 0, done.stderr
        found.append((folder / "data" / "a_0000000020.png").read_bytes())
    assert found[0] == found[1]
