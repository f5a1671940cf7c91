"""Statements: what each command and keyword is read as, abbreviations, ends of scripts, help in messages."""

from __future__ import annotations

import dataclasses
import pickle

import pytest

from hpcdem.core.errors import ScriptError, UsageError
from hpcdem.core.selection import Chain, Ellipse, Expression, Group, Ids, Interval, Polygon
from hpcdem.lang.zdem import table as t
from hpcdem.lang.zdem.parser import parse_text, read_script
from tests.tables import each

BEFORE = """START
SET DT 5e-2
WALL id 0 nodes (0 0) (10 0)
WALL id 1 nodes (0 0) (0 10) xv 2.0 yv 1.0
HIST id 1 interval 10 kinetic
HIST id 2 interval 10 step
"""
AT = BEFORE.count("\n") + 1


def parse_line(line):
    """One line, read in a script in which walls, histories and a time step exist."""
    statements = parse_text(BEFORE + line, "s.py").statements
    return statements[AT - 1]


def error_of(text):
    with pytest.raises(ScriptError) as caught:
        parse_text(text, "s.py")
    return str(caught.value)


def error_of_line(line):
    message = error_of(BEFORE + line)
    assert message.startswith(f"s.py:{AT}: ")
    return message.removeprefix(f"s.py:{AT}: ")


SQUARE = ((2e-2, 0.0), (3e-2, 0.0), (1e-2, 2e-2), (1e-2, 1e-2))


