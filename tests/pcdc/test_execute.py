"""Scripts are run: expressions, errors, commands."""

from __future__ import annotations

import inspect

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError, ScriptError
from hpcdem.lang.pcdc.bindings import CONVERTERS, argument, takes
from hpcdem.lang.pcdc.table import PCDC

BOX = "pcdc mesh structured (0,0) (4,2) cells 4 2 diagonal right group 'rock' set 'domain'\n"


def failure(bench, text: str) -> str:
    with pytest.raises(HpcdemError) as caught:
        bench(text)
    return str(caught.value)


def test_every_command_and_model_has_a_function_that_takes_its_words():
    used = set()
    for command in (c for c in PCDC.commands if not (c.idle or c.refused)):
        for row in command.models or (command,):
            if row.does in CONVERTERS:
                used.add(row.does)
                continue
            wanted = takes(row.does)
            options = row.options if "properties" not in wanted else ()
            words = {argument(o.name) for o in (*row.leading, *options) if not o.refused}
            words |= {argument(w.name) for o in options if o.values and not o.repeated for w in o.more}
            words |= {name for name, _ in row.fixed}
            others = {name for name in wanted if wanted[name].kind is not inspect.Parameter.VAR_KEYWORD}
            assert words <= others or len(others) < len(wanted), (command.name, row.does, words - others)
            needed = {name for name in others if wanted[name].default is inspect.Parameter.empty}
            assert needed <= words | {"kind", "name", "properties", "where"}, (command.name, row.does, needed - words)
    assert used == set(CONVERTERS)


def test_the_loop_of_the_manual(bench):
    bench("pcdc model new\nfor i in range(1,10):\n"
          "    pcdc geometry create polyline ([i],0) (0,[i]) as-layer ['line'+ str(i)]\n")  # fmt: skip
    assert list(bench.project.layers) == [f"line{i}" for i in range(1, 10)]
    assert bench.project.layers["line7"][0].points.tolist() == [[7.0, 0.0], [0.0, 7.0]]


