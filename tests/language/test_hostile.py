"""Bad scripts: each gives exactly one message with its line, and nothing else happens."""

from __future__ import annotations

import pytest

from hpcdem.errors import EXIT_USAGE, ScriptError
from hpcdem.lang.zdem.parser import parse_text

BEFORE = "START\nSET DT 5e-2\nWALL id 1 nodes (0 0) (0 10) xv 2.0\nHIST id 1 interval 10 kinetic\n"

# A line that follows BEFORE, and a part of what must be said about it.
LINES = [
    # words
    ("WALLY id 1 xv 1", "expected a command; did you mean 'WALL'?"),
    ("foo", "expected a command; commands are START"),
    ("CY 100", "expected a command"),
    ("5000", "every line begins with a command"),
    ("RANGE y 0 1", "RANGE is no command"),
    ("设置 速度", "a comment begins with #"),
    ("沉积4 #####", "a comment begins with #"),
    ("PROP fric 0.3 frci 0.2", "did you mean 'fric'?"),
    ("PROP fric 0.3 fric 0.2", "fric is given twice (column 15)"),
    ("PROP den 1 density 2", "density is given twice"),
    ("WALL id 1 0.3", "expected a keyword before this number"),
    ("CYC 100 200", "expected the end of the line"),
    ("STOP now", "expected the end of the line"),
    ("SET DT 5e-2 GRAVITYY 0 -9.8", "did you mean 'gravity'?"),
    ("BOND RANGE y 0 1", "expected 'break'"),
    ("BOND brake RANGE y 0 1", "expected 'break'"),
    ("BOND", "the line ends where 'break' is expected"),
    ("IMPLE id 1 xmove 100", "expected 'wall'"),
    ("IMPLE wall id 1 xmvoe 100", "did you mean 'xmove'?"),
    ("WALL id 1 xv 2 RANGE y 0 1", "WALL takes no RANGE"),
    ("CYC 10 RANGE y 0 1", "CYC takes no RANGE"),
    # numbers
    ("CYC", "the line ends where a whole number not below 0 for steps is expected"),
    ("CYC many", "read 'many' at column 5, expected a whole number not below 0 for steps"),
    ("CYC 1.5", "expected a whole number"),
    ("CYC -5", "expected a whole number not below 0"),
    ("CYC 1e300", "expected a whole number"),
    ("CYC 1e999", "too large"),
    ("CYC 5OOO", "read '5OOO'"),
    ("CYC {top}", "variables may stand in RANGE"),
    ("WALL id one xv 1", "expected a whole number not below 0 for id"),
    ("WALL id -1 xv 1", "expected a whole number not below 0 for id"),
    ("WALL id 1 fric -0.3", "expected a number not below 0 for fric"),
    ("WALL id 1 fric", "the line ends where a number not below 0 for fric is expected"),
    ("WALL id 1 xv fric 0.3", "read 'fric' at column 14, expected a number for xv"),
    ("WALL id 1 xv 2,0", "expected a keyword before this number"),
    ("PROP density -2500", "expected a number above 0 for density"),
    ("PROP poiss 0.7", "expected a Poisson ratio above -1, at most 0.5"),
    ("PROP damp 40", "expected a number from 0 to 1 for damp"),
    ("PROP shear 2.9e9Pa", "read '2.9e9Pa'"),
    ("PROP color 12", "expected a colour"),
    ("PROP color pink", "expected a colour: lg (0), green (1)"),
    ("SET DT 0", "expected a number above 0 for dt"),
    ("SET DT nan", "expected a number above 0 for dt"),
    ("SET DT inf", "expected a number above 0 for dt"),
    ("SET GRAVITY -9.8", "a second number for gravity"),
    ("SET print 100.5", "expected a whole number for print"),
    ("SET disk maybe", "expected on, off (or 0), or hex for disk"),
    ("SET damp 0.4", "expected the word 'lsm' after damp"),
    ("SET damp lsm -1", "expected a number not below 0"),
    ("SET wallside right", "expected left or both"),
    ("SET", "say what to set: dt, gravity"),
    # shapes and places
    ("WALL id 1 nodes (0 0) (0 0)", "the wall has no length"),
    ("WALL id 1 nodes (0 0) (10)", "the line ends"),
    ("WALL id 1 nodes (0 0 10 xv 2)", "expected a second number for nodes: two points"),
    ("WALL xv 2.0", "id missing; for example: WALL"),
    ("WALL id 1", "nothing to do"),
    ("WALL", "id missing"),
    ("WALL id 9 xv 2", "there is no wall 9 yet (walls so far: 1)"),
    ("BOX left 0 right 10 bottom 0", "height missing; for example: BOX"),
    ("BOX left 10 right 0 bottom 0 height 5", "right, 0.0, must be above left, 10.0"),
    ("BOX left 0 right 10 bottom 0 height -5", "expected a number above 0 for height"),
    ("BALL id 1 x 0 y 0 rad -1", "expected a number above 0 for rad"),
    ("BALL id 1 x 0 y 0", "rad missing"),
    ("BALL id 1 x 0 y 0 rad 0", "expected a number above 0 for rad"),
    ("GEN num 100 rad discrete x (0 10) y (0 10)", "read 'x' at column 26, expected a number above 0 for rad"),
    ("GEN num 100 rad 60 80 x (0 10) y (0 10)", "expected the word 'discrete' after rad"),
    ("GEN num 100 rad discrete 1 -2 x (0 10) y (0 10)", "read '-2'"),
    ("GEN num 0 rad discrete 1 x (0 10) y (0 10)", "expected a whole number above 0 for num"),
    ("GEN num 10.4 rad discrete 1 x (0 10) y (0 10)", "expected a whole number above 0 for num"),
    ("GEN num 100 rad discrete 1 x (10 0) y (0 10)", "the lower bound of x, 10.0, is above the upper bound, 0.0"),
    ("GEN num 100 rad discrete 1 x (0 10)", "y missing"),
    ("GEN rad discrete 1 x (0 10) y (0 10)", "give either num <int> or grid"),
    ("GEN num 5 grid rad discrete 1 x (0 10) y (0 10)", "give either num <int> or grid"),
    ("GEN num 5 idmin 1 rad discrete 1 x (0 10) y (0 10)", "idmin belongs to GEN grid"),
    ("GEN num 5 rad discrete 6 x (0 10) y (0 20)", "too narrow for a particle"),
    ("GEN num 5 rad discrete 1 x ({tpo} 10) y (0 20)", "did you mean 'top'?"),
    ("GEN num 5 rad discrete 1 x ({top} - 10) y (0 20)", "read '-'"),
    ("GLINE p1 (0 0) p2 (0 0) rad 1", "p1 and p2 are the same point"),
    ("GLINE p1 (0 0) p2 (9 0) rad 1 cratio 0", "expected a number above 0, at most 1 for cratio"),
    ("GLINE p1 (0 0) p2 (9 0)", "rad missing"),
    # RANGE
    ("DEL RANGE", "the line ends where a term"),
    ("DEL y 0 1", "expected a keyword: RANGE"),
    ("DEL RANGE y 0", "the line ends where the upper bound of y is expected"),
    ("DEL RANGE y 2 1", "the lower bound of y, 2.0, is above the upper bound, 1.0"),
    ("DEL RANGE y 0 1 2", "is there a number too many?"),
    ("DEL RANGE z 0 1", "expected one of x, y, P4"),
    ("DEL RANGE and y 0 1", "before it"),
    ("DEL RANGE y 0 1 or", "the line ends where a term"),
    ("DEL RANGE y 0 1 and or x 0 1", "before it"),
    ("DEL RANGE P4 (0 0) (1 0) (1 1)", "number 7 of the 8 numbers of P4"),
    ("DEL RANGE ellipse (0 0) 1 -1", "a half axis of ellipse is -1.0"),
    ("DEL RANGE id 5 2", "the first id, 5, is above the last, 2"),
    ("DEL RANGE group", "the line ends where a group name is expected"),
    ("DEL RANGE y {top}-", "missing at the end"),
    ("DEL RANGE y {top} -1000 {top}", "expected one of x, y, P4"),
    ("PROP RANGE y 0 1", "nothing to set before RANGE"),
    ("PROP group RANGE y 0 1", "expected a group name"),
    ("PROP RANGE y 0 1 fric 0.3", "RANGE stands last"),
    ("FIX RANGE y 0 1", "say which of x, y, spin"),
    # bonds, histories, files, running
    ("PROP", "nothing to set"),
    ("PROP ebmod 1e8 n_bond 1e4", "belong to different bond models"),
    ("HIST id 5 interval 10", "say what to record"),
    ("HIST id 5 interval 0 step", "expected a whole number above 0 for interval"),
    ("HIST id 5 interval 10 potential", "expected a keyword"),
    ("PLOT hist 2 1", "there is no history 2; HIST makes one"),
    ("PLOT", "the line ends"),
    ("EXP", "the line ends where a file name is expected"),
    ("EXP RANGE y 0 1", "expected a file name"),
    ("SAV", "the line ends where a file name is expected"),
    ('SAV "a.sav"', "without quotes"),
    ("IMPLE wall id 7 xmove 100", "there is no wall 7 (walls so far: 1)"),
    ("IMPLE wall id 1 ymove 100", "wall 1 does not move; give it a velocity with WALL id 1 yv"),
    ("IMPLE wall id 1 xmove 0", "expected a distance other than 0"),
    ("IMPLE wall id 1 xmove 1 ymove 1", "give one distance"),
    ("IMPLE wall id 1 print 100", "give one distance"),
    ("IMPLE wall id 1 xmove 1e300", "would take 1e+301 steps"),
    ("IMPLE wall xmove 100", "id missing"),
    ("IMPLE wall id 1 xmove 10 print -1", "expected a number not below 0 for print"),
    ("RES a.sav", "only be the first command"),
    ("LOAD a.dat", "only be the first command"),
    ("START", "only be the first command"),
    ("START again", "expected the end of the line"),
    # characters
    ("SET DT，5e-2", "type an ordinary ','"),
    ("CYC 5000\x00", "control character U+0000"),
    ("CYC \u202e5000", "control character U+202E"),
    ("CYC " + "9" * 5000, "expected a whole number"),
    ("x" * 5000 + " 1", "..."),
]  # fmt: skip