@each(
    ("line", "command", "arguments"),
    [
        ("STOP", "STOP", {}),
        ("WALL ID 7, NODES ( 2.0 40.0 ) ( 2.0 2.0 ), KN=4.4e3 KS=4.14e3 FRIC=0.55 COLOR=red", "WALL",
         {"id": 7, "nodes": ((2.0, 40.0), (2.0, 2.0)), "kn": 4400.0, "ks": 4140.0, "fric": 0.55, "color": 3}),
        ("WALL id 1 xv 0.0 yv 2.0", "WALL", {"id": 1, "xv": 0.0, "yv": 2.0}),
        ("wall id 1 fric 0.30 xv 40e-3", "WALL", {"id": 1, "fric": 0.3, "xv": 0.04}),
        ("BOX LEFT 1.0e-3 RIGHT (51000.0) BOTTOM 1.0e-3 HEIGHT (26000.0) kn=4e10 ks=4e10 fric 0.30", "BOX",
         {"left": 1e-3, "right": 51000.0, "bottom": 1e-3, "height": 26000.0, "kn": 4e10, "ks": 4e10, "fric": 0.3}),
        ("BALL ID=0 X=2.0 Y=0.5 RAD=0.5 COLOR=blue GROUP=Bom", "BALL",
         {"id": 0, "x": 2.0, "y": 0.5, "rad": 0.5, "color": 7, "group": "bom"}),
        ("GEN NUM 100000.0 rad discrete 60.0 80.0, x ( 10.0, 40000.0 ), y ( 10.0, 1e4 ), COLOR 5 GROUP rand", "GEN",
         {"num": 100000, "rad": (60.0, 80.0), "x": (10.0, 40000.0), "y": (10.0, 10000.0), "color": 5, "group": "rand"}),
        ("gen grid idmin 0 rad discrete 0.1 0.1 0.2 x (5.0 605.0) y (5.0 155.0)", "GEN",
         {"grid": True, "idmin": 0, "rad": (0.1, 0.1, 0.2), "x": (5.0, 605.0), "y": (5.0, 155.0)}),
        ("GEN NUM 9 rad disc 6. x ({left}, {right}), y ({top}-100.0, {top})", "GEN",
         {"num": 9, "rad": (6.0,), "x": (Expression("{left}", ("left",)), Expression("{right}", ("right",))),
          "y": (Expression("{top}-100.0", ("top", 100.0, "-")), Expression("{top}", ("top",)))}),
        ("GLINE RAD=0.5 P1 ( 2.0 10.0 ) P2 ( 40.0 10.0 ), kn=4.14e3 ks=4.14e3 fric=0.55 color=red CRATIO=0.8", "GLINE",
         {"rad": 0.5, "p1": (2.0, 10.0), "p2": (40.0, 10.0), "kn": 4140.0, "ks": 4140.0, "fric": 0.55, "color": 3,
          "cratio": 0.8}),
        ("gline p1 (0 0) p2 (9 0) r 0.5", "GLINE", {"p1": (0.0, 0.0), "p2": (9.0, 0.0), "rad": 0.5}),
        ("DEL", "DEL", {}),
        ("exp Init_XYR.dat", "EXP", {"file": "Init_XYR.dat"}),
        ("exp a.dat GROUP", "EXP", {"file": "a.dat", "group": True}),
        ("PROP DENSITY 2.5e3, fric 0.3, shear 2.9e9, poiss 0.2, damp 0.4, HERTZ", "PROP",
         {"density": 2500.0, "fric": 0.3, "shear": 2.9e9, "poiss": 0.2, "damp": 0.4, "hertz": True}),
        ("PROP hertz den 1 kn 2 ks 3", "PROP", {"hertz": True, "density": 1.0, "kn": 2.0, "ks": 3.0}),
        ("PROP ebmod 2e8, gbmmod 1e8, tstrength 2e100, sstrength 0e7, tolerate 10.0 fric 0.3", "PROP",
         {"ebmod": 2e8, "gbmod": 1e8, "tstrength": 2e100, "sstrength": 0.0, "tolerate": 10.0, "fric": 0.3}),
        ("PROP tolerate rext 0.4 ebmod 2e8", "PROP", {"tolerate": 1e-6, "rext": 0.4, "ebmod": 2e8}),
        ("PROP DENSITY 1.0, FRIC 0.1, KN 1e4, KS 1e4 tolerate rext 0.8", "PROP",
         {"density": 1.0, "fric": 0.1, "kn": 1e4, "ks": 1e4, "tolerate": 1e-6, "rext": 0.8}),
        ("PROP n_bond 1.0e4 s_bond 1.0e4 tolerate 10.0", "PROP", {"n_bond": 1e4, "s_bond": 1e4, "tolerate": 10.0}),
        ("PROP xv 0.0 yv -0.0 spin 1", "PROP", {"xv": 0.0, "yv": 0.0, "spin": 1.0}),
        ("INI xv -2.0, yv 1", "PROP", {"xv": -2.0, "yv": 1.0}),
        ("prop coloe Violet group A", "PROP", {"color": 9, "group": "a"}),
        ("BOND break", "BOND", {}),
        ("FIX x y spin", "FIX", {"x": True, "y": True, "spin": True}),
        ("free SPI", "FREE", {"spin": True}),
        ("SET DT 5e-2, GRAVITY (0.0 -9.8)", "SET", {"dt": 0.05, "gravity": (0.0, -9.8)}),
        ("SET disk ON", "SET", {"disk": "on"}),
        ("SET disk off", "SET", {"disk": "off"}),
        ("SET disk hex", "SET", {"disk": "hex"}),
        ("SET disk 0", "SET", {"disk": "off"}),
        ("SET frac 0.4", "SET", {"frac": 0.4}),
        ("SET damp lsm 0.04", "SET", {"damp": 0.04}),
        ("SET stepbar 100 sav 20000 print -1 ps 0 vtk 1000.0", "SET",
         {"stepbar": 100, "save": 20000, "print": -1, "ps": 0, "vtk": 1000}),
        ("SET save 5", "SET", {"save": 5}),
        ("SET seed 7 wallside left gentry 3.5 outdir Out", "SET",
         {"seed": 7, "wallside": "left", "gentry": 3.5, "outdir": "Out"}),
        ("CYC 5000", "CYC", {"steps": 5000}),
        ("cyc 1e3", "CYC", {"steps": 1000}),
        ("IMPLE WALL ID 1 xmove 16000.0 print 2000.0 ps 500.0 save 1000.0 vtk 100", "IMPLE",
         {"id": 1, "xmove": 16000.0, "print": 2000.0, "ps": 500.0, "save": 1000.0, "vtk": 100.0}),
        ("imp wall id 1 ymove -5", "IMPLE", {"id": 1, "ymove": -5.0}),
        ("IMPLIE wall id 1 xmove 1 sav 1", "IMPLE", {"id": 1, "xmove": 1.0, "save": 1.0}),
        ("SAV initxyr.sav", "SAV", {"file": "initxyr.sav"}),
        ("HIST ID 3 INTERVAL 1000 , kinetic", "HIST", {"id": 3, "interval": 1000, "kinetic": True}),
        ("HIST ID 4 INTERVAL 1000 , step", "HIST", {"id": 4, "interval": 1000, "step": True}),
        ("PLOT hist 2 1", "PLOT", {"x": 2, "y": 1}),
        ("PLOT 2 1", "PLOT", {"x": 2, "y": 1}),
        ("DRAW INTERVAL 200, bfill wall", "DRAW", {"interval": 200, "bfill": True, "wall": True}),
        ("draw bondc bid bang mesh cforce", "DRAW", dict.fromkeys(("bondc", "bid", "bang", "mesh", "cforce"), True)),
    ],
)  # fmt: skip
def test_every_command_and_keyword(line, command, arguments):
    statement = parse_line(line)
    assert (statement.command, statement.arguments, statement.selection) == (command, arguments, None)
    assert list(statement.arguments) == list(arguments), "arguments keep the order of the line"
    assert statement.line == AT and statement.text == line


