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
        ("", "is not a view"), ("[]", 'expected "view": 1'), ("{}", 'expected "view": 1'),
        ('{"view": 2}', 'expected "v'),
        ("[" * 100_000, "is not a view"), ('{"view": 1, "camra": null}', "camra is not a word of a view; did you mean"),
        ('{"view": 1, "layers": {"a": 1}}', "layers: expected a list, read names and values"),
        ('{"view": 1, "layers": [[]]}', "layer 1: expected names and values, read a list"),
        ('{"view": 1, "layers": [{"object": "joints"}, {"opacity": 1}]}', "layer 2, object: expected a value"),
        ('{"view": 1, "layers": [{"object": "joints"}, {"object": "joints"}]}', "two have the name 'joints'"),
        ('{"view": 1, "axes": "perhaps"}', "axes: expected true or false, read 'perhaps'"),
        ('{"view": 1, "step": 1.5}', r"step: expected a whole number, read 1\.5"),
        ('{"view": 1, "camera": [1, 0, 0, 1]}', "left < right"), ('{"view": 1, "step": -1}', "step: expected"),
    ],
)  # fmt: skip
def test_what_is_no_view_is_refused_with_its_file(tmp_path: Path, text: str, message: str):
    path = tmp_path / "a.mv"
    path.write_text(text)
    with pytest.raises(HpcdemError, match=message) as caught:
        read_view(path)
    assert str(caught.value).startswith(str(path))
    assert not any(word in str(caught.value) for word in ("Input should", "valid", "layers.0", "inputs"))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ('"object": "elephants"', r"layer 1 \(elephants\), object: expected elements, .* or faults.*'elephants'"),
        ('"opacity": 2', r"layer 1 \(joints\), opacity: expected at most 1, read 2"),
        ('"name": "a", "opacity": "2 x"', r"layer 1 \(a\), opacity: expected a number, read '2 x'"),
        ('"opcity": 1', "opcity is not a word of a layer; did you mean 'opacity'"),
        ('"limits": [0, "x"]', "limits, value 2: expected a number, read 'x'"),
        ('"limits": [0]', "limits, value 2: expected a value"), ('"limits": [0, 1, 2]', "limits: 3, at most 2"),
        ('"limits": 2', "limits: expected two numbers or full, read 2"),
        ('"limits": [1, 1]', "limits: 1 is not below 1"),
        ('"limits": [0, 1], "log": true', "with log both must be above 0"),
        ('"colour": "red"', "colour: expected a colour such as #d0562a, read 'red'"),
        ('"size": Infinity', "size: expected a finite number, read inf"),
        ('"name": "' + 70 * "a" + '"', "name: expected at most 60 characters, read 'aaa"),
    ],
)  # fmt: skip
def test_what_is_no_layer_is_refused_with_its_place(tmp_path: Path, given: str, message: str):
    text = f'{{"view": 1, "layers": [{{"object": "joints", {given}}}]}}'  # of two objects the second is read
    test_what_is_no_view_is_refused_with_its_file(tmp_path, text, message)


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
