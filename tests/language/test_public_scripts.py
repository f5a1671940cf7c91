"""What public ZDEM scripts and readers show beyond the manual: words, histories, pressures, files that are loaded."""

from __future__ import annotations

import io
import math
import re
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError, ScriptError
from hpcdem.core.fields import BOX_IDS
from hpcdem.io.dat import read_dat
from hpcdem.lang.zdem import check
from hpcdem.lang.zdem.execute import Interpreter
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.physics.dem.walls import Walls
from hpcdem.runtime.progress import Log
from tests.support import value, velocity

KN, U = 4.0e4, 0.02
ROWS = [  # five columns of three discs of radius 1, pressed together by U, as platens and a specimen between them
    "SET disk on",
    *(f"GLINE p1 (0.0 {k * (2.0 - U)}) p2 (8.0 {k * (2.0 - U)}) rad 1.0 group {name}"
      for k, name in enumerate(("bom_wall", "rock", "top_wall"))),
    f"PROP density 2500.0 kn {KN} ks {KN}",
    "FIX x y spin",
]  # fmt: skip


def recorded(folder: Path, ident: int) -> list[tuple[int, float]]:
    """The numbers of a history as public readers of ZDEM's files take them: whatever comes up to a line with `hist`,
    two lines of headings, rows of step and value, and a last line that is dropped."""
    lines = (folder / f"hist_id_{ident}.dat").read_text().splitlines()
    first = next(k for k, line in enumerate(lines) if "hist" in line) + 3
    return [(int(a), float(b)) for a, b in (line.split() for line in lines[first:-1])]


def test_histories_have_the_layout_of_public_readers_and_a_table_with_the_time(play, tmp_path):
    play("BALL id 0 x 0 y 0 rad 1", "PROP density 2 xv 3", "HIST id 7 interval 10 step", "CYC 25", "CYC 15")
    assert recorded(tmp_path / "data", 7) == [(k, float(k)) for k in (10, 20, 30, 40)]
    rows = (tmp_path / "data/hist_7.csv").read_text().splitlines()
    assert rows[0] == "step,time [s],step [1]"
    table = [list(map(float, row.split(","))) for row in rows[1:]]
    np.testing.assert_allclose(table, [[k, k * 1e-3, k] for k in (10, 20, 30, 40)], rtol=1e-12)


def test_a_run_that_continues_continues_its_histories(play, tmp_path):
    """The closing line of the run before is no obstacle."""
    play(
        "BALL id 0 x 0 y 0 rad 1", "PROP density 2 xv 3", "HIST id 7 interval 10 step", "CYC 20", "SAV a.sav", "CYC 20"
    )
    play("CYC 30", begin="RES a.sav")
    assert [step for step, _ in recorded(tmp_path / "data", 7)] == [10, 20, 30, 40, 50]


@pytest.mark.parametrize("thickness", [1.0, 2.5])
def test_stress_on_a_platen_of_particles_is_force_over_width_and_thickness(play, tmp_path, thickness):
    play(*ROWS, f"SET thickness {thickness}", "HIST id 1 interval 1 gstress group top_wall",
         "HIST id 2 interval 1 , gstress bom_wall", "CYC 2")  # fmt: skip
    # Five contacts of two springs KN in series, over a row of five discs.
    expected = 5.0 * (KN / 2.0) * U / (10.0 * thickness)
    for ident in (1, 2):
        assert recorded(tmp_path / "data", ident)[-1] == (2, pytest.approx(expected, rel=1e-12))


def test_stress_on_an_upright_platen_is_along_x(play, tmp_path):
    turned = [re.sub(r"p1 \(0.0 (\S+)\) p2 \(8.0 (\S+)\)", r"p1 (\1 0.0) p2 (\2 8.0)", line) for line in ROWS]
    play(*turned, "HIST id 1 interval 1 gstress group top_wall", "CYC 1")
    assert recorded(tmp_path / "data", 1)[-1][1] == pytest.approx(5.0 * (KN / 2.0) * U / 10.0, rel=1e-12)


@pytest.mark.parametrize("bars", ["top_wall|bom_wall", "bom_wall | top_wall", "top_wall| bom_wall"])
def test_strain_is_shortening_over_the_distance_of_the_groups(play, tmp_path, bars):
    play(*ROWS, f"HIST id 1 interval 5 gstrain group {bars}", "PROP yv -0.5 range group top_wall", "CYC 10")
    apart = 2.0 * (2.0 - U)
    assert recorded(tmp_path / "data", 1) == [(k, pytest.approx(0.5 * k * 1e-3 / apart, rel=1e-9)) for k in (5, 10)]