@pytest.mark.parametrize(
    ("text", "command", "arguments"),
    [
        ("START", "START", {}),
        ("RESTORE 00200.sav", "RESTORE", {"file": "00200.sav"}),
        ("res 0000046000.sav", "RESTORE", {"file": "0000046000.sav"}),
        ("LOAD xyr.dat", "LOAD", {"file": "xyr.dat"}),
        ("LOAD xyr.dat scale 0.1", "LOAD", {"file": "xyr.dat", "scale": 0.1}),
        ("LOAD xyr.dat x 1000.0 2000.0 y 2000.0 4000.0", "LOAD",
         {"file": "xyr.dat", "x": (1000.0, 2000.0), "y": (2000.0, 4000.0)}),
        ("LOAD data/Xyr-1.dat", "LOAD", {"file": "data/Xyr-1.dat"}),
    ],
)  # fmt: skip
def test_beginnings(text, command, arguments):
    (statement,) = parse_text(text, "s.py").statements
    assert (statement.command, statement.arguments) == (command, arguments)


X, Y = Interval("x", 1.0, 10.0), Interval("y", 1.0, 10.0)


@each(
    ("text", "selection"),
    [
        ("y 6000.0 99999.0", Interval("y", 6000.0, 99999.0)),
        ("x (4.0e-3, 606.0e-3), y (30.0e-3, 1.0),",
         Chain((Interval("x", 4e-3, 0.606), Interval("y", 0.03, 1.0)), ("and",))),
        ("x (1.0 10.0) y (1.0 10.0)", Chain((X, Y), ("and",))),
        ("x (1.0 10.0) and y (1.0 10.0)", Chain((X, Y), ("and",))),
        ("x (1 10) y (1 10) or GROUP Sed", Chain((X, Y, Group("sed")), ("and", "or"))),
        ("x (1 10) y (1 10) AND P4 ( 2e-2, 0.0) (3e-2, 0.0) ( 1e-2, 2e-2) (1e-2, 1e-2)",
         Chain((X, Y, Polygon(SQUARE)), ("and", "and"))),
        ("p4 (2e-2 0) (3e-2 0) (1e-2 2e-2) (1e-2 1e-2)", Polygon(SQUARE)),
        ("ellipse ( 20000.0, 0.0) 2000.0, 1000.0", Ellipse(20000.0, 0.0, 2000.0, 1000.0)),
        ("ellipse ( 2e-2, 0.0) 3e-2, 0.0", Ellipse(2e-2, 0.0, 3e-2, 0.0)),
        ("group sed", Group("sed")),
        ("group wall_bom and group wall_mov0", Group("wall_bom", "wall_mov0")),
        ("group a or group b", Chain((Group("a"), Group("b")), ("or",))),
        ("id 1 2", Ids(1, 2)),
        ("id 7", Ids(7, 7)),
        ("id 7 or id 9 10", Chain((Ids(7, 7), Ids(9, 10)), ("or",))),
        ("y {top}-1000.0, {top}",
         Interval("y", Expression("{top}-1000.0", ("top", 1000.0, "-")), Expression("{top}", ("top",)))),
        ("ell ({left} 0) 1 2", Ellipse(Expression("{left}", ("left",)), 0.0, 1.0, 2.0)),
    ],
)  # fmt: skip
@each("command", ["DEL", "BOND break", "PROP fric 0.3", "FIX x", "EXP a.dat GROUP"])
def test_ranges(command, text, selection):
    assert parse_line(f"{command} RANGE {text}").selection == selection
    assert parse_line(f"{command.lower()} ran {text}").selection == selection


