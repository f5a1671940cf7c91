"""One line: what is read, and what is refused with which words."""

from __future__ import annotations

import re

import pytest

from hpcdem.core.errors import ScriptError
from hpcdem.lang.pcdc import source
from hpcdem.lang.pcdc.kinds import TableName
from hpcdem.lang.pcdc.parser import parse
from hpcdem.lang.pcdc.statement import Statement
from hpcdem.lang.pcdc.table import COMMANDS, INSTEAD, PCDC
from tests.tables import each


def read(words: str) -> Statement:
    return parse(" " + words, "a.sc", 7, f"pcdc {words}", PCDC)


def resolved(words: str, *values):
    """Arguments and range with these values of the expressions."""
    return read(words).resolve(values)


def test_words_and_values():
    statement = read("el c-m mech-iso-e prop den 2500 y 50e9 P-R .25 d-f 1 ran group 'rock' set 'domain' x -1 +2.5")
    assert statement.command.name == "element c-model"
    assert statement.arguments == {
        "model": "mechanical-iso-elastic",
        "properties": {"density": 2500.0, "young": 50e9, "poisson-ratio": 0.25, "damp-factor": 1.0},
    }
    assert statement.range == (("group", {"value": "rock", "set": "domain"}), ("x", (-1.0, 2.5)))


@each(
    ("words", "arguments"),
    [
        ("model new", {}),
        ("model new dim 2", {"dim": 2}),
        ("model step 100000.0", {"steps": 100000}),
        ("model gravity (0,-9.81)", {"gravity": (0.0, -9.81)}),
        ("model option dynamic off collision TRUE", {"dynamic": False, "collision": True}),
        ("model time-step auto off", {"auto": False}),
        ("model restore 'a.sav'", {"file": "a.sav"}),
        ('model restore "out\\a.sav"', {"file": "out/a.sav"}),
        ("geom cr p (0,0)(1,2) ( 3 , 4 ) a-l 'x'", {"points": [(0.0, 0.0), (1.0, 2.0), (3.0, 4.0)], "as-layer": "x"}),
        ("table create 't' values (0,1)", {"name": "t", "values": [(0.0, 1.0)]}),
        ("element group '岩石'", {"group": "岩石"}),
        ("element group 'a [[b]] c'", {"group": "a [b] c"}),
        ("element group '#1'  # a comment", {"group": "#1"}),
        ("node boundary mech-m-b-c type 1", {"model": "mechanical-move-boundary-constraint",
                                             "properties": {"type": (1,)}}),
        ("node boundary mech-m-b-c type 2 (1,0)", {"model": "mechanical-move-boundary-constraint",
                                                   "properties": {"type": (2, (1.0, 0.0))}}),
        ("mesh create from-l 'o' size 2 refine-l 'h' size .1 refine-l 'g' size .2 dist 3 hole 'h'",
         {"from-layer": "o", "size": 2.0, "hole": ["h"],
          "refine-layer": [{"value": "h", "size": 0.1}, {"value": "g", "size": 0.2, "distance": 3.0}]}),
        ("element initial s-xx -1 grad (0,2) s-yy 3", {"stress-xx": {"value": -1.0, "gradient": (0.0, 2.0)},
                                                       "stress-yy": {"value": 3.0}}),
        ("chart exp 'c' 'c.png'", {"name": "c", "file": "c.png"}),
        ("chart exp 'c' 'c.png' crack", {"name": "c", "file": "c.png", "cracks": True}),
        ("history exp 'h.csv' names 'a' 'b'", {"file": "h.csv", "names": ["a", "b"]}),
        ("hist create 'h' node value reaction-y sum range boundary",
         {"name": "h", "object": "node", "value": "reaction-y", "sum": True}),
    ],
)  # fmt: skip
def test_arguments(words, arguments):
    assert dict(read(words).arguments) == arguments


def test_tables_stand_for_numbers_where_they_may():
    given = read("element-face boundary m-s-b-c s-n table 'blast'").arguments["properties"]
    assert given == {"stress-normal": TableName("blast")}
    with pytest.raises(ScriptError, match="read 'table', expected a number above 0 for 'ratio'"):
        read("model solve ratio table 'blast'")


