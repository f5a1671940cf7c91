"""What is wrong is said where it can be mended: models at the wrong object, words as scripts have them, names that no
line makes, heat in a part of the elements."""

from __future__ import annotations

from pathlib import Path

import pytest

from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.lang.pcdc import check
from hpcdem.lang.pcdc.trial import hyphened
from tests.pcdc.test_excavation import Desk

BOX = "pcdc mesh structured (0,0) (4,2) cells 4 2 group 'rock' set 'domain'\n"


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("element c-model contact-m-c property friction 30",
         "'contact-m-c' (contact-mohr-coulomb) belongs to pcdc element-face c-model, not to 'element c-model', which"),
        ("node boundary m-s-b-c stress-xx 1e6",
         "(mechanical-stress-boundary-condition) belongs to pcdc element-face boundary, not to 'node boundary'"),
        ("element-face boundary mech-vel-b-c velocity-x 0", "belongs to pcdc node boundary"),
        ("element c-model c-i-c-i property friction 30", "belongs to pcdc face-joint c-model"),
        ("face-joint c-model mech-iso-e property density 1", "belongs to pcdc element c-model"),
        ("node boundary therm-c-h flux 1", "belongs to pcdc element-face boundary"),
        ("face-joint c-model nonsense", "expected one of"),
    ],
)  # fmt: skip
def test_the_right_model_at_the_wrong_object(line, told):
    with pytest.raises(ScriptError) as error:
        check.read(f"pcdc {line}\n", "wrong.sc")
    assert told in str(error.value) and "wrong.sc:1" in str(error.value)


def test_words_with_hyphens_are_reported_with_hyphens(tmp_path: Path):
    assert hyphened("tensile_strength 'tensile_strength' of m_my_name, my_file.py") == (
        "tensile-strength 'tensile_strength' of m_my_name, my_file.py"
    )
    with pytest.raises(ScriptError) as error:
        check.read("pcdc element c-model mech-iso-e property density 1 young 1 poisson-ratio 0.7\n", "a.sc")
    assert "poisson-ratio" in str(error.value) and "poisson_ratio" not in str(error.value)
    desk = Desk(tmp_path)(BOX + "pcdc element c-model mech-iso-e property density 1 young 1e9 poisson-ratio 0.2\n")
    for line, word in (
        ("element property poisson-ratio [0.3 + 0.3]", "poisson-ratio"),
        ("face-joint c-model c-i-c-i property friction 30 cohesion 1e6 tensile-strength [-1] gf1 1 gf2 1",
         "tensile-strength"),
        ("history create 'a' element value [str('opening')] sum", "stress-xx"),
    ):  # fmt: skip
        with pytest.raises(HpcdemError) as told:
            desk(f"pcdc {line}\n")
        assert word in str(told.value).split(": ", 2)[-1] and word.replace("-", "_") not in str(told.value)


def test_names_that_no_line_makes():
    text = (
        BOX + "pcdc node group 'top' range y 2 2\npcdc element c-model mech-iso-e property density 1 young 1 p-r 0 "
        "range group 'rock' set 'domain'\n"
        "pcdc node boundary mech-m-b-c type 1 range group 'tip'\n"
        "pcdc element-face c-model contact-m-c property friction 30 range face-of 'rock'\n"
        "pcdc face-joint property friction 20 range between 'rock' 'cap' set 'domain'\n"
        "pcdc node boundary mech-m-b-c type 1 range set 'bc'\npcdc element group 'a' range geometry 'line'\n"
        "pcdc history create 'h' node value reaction-y sum range group 'bottom'\n"
    )
    said = [line for line in check.summary(text, "a.sc").splitlines() if line.startswith("warning")]
    assert said == [
        "warning: line 4: no line creates the group 'tip' of nodes in set 'default'",
        "warning: line 5: no line creates the group 'rock' of elements in set 'default'",
        "warning: line 6: no line creates the group 'cap' of elements in set 'domain'",
        "warning: line 7: no line creates the set 'bc' of nodes",
        "warning: line 8: no line creates the geometry layer 'line'",
        "warning: line 9: no line creates the group 'bottom' of nodes in set 'default'",
    ]
    unknown = text.replace("node group 'top'", "node group [name]")
    assert not any("of nodes" in line for line in check.summary(unknown, "a.sc").splitlines())
    assert "warning" not in check.summary(text + "pcdc mesh import 'x.msh'\n", "a.sc")


@pytest.mark.parametrize("run", ["model solve elastic", "model solve thermal steady", "model step 1"])
def test_heat_in_a_part_of_the_elements(tmp_path: Path, run):
    desk = Desk(tmp_path)(
        BOX + "pcdc element c-model mech-iso-e property density 2400 young 2e10 poisson-ratio 0.25\n"
        "pcdc element c-model therm-iso-h property conductivity 3 capacity 900 expansion-coeficient 1e-5 range x 0 2\n"
        "pcdc node boundary mech-m-b-c type 1 range y 0 0\npcdc node initial temperature 20\n"
    )
    if "solve" in run:
        desk("pcdc model option dynamic off\n")
    with pytest.raises(
        HpcdemError, match=r"element \d+ at \(2.*\) has no thermal model \(\d+ in all\), but other elements have one"
    ):
        desk(f"pcdc {run}\n")