def test_case_and_separators_do_not_count():
    plain = parse_line("PROP density 2.5e3 fric 0.3 hertz RANGE x 9000.0 26000.0 and group sed")
    dressed = parse_line("prop( DENSITY=2.5e3,, Fric = (0.3), HERTZ ),range X( 9000.0,26000.0) AND Group=SED,")
    assert dressed.same_as(plain)


def test_what_follows_stop_is_not_read():
    script = parse_text(b"START\nstop # end\nnonsense \xff\xfe (\nSTART\n", "s.py")
    assert [s.command for s in script.statements] == ["START", "STOP"]


def test_a_script_may_end_without_stop():
    assert [s.command for s in parse_text("START", "s.py").statements] == ["START"]


def test_line_numbers_survive_blank_lines_comments_and_windows():
    text = b"\xef\xbb\xbf# title\r\n\r\nSTART\r\n# \xc9\xfa\xb3\xc9\r\nSET DT 1.0 # \xc9\xfa\r\n"
    assert [(s.line, s.command) for s in parse_text(text, "s.py").statements] == [(3, "START"), (5, "SET")]


def test_bytes_and_text_are_read_alike():
    text = "START\nSAV 盐.sav # 保存\n"
    assert parse_text(text, "s.py").statements == parse_text(text.encode(), "s.py").statements
    assert parse_text(text.encode(), "s.py").statements[1].arguments == {"file": "盐.sav"}


def test_load_or_restore_may_follow_start_at_once():
    assert len(parse_text("START\nLOAD a.dat", "s.py").statements) == 2
    assert "must be the first" in error_of("START\nSET DT 1\nLOAD a.dat")
    assert "must be the first" in error_of("START\nSTART")
    assert "must be the first" in error_of("LOAD a.dat\nRES a.sav")


def test_scripts_travel_between_ranks():
    script = parse_text(BEFORE + "DEL RANGE y {top}-1, {top}", "s.py")
    assert pickle.loads(pickle.dumps(script)) == script


def test_reading_a_file(tmp_path):
    path = tmp_path / "a.py"
    path.write_bytes(b"START\r\nSTOP\r\n")
    script = read_script(path)
    assert (script.file, script.directory) == (str(path), tmp_path)
    for wrong in (tmp_path / "none.py", tmp_path, "a\0b"):
        with pytest.raises(UsageError, match="cannot read the script"):
            read_script(wrong)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("CYCEL 5000", "did you mean 'CYCLE'?"),
        ("STRAT", "did you mean 'START'?"),
        ("PROB fric 0.3", "did you mean 'PROP'?"),
        ("WALL id 1 frci 0.3", "WALL: read 'frci' at column 11, expected a keyword: id, nodes"),
        ("WALL id 1 frci 0.3", "did you mean 'fric'?"),
        ("IMPLE wall id 1 xvmoe 5", "did you mean 'xmove'?"),
        ("SET prnit 100", "did you mean 'print'?"),
        ("PROP fric 0.3 RANEG y 0 1", "did you mean 'RANGE'?"),
        ("DEL RANGE elipse (0 0) 1 1", "did you mean 'ellipse'?"),
        ("DEL RANGE y {tpo} 1", "did you mean 'top'?"),
        ("PROP color vilet", "did you mean 'violet'?"),
        ("SET disk hexx", "did you mean 'hex'?"),
        ("GEN num 5 rad dicrete 1 x 0 9 y 0 9", "did you mean 'discrete'?"),
        ("SET DT 5e-2 CYCLE 5000", "a new command begins a new line"),
    ],
)  # fmt: skip
def test_the_nearest_known_word(line, message):
    assert message in error_of_line(line)


def test_words_not_carried_out_are_kept_with_the_statement():
    shy = dataclasses.replace(
        t.ZDEM.command("wall"),
        options=tuple(
            dataclasses.replace(option, executed=option.name != "yv") for option in t.ZDEM.command("wall").options
        ),
    )
    terms = tuple(dataclasses.replace(term, executed=term.name != "ellipse") for term in t.RANGE_TERMS)
    commands = tuple(shy if c.name == "WALL" else dataclasses.replace(c, executed=c.name != "DRAW") for c in t.COMMANDS)
    text = BEFORE + "DRAW wall\nDEL RANGE ellipse (0 0) 1 1\nWALL id 1 xv 1"
    unexecuted = [s.unexecuted for s in parse_text(text, "s.py", t.Table(commands, terms)).statements]
    assert unexecuted == [(), (), (), ("WALL yv",), (), (), ("DRAW",), ("RANGE ellipse",), ()]  # fmt: skip