def test_stress_and_strain_of_walls(play, tmp_path):
    """A column of two discs between two walls, one of which comes down; the width is that of the wall."""
    play("SET disk on", "BALL id 0 x 0 y 1.0 rad 1", f"BALL id 1 x 0 y {3.0 - U} rad 1",
         f"PROP density 1.0 kn {KN} ks {KN}", "FIX x y spin",
         f"WALL id 0 nodes (-3.0 {U}) (2.0 {U}) kn {KN}",
         f"WALL id 3 nodes (-2.0 {4.0 - 2 * U}) (2.0 {4.0 - 2 * U}) kn {KN}",
         "HIST id 1 interval 1 , wall id 3 ystress", "HIST id 2 interval 1 ystress wall 0",
         "HIST id 3 interval 1 , ystrain wall 0|3", "WALL id 3 yv -1.0", "CYC 2")  # fmt: skip
    data = tmp_path / "data"
    assert recorded(data, 1)[-1][1] == pytest.approx((KN / 2.0) * (U + 0.002) / 4.0, rel=1e-9)
    assert recorded(data, 2)[-1][1] == pytest.approx((KN / 2.0) * U / 5.0, rel=1e-9)
    assert recorded(data, 3)[-1][1] == pytest.approx(0.002 / (4.0 - 3 * U), rel=1e-9)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("HIST id 1 interval 1 gstress group nobody", "no particle is in group nobody"),
        ("HIST id 1 interval 1 gstrain group rock|nobody", "no particle is in group nobody"),
        ("HIST id 1 interval 1 ystress wall 4", "there is no wall with id 4"),
        ("WALL id 4 nodes (0 -9) (0 9)\nHIST id 1 interval 1 ystress wall 4", "the wall has no width across y"),
        ("WALL id 4 nodes (0 9) (9 9)\nWALL id 5 nodes (9 9) (18 9)\nHIST id 1 interval 1 ystrain wall 4|5",
         "the walls are not apart in y"),
        ("SET energy 1\nPROP xp 1e3", "does not support xp and yp"),
        ("PROP xp 1e3\nSET energy 1", "does not support xp and yp"),
    ],
)  # fmt: skip
def test_what_cannot_be_recorded_is_refused_in_its_line(play, line, message):
    with pytest.raises(ScriptError, match=re.escape(message)) as caught:
        play(*ROWS, *line.split("\n"), "CYC 1")
    assert caught.value.line == 2 + len(ROWS) + line.count("\n") + 1


@pytest.mark.parametrize(
    ("disk", "mass"), [("on", 2000.0 * math.pi * 0.09), ("off", 2000.0 * 4.0 / 3.0 * math.pi * 0.027)]
)
@pytest.mark.parametrize("thickness", [1.0, 0.6])
def test_pressure_pushes_freed_particles(play, disk, mass, thickness):
    """Force = p 2 R thickness, from the end of the first step on; those that are fixed stay."""
    sim, log = play(f"SET disk {disk} thickness {thickness}", "BALL id 0 x 0 y 0 rad 0.3", "BALL id 1 x 5 y 0 rad 0.3",
                    "BALL id 2 x 9 y 0 rad 0.3", "PROP density 2000.0", "INI xp 10e3 yp -2e3 RANGE id 0 1",
                    "FIX x RANGE id 1", "CYC 4")  # fmt: skip
    push = np.array([10e3, -2e3]) * 0.6 * thickness
    np.testing.assert_allclose(velocity(sim, 0), 3 * 1e-3 * push / mass, rtol=1e-12)
    np.testing.assert_allclose(velocity(sim, 1), [0.0, 3e-3 * push[1] / mass], rtol=1e-12)
    assert not velocity(sim, 2).any()
    assert "warning: xp, yp: the force on each particle is pressure 2 R thickness" in log


