"""``--check``: counts that can be checked by hand, unknowns that stay unknown, the printed report."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from hpcdem.lang.zdem import table as t
from hpcdem.lang.zdem.check import examine, print_report, summary
from hpcdem.lang.zdem.estimate import FAILURES, estimate, insertion
from hpcdem.lang.zdem.parser import parse_text, read_script
from hpcdem.lang.zdem.plan import expected_steps, follow
from hpcdem.runtime import speed
from tests.foretold import frame_names

WALL = "WALL id 1 nodes (0 0) (0 9) xv 2.0\n"


@pytest.fixture(autouse=True)
def cache(tmp_path, monkeypatch):
    """No run was measured on this machine yet."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))


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


def test_a_replaced_wall_is_at_rest():
    from hpcdem.core.errors import ScriptError

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


@pytest.mark.parametrize(
    ("radii", "number", "tolerance"),
    [((20.0,), 600, 0.02), ((20.0,), 3000, 0.02), ((20.0,), 23_000, 0.04), ((20.0, 26.67), 20_000, 0.03),
     ((10.0, 10.0, 20.0, 20.0, 25.0, 30.0), 3000, 0.10)],
)  # fmt: skip
def test_what_fits_at_random(radii, number, tolerance):
    """The estimate against GEN itself, from a few particles to a full box."""
    from hpcdem.pre.packing import insert_randomly

    side = 3000.0
    rows, _ = insert_randomly(
        number, np.array(radii), (0.0, side), (0.0, side), np.empty((0, 3)), 1, 0, int(2.75 * number)
    )
    n, disks = insertion(number, 2.75, radii, side**2, side**2)
    assert n == pytest.approx(len(rows), rel=tolerance)
    assert disks == pytest.approx(np.pi * (rows[:, 2] ** 2).sum(), rel=tolerance)


@pytest.mark.parametrize(("radii", "number"), [((20.0,), 600), ((20.0,), 10**6), ((20.0, 26.67), 10**6)])
def test_what_fits_until_nothing_fits(radii, number):
    """The same for a GEN that gives up after failures in a row, a mean of several seeds: one may give up early."""
    from hpcdem.pre.packing import insert_randomly

    side, none = 3000.0, np.empty((0, 3))
    made = [
        len(insert_randomly(number, np.array(radii), (0.0, side), (0.0, side), none, seed, 0, in_a_row=FAILURES)[0])
        for seed in range(8)
    ]
    n, _ = insertion(number, 0.0, radii, side**2, side**2)
    assert n == pytest.approx(np.mean(made), rel=0.04)


MANUAL = [
    # particles generated, then what a run has between its commands (README of the manual's scripts, calibrated with
    # the published bed)
    ("push", 13_200, [13_200, 10_700, 10_700], 1.15e9),
    ("pre_struct", 13_200, [13_200, 10_700, 10_700], 5.0e8),
    ("detachment", 10_713, [10_713], 1.07e9),
    ("push_add_del", 11_900, [11_900, 8000, 8000, 7400, 9400, 9400], 9.5e8),
    ("ex8_dem_am_gen", 250_000, [250_000, 110_000], 1.7e10),
    ("extens_ductile_patent", 3500, None, 1.7e8),
    ("extens_rigid", 24_800, None, 3.9e9),
]


@pytest.mark.parametrize(("name", "made", "present", "work"), MANUAL, ids=[row[0] for row in MANUAL])
def test_particles_of_the_manual(manual_scripts, name, made, present, work):
    script = read_script(manual_scripts / f"{name}.py")
    assert examine(script).work == pytest.approx(work, rel=0.1)
    guess = estimate(script.statements, script.directory)
    assert next(n for n in guess.made.values() if n > 1000) == pytest.approx(made, rel=0.1)
    if present is not None:
        assert list(guess.before.values()) == pytest.approx(present, rel=0.08)


def present(*lines):
    """Particles at every run."""
    script = parse_text("\n".join(lines))
    return list(estimate(script.statements, script.directory).before.values())