def test_expressions_see_what_python_sees_there(bench):
    bench(
        "def outer(a):\n"
        "    b = 2 * a\n"
        "    def inner(c):\n"
        "        pcdc geometry create polyline ([a],[b]) ([c],[m_g]) as-layer 'x'\n"
        "    inner(b + 1)\n"
        "m_g = 9\n"
        "outer(3)\n"
        "class Maker:\n"
        "    size = 4\n"
        "    def __init__(self):\n"
        "        pcdc geometry create polyline (0,0) ([self.size],[Maker.size]) as-layer 'y'\n"
        "Maker()\n"
        "v = Vector(1, 2)\n"
        "pcdc geometry create polyline [v] [2*v] [(v.X, v.Y + 7)] as-layer 'z'\n"
        "pcdc geometry create polyline [[Vector(k, k*k) for k in range(4)]] as-layer 'w'\n"
    )
    points = {name: bench.project.layers[name][0].points.tolist() for name in "xyzw"}
    assert points["x"] == [[3, 6], [7, 9]] and points["y"] == [[0, 0], [4, 4]]
    assert points["z"] == [[1, 2], [2, 4], [1, 9]] and points["w"] == [[0, 0], [1, 1], [2, 4], [3, 9]]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("pcdc model new\npcdc node group 'a' range x 0 1\n",
         "script.sc:2: pcdc node group 'a' range x 0 1: no mesh yet"),
        ("for i in range(3):\n    n = i - 2\n    pcdc model step [n]\n",
         "script.sc:3: pcdc model step [n]: read -2 from '[n]', expected a whole number, not negative"),
        ("def m_f(n):\n    pcdc geometry delete 'x[n]'\ndef m_g():\n    m_f(4)\n\nm_g()\n",
         "script.sc:2: pcdc geometry delete 'x[n]': there is no geometry layer 'x4' (layers so far: none) "
         "(called from lines 4, 6)"),
        ("x = 1\npcdc model step [nothing]\n",
         "script.sc:2: pcdc model step [nothing]: NameError: name 'nothing' is not defined"),
        ("def m_f():\n    pcdc model step [1/0]\nm_f()\n",
         "script.sc:2: pcdc model step [1/0]: ZeroDivisionError: division by zero (called from line 3)"),
        ("pcdc geometry create circle (0,0) \\\n   [a] \\\n   as-layer 'x'\n", "script.sc:1: pcdc geometry create"),
        ("pcdc element-face boundary m-s-b-c s-n table 'blast'\n", "there is no table 'blast'; available: none so far"),
        ("pcdc element group 'rock' range set 'none'\n", "no mesh yet"),
        (BOX + "pcdc element group 'a' range group 'rok' set 'domain'\n",
         "set 'domain' has no group 'rok' of elements; it has 'rock'"),
        (BOX + "pcdc element group 'a' range group 'rock'\n",
         "there is no set 'default' of elements; available: 'domain'"),
        (BOX + "pcdc node group 'a' range x 9 10\n", "the range selects no node"),
        (BOX + "pcdc node group 'a' range id 99\n", "there is no node 99; numbers range from 0 to 14"),
        (BOX + "pcdc node group 'a' range geometry 'rim'\n",
         "there is no geometry layer 'rim'; available: 'left', 'right', 'bottom', 'top'"),
        (BOX + "pcdc node boundary mech-m-b-c type 2\n", "type 2 needs the vector"),
        (BOX + "pcdc node boundary mech-m-b-c type 3 (1,0)\n", "3 is for three"),
        (BOX + "pcdc element c-model null\n", "this would remove all elements"),
        (BOX + "pcdc node reset velocity\n" + BOX, "all bodies are meshed before the first of them is assigned"),
        (BOX + "pcdc mesh intersect layer 'top'\n", "no joint lies on layer 'top'"),
        ("pcdc history export 'h.csv'\n", "no histories to write"),
        ("pcdc chart export 'c' 'c.png'\n", "there is no chart 'c'; available: none so far"),
        ("pcdc output vtk 'a/b'\n", "cannot contain a folder"),
        ("pcdc model restore 'none.sav'\n", "there is no such file"),
    ],
)  # fmt: skip
def test_errors_name_file_line_and_text(bench, text, message):
    assert message in failure(bench, text)


def test_python_that_fails_shows_its_traceback(bench):
    told = failure(bench, "def f(x):\n    return 1 / x\n\npcdc model new\nf(0)\n")
    assert told.startswith("script.sc ended with an error\n") and "ZeroDivisionError" in told
    assert 'File "script.sc", line 5' in told and 'File "script.sc", line 2, in f' in told
    assert "return 1 / x" in told and "execute.py" not in told


def test_the_trace_shows_commands_as_they_were_written(bench):
    told = failure(bench, "def f():\n    pcdc model new\n    raise ValueError('no')\nf()\n")
    assert "raise ValueError('no')" in told and "__pcdc__" not in told


def test_an_error_of_the_program_itself_is_reported_whole(bench, monkeypatch):
    monkeypatch.setattr(bench.blocks, "gravity", lambda *g: 1 / 0, raising=False)
    with pytest.raises(ZeroDivisionError):
        bench("pcdc model gravity (0,1)\n")


def test_a_script_can_catch_errors(bench):
    bench("try:\n    pcdc geometry delete 'x'\nexcept Exception as error:\n    told = str(error)\n"
          "try:\n    pcdc model step [nothing]\nexcept NameError as error:\n    other = str(error)\n")  # fmt: skip
    assert (
        "script.sc:2: pcdc geometry delete 'x'" in bench["told"] and bench["other"] == "name 'nothing' is not defined"
    )


def test_random_numbers_begin_with_the_same_seed(bench):
    bench("import random\nm_a = random.random()\n")
    first = bench["m_a"]
    bench("m_a = random.random()\n")
    assert bench["m_a"] == first


def test_print_speaks_once(bench, capsys):
    bench("print('a', 1, sep='-')\n")
    assert capsys.readouterr().out == "a-1\n"