def test_pressure_is_in_frames_and_ends_when_it_is_taken_back(play, tmp_path):
    lines = ["SET print 2", "BALL id 0 x 0 y 0 rad 0.5", "BALL id 1 x 9 y 0 rad 0.5", "PROP density 2.0"]
    sim, _ = play(*lines, "PROP xp 100.0 RANGE id 1", "CYC 2", "PROP xp 0.0", "CYC 2")
    p = read_dat(tmp_path / "data/all_0000000002.dat").tables["particles"].columns
    assert (p["push_x"].tolist(), p["push_y"].tolist()) == ([0.0, 100.0], [0.0, 0.0])
    assert "push_x" not in read_dat(tmp_path / "data/all_0000000004.dat").tables["particles"].columns
    # Forces of one step act in the next: two steps with it, one more with what was stored.
    assert value(sim, "vx", 1) == pytest.approx(2 * 1e-3 * 100.0 / (2.0 * math.pi * 0.25))


def test_rubber_marks_bonds_and_changes_nothing_else(play, tmp_path):
    lines = [*ROWS, "SET print 5", "FREE x y RANGE group rock"]
    bonded = "PROP ebmod 1e6 gbmod 1e6 tstrength 1e9 sstrength 1e9"
    plain, _ = play(*lines, bonded, "CYC 5")
    places = plain.particles["y"].copy()
    marked, log = play(*lines, f"{bonded} rubber RANGE group rock", f"{bonded} RANGE group top_wall", "CYC 5")
    assert "has no effect on the motion" in log
    bonds = read_dat(tmp_path / "data/all_0000000005.dat").tables["bonds"].columns
    assert sorted(set(bonds["rubber"].tolist())) == [0, 1] and bonds["rubber"].sum() == 4
    marked, _ = play(*lines, f"{bonded} rubber", "CYC 5")
    assert marked.particles["y"].tolist() == places.tolist()


def test_words_of_public_scripts(play, tmp_path):
    """A script of our own in the manner of the published ones, with their slip of the pen, xm, log, pause, -bline."""
    sim, log = play(
        "log on", "set disk off, dt 1e-3, GRAVTIY=(0.0, -9.8)", "WALL id 0 nodes (0 0) (9 0) color=1",
        "ball id 0 x 4.0 y 0.5 rad 0.5", "prop den 2.5e3 shear 2.9e9 poiss 0.2 damping 0.7 hertz",
        "draw interval 100 -bline bfill bondc wall", "pause", "wall id 0 xv 0.5", "imple wall id 0 xm 0.01 print 0.005",
    )  # fmt: skip
    assert (sim.settings.gy, sim.clock.step) == (-9.8, 20)
    assert sim.drawing == (100, ("bfill", "bondc", "wall"))
    assert "script.py:4: SET: 'GRAVTIY' is interpreted as gravity, which begins like it" in log
    assert "script.py:7: PROP: 'damping' is interpreted as damp" in log
    assert "PAUSE: runs are not interactive" in log and "LOG: the log goes to standard output" in log
    assert log.count("warning:") <= 3
    script = parse_text("START\nSET DT 1 gravtiy (0 1)\nCYC 1\n", "a.py")
    assert "note: line 2: SET: 'gravtiy' is interpreted as gravity" in check.summary(script)


@pytest.mark.parametrize("blank", [" ", "\t", "   \t "])
def test_a_group_may_be_the_fourth_column_of_a_file(play, tmp_path, blank):
    rows = [("1.0", "2.0", "0.5", "sed"), ("3.0", "2.0", "0.25", "base"), ("5.0", "2.0", "0.25", "sed")]
    (tmp_path / "a.dat").write_text("\n".join(blank.join(row) for row in rows) + "\n")
    sim, _ = play(begin="LOAD a.dat")
    assert [sim.groups[g] for g in sim.particles["group"]] == ["sed", "base", "sed"]


# ---- walls of BOX ----------------------------------------------------------------------------------------------------


def test_box_has_the_walls_of_zdem_first_in_its_order(play, tmp_path):
    play("SET print 1", "WALL id 7 nodes (1 1) (2 1)", "BOX left 0 right 10 bottom -1 height 5",
         "BALL id 0 x 4 y 3 rad 0.5", "PROP density 1", "CYC 1")  # fmt: skip
    walls = read_dat(tmp_path / "data/all_0000000001.dat").walls
    assert walls["id"].tolist() == [100, 101, 102, 103, 7]
    ends = np.hstack([walls["p1"], walls["p2"]])[:4].tolist()
    assert ends == [[0, -1, 10, -1], [10, -1, 10, 4], [10, 4, 0, 4], [0, 4, 0, -1]]
    assert [row.split(",")[2] for row in (tmp_path / "data/walls.csv").read_text().splitlines()[1:]] == [
        "100", "101", "102", "103", "7"
    ]  # fmt: skip