def test_a_bed_is_cut_widened_and_filled_up():
    """30 m x 10 m of material of 0.95: two thirds stay, and lie 4/3 as wide; then there is room on top."""
    lines = ["START", "SET dt 1", "WALL id 1 nodes (30 0) (30 20) xv 0.001",
             "GEN num 100000 rad discrete 0.1 x (0 30) y (0 20)", "PROP hertz", "CYC 1"]  # fmt: skip
    full = present(*lines, "CYC 1")[1]
    height = full * math.pi * 0.01 / 30 / 0.95
    cut = present(*lines, f"DEL RANGE y {height * 2 / 3} 99", "CYC 1")[1]
    assert cut == pytest.approx(full * 2 / 3, rel=1e-3)
    moved = [f"DEL RANGE y {height * 2 / 3} 99", "IMPLE wall id 1 xmove 10"]
    again = present(*lines, *moved, f"DEL RANGE y {height / 4} 99", "CYC 1")[-1]
    assert again == pytest.approx(full / 3, rel=1e-3), "two thirds at 3/4 of the height, cut at half"
    top = examined(*lines, *moved, "GEN num 9 rad discrete 0.1 x (0 40) y ({top} {top}+2.0)")
    assert top.made[len(lines) + 2] == 9
    none = examined(*lines, *moved, "GEN num 9 rad discrete 0.1 x (0 40) y (0 {top})")
    assert none.made[len(lines) + 2] == 0 and none.rough


def test_what_is_not_followed_makes_an_estimate():
    row = "GLINE p1 (0 0) p2 (9 0) rad 0.5"
    assert examined("START", row).certain
    assert examined("START", row, "DEL").particles == 10 and examined("START", row, "DEL").certain
    assert not examined("START", row, "DEL RANGE group a").certain


def test_particles_of_files(tmp_path):
    (tmp_path / "a.dat").write_text("0 0 1\n2 0 1\n\n4 0 1\n")
    assert examined("LOAD a.dat", file=str(tmp_path / "s.py")).particles == 3
    assert examined("LOAD b.dat", file=str(tmp_path / "s.py")).particles is None
    assert examined("RES a.sav", file=str(tmp_path / "s.py")).particles is None
    assert examined("LOAD a.dat x 1 3 scale 5", file=str(tmp_path / "s.py")).particles == 1
    (tmp_path / "a.dat").write_text("0 0 one\n")
    assert examined("LOAD a.dat", file=str(tmp_path / "s.py")).particles is None


def test_a_restart_file_is_inspected(tmp_path):
    from hpcdem.lang.zdem.execute import Interpreter
    from hpcdem.physics.dem.simulation import Simulation

    lines = "START\nSET dt 0.05\nWALL id 1 nodes 0 0 0 9 xv 2\nGEN grid rad discrete 1 x 0 8 y 0 8\nSAV a.sav"
    Interpreter(parse_text(lines, str(tmp_path / "a.py"))).run(Simulation(outdir=tmp_path / "data"))
    report = examined("RES a.sav", "IMPLE wall id 1 xmove 3", file=str(tmp_path / "s.py"))
    assert (report.particles, report.steps, report.work) == (16, 30, 480)
    (tmp_path / "a.sav").write_bytes(b"no checkpoint")
    report = examined("RES a.sav", "IMPLE wall id 1 xmove 3", file=str(tmp_path / "s.py"))
    assert report.steps is None and "line 1: a.sav cannot be read" in report.notes


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
    assert report.outputs["save"].files == 1 + 1 + 2
    assert report.outputs["print"].size == 0, "no particles"


def test_outputs_after_restore_are_known_as_far_as_the_script_defines_them():
    report = examined("RES 0000000090.sav", "SET print 100", "CYC 20")
    assert report.runs[0].start == 90
    assert report.outputs["print"].files == 2
    assert report.outputs["ps"].files is None
    assert any("file 0000000090.sav not found" in note for note in report.notes)


@pytest.mark.parametrize(("steps", "number"), [(20, "about 1"), (200, "3")])
def test_a_number_of_frames_that_depends_on_an_unknown_step_is_reported_as_such(capsys, steps, number):
    report = examined("RES settled.sav", "SET print 100", f"CYC {steps}")
    assert report.runs[0].start is None and report.outputs["print"].rough == number.startswith("about")
    print_report(report)
    row = next(row for row in capsys.readouterr().out.splitlines() if "all_<step>.dat" in row)
    assert number in [cell.strip() for cell in row.split("  ")]


def test_names_of_frames(manual_scripts):
    """The 42 of chapter 6.3: every step and every _ini, in order."""
    script = read_script(manual_scripts / "push_add_del.py")
    steps = [0, *range(1000, 6000, 1000), 5000, 6000, 6000, 16000, 26000, 36000, 36000, 46000, 56000, 56000,
             *range(56100, 58100, 100), 58000, *range(68000, 109000, 10000)]  # fmt: skip
    initial = [0, 5000, 6000, 36000, 56000, 58000]
    expected = [f"all_{s:010d}{'_ini' * (s in initial and s not in steps[k + 1 :])}" for k, s in enumerate(steps)]
    names = frame_names(follow(script.statements))
    assert names == [f"{name}.dat" for name in expected] and len(set(names)) == 42