def test_commands_are_reported_what_the_line_says(bench):
    bench(
        "pcdc model gravity (0,-9.81)\n"
        "pcdc model option dynamic off collision on large-strain off overlap relax\n"
        "pcdc model time-step safety 0.5 mass-scaling 1e-6\n" + BOX + "pcdc table create 'v' values (0,0) (1,2)\n"
        "pcdc el c-m mech-iso-e den 2500 s 20e9 b 33e9 friction 30 pen 5e11\n"
        "pcdc element property damp-factor 0.3 range id 3 5\n"
        "pcdc element initial stress-xx -5e6 stress-yy 0 gradient (0,25e3) range x 0 2\n"
        "pcdc element-f c-m contact-m-c property pen-shear 1e11 pen-normal 2e11 friction 30 d-t 5e6 d-b 2 d-r 0.5\n"
        "pcdc face-j c-m c-i-c-i f 30 c 1e6 t-s 2e6 gf1 10 gf2 100 pen-o 5e12 np 3 range id 1\n"
        "pcdc element-face prop friction 20 range geometry 'top'\npcdc face-joint prop t-s 5 p-overlap 6 range id 1\n"
        "pcdc node bou mech-vel-b-c v-x 1 v-y table 'v' range y 2 2\n"
        "pcdc node bou mech-vel-b-c a-x table 'v' a-y 3 range id 0\n"
        "pcdc node bou mech-f-b-c f-x 1 f-y table 'v' range id 0 1\n"
        "pcdc node bou mech-m-b-c type 2 (1,1) range id 2\n"
        "pcdc element-face bou m-s-b-c s-xx 1 s-yy 2 s-n table 'v' quiet on inc-x table 'v' inc-y 0.5 "
        "range geometry 'top'\n"
        "pcdc element-face bou mechanical-s-b-c s-n -1\n"
        "pcdc node init velocity (3,4) range id 7\n"
        "pcdc element c-model null relax 0.5 range id 0\n"
        "pcdc node reset velocity\npcdc node reset displacement\npcdc element reset state\n"
        "pcdc face-joint reset state\n"
        "pcdc node boundary remove range id 0\npcdc element-face boundary remove\n"
    )
    told = bench.blocks.told
    assert told("gravity") == [((0.0, -9.81), {})]
    assert told("option") == [((), {"dynamic": False, "collision": True, "large_strain": False, "overlap": "relax"})]
    assert told("time_step") == [((), {"value": None, "auto": None, "safety": 0.5, "mass_scaling": 1e-6})]
    solid = {"density": 2500.0, "shear": 20e9, "bulk": 33e9, "friction": 30.0, "penalty": 5e11}
    assert told("element_model") == [((None, "mech_iso_elastic", solid), {})]
    (((numbers, given), _),) = told("element_property")
    assert numbers.tolist() == [3, 4, 5] and given == {"damp_factor": 0.3}
    (((numbers,), given),) = told("initial_stress")
    assert numbers.tolist() == [0, 1, 2, 3, 8, 9, 10, 11]
    assert given == {"xx": -5e6, "yy": 0.0, "gradient": {"yy": (0.0, 25e3)}}
    contact = {"penalty_shear": 1e11, "penalty_normal": 2e11, "friction": 30.0, "damping_t": 5e6, "damping_b": 2.0}
    contact["damping_ratio"] = 0.5
    assert told("face_model") == [((None, "contact_mohr_coulomb", contact), {})]
    (((numbers, name, joint), _),) = told("joint_model")
    assert numbers.tolist() == [1] and name == "classic_intrinsic_cohesive_interface"
    assert joint == {
        "friction": 30.0, "cohesion": 1e6, "tensile_strength": 2e6, "gf1": 10.0, "gf2": 100.0, "penalty_overlay": 5e12,
        "penalty_normal": pytest.approx(10 * 9 * 33e9 * 20e9 / (3 * 33e9 + 20e9)),
    }  # fmt: skip
    assert [(len(args[0]), args[1]) for args, _ in told("face_property")] == [(4, {"friction": 20.0})]
    (((numbers, changed), _),) = told("joint_property")
    assert numbers.tolist() == [1] and changed == {"tensile_strength": 5.0, "penalty_overlay": 6.0}
    first, second = told("velocity_condition")
    assert first[0][0].tolist() == [10, 11, 12, 13, 14] and first[0][1:] == (1.0, "v", None, None, None, None)
    assert second[0][0].tolist() == [0] and second[0][1:] == (None, None, "v", 3.0, None, None)
    (((numbers, *force), _),) = told("force_condition")
    assert numbers.tolist() == [0, 1] and force == [1.0, "v", None]
    (((numbers, *move), _),) = told("move_constraint")
    assert numbers.tolist() == [2] and move == [2, (1.0, 1.0)]
    (on_top, traction), (around, pressure) = told("stress_condition")
    assert traction == {
        "xx": 1.0, "yy": 2.0, "zz": None, "normal": "v", "quiet": True, "incoming_x": "v", "incoming_y": 0.5,
        "incoming_z": None, "xy": None, "xz": None, "yz": None, "dip": None,
    }  # fmt: skip
    assert len(on_top[0]) == 4 and len(around[0]) == 12  # the outline of 4 x 2
    assert {name: value for name, value in pressure.items() if value is not None} == {"normal": -1.0}
    assert [(args[0].tolist(), args[1:]) for args, _ in told("set_velocity")] == [([7], (3.0, 4.0))]
    assert [(args[0].tolist(), args[1:]) for args, _ in told("null")] == [([0], (0.5,))]
    for name in ("reset_velocity", "reset_displacement", "reset_state", "reset_joint_state", "remove_conditions"):
        assert len(told(name)) == 1, name
    assert bench.project.alive.tolist() == [False] + [True] * 15