def test_expressions_stand_where_values_and_their_parts_stand():
    statement = read("geom create polyline ([i],0) (-[i],[a[0]]) as-layer ['line'+ str(i)]")
    assert statement.expressions == ("i", "i", "a[0]", "'line'+ str(i)")
    arguments, _ = statement.resolve((3, 3, 5.0, "line3"))
    assert arguments == {"points": [(3.0, 0.0), (-3.0, 5.0)], "as-layer": "line3"}
    arguments, terms = resolved("node group 'a[i]b[j]' range id [n] x -[w] [w]", 1, "x", 4, 2.0, 2.0)
    assert arguments == {"group": "a1bx"} and terms == (("id", (4,)), ("x", (-2.0, 2.0)))
    assert resolved("model option dynamic [m_dyn]", True)[0] == {"dynamic": True}
    assert resolved("element-face boundary m-s-b-c s-n table ['t'+str(i)]", "t1")[0]["properties"] == {
        "stress-normal": TableName("t1")
    }


def test_a_list_stands_for_many_values():
    for given in ([(0, 0), (1, 2)], ((0, 0), (1, 2)), iter([(0, 0), (1, 2)])):
        assert resolved("table create 't' values [points]", given)[0]["values"] == [(0.0, 0.0), (1.0, 2.0)]
    assert resolved("table create 't' values [p]", (0, 5))[0]["values"] == [(0.0, 5.0)]
    assert resolved("table create 't' values [p] [q]", (0, 5), (1, 6))[0]["values"] == [(0.0, 5.0), (1.0, 6.0)]


@pytest.mark.parametrize(
    ("words", "values", "message"),
    [
        ("model step [n]", (1.5,), "read 1.5 from '[n]', expected a whole number, not negative for 'steps'"),
        ("model step [n]", (True,), "read True from '[n]', expected a whole number"),
        ("model step [n]", ("10",), "read '10' from '[n]', expected a whole number"),
        ("model solve ratio [r]", (float("nan"),), "read nan from '[r]', expected a number above 0"),
        ("model solve ratio [r]", (None,), "read None from '[r]'"),
        ("model gravity [g]", ((1, 2, 3),), "read (1, 2, 3) from '[g]', expected a vector (x,y)"),
        ("model gravity (0,-[g])", ("x",), "read 'x' from '-[g]', expected values that are not negative"),
        ("element group [name]", (3,), "read 3 from '[name]', expected a text in quotes for 'group'"),
        ("element group '[name]'", ("",), "read '' from '[name]', expected a text in quotes"),
        ("table create 't' values [p]", ([1, 2, 3],), "expected a list of vectors (x,y)"),
        ("table create 't' values [p]", (7,), "read 7 from '[p]'"),
        ("model option dynamic [d]", (2,), "expected on or off for 'dynamic'"),
        ("element group ['a'*100000]", (["a"] * 1000,), "expected a text in quotes"),
    ],
)
def test_values_of_the_wrong_kind(words, values, message):
    with pytest.raises(ScriptError) as caught:
        resolved(words, *values)
    assert str(caught.value).startswith(f"a.sc:7: pcdc {words}: ") and message in str(caught.value)
    assert len(str(caught.value)) < 400