def test_sides_of_box_can_be_changed_and_moved_by_their_ids(play):
    sim, _ = play("BOX left 0 right 10 bottom 0 height 5 kn 1", "WALL id 103 xv 2.0 kn 5.0",
                  "BALL id 0 x 4 y 3 rad 0.5", "PROP density 1", "IMPLE wall id 103 xmove 1.0")  # fmt: skip
    row = sim.walls.row(103)
    assert sim.clock.step == 500 and sim.walls.p1[row, 0] == pytest.approx(1.0) and sim.walls.kn[row] == 5.0
    assert sim.walls.box()[0] == pytest.approx(1.0)  # particles to the left of it have left the BOX


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["BOX left 0 right 10 bottom 0 height 5", "WALL id 101 nodes (0 0) (1 1)"], "wall 101 is a side of BOX"),
        (["WALL id 102 nodes (0 0) (1 1)", "BOX left 0 right 10 bottom 0 height 5"], "wall 102 exists already"),
    ],
)
def test_ids_of_box_are_its_own(lines, message):
    with pytest.raises(ScriptError, match=message) as caught:
        parse_text("\n".join(["START", *lines]) + "\n", "a.py")
    assert caught.value.line == 3


def test_without_box_its_ids_are_free(play):
    sim, _ = play("WALL id 100 nodes (0 0) (1 1)", "WALL id 100 fric 0.5")
    assert sim.walls.id.tolist() == [100] and sim.walls.box() is None


@pytest.mark.parametrize(("own", "bottom"), [(7, 100), (100, -3)])
def test_walls_of_older_checkpoints_keep_their_meaning(own, bottom):
    """BOX gets its present ids; where a wall of the user has one of them, both keep what they have."""
    old = Walls()
    old.put(own, (0.0, 0.0), (1.0, 0.0))
    for number, (side, nodes) in enumerate(
        {
            "left": ((0, 5), (0, 0)),
            "right": ((9, 0), (9, 5)),
            "bottom": ((0, 0), (9, 0)),
            "top": ((9, 5), (0, 5)),
        }.items()
    ):
        old.put(-1 - number, *nodes, one_sided=True)
        old.kn[1 + number] = list(BOX_IDS).index(side)
    columns = {name: getattr(old, name).tolist() for name in Walls.COLUMNS if name != "side"}
    walls = Walls()
    walls.take_columns(columns)
    assert walls.box() == (0.0, 9.0, 0.0, 5.0)
    assert walls.id[walls.in_output_order()[0]] == bottom and walls.kn[walls.in_output_order()].tolist() == [
        0,
        1,
        2,
        3,
        0,
    ]
    assert walls.find(own) == 0 and walls.one_sided.tolist() == [False, True, True, True, True]
    again = Walls()
    again.take_columns({name: getattr(walls, name).tolist() for name in Walls.COLUMNS})
    assert again.id.tolist() == walls.id.tolist() and again.box() == walls.box()
    with pytest.raises(CommandError, match="zero length"):
        again.put_side("left", (0.0, 0.0), (0.0, 0.0))


def test_coincident_walls_of_box_and_script_both_push(play):
    lines = ["SET disk on", "BALL id 0 x 4 y 0.9 rad 1", "PROP density 1e3 kn 1e4 ks 1e4"]
    box, wall = "BOX left -9 right 9 bottom 0 height 9 kn 1e4", "WALL id 0 nodes (-9 0) (9 0) kn 1e4"
    alone, _ = play(*lines, box, "CYC 1")
    both, _ = play(*lines, box, wall, "CYC 1")
    assert (
        both.lists.owned_forces()[0, 1]
        == pytest.approx(2.0 * alone.lists.owned_forces()[0, 1])
        == pytest.approx(2 * 0.1 * 5e3)
    )


# ---- LOAD of frames --------------------------------------------------------------------------------------------------

