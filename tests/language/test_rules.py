"""What the manual says a command does is what it does: scripts are run, and the model is looked at.

Sources: ZDEM manual 2.x, preface ("script conventions"), chapter 7 (command reference), chapter 14 (change log). Where
the manual is silent the rule is that of docs/zdem_reference.md.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from hpcdem.commands.dem.bonds import _slots
from hpcdem.core.errors import ScriptError
from hpcdem.physics.dem.simulation import Simulation
from tests.support import at_wall, body, force, pair, position, value, velocity
from tests.tables import each


def model(play, *lines: str, **how) -> Simulation:
    return play(*lines, **how)[0]


def ids(sim: Simulation, column: str, wanted: int) -> list[int]:
    """Ids of the particles with this value of an integer field."""
    return sorted(sim.particles["gid"][sim.particles[column] == wanted].tolist())


def rows(path: Path) -> list[list[str]]:
    return [line.split() for line in path.read_text().splitlines()]


def frames(folder: Path, suffix: str = ".dat") -> list[str]:
    """Steps of the frames in order, with "_ini" where that stands: ["0_ini", "40"]."""
    found = [frame for p in folder.glob(f"all_*{suffix}") if (frame := p.name.removesuffix(suffix)[4:])]
    return [f"{int(name[:10])}{name[10:]}" for name in sorted(found)]


RED, BLUE = 3, 7
ROW = [f"BALL id {k} x {float(k)} y {0.5 * k} rad 0.25" for k in range(10)]
"""Ten particles apart from each other on the line y = x / 2."""
PAIR = ["BALL id 1 x 0 y 0 rad 1", "BALL id 2 x 2 y 0 rad 1", "PROP density 1000 kn 4e6 ks 4e6 fric 0.5"]


# ---- preface -------------------------------------------------------------------------------------------------------


def test_case_separators_and_comments_do_not_matter(play):
    plain = model(play, "BALL id 3 x 1.5 y 2 rad 0.5 color red group Sed", "PROP density 10 RANGE group sed")
    odd = model(play, "bAlL=(ID,3),,X=1.5 y(2) RAD 5E-1,Color=RED ! 颗粒", "; 中文", "prop DEN,10 # all",
                "PROP GROUP sed")  # fmt: skip
    for name in ("x", "y", "radius", "gid", "color"):
        assert value(plain, name, 3) == value(odd, name, 3)
    assert plain.groups[1:] == odd.groups[1:] == ["sed"]


# ---- ball, gen, gline ----------------------------------------------------------------------------------------------


def test_ball(play):
    sim = model(play, "BALL ID=0 X=2.0 Y=0.5 RAD=0.5 COLOR=blue", "BALL id 7 x 9 y 9 rad 2")
    assert [value(sim, n, 0) for n in ("x", "y", "radius", "color")] == [2.0, 0.5, 0.5, BLUE]
    assert value(sim, "color", 7) == 0 and sim.groups[int(value(sim, "group", 7))] == "***"
    assert not velocity(sim, 7).any()


def test_ids_of_the_deleted_are_not_used_again(play):
    sim = model(play, *ROW, "DEL RANGE id 4 9", "GEN num 1 rad discrete 1 x (50 60) y (0 10)")
    assert sorted(sim.particles["gid"]) == [0, 1, 2, 3, 10]


def test_gen_fills_the_rectangle_without_overlap(play):
    sim, log = play("GEN NUM 2000.0, rad discrete 0.3 0.4, x (1 21), y (2 12), COLOR red GROUP sand")
    x, y, r = (sim.particles[n] for n in ("x", "y", "radius"))
    assert set(r) == {0.3, 0.4} and ids(sim, "color", RED) == sorted(sim.particles["gid"])
    assert (x - r).min() >= 1 and (x + r).max() <= 21 and (y - r).min() >= 2 and (y + r).max() <= 12
    gap = np.hypot(x[:, None] - x, y[:, None] - y) - (r[:, None] + r) + np.eye(len(x)) * 9
    assert gap.min() >= 0.0
    assert 0.45 < math.pi * (r**2).sum() / 200 < 0.56, "as full as random insertion gets"
    assert f"GEN: 2000 requested, {len(x)} placed" in log


def test_gen_draws_repeated_radii_more_often(play):
    sim = model(play, "GEN num 3000 rad discrete 1 1 1 2 x (0 1000) y (0 1000)")
    assert (sim.particles["radius"] == 1).mean() == pytest.approx(0.75, abs=0.03)


def test_gen_between_the_extents_of_the_model(play):
    sim = model(play, "BALL id 0 x 0 y 0 rad 1", "BALL id 1 x 100 y 50 rad 2",
                "GEN num 40 rad discrete 1 x ({left}, {right}) y ({top}-20.0, {top}) GROUP sed1")  # fmt: skip
    new = sim.particles["gid"] > 1
    x, y = sim.particles["x"][new], sim.particles["y"][new]
    assert new.sum() == 40
    assert x.min() >= 0 and x.max() <= 101 and y.min() >= 33 and y.max() <= 51
    assert x.max() - x.min() > 80 and y.max() - y.min() > 12


def test_a_full_box_takes_no_more_and_says_so(play):
    sim, log = play("GEN grid rad discrete 1 x (0 20) y (0 20)", "GEN num 100 rad discrete 1 x (0 20) y (0 20)", "STOP")
    assert len(sim.particles) == 100
    assert [line for line in log.splitlines() if "GEN" in line] == [
        "GEN: 100 requested, 0 placed in 1000 attempts, 0.0 % of the area covered"
    ]


def test_gen_grid_and_idmin(play):
    sim = model(play, "GEN grid idmin 40 rad discrete 0.5 1 x (0 10) y (0 6) group g", "BALL id 100 x 50 y 0 rad 1")
    grid = sim.particles["gid"] < 100
    assert sorted(sim.particles["gid"][grid]) == list(range(40, 55)), "5 x 3 nodes two largest radii apart"
    assert sorted(set(sim.particles["x"][grid])) == [1, 3, 5, 7, 9]
    assert set(sim.particles["radius"][grid]) == {0.5, 1.0}
    again = model(play, "GEN grid idmin 40 rad discrete 1 x (0 4) y (0 4)", "GEN grid rad discrete 1 x (9 11) y (0 2)")
    assert sorted(again.particles["gid"]) == [40, 41, 42, 43, 44]


def test_idmin_does_not_take_ids_twice(play):
    with pytest.raises(ScriptError, match=r"script.py:4: GEN: idmin 3: ids below 4 are or were in use"):
        play("GEN grid rad discrete 1 x (0 4) y (0 4)", "GEN grid idmin 3 rad discrete 1 x (9 11) y (0 2)")


def test_seed(play):
    line = "GEN num 20 rad discrete 1 x (0 90) y (0 90)"
    x = [model(play, *extra, line).particles["x"].copy() for extra in ([], ["SET seed 5"], ["SET seed 1"])]
    assert np.array_equal(x[0], x[1]) and not np.array_equal(x[0], x[2])


def test_gline_and_cratio(play):
    """0.8 is the manual's example: centres (0.5 + 0.5) 0.8 apart."""
    line = "GLINE RAD=0.5 P1 ( 2.0 10.0 ) P2 ( 40.0 10.0 ), kn=4.14e3 ks=2e3 fric=0.55 color=red GROUP=bom"
    touching, dense = model(play, line), model(play, f"{line} CRATIO=0.8")
    assert np.array_equal(np.sort(touching.particles["x"]), 2.0 + np.arange(39.0))
    assert np.allclose(np.sort(dense.particles["x"]), 2.0 + 0.8 * np.arange(48))
    material = touching.materials.rows[touching.particles["material"][0]]
    assert (material["kn"], material["ks"], material["fric"]) == (4.14e3, 2e3, 0.55)
    assert set(touching.particles["color"]) == {RED} and touching.groups[-1] == "bom"