BOLT = "den 7850 young 200e9 diam 0.02 s-s-r-b 1e9 g-t 0.01 c-r-g 1e6 c-g-b 1e6"
WATER = "property f-den 1000 f-bulk 2e9 vis 1e-6 a-initial 1e-5 a-min 1e-6"
REFUSED = [
    ("bolt create polyline (0,0)", "a bolt needs at least two points, got 1"),
    ("bolt create polyline (0,0) (0,0) (1,1)", "two consecutive points of the bolt coincide"),
    ("bolt create polyline (0,0) (1,1) segments 4 length 0.1", "segments and length cannot be combined"),
    ("bolt create polyline (0,0) (1,1) segments 0", "read '0', expected a whole number above 0 for 'segments'"),
    ("bolt create polyline (0,0) (1,1) grout -1 2", "read '-1', expected a number, not negative for 'grout'"),
    ("bolt create line (0,0) (1,1)", "read 'line' after 'bolt create'"),
    ("bolt c-model mech-e-p property density 1", "lacks y{oung}, d{iameter}"),
    ("bolt c-model mech-e-p property spacing 0", "read '0', expected a number above 0 for 'spacing'"),
    (f"bolt c-model mech-e-p property {BOLT} t-y-f 1e3 pre-f 2e3", "pretension-force must not be above"),
    (f"bolt c-model mech-e-p property {BOLT} f-r-g 90", "read '90', expected an angle from 0 to 89"),
    (f"bolt c-model mech-e-p property {BOLT} young table 'a' over x", "expected a number above 0"),
    (f"bolt c-model mech-e-p property {BOLT} range geometry 'a'", "read 'geometry' after"),
    (f"bolt c-model mech-e-p property {BOLT} range boundary", "read 'boundary' after"),
    ("bolt c-model mech-iso-elastic property density 1", "belongs to pcdc element c-model, not to 'bolt c-model'"),
    ("bolt-n boundary b-n-c", "needs at least one of"),
    ("face-joint c-model hydr-p-m property f-den 1", "lacks f{luid}-b{ulk}, vis{cosity}"),
    (f"face-joint c-model hydr-p-m {WATER} a-max 1e-7", "must not be above aperature-maximum"),
    (f"face-joint c-model hydr-p-m {WATER} leak-off on", "leak-off needs matrix-permeability"),
    (f"face-joint c-model hydr-p-m {WATER} m-permeability 1e-15", "needs leak-off, which is off"),
    ("face-joint c-model hydr-p-m aperture-initial -1", "expected a number, not negative"),
    ("node boundary hydra-c-f-b", "needs at least one of"),
    ("node boundary hydra-c-f-b pressure 1 flow-rate 2", "pressure and flow-rate cannot be combined"),
    ("flow-node initial", "needs at least one of"),
    ("flow-node initial pressure 1 saturation 1", "pressure and saturation cannot be combined"),
    ("flow-node initial saturation 1.5", "expected a number from 0 to 1"),
    ("flow-node initial pressure -1", "expected a number, not negative"),
    ("model sub-step", "needs at least one of"), ("model sub-step mechanical 0", "a whole number above 0"),
    ("model time-step hydraulic -1", "expected a number, not negative"),
    ("bolt-n boundary b-n-c velocity-x 1 acceleration-x 1", "cannot be combined"),
    ("", "the line ends where a command: model, geometry,"),
    ("foo bar", "read 'foo' after 'pcdc', expected one of model, geometry"),
    ("modle new", "did you mean 'model'?"),
    ("m new", "'m' is too short after 'pcdc'; it may mean model (at least 'mod'), mesh (at least 'mesh')"),
    ("model opt dyn off extra", "read 'extra' after 'model option', expected one of dynamic, collision"),
    ("model option dynamic", "the line ends where on or off for 'dynamic' is expected; end a continued line"),
    ("model option dynamic maybe", "read 'maybe', expected on or off for 'dynamic'"),
    ("model option", "'model option' needs at least one of dynamic, collision"),
    ("model option dynamic on dynamic off", "'dynamic' is given twice"),
    ("model new dim 4", "read '4', expected 2 or 3 for 'dim'"),
    ("model step 10 20", "read '20', expected the end of the line"),
    ("model step 10 range id 1", "'model step' does not accept a range"),
    ("model solve ratio m_ratio", "read 'm_ratio'; put variables and expressions of Python in square brackets: ["),
    ("model solve ratio 1e-6*2", "put variables and expressions of Python in square brackets: [1e-6*2]"),
    ("model solve ratio n", "put Python variables in brackets: [n]"),
    ("model solve ratio [1+]", "'[1+]' is not an expression of Python"),
    ("model solve ratio []", "read '[]', expected a Python expression"),
    ("model solve ratio [x", "does not end: ']' is missing"),
    ("model solve ratio [x]*2", "read '*2' directly after '[x]': put the whole expression in brackets"),
    ("model solve ratio [x = 1]", "is not an expression of Python"),
    ("model solve ratio -1", "read '-1', expected a number above 0 for 'ratio'"),
    ("model solve ratio 1e999", "this one is too large"),
    ("element-face c-model contact-m-c property penalty-normal 1e308",
     "read '1e308', expected a number above 0 for 'penalty-normal'; no number is larger than 1e+60"),
    ("model gravity (0,-1e308)", "no number is larger than 1e+60"),
    ("model solve ratio 0x10", "read '0x10'"),
    ("model solve ratio 1_000", "read '1_000'"),
    ("model step 12345678901234567890", "expected a number of fewer digits"),
    ("model gravity (0,-9.81", "does not end: ')' is missing"),
    ("model gravity (0;1)", "read '0;1', expected a keyword, a number"),
    ("model gravity (0 1)", "expected ',' or ')'"),
    ("model gravity (0,m_g)", "read 'm_g'; put variables"),
    ("model gravity (0,g)", "read 'g' in a vector, expected a number; put variables"),
    ("model gravity 0 -9.81", "read '0', expected a vector (x,y) for 'gravity'"),
    ("model gravity (0,0,-9.81)", "expected a vector (x,y) for 'gravity'"),
    ("model gravity（0，-9.81）", "is a full-width sign, expected '('"),
    ("model restore a", "expected the name of a file in quotes for 'file'; write 'a', or [a] for a variable of Python"),
    ("model restore 'a", "the text 'a does not end: ' is missing"),
    ("model restore 'data/'", "expected the name of a file"),
    ("element group 'a[i'", "in a text write [[ for a bracket"),
    ("element group 'a'range", "insert a blank"),
    ("element c-model", "the line ends where the name of a model: mechanical-iso-elastic, null"),
    ("element c-model mech-iso", "it may mean mechanical-iso-elastic (at least 'mech-iso-e')"),
    ("element c-model mech-iso-x", "read 'mech-iso-x' after 'element c-model', expected one of"),
    ("element c-model mech-iso-e y 1 p-r 0.2", "lacks den{sity}"),
    ("element c-model mech-iso-e den 1 y 1", "needs young and poisson-ratio or shear and bulk"),
    ("element c-model mech-iso-e den 1 y 1 p-r 0.5", "read '0.5', expected a number above -1, at most 0.4999"),
    ("element c-model mech-iso-e den 1 y 1 p-r 0.2 colour 3", "after 'element c-model mechanical-iso-elastic'"),
    ("element c-model null density 3", "read 'density' after 'element c-model null'"),
    ("element-face c-model contact-m-c p 3", "it may mean penalty-normal (at least 'p-n'), penalty-shear"),
    ("element-face boundary m-s-b-c", "needs at least one of stress-xx, stress-yy, stress-zz, stress-xy"),
    ("node group 'a' range", "the line ends where a term: group, set, id"),
    ("node group 'a' range colour 3", "read 'colour' after 'node group range', expected one of group, set, id, x, y"),
    ("node group 'a' range x", "the line ends where a number for 'x' is expected"),
    ("node group 'a' range id 1.5", "read '1.5', expected a whole number, not negative for 'id'"),
    ("mesh create from-layer 'a' size 1 region 'b' hole 'c' size 2", "'size' is given twice"),
    ("node group 'a' range z 1 2", "'z' is for three dimensions; model new dim 3 makes a model of three"),
    ("geometry create sphere (0,0) 1 as-layer 's'", "'geometry create sphere' is for three dimensions"),
    ("model gravity (0,0,-9.81)", "read '(0,0,-9.81)', expected a vector (x,y) for 'gravity'"),
    ("mesh structured (0,0) (1,1) cells 2 2 2", "read '2', expected a keyword after 'mesh structured'"),
    ("model option potential munjiza", "'potential' is for three dimensions"),
    ("element initial stress-xz 1", "'stress-xz' is for three dimensions"),
    ("element property kelvin-strain-zz 1", "'kelvin-strain-zz' is for three dimensions"),
    ("element c-model mech-bur property k-s-xz 1", "'kelvin-strain-xz' is for three dimensions"),
    ("element c-model mech-bur property k-s-yz 1", "'kelvin-strain-yz' is for three dimensions"),
    ("element group 'a' range between 'b' 'c'", "read 'between' after 'element group range'"),
    ("mesh create from-layer 'a'", "'mesh create' lacks size"),
    ("mesh create from-layer 'a' size 1 refine-layer 'b'", "'mesh create refine-layer' lacks size"),
    ("mesh create from-layer 'a' size 1 type hex", "expected one of tri, quad for 'type'"),
    ("table create 't' values", "the line ends where vectors (x,y) for 'values' is expected"),
    ("table create 't' values 3 4", "read '3', expected vectors (x,y) for 'values'"),
    ("history create 'h' node value stress-xx id 1", "a history of node can follow displacement, velocity, position-x"),
    ("history create 'h' node value reaction-y", "needs one of id, nearest and range"),
    ("history create 'h' node value reaction-y id 1 nearest (0,0)", "one of id, nearest and range, not id and nearest"),
    ("history create 'h' node value reaction-y range boundary", "needs sum, mean, minimum or maximum"),
    ("history create 'h' node value reaction-y sum id 3", "sum needs a range"),
    ("history create 'h' model value time id 3", "a history of the model does not accept id"),
    ("chart add 'c'", "a curve has either y, the name of a history, or values or profile, got none"),
    ("chart add 'c' values (0,0) scale-x 2", "scale-x applies to histories"),
    ("model time-step auto on value 1e-6", "cannot be combined"),
]  # fmt: skip