SETTLED = [
    "SET disk off gravity 0.0 -9.8 print 50 dt 0.01",
    "BOX left -50.0 right 450.0 bottom -50.0 height 500.0",
    "WALL id 0 nodes (0.0, 0.0) (400.0, 0.0) fric 0.2",
    "WALL id 1 nodes (0.0, 300.0) (0.0, 0.0) fric 0.1",
    "GEN num 30 rad discrete 20.0 25.0 x (0.0, 400.0) y (0.0, 300.0) group sand",
    "PROP density 2400.0 fric 0.3 shear 2.0e8 poiss 0.25 damp 0.4 hertz",
    "CYC 900",
    "PROP ebmod 1e8 gbmod 5e7 tstrength 1e6 sstrength 2e6 range x (0.0, 250.0)",
    "PROP color red group left range x 0.0 100.0",
    "FIX spin RANGE id 3",
    "WALL id 1 xv 5.0",
    "CYC 100",
]


def test_a_frame_is_loaded_with_all_that_it_holds(play, tmp_path):
    """The next hundred steps go as those of the run itself, as far as the digits of a text allow."""
    whole, _ = play(*SETTLED, "SAV end.sav", "CYC 100")
    loaded, log = play(begin="LOAD all_0000001000.dat")
    saved, _ = play(begin="RES end.sav")
    assert "is a frame: " in log and "of step 1000" in log
    assert (loaded.clock.step, loaded.settings.dt, loaded.settings.gy, loaded.settings.disk) == (
        1000,
        0.01,
        -9.8,
        "off",
    )
    assert loaded.bonds == saved.bonds_left() > 5
    order, other = np.argsort(loaded.particles["gid"]), np.argsort(saved.particles["gid"])
    for name in ("gid", "fix", "color"):
        assert loaded.particles[name][order].tolist() == saved.particles[name][other].tolist()
    assert [loaded.groups[k] for k in loaded.particles["group"][order]] == [
        saved.groups[k] for k in saved.particles["group"][other]
    ]
    assert {i: tuple(loaded.walls.p1[loaded.walls.row(i)]) for i in (0, 1, 100, 103)} == {
        i: pytest.approx(tuple(saved.walls.p1[saved.walls.row(i)])) for i in (0, 1, 100, 103)
    }
    on, _ = play("WALL id 1 fric 0.1", "CYC 100", begin="LOAD all_0000001000.dat")
    gid = whole.particles["gid"]
    assert on.clock.step == whole.clock.step == 1100 and on.bonds_left() == whole.bonds_left()
    assert on.clock.time == pytest.approx(whole.clock.time)
    for k in gid:
        for name, size in (("x", 1e-5), ("y", 1e-5), ("vx", 1e-5), ("spin", 1e-6)):
            assert value(on, name, k) == pytest.approx(value(whole, name, k), abs=size), (name, k)


def test_a_frame_in_part(play, tmp_path):
    play(*SETTLED)
    sim, _ = play(begin="LOAD all_0000001000.dat x 0.0 200.0")
    assert 0 < len(sim.particles) < 30 and sim.particles["x"].max() < 200.0
    assert set(sim.hist.partner[sim.hist.partner >= 0]) <= set(sim.particles["gid"].tolist())
    sim, _ = play("CYC 5", begin="LOAD all_0000001000.dat x 0.0 200.0")
    script = parse_text("LOAD all_0000001000.dat x 0.0 200.0\nCYC 5\n", str(tmp_path / "b.py"))
    assert check.examine(script).particles == len(sim.particles)


ZDEM = Path(__file__).parents[1] / "unit/io_zdem_2.2.dat"
BONDS = """       id1        id2         Fn         Fs   globalFx   globalFy         kn         ks     n_bond     s_bond       frci  slip         Un    realkn     realks   rubber  type
"""  # noqa: E501


def with_bond(strength: str) -> str:
    row = (
        f"         0          4 -1.000e+00  0.000e+00 -1.000e+00 0.000e+00 0.0 0.0 {strength} 0.0 0 -1.0 0.0 0.0 1 1\n"
    )
    text = ZDEM.read_text()
    assert text.count(BONDS) == 1
    return text.replace(BONDS, BONDS + row)