# ---- range ---------------------------------------------------------------------------------------------------------

CHOSEN = [
    ("x (1.0 4.0)", [1, 2, 3]),
    ("x (1.0 8.0) y (1.0 2.0)", [2, 3]),
    ("x 0 9 y 1.0, 999.0", [2, 3, 4, 5, 6, 7, 8]),
    ("x (1.0 5.0) y (0 1.0) AND group odd", [1]),
    ("x (1.0 5.0) y (0 1.0) OR group odd", [1, 3, 5, 7, 9]),
    ("P4 (0.5 0) (4.5 0) (4.5 9) (0.5 9)", [1, 2, 3, 4]),
    ("P4 (0.5 9) (4.5 9) (4.5 0) (0.5 0)", [1, 2, 3, 4]),
    ("P4 (2e-1 -1) (3 -1) (6 -1) (4.0 2.5)", [3, 4]),  # three corners in a row
    ("x (1.0 9.0) y (0 9) AND P4 (0.5 0) (4.5 0) (4.5 9) (0.5 9)", [1, 2, 3, 4]),
    ("x (7 9) y (0 9) OR P4 (0.5 0) (4.5 0) (4.5 9) (0.5 9)", [1, 2, 3, 4, 7, 8]),
    ("ellipse (4 2) 2.0 1.5", [3, 4, 5]),
    ("ellipse (4 2) 2.5 2.5", [2, 3, 4, 5, 6]),
    ("ellipse (4 2) 2.0 0.0", []),
    ("group odd", [1, 3, 5, 7, 9]),
    ("group ODD", [1, 3, 5, 7, 9]),
    ("group odd and group even", list(range(10))),  # a particle is in one group: the manual's base means either
    ("group odd or group even", list(range(10))),
    ("group odd and x 2 6", [3, 5]),
    ("id 4", [4]),
    ("id 4 6", [4, 5, 6]),
    ("id 1 2 or id 8 9", [1, 2, 8, 9]),
    ("id 1 2 or id 8 9 and group odd", [1, 9]),  # from left to right
    ("y {top}-1.0, {top}", [8, 9]),  # top is 4.75
    ("y {bottom} {top}*0.5", [0, 1, 2, 3, 4]),
    ("x {left} {right}/2+0.5", [0, 1, 2, 3, 4, 5]),
    ("x {right}-2.25 {right}", [7, 8, 9]),
    ("x {left}-1 {right}+1 y 2 4", [4, 5, 6, 7]),
    ("group nobody", []),
]


