"""What a view is: read back as it was written, and refused by name where it makes no sense."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.post.view.model import Layer, ModelView, read_view, save_view

FULL = ModelView(
    layers=(
        Layer(object="elements", name="rock", field="stress_yy", limits=(-1e6, 0.0), colours="blue-red", opacity=0.5,
              edges=True, filter="x > 1", vectors="velocity", arrows=2.0),
        Layer(object="joints", visible=False, colour="#112233", size=3.0),
        Layer(object="channels", field="aperture", log=True),
    ),
    camera=(0.0, 1.0, -1.0, 1.0), deformed=10.0, title="岩体 {step}", axes=False, legend=False, step=12,
)  # fmt: skip


def test_a_file_holds_all_of_a_view(tmp_path: Path):
    for name, view in (("full", FULL), ("empty", ModelView())):
        save_view(tmp_path / f"{name}.mv", view)
        assert read_view(tmp_path / f"{name}.mv") == view
    assert "岩体" in (tmp_path / "full.mv").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "is no view"), ("[]", 'expected "view": 1'), ("{}", 'expected "view": 1'), ('{"view": 2}', 'expected "v'),
        ("[" * 100_000, "is no view"), ('{"view": 1, "camra": null}', "camra: Extra inputs"),
        ('{"view": 1, "layers": [{"object": "elephants"}]}', "layers.0.object"),
        ('{"view": 1, "layers": [{"object": "joints", "opacity": 2}]}', r"layers.0.opacity: .*read '2'"),
        ('{"view": 1, "layers": [{"object": "joints", "limits": [1, 1]}]}', "1 is not below 1"),
        ('{"view": 1, "layers": [{"object": "joints", "limits": [0, 1], "log": true}]}', "with log both are above 0"),
        ('{"view": 1, "layers": [{"object": "joints", "colour": "red"}]}', "layers.0.colour"),
        ('{"view": 1, "layers": [{"object": "joints", "size": Infinity}]}', "layers.0.size"),
        ('{"view": 1, "layers": [{"object": "joints"}, {"object": "joints"}]}', "two are called 'joints'"),
        ('{"view": 1, "camera": [1, 0, 0, 1]}', "left below right"), ('{"view": 1, "step": -1}', "step: "),
    ],
)  # fmt: skip
def test_what_is_no_view_is_refused_with_its_file(tmp_path: Path, text: str, message: str):
    path = tmp_path / "a.mv"
    path.write_text(text)
    with pytest.raises(HpcdemError, match=message) as caught:
        read_view(path)
    assert str(caught.value).startswith(str(path))


def test_files_that_cannot_be_read(tmp_path: Path):
    with pytest.raises(HpcdemError, match=r"a\.mv"):
        read_view(tmp_path / "a.mv")
    (tmp_path / "b.mv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(HpcdemError, match="is not text"):
        read_view(tmp_path / "b.mv")


def test_only_what_differs_is_written(tmp_path: Path):
    save_view(tmp_path / "a.mv", ModelView(layers=(Layer(object="joints", edges=True),)))
    assert json.loads((tmp_path / "a.mv").read_text()) == {
        "view": 1, "layers": [{"object": "joints", "edges": True}]
    }  # fmt: skip
