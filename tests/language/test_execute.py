"""Statements reach the right commands with the right values, in order; errors leave with file and line; resuming."""

from __future__ import annotations

import dataclasses
import importlib
import inspect

import pytest

from hpcdem.commands import dem
from hpcdem.core.errors import CommandError, PhysicsError, ScriptError, UsageError
from hpcdem.core.selection import Group, Interval
from hpcdem.lang.zdem import execute
from hpcdem.lang.zdem import table as t
from hpcdem.lang.zdem.execute import refuse_unexecuted
from hpcdem.lang.zdem.parser import parse_text, read_script
from hpcdem.lang.zdem.plan import expected_steps
from tests.tables import each

EXTENTS = {"left": 0.0, "right": 500.0, "bottom": 0.0, "top": 4000.0}


class Sim:
    """What the interpreter uses of a simulation."""

    position = -1
    line = 0
    script = ""

    def extents(self):
        return EXTENTS


class Recorder:
    """Stands for hpcdem.commands: notes every call, and fails where it is told to.

    Every call must fit the signature of the real command.
    """

    def __init__(self, fail=None):
        self.calls = []
        self.positions = []
        self.fail = fail or {}

    def __getattr__(self, module):
        return _Module(self, module)


class _Module:
    def __init__(self, recorder, module):
        self.recorder, self.module = recorder, module

    def __getattr__(self, command):
        def call(sim, *args, **kwargs):
            name = f"{self.module}.{command}"
            self.recorder.calls.append(by_name(name, args, kwargs))
            self.recorder.positions.append((sim.position, sim.line))
            if name in self.recorder.fail:
                raise self.recorder.fail[name]

        return call


def by_name(command, args, kwargs):
    """A call, which must fit the signature of the real command, with all its arguments by name."""
    module, _, name = command.partition(".")
    real = getattr(importlib.import_module(f"hpcdem.commands.dem.{module}"), name)
    given = inspect.signature(real).bind(None, *args, **kwargs).arguments
    more = [one.name for one in inspect.signature(real).parameters.values() if one.kind is one.VAR_KEYWORD]
    given |= {key: value for name in more for key, value in given.pop(name, {}).items()}
    return command, (), {key: value for key, value in given.items() if key != "sim"}


def run(text, file="/models/a.py", fail=None, **how):
    recorder, sim = Recorder(fail), Sim()
    carry_out(parse_text(text, file), recorder, sim, **how)
    return recorder, sim


def carry_out(script, recorder, sim, **how):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(execute, "dem", recorder)
        execute.Interpreter(script).run(sim, **how)


def calls_of(*lines):
    """Calls made by lines that stand between a beginning and STOP."""
    before = ["START", "SET DT 5e-2", "WALL id 1 nodes (0 0) (0 9) xv 2 yv 1", "HIST id 1 interval 9 kinetic",
              "HIST id 2 interval 9 step"]  # fmt: skip
    recorder, _ = run("\n".join([*before, *lines, "STOP"]))
    assert recorder.calls[0] == ("particles.start", (), {})
    assert recorder.calls[-1] == ("cycles.stop", (), {})
    return recorder.calls[len(before) : -1]


A = Group("a")