@each(("where", "chosen"), CHOSEN, ids=[where for where, _ in CHOSEN])
def test_range(play, where, chosen):
    groups = ["PROP group even", "PROP group odd RANGE id 1 or id 3 or id 5 or id 7 or id 9"]
    sim = model(play, *ROW, *groups, f"PROP color red RANGE {where}")
    assert ids(sim, "color", RED) == chosen


def test_without_range_all_are_meant(play):
    assert len(ids(model(play, *ROW, "prop coloe red"), "color", RED)) == 10


def test_extents_are_those_of_particles_that_can_move(play):
    """A base that is fixed in x and y does not count; one that is fixed in one of them does."""
    fixed = ["FIX x y RANGE id 9", "FIX y RANGE id 8", "PROP color red RANGE x {right}-0.75 99"]
    assert ids(model(play, *ROW, *fixed), "color", RED) == [8, 9]
    assert value(model(play, *ROW, "FIX x y", "FREE y RANGE id 5", "PROP color red RANGE x {left} {right}"), "color", 5)


def test_a_group_that_is_not_there_is_reported(play):
    _, log = play(*ROW, "PROP color red RANGE group sedd")
    assert "warning: no particle has ever been in group sedd" in log


def test_a_particle_is_in_one_group(play):
    sim = model(play, *ROW, "PROP group a", "PROP group b RANGE id 0 4", "PROP color red RANGE group a")
    assert ids(sim, "color", RED) == [5, 6, 7, 8, 9]


# ---- del, exp, load, sav, res --------------------------------------------------------------------------------------


def test_del_takes_contacts_and_bonds_along(play):
    sim = model(play, *PAIR, "BALL id 3 x 4 y 0 rad 1", "PROP density 1000 kn 4e6", "PROP n_bond 1e9", "CYC 1",
                "DEL RANGE x 3 5", "CYC 1")  # fmt: skip
    assert sorted(sim.particles["gid"]) == [1, 2] and sim.bonds_left() == 1
    assert len(model(play, *ROW, "DEL RANGE y 1.0 3.0").particles) == 6
    assert len(model(play, *ROW, "DEL").particles) == 0


def test_the_last_particle_may_go(play):
    """A model may run empty and be filled again; the bonds of those before are forgotten."""
    sim, log = play(*PAIR, "PROP n_bond 1e9", "CYC 1", "DEL", "WALL id 1 nodes (0 0) (0 9) xv 2", "CYC 5", *PAIR[:1],
                    "PROP density 1 kn 1", "CYC 1")  # fmt: skip
    assert sim.clock.step == 7 and len(sim.particles) == 1 and "unseen" not in log