def test_a_new_model_forgets_everything_but_python(bench):
    bench(BOX + "m_a = 1\npcdc geometry create point (0,0) as-layer 'x'\npcdc history create 't' model value time\n"
          "pcdc model new\n")  # fmt: skip
    project = bench.project
    assert project.mesh is None and not list(project.layers) and not project.histories and bench["m_a"] == 1
    assert all(not groups.sets for groups in project.groups.values())


def test_the_python_interface(bench):
    bench(
        BOX + "pcdc node group 'top' set 'bc' range y 2 2\npcdc model step 50\n"
        "m_t, m_c = pcdc.time, pcdc.cycle\n"
        "m_p = pcdc.node(0).position\nm_v = pcdc.node(3).velocity.Y\nm_d = pcdc.node(3).displacement_x\n"
        "numbers = pcdc.numbers('node', group='top', set='bc')\n"
        "m_r = pcdc.total('node', 'reaction-y', group='top', set='bc')\n"
        "stress = pcdc.values('element', 'stress-xx', x=(0, 1), present=True)\n"
        "in_mesh = pcdc.values('element', 'stress-xx', x=(0, 1))\nm_e = pcdc.element(5).stress_yy\n"
    )
    assert (bench["m_t"], bench["m_c"], bench["m_r"]) == (0.5, 50, 10.0)
    assert (bench["m_p"].X, bench["m_p"].Y, bench["m_v"], bench["m_d"]) == (0.5, 1.0, 2.0, 0.5)
    assert bench["numbers"].tolist() == [10, 11, 12, 13, 14]
    # The nodes have moved by 0.5: only centres that are now left of x = 1 count, those of the first column.
    assert isinstance(bench["stress"], np.ndarray) and len(bench["stress"]) == 2
    assert len(bench["in_mesh"]) == 4
    for wrong in (
        "pcdc.node('a')",
        "pcdc.numbers('thing')",
        "pcdc.values('node', 'colour')",
        "pcdc.numbers('node', z=1)",
    ):
        assert failure(bench, f"x = {wrong}\n")


def test_wrong_use_of_the_python_interface_is_an_error_of_the_script(bench):
    with pytest.raises(ScriptError, match=r"script.sc:1: .*not one of element, node, joint, face"):
        bench("pcdc model step [len(pcdc.numbers('thing'))]\n")