@each(("words", "message"), REFUSED, ids=[words or "nothing" for words, _ in REFUSED])
def test_refusals_name_file_line_text_and_what_was_expected(words, message):
    with pytest.raises(ScriptError) as caught:
        read(words)
    told = str(caught.value)
    assert told.startswith(f"a.sc:7: pcdc {words}: ") and message in told and "\n" not in told


def test_every_example_of_the_table_is_read():
    examples = [(command.name, text) for command in PCDC.commands for text in command.example]
    assert len(examples) > 50 and {name for name, _ in examples} == {c.name for c in PCDC.commands}
    for name, text in examples:
        if PCDC.command(name).refused:
            continue
        dim = 3 if PCDC.command(name).dims == (3,) or re.search(r"\(\S+?,\S+?,\S+?\)", text) else 2
        assert parse(text.removeprefix("pcdc"), "a.sc", 1, text, PCDC, dim=dim).command.name == name


REFUSED_IN_SPACE = [
    ("model gravity (0,-9.81)", "read '(0,-9.81)', expected a vector (x,y,z) for 'gravity'"),
    ("mesh structured (0,0,0) (1,1,1) cells 2 2", "the line ends where a whole number above 0 for 'cells' is expected"),
    ("mesh structured (0,0,0) (1,1,1) cells 2 2 2 type tri", "type tri: in three dimensions it is tet or hex"),
    ("geometry create rectangle (0,0) (1,1) as-layer 'c'",
     "'geometry create rectangle' is for two dimensions; in three dimensions use geometry create box"),
    ("element densify maximum-length 1", "for two dimensions; in three dimensions use mesh create"),
    ("element-face boundary m-s-b-c dip 1e5", "'dip' is for two dimensions; in three dimensions use stress-xy"),
]  # fmt: skip