def test_exp(play, tmp_path):
    """x y r [group], 1000 <= y < 2000."""
    play(*ROW, "PROP group bom RANGE id 0 1", "EXP all.dat", "EXP group.dat GROUP", "EXP bom.dat range group bom",
         "EXP some.dat GROUP range y 1.0 2.0")  # fmt: skip
    assert len(rows(tmp_path / "all.dat")) == 10
    assert rows(tmp_path / "all.dat")[3] == ["3.000000000000e+00", "1.500000000000e+00", "2.500000000000e-01"]
    assert [row[3] for row in rows(tmp_path / "group.dat")] == ["bom"] * 2 + ["***"] * 8
    assert [float(row[0]) for row in rows(tmp_path / "bom.dat")] == [0.0, 1.0]
    assert [row[1:4:2] for row in rows(tmp_path / "some.dat")] == [
        ["1.000000000000e+00", "***"], ["1.500000000000e+00", "***"],
    ]  # fmt: skip


def test_load(play, tmp_path):
    (tmp_path / "xyr.dat").write_text("1000 2000 10 sed\n1500 3999 20 bom\n\n2000 3000 30\n1999 2500 40 # and this\n")
    whole = model(play, begin="LOAD xyr.dat")
    assert whole.particles["x"].tolist() == [1000, 1500, 2000, 1999] and whole.groups == ["***", "sed", "bom"]
    assert model(play, "PROP color red RANGE group bom", begin="LOAD xyr.dat").particles["color"].tolist() == [
        0,
        3,
        0,
        0,
    ]
    assert model(play, begin="LOAD xyr.dat scale 0.1").particles["radius"].tolist() == [1, 2, 3, 4]
    part, log = play(begin="LOAD xyr.dat x 1000.0 2000.0 y 2000.0 4000.0")
    assert part.particles["radius"].tolist() == [10, 20, 40]
    assert "LOAD: 3 of 4 particles lie within the bounds" in log
    both = model(play, begin="LOAD xyr.dat scale 0.5 x 1900 9000")
    assert both.particles["x"].tolist() == [1000.0, 999.5], "the bounds are those of the file"


def test_a_window_without_particles_is_refused(play, tmp_path):
    (tmp_path / "xyr.dat").write_text("1 2 1\n")
    with pytest.raises(ScriptError, match=r"script\.py:1: LOAD: none of the 1 particles of .* lies within the bounds"):
        play(begin="LOAD xyr.dat x 10 20")


def test_exp_does_not_replace_the_file_that_was_loaded(play, tmp_path):
    (tmp_path / "xyr.dat").write_text("1 2 1\n5 2 1\n")
    with pytest.raises(ScriptError, match=r"xyr\.dat would overwrite the file that line 1 reads"):
        play("DEL RANGE x 4 9", "EXP xyr.dat", begin="LOAD xyr.dat")
    assert (tmp_path / "xyr.dat").read_text() == "1 2 1\n5 2 1\n"
    play("DEL RANGE x 4 9", "EXP left.dat", begin="LOAD xyr.dat")
    assert rows(tmp_path / "left.dat") == [["1.000000000000e+00", "2.000000000000e+00", "1.000000000000e+00"]]


def test_sav_and_res(play, tmp_path):
    """Names of ten digits (change log 2.2); RES looks beside the script and in its data folder."""
    sim = model(play, *PAIR, "PROP yv 1.5", "SET save 50", "CYC 100", "SAV Here.sav")
    assert sorted(p.name for p in (tmp_path / "data").glob("*.sav")) == ["0000000050.sav", "0000000100.sav"]
    here = model(play, begin="RES Here.sav")
    data = model(play, "CYC 50", begin="RES 0000000050.sav")
    for again in (here, data):
        assert again.clock.step == 100
        assert np.array_equal(again.particles["y"], sim.particles["y"])


# ---- prop, fix -----------------------------------------------------------------------------------------------------


def test_ini_is_prop(play):
    sim = model(
        play, *ROW, "INI xv 2.0 yv -1 spin 3 RANGE id 1", "INIT den 7 fric 0.25 shear 2e9 poiss 0.2 damp 0.4 kn 5 ks 6"
    )
    assert (velocity(sim, 1).tolist(), value(sim, "spin", 1)) == ([2.0, -1.0], 3.0) and not velocity(sim, 2).any()
    row = sim.materials.rows[sim.particles["material"][0]].tolist()
    assert row[:7] == (7, 0.25, 2e9, 0.2, 0.4, 5, 6) and not any(row[7:])