def test_a_frame_of_zdem(play, tmp_path):
    (tmp_path / "a.dat").write_text(with_bond("5.0e5 7.0e5"))
    sim, log = play(begin="LOAD a.dat")
    assert sim.particles["gid"].tolist() == [0, 4, 7] and (sim.clock.step, sim.clock.time) == (100, 2.0)
    assert velocity(sim, 7).tolist() == [1.75, 0.125] and value(sim, "fix", 7) == 5
    m = sim.materials.rows[sim.particles["material"]]
    assert (
        m["shear"].tolist() == [2.9e9] * 3
        and m["hertz"].tolist() == [1, 1, 0]
        and m["density"].tolist() == [2500.0] * 3
    )
    assert sim.walls.id.tolist() == [100, 0] and sim.walls.v[1].tolist() == [2.0, 0.0]
    assert sim.bonds == 1 and sim.bond_types.rows[1].tolist() == (2.0, 0.0, 0.0, 5e5, 7e5, 1.0, 0.0, 0.0)
    assert sim.settings.gy == -9.81 and sim.settings.lsm == 0.25
    (tmp_path / "a.dat").write_text(with_bond("0.0 0.0"))
    sim, log = play(begin="LOAD a.dat")
    assert sim.bonds == 0 and "does not contain the strength of 1 of its bonds" in log


def test_a_frame_of_an_earlier_version(play, tmp_path):
    """Fewer columns, BOX with ids -1 to -4, settings one by one."""
    play(*SETTLED)
    text = (tmp_path / "data/all_0000001000.dat").read_text()
    for old, new in zip(("100", "101", "102", "103"), (" -3", " -2", " -4", " -1")):
        text = re.sub(rf"^(\s+[0-3]\s+){old} ", rf"\g<1>{new} ", text, flags=re.MULTILINE)
        text = re.sub(rf"^(\s+){old} (\s+\d+ .*)", rf"\g<1>{new} \g<2>", text, flags=re.MULTILINE)
    text = text.replace("gravity : ", "ignored : ").replace("\nball_num:", "\ngx: 0.0\ngy: -9.8\nball_num:")
    (tmp_path / "old.dat").write_text(text)
    new, _ = play("CYC 10", begin="LOAD all_0000001000.dat")
    old, _ = play("CYC 10", begin="LOAD old.dat")
    assert old.settings.gy == -9.8 and old.walls.box() == new.walls.box() and old.walls.find(100) is not None
    assert np.sort(old.particles["y"]).tolist() == np.sort(new.particles["y"]).tolist()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda t: t.replace("1.005000000000e+02", "nan"), "particle 0 has no position or size"),
        (lambda t: t.replace("2.50e-01  -5.00e-01", "nan  -5.00e-01"), "vx of particle 0 is not a number"),
        (lambda t: t[: t.index("8.0000000000")], "rows of unequal length"),
        (lambda t: t.replace("ball num : 3", "ball num : 5"), "5 balls announced, 3 found"),
        (
            lambda t: re.sub(r"^(\s+1\s+)0(\s+0.000e\+00)", r"\g<1>100\2", t, flags=re.MULTILINE),
            "refers to the unknown wall 0",
        ),
        (
            lambda t: re.sub(
                r"^(\s+1\s+)0 ",
                r"\g<1>100 ",
                t.replace("         0          4  2.505", "       100          4  2.505"),
                flags=re.MULTILINE,
            ),
            "two walls have the same id",
        ),
    ],
)
def test_damaged_frames_are_refused_in_their_line(play, tmp_path, change, message):
    text = change(ZDEM.read_text())
    assert text != ZDEM.read_text()
    (tmp_path / "a.dat").write_text(text)
    with pytest.raises(ScriptError, match=message) as caught:
        play(begin="LOAD a.dat")
    assert caught.value.line == 1
    (tmp_path / "b.dat").write_text(ZDEM.read_text())
    with pytest.raises(ScriptError, match="scale 2 is for files of x y r"):
        play(begin="LOAD b.dat scale 2.0")


def test_a_sav_of_zdem_is_named_for_what_it_is(play, tmp_path):
    (tmp_path / "0000046000.sav").write_bytes(b"2.2(2022-05-11)\n" + bytes(range(256)) * 20)
    with pytest.raises(ScriptError) as caught:
        play(begin="RES 0000046000.sav")
    text = str(caught.value)
    assert "Only ZDEM reads its own .sav files" in text and "LOAD" in text and "EXP" in text
    assert "HDF5" not in text and caught.value.line == 1


# ---- refusals before the run -----------------------------------------------------------------------------------------