# Whole scripts, the line of the error, and a part of what must be said.
SCRIPTS = [
    (b"", 1, "there is no command in the script; the first must be START, RESTORE or LOAD"),
    (b"\xef\xbb\xbf", 1, "there is no command"),
    (b"# only a title\n\n; and this\n", 1, "there is no command"),
    (b"\r\n\r\n", 1, "there is no command"),
    (b"SET disk off\nSTART\n", 1, "the first command is SET; it must be START, RESTORE or LOAD"),
    (b"\n\nSTOP\n", 3, "the first command is STOP"),
    (b"CYC 100", 1, "the first command is CYC"),
    (b"RESTORE\n", 1, "the line ends where a file name is expected"),
    (b"LOAD a.dat x 1\n", 1, "the upper bound of x"),
    (b"LOAD a.dat scale 0\n", 1, "expected a number above 0 for scale"),
    (b"START\nCYC 100\n", 2, "there is no time step yet"),
    (b"START\nSET DT 1\nWALL id 1 nodes 0 0 1 1\nIMPLE wall id 1 xmove 1", 4, "wall 1 does not move"),
    (b"START\nSET DT 1\nIMPLE wall id 1 xmove 1", 3, "there is no wall 1 (walls so far: none)"),
    (b"START\nSAV \xc9\xfa.sav\n", 2, "is not UTF-8"),
    (b"\xff\xfeS\x00T\x00A\x00R\x00T\x00", 1, "UTF-16"),
    (b"START\n\x7fELF\x02\x01\x01", 2, "control character"),
    (b"\x89PNG\r\n\x1a\n\x00", 1, "is not UTF-8"),
    (b"\x89HDF\r\n\x1a\n", 1, "is not UTF-8"),
    (b"import hpcdem\nsim = hpcdem.Simulation()\n", 1, "read 'import' at column 1, expected a command; did you mean"),
    (b"{\n}\n", 1, "expected a command"),
]