@pytest.mark.parametrize(
    ("disk", "volume", "inertia"),
    [
        (None, math.pi * 4, 0.5),
        ("on", math.pi * 4, 0.5),
        ("off", 4 / 3 * math.pi * 8, 0.4),
        ("0", 4 / 3 * math.pi * 8, 0.4),
        ("hex", 2 * math.sqrt(3) * 4, 0.5),
    ],
)
def test_disk(play, disk, volume, inertia):
    """On by default; given late it holds for the particles that are there."""
    lines = ["BALL id 0 x 0 y 0 rad 2", "PROP density 100", "CYC 1", *([f"SET disk {disk}"] if disk else []), "CYC 1"]
    mass, moment = body(model(play, *lines))
    assert mass == pytest.approx(100 * volume, rel=1e-14)
    assert moment == pytest.approx(inertia * mass * 4, rel=1e-14)


def test_fix_keeps_the_velocity_and_free_gives_back(play):
    before = ["BALL id 0 x 0 y 0 rad 1", "PROP density 1 xv 2 yv 3", "SET gravity 1 -10"]
    held = model(play, *before, "FIX x", "CYC 10")
    assert velocity(held).tolist() == [2.0, pytest.approx(3 - 0.1)]
    assert position(held)[0] == pytest.approx(0.02)
    again = model(play, *before, "FIX x y spin", "FREE y spin", "CYC 10")
    assert velocity(again).tolist() == [2.0, pytest.approx(2.9)]


def test_fix_is_for_the_particles_that_are_there(play):
    sim = model(play, "BALL id 0 x 0 y 0 rad 1", "FIX x y spin", "BALL id 1 x 9 y 0 rad 1", "FIX spin RANGE group ***")
    assert [value(sim, "fix", k) for k in (0, 1)] == [7, 4]


def test_gravity_and_damping(play):
    """The first step sees g (1 + damp), a falling particle g (1 - damp)."""
    sim = model(play, "BALL id 0 x 0 y 0 rad 1", "PROP density 1 damp 0.4", "SET DT 0.1, GRAVITY 0.0, -10", "CYC 3")
    assert velocity(sim)[1] == pytest.approx(-10 * 0.1 * (1.4 + 0.6 + 0.6))


def test_lattice_solid_damping_and_switching_it_off(play):
    ball = ["BALL id 0 x 0 y 0 rad 1", "PROP density 1 xv 1", "SET damp lsm 50"]
    slower = velocity(model(play, *ball, "CYC 1"))[0]
    assert slower == pytest.approx(1 - 50 * 1e-3 / math.pi)
    assert velocity(model(play, *ball, "SET damp lsm 0", "CYC 1"))[0] == 1.0


def test_of_dt_and_frac_the_last_counts(play):
    """frac sqrt(m / k) with the stiffness of a pair, half that of its particles."""
    step = 0.4 * math.sqrt(1000 * math.pi / 2e6)
    assert model(play, *PAIR, "SET frac 0.4", "CYC 1").clock.dt == pytest.approx(step)
    assert model(play, *PAIR, "SET frac 0.4", "SET dt 2e-3", "CYC 1").clock.dt == 2e-3
    assert model(play, *PAIR, "SET frac 0.4 dt 2e-3", "CYC 1").clock.dt == 2e-3


def test_a_hertz_particle_made_linear_again(play):
    hertz = ["PROP shear 1e9 poiss 0.2 hertz", "PROP fric 0.1"]
    assert model(play, *PAIR, *hertz).materials.rows["hertz"][-1] == 1
    sim = model(play, *PAIR, *hertz, "PROP kn 1e6")
    assert sim.materials.rows[sim.particles["material"][0]]["hertz"] == 0


# ---- bonds ---------------------------------------------------------------------------------------------------------

STRIP = [f"BALL id {k} x {2.0 * k} y 0 rad 1" for k in range(6)]
"""Six particles that just touch."""


def the_bond(sim: Simulation) -> np.void:
    """Values of the only bond there is."""
    return sim.bond_types.rows[sim.lists.bond[_slots(sim.lists)].max()]


def bonds_of(play, *lines: str) -> int:
    return model(play, *lines).bonds_left()