def test_names_are_those_that_a_run_writes(tmp_path):
    from hpcdem.lang.zdem.execute import Interpreter
    from hpcdem.physics.dem.simulation import Simulation

    text = "\n".join(
        [
            "START",
            "SET DT 0.05 print 4",
            WALL.strip(),
            "CYC 0",
            "CYC 10",
            "SET print 0",
            "CYC 3",
            "IMPLE wall id 1 xmove 1",
            "IMPLE wall id 1 xmove 1 print 0.3",
            "IMPLE wall id 1 xmove 1 print 0.2",
            "IMPLE wall id 1 xmove 0.04",
            "SET print 7 ps 3",
            "CYC 20",
        ]
    )
    script = parse_text(text, str(tmp_path / "a.py"))
    Interpreter(script).run(Simulation(outdir=tmp_path / "data"))
    runs = follow(script.statements)
    written = {p.name for p in (tmp_path / "data").glob("all_*.dat")}
    assert set(frame_names(runs)) == written
    assert sum(run.files("print") for run in runs) >= len(written)
    assert len(list((tmp_path / "data").glob("*.ps"))) == sum(run.files("ps") for run in runs)
    assert frame_names(follow(parse_text("START\nSET frac 1\n" + WALL + "IMPLE wall id 1 xmove 1").statements)) is None


def test_time():
    lines = ["START", "SET DT 1", "GEN grid rad discrete 1 x 0 200 y 0 200", "CYC 30000"]
    report = examined(*lines)
    assert (report.rate, report.measured, report.work) == (speed.DEFAULT, False, 3 * 10**8)
    assert report.seconds(1) == 30.0 and report.seconds(4) == 7.5
    assert "30 s on 1" in printed(*lines) and "assumed, as no run was measured here yet" in printed(*lines)
    speed.remember(1e6, "linear")
    assert examined(*lines).seconds(1) == 300.0
    assert "5 min on 1" in printed(*lines) and "measured in the last run here" in printed(*lines)
    speed.remember(2e6, "hertz")
    assert examined(*lines, "PROP hertz").seconds(1) == 150.0
    assert "time unknown" in printed("RES a.sav", "CYC 5")


def printed(*lines):
    return " ".join(summary(parse_text("\n".join(lines), "/nowhere/a.py")).split())


def test_output_files_are_listed():
    text = printed(
        "START",
        "SET DT 1 print 10 vtk 20 save 20 outdir out",
        "BALL id 1 x 0 y 0 rad 1",
        "HIST id 4 interval 9 step",
        "PLOT 4 4",
        "CYC 40",
        "EXP xyr.dat",
        "SAV end.sav",
    )
    for words in (
        "out/all_<step>.dat 5 about 14.5 kB",
        "out/all_<step>.vtkhdf 5",
        "out/wall_<step>.vtk 2",
        "out/<step>.sav 2",
        "xyr.dat 1 line 7: particles",
        "end.sav 1 line 8",
        "out/hist_id_4.dat 1",
        "out/hist_4.csv 1",
        "out/hist_4_vs_4.txt",
        "out/hist_4_vs_4.png",
        "out/walls.csv",
    ):
        assert words in text
    assert ".ps" not in text


def test_files_that_could_not_be_written_are_reported(tmp_path):
    report = examined("START", "SAV results/a.sav", file=str(tmp_path / "s.py"))
    assert any("line 2: SAV: folder" in note for note in report.notes)


def test_what_would_be_refused():
    commands = tuple(dataclasses.replace(c, executed=c.name != "DRAW") for c in t.COMMANDS)
    report = examined("START", "", "DRAW wall", table=dataclasses.replace(t.ZDEM, commands=commands))
    assert report.unexecuted == ((3, "DRAW"),)


def test_summary(manual_scripts):
    text = summary(read_script(manual_scripts / "push.py"))
    for words in (
        "106 000",
        "IMPLE wall id 1 xmove 10000.0",
        "about 13 000",
        "data/all_<step>.vtkhdf",
        "about 1 110 000 000",
    ):
        assert words in text
    assert "[" not in text.replace("[red]", ""), "no markup is left"


def test_summary_of_text_that_looks_like_markup():
    assert "SAV [red]a[/].sav" in summary(parse_text("START\nSAV [red]a[/].sav"))


def test_nothing_is_written(tmp_path):
    summary(parse_text("START\nSET DT 1\nCYC 5\nSAV a.sav", str(tmp_path / "a.py")))
    assert list(tmp_path.iterdir()) == []