@each(
    ("line", "calls"),
    [
        ("BOX left 0 right 9 bottom 0 height 5 fric 0.1",
         [("walls.box", (), {"left": 0.0, "right": 9.0, "bottom": 0.0, "height": 5.0, "fric": 0.1})]),
        ("WALL id 4 nodes (0 0) (1 0) kn 1 color red",
         [("walls.wall", (), {"id": 4, "nodes": ((0.0, 0.0), (1.0, 0.0)), "kn": 1.0, "color": 3})]),
        ("WALL id 1 xv 0 yv 2", [("walls.wall", (), {"id": 1, "xv": 0.0, "yv": 2.0})]),
        ("BALL id 3 x 1 y 2 rad 0.5 group A",
         [("particles.ball", (3,), {"x": 1.0, "y": 2.0, "rad": 0.5, "group": "a"})]),
        ("GEN num 5 rad discrete 1 2 x (0 90) y (0 80) color blue",
         [("particles.gen", (5, (1.0, 2.0)), {"x": (0.0, 90.0), "y": (0.0, 80.0), "color": 7})]),
        ("GEN num 5 rad discrete 1 x ({left} {right}) y ({top}-1000.0 {top})",
         [("particles.gen", (5, (1.0,)), {"x": (0.0, 500.0), "y": (3000.0, 4000.0)})]),
        ("GEN grid idmin 0 rad discrete 1 x (0 90) y (0 80) group g",
         [("particles.gen_grid", ((1.0,),), {"idmin": 0, "x": (0.0, 90.0), "y": (0.0, 80.0), "group": "g"})]),
        ("GLINE p1 (0 0) p2 (9 0) r 1 cratio 0.4",
         [("particles.gline", (), {"p1": (0.0, 0.0), "p2": (9.0, 0.0), "rad": 1.0, "cratio": 0.4})]),
        ("DEL RANGE y {top}-1000.0 {top}", [("particles.delete", (Interval("y", 3000.0, 4000.0),), {})]),
        ("DEL", [("particles.delete", (None,), {})]),
        ("EXP b.dat", [("particles.export", ("/models/b.dat",), {"where": None})]),
        ("EXP /tmp/B.dat GROUP RANGE group a",
         [("particles.export", ("/tmp/B.dat",), {"group": True, "where": A})]),
        ("PROP den 1 hertz color 3 group b RANGE group a",
         [("properties.prop", (A,), {"density": 1.0, "hertz": True, "color": 3, "group": "b"})]),
        ("INI xv 0 spin 1", [("properties.prop", (None,), {"xv": 0.0, "spin": 1.0})]),
        ("PROP ebmod 2 gbmod 2 tstrength 3 sstrength 4 RANGE group a",
         [("bonds.bond", (A,), {"ebmod": 2.0, "gbmod": 2.0, "tstrength": 3.0, "sstrength": 4.0})]),
        ("PROP n_bond 1 s_bond 2 tolerate rext 0.4 fric 0.3",
         [("properties.prop", (None,), {"fric": 0.3}),
          ("bonds.bond", (None,), {"n_bond": 1.0, "s_bond": 2.0, "tolerate": 1e-6, "rext": 0.4})]),
        # Were the group changed first, RANGE would find nobody for the bonds.
        ("PROP group b color red ebmod 2 RANGE group a",
         [("properties.prop", (A,), {"color": 3}), ("bonds.bond", (A,), {"ebmod": 2.0}),
          ("properties.prop", (A,), {"group": "b"})]),
        ("PROP kn 1 ks 1 tolerate rext 0.8", [("properties.prop", (None,), {"kn": 1.0, "ks": 1.0})]),
        ("PROP tolerate rext 0.8", []),
        ("BOND break RANGE group a", [("bonds.break_bonds", (A,), {})]),
        ("FIX y spin RANGE group a", [("properties.fix", (("y", "spin"),), {"where": A})]),
        ("FREE x", [("properties.free", (("x",),), {"where": None})]),
        ("SET DT 1 GRAVITY 0 -9.8 disk 0 damp lsm 4 sav 7 outdir out",
         [("settings.set_option", (name, value), {}) for name, value in
          [("dt", 1.0), ("gravity", (0.0, -9.8)), ("disk", "off"), ("lsm", 4.0), ("save", 7),
           ("outdir", "/models/out")]]),
        ("CYC 5000", [("cycles.cycle", (5000,), {})]),
        ("IMPLE wall id 1 xmove 100 save 20 print 10 ps 5 vtk 2",
         [("cycles.imple", (1,), {"xmove": 100.0, "save": 20.0, "print": 10.0, "ps": 5.0, "vtk": 2.0})]),
        ("IMPLE wall id 1 ymove -5", [("cycles.imple", (1,), {"ymove": -5.0})]),
        ("SAV b.sav", [("checkpoints.save", ("/models/b.sav",), {})]),
        ("HIST id 5 interval 10 step", [("history.hist", (5, 10, "step"), {})]),
        ("PLOT hist 2 1", [("history.plot_hist", (), {"x": 2, "y": 1})]),
        ("DRAW interval 200 bfill wall", [("history.draw", (200, ["bfill", "wall"], []), {})]),
        ("DRAW -bline bfill", [("history.draw", (None, ["bfill"], ["bline"]), {})]),
    ],
)  # fmt: skip
def test_every_command(line, calls):
    assert calls_of(line) == [by_name(*call) for call in calls]


