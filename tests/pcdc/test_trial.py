"""Values that no model could make right are refused by --check, with their line; as expressions they are refused when
the line is carried out."""

from __future__ import annotations

import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.lang.pcdc import check
from tests.tables import each

ROCK = "element c-model mech-iso-e property density 2500 "
JOINT = "face-joint c-model c-i-c-i property cohesion 1e6 tensile-strength 1e6 "
SOIL = "element c-model mech-m-c property density 2000 young 1e8 poisson-ratio 0.3 cohesion 1e4 "
REFUSED = [
    (JOINT + "gf1 1 gf2 1 np 7", "expected 3, the points of a joint"),
    (JOINT + "gf1 0 gf2 1", "gf1 must be > 0"), (JOINT + "gf1 1 gf2 0", "gf2 must be > 0"),
    (JOINT + "gf1 1 gf2 1 friction 89.5", "expected an angle from 0 to 89 [degrees] for 'friction'"),
    ("node boundary mech-m-b-c type 3", "expected 0 free, 1 fixed or 2"),
    ("node boundary mech-m-b-c type -1", "0 free, 1 fixed or 2"),
    ("node boundary mech-m-b-c type 2", "type 2 needs the vector"),
    ("node boundary mech-m-b-c type 2 (0,0)", "type 2 needs the vector"),
    ("node boundary mech-vel-b-c velocity-x 1 acceleration-x 2", "velocity-x and acceleration-x cannot be combined"),
    ("node boundary mech-vel-b-c velocity-y table 'v' acceleration-y 2", "velocity-y and acceleration-y cannot be"),
    (ROCK + "young 1e9 poisson-ratio 0.49995", "expected a number above -1, at most 0.4999 for 'poisson-ratio'"),
    (ROCK + "young 1e9 poisson-ratio 0.3 shear 1e9", "needs two of"),
    ("element property young 1e9 shear 0.2e9", "Poisson's ratio 1.5"),
    ("element property friction 89.9", "expected an angle from 0 to 89 [degrees] for 'friction'"),
    (SOIL + "tensile 1 friction 20 dilation 30", "dilation must not be above friction (20 degrees), got 30"),
    (SOIL + "tensile -1", "expected a number, not negative"),
    ("element property cohesion -1", "expected a number, not negative"),
    ("element-face c-model contact-m-c property damping-b 0.5", "expected a number, at least 1 for 'damping-b'"),
    ("element-face property damping-b 0.5", "expected a number, at least 1 for 'damping-b'"),
    ("model new dim 1", "expected 2 or 3"),
    ("model time-step safety 1.01", "at most 1"),
    ("geometry create polyline (0,0) as-layer 'a'", "1 points given, at least 2"),
    ("geometry create polygon (0,0) (1,1) (1,0) (0,1) as-layer 'a'", "cross or touch"),
    ("geometry create rectangle (0,0) (0,1) as-layer 'a'", "span no area"),
    ("geometry create arc (0,0) 1 30 390 as-layer 'a'", "are equal: use 'circle' for a full circle"),
    ("geometry create fractures orientation fixed 0 length fixed 1 inside 'a' seed 1 as-layer 'b'", "one density"),
    ("geometry create fractures orientation fixed 0 length fixed 1 p21 1 p20 1 inside 'a' seed 1 as-layer 'b'",
     "one density"),
    ("geometry create fractures orientation fixed 0 length power 2 p21 1 inside 'a' seed 1 as-layer 'b'",
     "a power law needs a least length"),
    ("geometry create fractures orientation fixed 0 length lognormal 2 p21 1 inside 'a' seed 1 as-layer 'b'",
     "positive standard deviation"),
    ("geometry create fractures orientation fixed 0 length fixed 1 p21 1 ends-at 1.5 inside 'a' seed 1 as-layer 'b'",
     "from 0 to 1"),
    ("geometry create fractures orientation fixed 0 length fixed 1 p10 1 reached inside 'a' seed 1 as-layer 'b'",
     "only p20 and p21"),
    ("mesh structured (0,0) (1,0) cells 2 2", "upper bound above the lower"),
    ("mesh structured (0,0) (1,1) cells 200 2 ratio 1e9 1", "differ too much"),
    ("mesh equilateral (0,0) (0,1) size 0.1", "upper bound above the lower"),
    ("table create 't' values (0,0) (2,1) (1,1)", "times must ascend"),
    ("history create 'a/b' model value time", "cannot be part of a file name"),
    ("chart export 'c' 'c.gif'", "*.png, *.pdf or *.svg"), ("output vtk 'a/b'", "cannot contain a folder"),
    ("element group 'a' range id 5 3", "id 5 3: the first is above the second"),
    ("element group 'a' range y 1 -1", "y 1 -1: the first is above the second"),
]  # fmt: skip


@each(("line", "told"), REFUSED, ids=[line[:40] for line, _ in REFUSED])
def test_check_refuses_the_line(line, told):
    with pytest.raises(HpcdemError) as error:
        check.summary(f"x = 1\npcdc {line}\n", "script.sc")
    assert str(error.value).startswith("script.sc:2: ") and told in str(error.value)


def test_expressions_are_left_to_the_run(bench):
    """The same values behind brackets: --check cannot know them, the commands refuse them."""
    text = (
        "pcdc mesh structured (0,0) (4,2) cells 4 2 diagonal right\n"
        "pcdc element c-model mech-iso-e property den 2500 y 1e9 p-r 0.2\nn = 7\n"
    )
    lines = [
        "face-joint c-model c-i-c-i property cohesion 1e6 tensile-strength 1e6 gf1 1 gf2 1 np [n]",
        "node boundary mech-m-b-c type [n - 4]", "node boundary mech-m-b-c type 2 ([n - 7],0)",
        "geometry create rectangle (0,0) ([n - 7],1) as-layer 'a'", "table create 't' values (0,0) ([n],1) ([n - 1],1)",
        "geometry create arc (0,0) 1 [n] [n] as-layer 'a'", "element group 'a' range id [n] 3",
    ]  # fmt: skip
    for line in lines:
        assert "1 commands read" in check.summary(f"n = 7\npcdc {line}\n", "script.sc")
        with pytest.raises(HpcdemError, match=r"\.sc:"):
            bench(text + f"pcdc {line}\n")
        bench("pcdc model new\n")


def test_what_is_right_in_some_model_is_read():
    right = [
        "element property young 1e9", "element property young table 't' over y poisson-ratio 0.3 friction field 'f'",
        "element property shear 1e9 bulk 2e9", "face-joint property gf1 0",
        "face-joint property tensile-strength 1e6", ROCK + "young [E] poisson-ratio 0.3",
        "node boundary mech-vel-b-c velocity-x table 'v' acceleration-y 2", "node boundary mech-m-b-c type 1 (0,0)",
        JOINT.replace("1e6", "0") + "gf1 0 gf2 0 np 3", "geometry create point (1,1) (2,2) as-layer 'p'",
        "element group 'a' range id 5", "mesh structured (1,1) (0,0) cells 2 2 ratio 1.1 1",
        "geometry create fractures orientation fisher 30 spread 20 length power 2 least 1 greatest 3 p21 1 "
        "inside 'a' seed 1 as-layer 'b'",
    ]  # fmt: skip
    for line in right:
        assert "1 commands read" in check.summary(f"pcdc {line}\n", "script.sc")
