"""Scripts with elements that yield, on the real simulation."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.fdem import Project
from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.lang.pcdc.execute import Interpreter
from hpcdem.physics.fdem.simulation import Blocks

PILLAR = """
pcdc mesh structured (0,0) (1,2) cells 4 8 diagonal alternate
pcdc element c-model mech-m-c property den 2000 bulk 3.9e9 shear 2.8e9 fri 30 coh 3.45e6 ten 1e6 di 10
pcdc model option dynamic off
pcdc model option collision off
pcdc node boundary mech-vel-b-c velocity-y 0 range y -0.01 0.01
pcdc node boundary mech-vel-b-c velocity-y -2e-5 range y 1.99 2.01
pcdc history create 'flow' element id 3 value plastic-shear-strain every 50
"""


def run(folder: Path, *texts: str) -> Interpreter:
    project = Project(Blocks(outdir=folder / "data"), folder, folder / "data")
    interpreter = Interpreter(project)
    for k, text in enumerate(texts):
        interpreter.run(interpreter.read(text, f"part{k}.sc"))
    return interpreter


def test_a_pillar_yields_and_continues_from_a_file(tmp_path):
    """Stress and flow in frames and histories; what is saved in the middle of flow goes on bit for bit."""
    middle = "pcdc model step 300\npcdc model save 'a.sav'\n"
    rest = "pcdc model step 200\npcdc output vtk 'end'\n"
    whole = run(tmp_path, PILLAR + middle + rest).namespace["pcdc"]
    again = run(tmp_path, "pcdc model restore 'a.sav'\n" + rest).namespace["pcdc"]
    for name in ("stress_yy", "stress_zz", "plastic_shear_strain", "plastic_state", "plastic_work"):
        assert np.array_equal(whole.values("element", name), again.values("element", name)), name
    assert whole.element(3).plastic_shear_strain > 1e-4
    assert whole.history("flow")[-1, 2] == whole.element(3).plastic_shear_strain
    assert whole.values("element", "stress_yy").mean() == pytest.approx(-2.0 * 3.45e6 * 3.0**0.5, rel=0.01)
    (frame,) = (tmp_path / "data").glob("end*.vtkhdf")
    assert np.array_equal(read_mesh_frame(frame).of_elements["plastic_state"], whole.values("element", "plastic_state"))


def test_cohesion_that_softens(tmp_path):
    """By a table over plastic strain: the pillar bears what is left in the end."""
    soft = PILLAR.replace("coh 3.45e6", "coh table 'c' over plastic-strain")
    text = "pcdc table create 'c' values (0,3.45e6) (1e-3,1e6)\n" + soft + "pcdc model step 800\n"
    pcdc = run(tmp_path, text).namespace["pcdc"]
    assert pcdc.values("element", "stress_yy").mean() == pytest.approx(-2.0 * 1e6 * 3.0**0.5, rel=0.05)
    assert pcdc.values("element", "plastic_shear_strain").max() > 1e-3
    with pytest.raises(HpcdemError, match="expected one of x, y for 'over'"):
        run(tmp_path, text.replace("bulk 3.9e9", "bulk table 'c' over plastic-strain"))


def test_frames_of_elastic_models_are_as_they_were(tmp_path):
    elastic = PILLAR.replace("mech-m-c", "mech-iso-e").replace("coh 3.45e6 ten 1e6 di 10", "")
    run(tmp_path, elastic + "pcdc model step 1\npcdc output vtk 'end'\n")
    (frame,) = (tmp_path / "data").glob("end*.vtkhdf")
    assert not [name for name in read_mesh_frame(frame).of_elements if name.startswith("plastic")]


def test_changed_properties(tmp_path):
    """Each word that a property of this model has reaches it."""
    words = "friction 20 cohesion 2e6 tensile 5e5 dilation 5 damp-factor 0.1 density 2100"
    pcdc = run(tmp_path, PILLAR + f"pcdc element property {words}\n").namespace["pcdc"]
    for name, value in (
        ("friction", 20.0), ("element_cohesion", 2e6), ("element_tensile", 5e5), ("element_dilation", 5.0),
        ("damp_factor", 0.1), ("density", 2100.0), ("bulk", 3.9e9),
    ):  # fmt: skip
        assert pcdc.values("element", name) == pytest.approx(np.full(64, value)), name


def test_a_diagram_beside_the_plastic_strain(tmp_path):
    """The word `plastic` alone puts contours beside the curve, where the elements have flowed."""
    imread = pytest.importorskip("matplotlib.image").imread
    chart = "pcdc chart create 'c'\npcdc chart add 'c' y 'flow'\npcdc chart export 'c' 'c.png' {}\n"
    pictures = {}
    for word in ("", "cracks", "plastic"):
        folder = tmp_path / f"with {word}"
        folder.mkdir()
        run(folder, PILLAR + "pcdc model step 500\n" + chart.format(word))
        pictures[word] = imread(folder / "data" / "c.png")
    sizes = {word: picture.shape[1] for word, picture in pictures.items()}
    assert sizes[""] < min(sizes["cracks"], sizes["plastic"])
    left = pictures["plastic"][:, : sizes["plastic"] // 3, :3]
    coloured = (left.max(axis=2) - left.min(axis=2) > 0.1).mean()
    assert coloured > 0.1 and not np.array_equal(pictures["plastic"], pictures["cracks"])
    with pytest.raises(ScriptError, match="give only one of cracks"):
        run(tmp_path, PILLAR + "pcdc model step 50\n" + chart.format("cracks plastic"))