def error_of(source):
    with pytest.raises(ScriptError) as caught:
        parse_text(source, "push.py")
    return caught.value


@pytest.mark.parametrize(("line", "message"), LINES, ids=[f"{i}:{line[:30]!a}" for i, (line, _) in enumerate(LINES)])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_bad_lines(line, message, end):
    error = error_of((BEFORE + line + "\nCYC 1\nSTOP\n").replace("\n", end))
    assert message in error.message
    assert error.line == BEFORE.count("\n") + 1
    assert str(error) == f"push.py:{error.line}: {error.message}"
    assert "\n" not in str(error) and len(str(error)) < 600
    assert error.exit_code == EXIT_USAGE


@pytest.mark.parametrize(("source", "line", "message"), SCRIPTS)
def test_bad_scripts(source, line, message):
    error = error_of(source)
    assert (error.line, message in error.message) == (line, True), str(error)


def test_the_first_wrong_line_is_reported():
    assert error_of(BEFORE + "foo\nbar\n").line == 5


VALID = [line for line in BEFORE.splitlines()[2:]] + [
    "BOX left 0.0 right 41000.0 bottom 0.0 height 11000.0 kn=0e10 ks=0e10 fric 0.0",
    "GEN NUM 100000 rad discrete 60.0 80.0 x (10.0 40000.0) y (10.0 10000.0) COLOR black GROUP ball",
    "PROP ebmod 2e8 gbmod 2e8 tstrength 2e7 sstrength 4e7 RANGE P4 (0 0) (1 0) (1 1) (0 1) and group ball",
    "IMPLE wall id 1 xmove 100.0 save 20.0 print 10.0",
    "SET GRAVITY 0.0 -9.8",
]


@pytest.mark.parametrize("line", VALID)
def test_every_word_replaced_by_nonsense_is_found(line):
    """Whatever word is spoilt, the message is about that line; names may be anything."""
    words = line.split()
    for at in range(len(words)):
        spoilt = " ".join([*words[:at], "qqq,,qqq", *words[at + 1 :]])
        error = error_of(BEFORE + spoilt + "\n")
        assert error.line == 5, spoilt


@pytest.mark.parametrize("line", VALID)
def test_every_line_cut_short_is_found_or_complete(line):
    words = line.split()
    for n in range(1, len(words)):
        try:
            parse_text(BEFORE + " ".join(words[:n]), "push.py")
        except ScriptError as error:
            assert error.line == 5