def test_the_simulation_knows_where_it_is():
    recorder, sim = run("START\n\nSET DT 1\n# a comment\nCYC 5\nSTOP")
    assert recorder.positions == [(0, 1), (1, 3), (2, 5), (3, 6)]
    assert sim.script == "START\n\nSET DT 1\n# a comment\nCYC 5\nSTOP"


def test_the_end_of_the_script_is_a_stop():
    assert run("START")[0].calls == [("particles.start", (), {}), ("cycles.stop", (), {})]
    assert run("START\nSTOP\nCYC 1")[0].calls == [("particles.start", (), {}), ("cycles.stop", (), {})]


def test_starting_in_the_middle():
    recorder, _ = run("START\nSET DT 1\nCYC 5\nCYC 6", start_at=2)
    assert [name for name, *_ in recorder.calls] == ["cycles.cycle", "cycles.cycle", "cycles.stop"]


def test_errors_of_commands_leave_with_file_and_line():
    with pytest.raises(ScriptError) as caught:
        run("START\nSET DT 1\n\nCYC 5", fail={"cycles.cycle": CommandError("3 particles have no density")})
    assert str(caught.value) == "/models/a.py:4: CYC: 3 particles have no density"
    assert isinstance(caught.value.__cause__, CommandError)


def test_errors_of_the_physics_are_left_alone():
    with pytest.raises(PhysicsError, match="particle 7"):
        run("START\nSET DT 1\nCYC 5", fail={"cycles.cycle": PhysicsError("particle 7 is not finite")})


def test_errors_of_expressions_leave_with_file_and_line():
    with pytest.raises(ScriptError) as caught:
        run("START\nDEL RANGE y {top}/0 {top}")
    assert str(caught.value) == "/models/a.py:2: DEL: '{top}/0' divides by zero"


# ---- files to read


@pytest.mark.parametrize("folder", ["", "data"])
@pytest.mark.parametrize(("line", "command"), [("RES 1.sav", "checkpoints.restore"), ("LOAD 1.sav", "particles.load")])
def test_files_are_searched_beside_the_script_then_in_data(tmp_path, folder, line, command):
    place = tmp_path / folder
    place.mkdir(exist_ok=True)
    (place / "1.sav").touch()
    recorder, _ = run(line, file=str(tmp_path / "a.py"))
    assert recorder.calls[0] == (command, (), {"file": str(place / "1.sav")})


def test_load_takes_a_scale_and_a_window(tmp_path):
    (tmp_path / "a.dat").touch()
    recorder, _ = run("LOAD a.dat scale 2 x 0 1 y 2 3", file=str(tmp_path / "a.py"))
    file = str(tmp_path / "a.dat")
    assert recorder.calls[0][2] == {"file": file, "scale": 2.0, "x": (0.0, 1.0), "y": (2.0, 3.0)}


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ScriptError) as caught:
        run("# title\nRES 1.sav", file=str(tmp_path / "a.py"))
    assert caught.value.line == 2
    assert caught.value.message == f"RESTORE: there is no file {tmp_path}/1.sav, nor {tmp_path}/data/1.sav"


def test_rank_0_searches_for_files(tmp_path):
    class Comm:
        rank = 1
        answers = iter([None, "/from/rank/0"])  # no folder is missing; where the file is

        def bcast(self, found):
            assert found is None
            return next(self.answers)

    sim, recorder = Sim(), Recorder()
    sim.comm = Comm()
    carry_out(parse_text("RES 1.sav", str(tmp_path / "a.py")), recorder, sim)
    assert recorder.calls[0] == ("checkpoints.restore", (), {"file": "/from/rank/0"})


# ---- going on after a checkpoint

SCRIPT = "START\nSET DT 1\nCYC 5\nDEL RANGE y 0 1\nCYC 6\nSAV b.sav\nCYC 7\n"