SAND = "GEN num 5 rad discrete 0.5 x (0 10) y (0 10)"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([SAND, "PROP density 1 kn 1e4 ks 1e4", f"{SAND} group sed", "PROP density 1 range group sed", "CYC 500"],
         r"script.py:7: CYC: 5 particles have no contact law, .*: 5 of group sed, created in line 5$"),
        ([SAND, "PROP density 1 shear 1e9 poiss 0.2 hertz", f"{SAND} group sed", "BALL id 99 x 50 y 50 rad 1 group b",
          "PROP density 1 range group sed", "PROP density 1 range group b", "CYC 500"],
         ":9: CYC: 6 particles .* law.*: 5 of group sed, created in line 5; 1 of group b, created in line 6"),
        ([f"{SAND} group sand", "CYC 1"],
         "script.py:4: CYC: 5 particles that are free to move have no density .*: 5 of group sand, created in line 3$"),
    ],
)  # fmt: skip
def test_grains_without_density_or_law_are_refused_before_the_first_step(play, tmp_path, lines, message):
    with pytest.raises(ScriptError, match=message):
        play(*lines)
    assert not (tmp_path / "data").exists()


def test_fixed_particles_without_a_law_are_reported(play):
    """They may be out of reach of all others."""
    lines = [SAND, "PROP density 1 shear 1e9 poiss 0.2 hertz", "BALL id 99 x 50 y 50 rad 1 group b"]
    _, log = play(*lines, "FIX x y spin range group b", "CYC 5", "CYC 5")
    assert log.count("warning: 1 particles that are fixed have no contact law") == 1
    assert "error: 1 of group b, created in line 5" in log
    _, log = play(*lines, "PROP shear 1e9 hertz", "FIX x y spin range group b", "CYC 5")
    assert "warning" not in log


def test_particles_without_any_law_may_fly(play):
    sim, _ = play(SAND, "PROP density 1 yv 1", "CYC 10")
    assert sim.clock.step == 10


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (["GEN num 5 rad discrete 0.5 x (0 10) y (0 10), COLOR gb", "GROUP sed"],
         "read 'GROUP' at column 1, expected a command; it may be the rest of line 2"),
        (["DEL", "RANGE y 0 1"], "RANGE is not a command.*; it may be the rest of line 2"),
        (["GEN num 5 rad discrete 0.5", "x (0 10) y (0 10)"], "x, y missing"),
        (["GEN num 5 rad discrete 0.5 x (0 10) y (0 10) GROUP", "sed"], "a group name is expected; a command is one"),
    ],
)  # fmt: skip
def test_lines_that_a_pdf_broke(lines, message):
    with pytest.raises(ScriptError, match=message):
        parse_text("\n".join(["START", *lines]) + "\n", "a.py")


def test_two_bounds_that_may_be_an_expression_with_a_blank_are_reported(play):
    _, log = play("BALL id 0 x 0 y 0 rad 1", "PROP color red RANGE y {top} -1000.0")
    assert "'{top}' and '-1000.0' are interpreted as two bounds of y; blanks are not allowed" in log
    _, log = play(
        "BALL id 0 x 0 y 0 rad 1", "PROP color red RANGE y -1000.0 {top}", "PROP color red RANGE y {top}-9 {top}"
    )
    assert "warning" not in log


def test_the_log_of_a_run_that_continues_counts_from_the_beginning_of_the_command(play, tmp_path):
    text = (
        "START\nSET dt 1e-3 stepbar 25\nBALL id 0 x 0 y 0 rad 1\nPROP density 1\nWALL id 1 nodes (9 9) (9 8) xv 1.0\n"
    )
    text += "IMPLE wall id 1 xmove 0.1 save 0.05\n"
    script = parse_text(text, str(tmp_path / "script.py"))
    first = Simulation(SerialComm(), 1, tmp_path / "data", Log(0, io.StringIO()))
    Interpreter(script).run(first)

    from hpcdem.physics.dem import saved_state

    out = io.StringIO()
    again = Simulation(SerialComm(), 1, tmp_path / "data", Log(0, out))
    found = saved_state.restore(again, tmp_path / "data/0000000050.sav")
    again.progress = found["progress"]
    again.log.script_started("script.py", 100, 50)
    again.log.set_interval(explicit=True)
    Interpreter(script).run(again, resume=found["position"], saved_script=found["script"])
    assert "line 6: IMPLE, 100 steps, 50 left" in out.getvalue()
    assert "step 75 | IMPLE 75.0% | script 75.0%" in out.getvalue()
    assert "step 100 | IMPLE 100.0% | script 100.0%" in out.getvalue()