@pytest.mark.parametrize(("words", "message"), REFUSED_IN_SPACE, ids=[words for words, _ in REFUSED_IN_SPACE])
def test_what_is_refused_in_three_dimensions(words, message):
    with pytest.raises(ScriptError) as caught:
        parse(" " + words, "a.sc", 7, f"pcdc {words}", PCDC, dim=3)
    assert message in str(caught.value)


def test_lines_are_read_for_the_model_above_them():
    """Also after a restored one, of which nobody knows: then both are read."""
    text = "pcdc model new dim 3\npcdc model gravity (0,0,-1)\npcdc model new\npcdc model gravity (0,-1)\n"
    assert len(source.read(text).statements) == 4
    text = "pcdc model restore 'a.sav'\npcdc model gravity (0,0,-1)\npcdc model gravity (0,-1)\n"
    assert len(source.read(text).statements) == 3
    with pytest.raises(ScriptError, match=r"script:2: .*expected a vector \(x,y,z\)"):
        source.read("pcdc model new dim 3\npcdc model gravity (0,-1)\n")
    with pytest.raises(ScriptError, match=r"script:3: .*expected a vector \(x,y\)"):
        source.read("pcdc model new dim 3\npcdc model new\npcdc model gravity (0,0,-1)\n")


def test_keywords_of_a_keyword_come_once_the_second_is_the_command_s() -> None:
    text = "pcdc mesh create from-layer 'a' size 2 region 'b' group 'c' group 'd' set 'e' refine-layer 'f' size 1\n"
    arguments = source.read(text).statements[0].arguments
    assert arguments["region"] == [{"value": "b", "group": "c"}] and arguments["group"] == {"value": "d", "set": "e"}
    assert arguments["size"] == 2.0 and arguments["refine-layer"] == [{"value": "f", "size": 1.0}]


def test_what_is_there_instead_is_there_in_space():
    """Words of the advice: commands of three dimensions, and words that are for two only."""
    plane = {command.name for command in COMMANDS if 3 not in command.dims}
    words = {
        str(o.keyword) for c in COMMANDS for o in (*c.options, *c.models, *(o for m in c.models for o in m.options))
    }
    for word, advice in INSTEAD.items():
        assert word in plane or word in words | {str(term.keyword) for term in PCDC.range_terms}, word
        assert not any(advice.startswith(name) for name in plane), word