def test_bonds_need_both_ends_in_range(play):
    keys = "PROP ebmod 2e8 gbmod 2e8 tstrength 2e7 sstrength 4e7"
    assert bonds_of(play, *STRIP, keys) == 5
    assert bonds_of(play, *STRIP, f"{keys} RANGE id 0 3") == 3
    assert bonds_of(play, *STRIP, f"{keys} RANGE id 3") == 0
    assert bonds_of(play, *STRIP, "PROP density 1 kn 1 ks 1 fric 1 tolerate rext 0.8") == 0, "no bond key, no bond"


@pytest.mark.parametrize(
    ("gap", "words", "made"),
    [
        (0.0, "", 1),
        (5e-7, "", 1),
        (2e-6, "", 0),
        (2e-6, "tolerate", 0),
        (5e-7, "tolerate", 1),
        (9.9, "tolerate 10.0", 1),
        (10.1, "tolerate 10.0", 0),
        (-0.2, "tolerate rext 0.8", 0),
        (-0.5, "rext 0.8", 1),
        (-0.2, "tolerate 0.3 rext 0.8", 1),
        (0.1, "rext 1.1", 1),
        (0.3, "rext 1.1", 0),
    ],
)
def test_tolerate_and_rext(play, gap, words, made):
    """|OA| - (rO + rA) rext <= tolerate; by themselves 1e-6 and 1."""
    balls = ["BALL id 1 x 0 y 0 rad 1.2", f"BALL id 2 x {2.2 + gap!r} y 0 rad 1", "BALL id 9 x 900 y 0 rad 9"]
    assert bonds_of(play, *balls, f"PROP n_bond 1.0e4 s_bond 1.0e4 {words}") == made


def test_rext_equal_to_cratio_bonds_neighbours_only(play):
    row = "GLINE p1 (0 0) p2 (8 0) rad 1 cratio 0.4"
    assert bonds_of(play, row, "PROP n_bond 1 tolerate rext 0.4") == 10
    assert bonds_of(play, row, "PROP n_bond 1") == 10 + 9, "the second neighbour overlaps too"


def test_bond_keys_given_again_reset_the_bond(play):
    """Change log 2.2: n_bond 1, then 2, gives 2; and what is left out stays."""
    lines = [*PAIR, "PROP n_bond 1.0 s_bond 5 range id 1 2", "PROP n_bond 2.0 range id 1 2", "CYC 1"]
    sim = model(play, *lines)
    kind = the_bond(sim)
    assert (kind["tstrength"], kind["sstrength"], sim.bonds_left()) == (2.0, 5.0, 1)


def test_a_bond_is_of_the_model_given_last(play):
    sim = model(play, *PAIR, "PROP ebmod 1e8 tstrength 1e7", "PROP n_bond 3", "CYC 1")
    kind = the_bond(sim)
    assert (kind["ebmod"], kind["tstrength"], sim.bonds_left()) == (0.0, 3.0, 1)


def test_a_stretched_bond_gets_new_values(play):
    """It no longer meets the criterion, but it is there."""
    sim = model(
        play, *PAIR, "PROP n_bond 1e9", "FIX x y spin", "PROP xv 1 RANGE id 2", "CYC 100", "PROP n_bond 1e5", "CYC 1"
    )
    assert pair(sim, 1, 2) is None and sim.broken() == (1, 0), "2e6 N/m x 0.1 m breaks it now"


def test_a_broken_linear_bond_is_an_ordinary_contact(play):
    """Change log 2.2: kn and ks are not lost."""
    pull = [*PAIR, "PROP n_bond 1e3 s_bond 1e9", "FIX x y spin", "PROP xv 0.1 RANGE id 2", "CYC 20"]
    torn = model(play, *pull)
    assert torn.broken() == (1, 0) and pair(torn, 1, 2) is None
    back = model(play, *pull, "PROP xv -0.1 RANGE id 2", "CYC 40", "PROP xv 0 yv 0.1 RANGE id 2", "CYC 1")
    contact = pair(back, 1, 2)
    assert back.bonds_left() == 0
    assert contact.fn == pytest.approx(2e6 * 0.002, rel=1e-3)
    assert contact.fs == pytest.approx(2e6 * 0.1 * 1e-3, rel=1e-3)


