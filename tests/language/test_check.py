"""``--check``: counts that can be checked by hand, unknowns that stay unknown, the printed report."""

from __future__ import annotations

import dataclasses

import pytest

from hpcdem.lang.zdem import table as t
from hpcdem.lang.zdem.check import JAMMED, examine, summary
from hpcdem.lang.zdem.parser import parse_text, read_script
from hpcdem.lang.zdem.plan import expected_steps

WALL = "WALL id 1 nodes (0 0) (0 9) xv 2.0\n"


def examined(*lines, file="/nowhere/a.py", table=t.ZDEM):
    return examine(parse_text("\n".join(lines), file, table))


@pytest.mark.parametrize(
    ("lines", "steps"),
    [
        (["SET DT 0.05", "CYC 100", "CYC 0"], 100),
        (["SET DT 0.05", "IMPLE wall id 1 xmove 3000"], 30_000),
        (["SET DT 0.05", "IMPLE wall id 1 xmove -3000"], 30_000),
        (["SET DT 0.05", "WALL id 1 yv -0.5", "IMPLE wall id 1 ymove 3000"], 120_000),
        (["SET DT 0.05", "IMPLE wall id 1 xmove 0.04"], 0),
        (["SET DT 0.05", "IMPLE wall id 1 xmove 0.05"], 1),
        (["SET frac 0.4", "CYC 10"], 10),
        (["SET frac 0.4", "IMPLE wall id 1 xmove 3000"], None),
        (["SET DT 0.05 frac 0.4", "IMPLE wall id 1 xmove 3000"], None),
        (["SET frac 0.4 DT 0.05", "IMPLE wall id 1 xmove 3000"], 30_000),
    ],
)
def test_expected_steps(lines, steps):
    assert expected_steps(parse_text("\n".join(["START", WALL, *lines])).statements) == steps


def test_steps_after_restore():
    statements = parse_text("RES a.sav\nCYC 5\nIMPLE wall id 1 xmove 100").statements
    assert expected_steps(statements) is None
    assert expected_steps(statements, dt=0.05) is None
    assert expected_steps(statements, dt=0.05, walls={1: (2.0, 0.0)}) == 1005


def test_a_replaced_wall_stands_still():
    from hpcdem.errors import ScriptError

    with pytest.raises(ScriptError, match="wall 1 does not move"):
        parse_text("START\nSET DT 1\n" + WALL + "WALL id 1 nodes (0 0) (1 1)\nIMPLE wall id 1 xmove 1")


@pytest.mark.parametrize(
    ("line", "particles"),
    [
        ("BALL id 1 x 0 y 0 rad 1", 1),
        ("GLINE p1 (0 0) p2 (10000 0) rad 80", 63),
        ("GLINE p1 (0 0) p2 (160 0) rad 80", 2),
        ("GLINE p1 (10000 1000) p2 (25000 1000) rad 80 cratio 0.4", 235),
        ("GEN num 50 rad discrete 60 80 x (0 40000) y (0 10000)", 50),
        ("GEN grid rad discrete 0.1e-3 0.3e-3 x (5e-3 605e-3) y (5e-3 155e-3)", 250_000),
        ("GEN num 70 rad discrete 60 x ({left} {right}) y ({top} 9e3)", 70),
    ],
)
def test_particles(line, particles):
    assert examined("START", line).particles == particles


def test_a_full_box_holds_what_random_insertion_can_place():
    report = examined("START", "GEN num 100000 rad discrete 60 80 x (10 40000) y (10 10000)")
    disk = 3.141592653589793 * (60**2 + 80**2) / 2
    assert report.particles == pytest.approx(JAMMED * 39990 * 9990 / disk, abs=1)
    assert 13_000 < report.particles < 14_000


def test_particles_of_files(tmp_path):
    (tmp_path / "a.dat").write_text("0 0 1\n2 0 1\n\n4 0 1\n")
    assert examined("LOAD a.dat", file=str(tmp_path / "s.py")).particles == 3
    assert examined("LOAD b.dat", file=str(tmp_path / "s.py")).particles is None
    assert examined("RES a.sav", file=str(tmp_path / "s.py")).particles is None


def test_work_counts_the_particles_that_are_there():
    report = examined(
        "START", "SET DT 1", "CYC 7", "BALL id 1 x 0 y 0 rad 1", "CYC 10", "BALL id 2 x 9 y 0 rad 1", "CYC 3"
    )
    assert (report.steps, report.particles, report.work) == (20, 2, 10 * 1 + 3 * 2)


def test_output_files():
    report = examined("START", WALL, "SET DT 0.05 print 40 vtk 30 save 100", "CYC 100", "SET ps 1", "CYC 100",
                      "IMPLE wall id 1 xmove 10 print 3 save 4", "SAV a.sav")  # fmt: skip
    # CYC 0-100: _ini, 40, 80; CYC 100-200: _ini, 120, 160, 200; IMPLE of 100 steps: _ini, 30, 60, 90 and the end
    assert report.outputs["print"].files == 3 + 4 + 5
    assert report.outputs["vtk"].files == 3 + 3
    assert report.outputs["ps"].files == 100
    assert report.outputs["save"].files == 1 + 1 + 2 + 1
    assert report.outputs["print"].size == 0, "no particles"


def test_outputs_after_restore_are_known_as_far_as_the_script_tells():
    report = examined("RES 0000000090.sav", "SET print 100", "CYC 20")
    assert report.runs[0].start == 90
    assert report.outputs["print"].files == 2
    assert report.outputs["ps"].files is None
    assert any("no file 0000000090.sav" in note for note in report.notes)


def test_what_would_be_refused():
    commands = tuple(dataclasses.replace(c, executed=c.name != "DRAW") for c in t.COMMANDS)
    report = examined("START", "", "DRAW wall", table=dataclasses.replace(t.ZDEM, commands=commands))
    assert report.unexecuted == ((3, "DRAW"),)


def test_summary(manual_scripts):
    text = summary(read_script(manual_scripts / "push.py"))
    for words in ("106 000", "IMPLE wall id 1 xmove 10000.0", "at most 13 91", "frames (.dat and .vtkhdf)", "note: "):
        assert words in text
    assert "[" not in text.replace("[red]", ""), "no markup is left"


def test_summary_of_text_that_looks_like_markup():
    assert "SAV [red]a[/].sav" in summary(parse_text("START\nSAV [red]a[/].sav"))


def test_nothing_is_written(tmp_path):
    summary(parse_text("START\nSET DT 1\nCYC 5\nSAV a.sav", str(tmp_path / "a.py")))
    assert list(tmp_path.iterdir()) == []