@pytest.mark.parametrize(
    ("position", "names"),
    [
        (2, ["cycles.resume", "particles.delete", "cycles.cycle", "checkpoints.save", "cycles.cycle", "cycles.stop"]),
        (4, ["cycles.resume", "checkpoints.save", "cycles.cycle", "cycles.stop"]),
        (5, ["cycles.cycle", "cycles.stop"]),  # the checkpoint was written by SAV itself
        (6, ["cycles.resume", "cycles.stop"]),
    ],
)
def test_resuming(position, names):
    recorder, _ = run(SCRIPT, resume=position, saved_script=SCRIPT)
    assert [name for name, *_ in recorder.calls] == names
    assert recorder.positions[0][0] == (position if "resume" in names[0] else position + 1)


def test_errors_while_resuming_leave_with_file_and_line():
    with pytest.raises(ScriptError, match=r"a\.py:5: CYC: no"):
        run(SCRIPT, resume=4, fail={"cycles.resume": CommandError("no")})


def test_lines_still_to_come_may_be_changed_before_resuming():
    run(SCRIPT.replace("CYC 7", "CYC 700\nDEL"), resume=4, saved_script=SCRIPT)
    run("# a note\n" + SCRIPT.replace("SET DT 1", "set dt = 1.0 # s"), resume=4, saved_script=SCRIPT)


def test_lines_carried_out_must_not_be_changed_before_resuming():
    with pytest.raises(UsageError) as caught:
        run(SCRIPT.replace("CYC 5", "CYC 50"), resume=4, saved_script=SCRIPT)
    assert str(caught.value).startswith("/models/a.py:3: 'CYC 50' was 'CYC 5' when the checkpoint was written")


def test_resuming_another_script():
    with pytest.raises(UsageError, match=r"statement 7 of its script, /models/a\.py has only 1"):
        run("START", resume=6)


# ---- what the solver cannot do


def test_what_is_not_carried_out_is_refused_before_anything_runs():
    commands = tuple(dataclasses.replace(c, executed=c.name not in ("PLOT", "DRAW")) for c in t.COMMANDS)
    text = "START\nSET DT 1\nCYC 5\nDRAW wall\n"
    script = parse_text(text, "a.py", dataclasses.replace(t.ZDEM, commands=commands))
    recorder = Recorder()
    with pytest.raises(ScriptError) as caught:
        carry_out(script, recorder, Sim())
    assert str(caught.value) == "a.py:4: hpcdem does not support DRAW yet"
    assert recorder.calls == []


def test_everything_in_the_table_is_carried_out_today():
    for command in t.COMMANDS:
        for row in (command, *command.leading, *command.options, *t.RANGE_TERMS):
            assert row.executed, (command.name, row.name)


@pytest.mark.parametrize(
    "name",
    ["push", "syn_erosion", "syn_sedimentaion", "pre_struct", "detachment", "palaeohigh", "extens_rigid",
     "ex8_dem_am_gen", "ex8_dem_am_push", "extens_ductile_patent", "push_add_del"],
)  # fmt: skip
def test_manual_scripts_reach_their_commands(manual_scripts, tmp_path, name):
    """Every statement of the scripts makes calls that the real commands accept."""
    for file in ("init_xyr.dat", "ini_xyr.dat", "0000046000.sav"):
        (tmp_path / file).touch()
    text = (manual_scripts / f"{name}.py").read_bytes()
    script = parse_text(text, str(tmp_path / "script.py"))
    refuse_unexecuted(script.statements)
    recorder = Recorder()
    carry_out(script, recorder, Sim())
    assert {position for position, _ in recorder.positions} == set(range(len(script.statements)))


def test_the_real_commands_are_found_by_name():
    assert dem.particles is importlib.import_module("hpcdem.commands.dem.particles")


def test_reading_and_running_agree_on_the_steps(tmp_path):
    path = tmp_path / "a.py"
    path.write_text("START\nSET DT 5e-2\nWALL id 1 nodes (0 0) (0 9) xv -2\nCYC 10\nIMPLE wall id 1 xmove 100.04\n")
    assert expected_steps(read_script(path).statements) == 10 + 1000