def test_bond_break(play):
    bonded = [*STRIP, "PROP density 1 kn 1e6", "PROP n_bond 1e9"]
    assert bonds_of(play, *bonded, "BOND break RANGE x 3.0 7.0") == 4, "only 2-3 has both ends inside"
    assert bonds_of(play, *bonded, "BOND break range id 0 2", "CYC 5") == 3, "and they do not come back by touching"
    assert bonds_of(play, *bonded, "BOND break", "PROP n_bond 1") == 5, "but by a new command"


def test_bonds_farther_than_ten_radii_are_a_slip(play):
    with pytest.raises(ScriptError, match=r"script.py:9: PROP: tolerate 10 and rext 1 would bond particles 10 m apart"):
        play(*[line.replace("rad 1", "rad 0.9") for line in STRIP], "PROP n_bond 1 tolerate 10.0")


# ---- walls ---------------------------------------------------------------------------------------------------------


def at_the_wall(play, x: float, *lines: str) -> float:
    """Force in x on a ball at x, beside the line x = 0 that goes upwards (its left is x < 0)."""
    ball = f"BALL id 0 x {x} y 0 rad 1"
    sim = model(
        play, *lines, "WALL id 1 nodes (0 -9) (0 9) kn 4e6", ball, "PROP density 1 kn 4e6", "FIX x y spin", "CYC 1"
    )
    return force(sim)[0]


def test_walls_have_two_sides(play):
    """Change log 2.1; before, only the left side of P1 -> P2."""
    assert at_the_wall(play, -0.9) == pytest.approx(-0.1 * 2e6)
    assert at_the_wall(play, 0.9) == pytest.approx(0.1 * 2e6)
    assert at_the_wall(play, -0.9, "SET wallside left") == pytest.approx(-0.1 * 2e6)
    assert at_the_wall(play, 1.1, "SET wallside left") == 0.0
    assert at_the_wall(play, 0.9, "SET wallside left") == pytest.approx(-1.9 * 2e6), "expelled to the left"


def test_both_sides_have_the_properties_of_the_wall(play):
    lines = [
        "WALL id 1 nodes (0 -9) (0 9) kn 4e6 ks 4e6 fric 0.2",
        "BALL id 1 x -0.9 y 0 rad 1",
        "BALL id 2 x 0.9 y 0 rad 1",
        "PROP density 1 kn 4e6 ks 4e6 fric 0.5",
        "FIX x y spin",
        "PROP yv 1",
        "CYC 100",
    ]
    sim = model(play, *lines)
    for k in (1, 2):
        contact = at_wall(sim, k, 1)
        assert contact.fn == pytest.approx(2e5) and abs(contact.fs) == pytest.approx(0.2 * 2e5), "the smaller friction"


def test_a_wall_moves_until_it_is_reported_otherwise(play):
    wall = "WALL id 1, nodes ( 2.0 40.0 ) ( 2.0 2.0 ), kn=4.4e3 ks=4.14e3 fric=0.55 color=red"
    sim = model(play, wall, "WALL id 1 xv 2.0 yv -1", "CYC 100", "WALL id 1 xv 0.0", "CYC 100")
    k = sim.walls.row(1)
    assert sim.walls.p1[k].tolist() == pytest.approx([2.2, 39.8]) and sim.walls.p2[k].tolist() == pytest.approx(
        [2.2, 1.8]
    )
    assert (sim.walls.kn[k], sim.walls.ks[k], sim.walls.fric[k], sim.walls.color[k]) == (4.4e3, 4.14e3, 0.55, RED)


def test_a_wall_made_again_begins_anew(play):
    sim = model(play, "WALL id 1 nodes (0 0) (0 9) fric 0.5 xv 2", "WALL id 1 nodes (5 0) (5 9)", "CYC 10")
    k = sim.walls.row(1)
    assert len(sim.walls) == 1 and sim.walls.fric[k] == 0.0 and sim.walls.p1[k].tolist() == [5.0, 0.0]


def test_box_keeps_in_and_deletes_who_gets_out(play):
    box = "BOX left 0 right 20 bottom -1 height 11 kn=4e6 ks=0 fric 0"
    sim, log = play(box, "BALL id 0 x 0.9 y 5 rad 1", "BALL id 1 x 10 y 9.5 rad 1", "BALL id 2 x 25 y 5 rad 1",
                    "PROP density 1 kn 4e6", "FIX x y spin", "CYC 1")  # fmt: skip
    assert force(sim, 0)[0] == pytest.approx(0.1 * 2e6)
    assert force(sim, 1)[1] == pytest.approx(-0.5 * 2e6), "the top is bottom + height"
    assert sorted(sim.particles["gid"]) == [0, 1] and "2 at (25, 5)" in log


# ---- running and output --------------------------------------------------------------------------------------------


def test_imple_reaches_the_displacement_and_counts_its_outputs_from_its_start(play, tmp_path):
    wall = ["WALL id 1 nodes (0 0) (0 9) xv 2.0", "BALL id 0 x 50 y 0 rad 1", "PROP density 1"]
    sim = model(
        play, *wall, "SET print 30 save 40", "CYC 70", "IMPLE wall id 1 xmove 0.2 print 0.08 ps 0.1 vtk 0.05 save 0.15"
    )
    data = tmp_path / "data"
    assert sim.clock.step == 170 and sim.walls.p1[0, 0] == pytest.approx(170 * 2e-3)
    assert frames(data) == ["0_ini", "30", "60", "70_ini", "110", "150", "170"]
    assert frames(data, ".ps") == ["120", "170"] and frames(data, ".vtk") == ["95", "120", "145", "170"]
    assert sorted(int(p.stem) for p in data.glob("*.sav")) == [40, 145]


def test_ymove_and_the_sense_of_the_displacement(play):
    """The distance is what counts; that the wall goes the other way is told."""
    wall = ["WALL id 1 nodes (0 0) (9 0) yv -0.5", "BALL id 0 x 50 y 9 rad 1", "PROP density 1"]
    sim, log = play(*wall, "IMPLE wall id 1 ymove 0.05")
    assert sim.clock.step == 100 and "opposite to the distance 0.05" in log


@pytest.mark.parametrize(
    ("words", "expected"), [("print 4", ["0_ini", "4", "8"]), ("print -1", ["0_ini"]), ("print 0", ["0_ini"])]
)
def test_intervals_of_set(play, tmp_path, words, expected):
    model(play, "BALL id 0 x 0 y 0 rad 1", "PROP density 1", f"SET {words} ps 5 vtk 3", "CYC 10")
    assert frames(tmp_path / "data") == expected
    assert frames(tmp_path / "data", ".ps") == ["5", "10"]
    assert frames(tmp_path / "data", ".vtk") == ["3", "6", "9"]


def test_every_name_of_the_restart_interval(play, tmp_path):
    """Chapter 7 writes sav, the scripts SAVE."""
    for word in ("sav", "SAVE"):
        model(play, f"SET {word} 5", "CYC 5")
        (tmp_path / "data" / "0000000005.sav").unlink()


def test_stepbar(play):
    _, log = play("BALL id 0 x 0 y 0 rad 1", "PROP density 1", "SET stepbar 10", "CYC 30")
    assert [line.split()[1] for line in log.splitlines() if line.startswith("step")] == ["10", "20", "30"]


def test_hist_and_plot(play, tmp_path):
    play(
        "BALL id 0 x 0 y 0 rad 1",
        "PROP density 2 xv 3",
        "HIST ID 1 INTERVAL 10 , kinetic",
        "HIST ID 2 INTERVAL 20 , step",
        "PLOT hist 2 1",
        "CYC 40",
        "STOP",
    )
    data = tmp_path / "data"
    table = (data / "hist_1.csv").read_text().splitlines()
    assert table[0] == "step,time [s],kinetic [J]" and [row.split(",")[0] for row in table[1:]] == [
        "10",
        "20",
        "30",
        "40",
    ]
    assert float(table[1].split(",")[2]) == pytest.approx(0.5 * 2 * math.pi * 9)
    curve = rows(data / "hist_1_vs_2.txt")
    assert curve[0] == ["#", "step", "kinetic"] and [float(row[0]) for row in curve[1:]] == [20.0, 40.0]
    drawn = pytest.importorskip("matplotlib.image").imread(data / "hist_1_vs_2.png")
    inside = drawn[200:-200, 300:-100, :3]
    assert drawn.shape[0] > 500 and (inside.max(axis=-1) - inside.min(axis=-1)).max() > 0.3  # a coloured line


def test_draw_is_noted(play):
    _, log = play("DRAW INTERVAL 200, bfill wall")
    assert "DRAW" in log


def test_what_follows_stop_is_not_read(play):
    assert model(play, "STOP", "this is no command", "CYC 1e999").clock.step == 0
