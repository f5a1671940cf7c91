"""The 11 scripts of the ZDEM manual, as published, as printed (with OCR spellings) and in short variants."""

from __future__ import annotations

import pytest

from hpcdem.core.errors import ScriptError
from hpcdem.core.selection import Chain, Ellipse, Group, Interval, Polygon
from hpcdem.lang import detect
from hpcdem.lang.zdem import check
from hpcdem.lang.zdem.execute import refuse_unexecuted
from hpcdem.lang.zdem.parser import read_script
from hpcdem.lang.zdem.plan import expected_steps

# Statements and steps, as published; steps None where they depend on a restart file or on SET frac.
PUBLISHED = {
    "push": (31, 106_000),
    "syn_erosion": (8, None),
    "syn_sedimentaion": (12, None),
    "pre_struct": (33, 46_000),
    "detachment": (28, 100_000),
    "palaeohigh": (31, 100_000),
    "extens_rigid": (84, 168_000),
    "ex8_dem_am_gen": (23, 80_000),
    "ex8_dem_am_push": (28, None),
    "extens_ductile_patent": (74, 47_000),
    "push_add_del": (40, 108_000),
}
SHORT_STEPS = {
    "push": 8_000, "syn_erosion": None, "syn_sedimentaion": None, "pre_struct": 5_000, "detachment": 6_000,
    "palaeohigh": 6_000, "extens_rigid": 15_400, "ex8_dem_am_gen": 6_500, "ex8_dem_am_push": None,
    "extens_ductile_patent": 6_900, "push_add_del": 12_600,
}  # fmt: skip
PRINTED = ("detachment", "extens_ductile_patent", "palaeohigh", "pre_struct", "push", "syn_sedimentaion")


@pytest.fixture
def statements(manual_scripts):
    """Statements of a published script by command: ``statements("push", "WALL")``."""

    def of(name, command=None):
        found = read_script(manual_scripts / f"{name}.py").statements
        return [s for s in found if command is None or s.command == command]

    return of


@pytest.mark.parametrize("name", PUBLISHED)
def test_published(manual_scripts, name):
    path = manual_scripts / f"{name}.py"
    script = read_script(path)
    refuse_unexecuted(script.statements)
    assert (len(script.statements), expected_steps(script.statements)) == PUBLISHED[name]
    assert script.statements[-1].command == "STOP"
    assert detect.kind(path.read_bytes()) == "zdem"


@pytest.mark.parametrize("name", SHORT_STEPS)
def test_short(manual_scripts, name):
    script = read_script(manual_scripts / "short" / f"{name}.py")
    refuse_unexecuted(script.statements)
    assert expected_steps(script.statements) == SHORT_STEPS[name]


@pytest.mark.parametrize("name", PRINTED)
def test_as_printed_means_the_same(manual_scripts, name):
    """Misprints whose meaning is clear: gbmmod, IMPL, IMPLIE; a file name is taken as it stands."""
    published = read_script(manual_scripts / f"{name}.py").statements
    printed = read_script(manual_scripts / "as_printed" / f"{name}.py").statements
    differ = [(a.text, b.text) for a, b in zip(published, printed, strict=True) if not a.same_as(b)]
    assert differ == ([("EXP init_xyr.dat", "EXP init_xyrr.dat")] if name == "pre_struct" else [])


def test_the_printed_wall_without_length(manual_scripts):
    with pytest.raises(ScriptError) as caught:
        read_script(manual_scripts / "as_printed" / "push_add_del.py")
    assert caught.value.line == 10
    assert caught.value.message == "WALL: the wall has no length, both nodes are (1000.0, 10000.0)"


def test_push(statements):
    start, disk, box, floor, left, right, gen, prop, dt, vtk, ps, dat, settle, cut, relax, bond, *rest = statements(
        "push"
    )
    assert (start.command, disk.arguments) == ("START", {"disk": "off"})
    assert box.arguments == {
        "left": 0.0, "right": 41000.0, "bottom": 0.0, "height": 11000.0, "kn": 0.0, "ks": 0.0, "fric": 0.0,
    }  # fmt: skip
    assert floor.arguments == {
        "id": 0, "nodes": ((0.0, 10.0), (40000.0, 10.0)), "kn": 0.0, "ks": 0.0, "fric": 0.0, "color": 5,
    }  # fmt: skip
    assert (left.get("nodes"), left.get("color")) == (((10.0, 10000.0), (10.0, 10.0)), 7)
    assert (right.get("nodes"), right.get("color")) == (((40000.0, 10.0), (40000.0, 10000.0)), 3)
    assert gen.arguments == {
        "num": 100000, "rad": (60.0, 80.0), "x": (10.0, 40000.0), "y": (10.0, 10000.0), "color": 5,
        "group": "ball_rand",
    }  # fmt: skip
    assert prop.arguments == {
        "density": 2500.0, "fric": 0.0, "shear": 2.9e9, "poiss": 0.2, "damp": 0.4, "hertz": True,
    }  # fmt: skip
    assert dt.arguments == {"dt": 0.05, "gravity": (0.0, -9.8)}
    assert (vtk.arguments, ps.arguments, dat.arguments) == ({"vtk": 1000}, {"ps": 1000}, {"print": 1000})
    assert (settle.arguments, relax.arguments) == ({"steps": 5000}, {"steps": 1000})
    assert cut.selection == Interval("y", 4000.0, 999000.0)
    assert bond.arguments == {"ebmod": 2e8, "gbmod": 2e8, "tstrength": 2e7, "sstrength": 4e7, "fric": 0.3}
    assert bond.selection is None
    colours = [(s.get("color"), s.selection) for s in rest if s.command == "PROP"]
    assert colours == [
        (c, Interval("y", 500.0 * i, 500.0 * (i + 1))) for i, c in enumerate([0, 1, 2, 3, 5, 6, 7, 8, 9])
    ]
    assert [s.arguments for s in rest if s.command == "WALL"] == [
        {"id": 0, "fric": 0.3}, {"id": 1, "fric": 0.3}, {"id": 2, "fric": 0.3}, {"id": 1, "xv": 2.0},
    ]  # fmt: skip
    imple = rest[-2]
    assert imple.command == "IMPLE" and imple.line == 53
    assert imple.arguments == {"id": 1, "xmove": 10000.0, "save": 2000.0, "print": 1000.0, "ps": 1000.0, "vtk": 1000.0}


def test_pre_existing_fault(statements):
    (fault,) = [s for s in statements("pre_struct", "PROP") if s.get("group") == "struct1"]
    assert fault.selection == Polygon(((4000.0, 0.0), (4500.0, 0.0), (10500.0, 4000.0), (10000.0, 4000.0)))
    (broken,) = statements("pre_struct", "BOND")
    assert broken.selection == Group("struct1")
    assert [s.get("num") for s in statements("pre_struct", "GEN")] == [100000]


def test_palaeohigh(statements):
    high = [s.selection for s in statements("palaeohigh", "PROP") if s.get("group") == "palaeohigh"]
    assert high[0] == Ellipse(20000.0, 0.0, 2000.0, 1000.0)
    assert high[1] == Polygon(((10000.0, 0.0), (12000.0, 0.0), (15000.0, 0.0), (12500.0, 1500.0)))
    (fixed,) = statements("palaeohigh", "FIX")
    assert (list(fixed.arguments), fixed.selection) == (["x", "y", "spin"], Group("palaeohigh"))


def test_analogue_model(statements):
    (gen,) = statements("ex8_dem_am_gen", "GEN")
    assert gen.arguments == {
        "grid": True, "idmin": 0, "rad": (1e-4, 1e-4, 2e-4, 2e-4, 2.5e-4, 3e-4), "x": (5e-3, 0.605), "y": (5e-3, 0.155),
        "group": "ball_rand",
    }  # fmt: skip
    (cut,) = statements("ex8_dem_am_gen", "DEL")
    assert cut.selection == Chain((Interval("x", 4e-3, 0.606), Interval("y", 0.03, 1.0)), ("and",))
    settings = {k: v for s in statements("ex8_dem_am_push", "SET") for k, v in s.arguments.items()}
    assert settings == {"disk": "hex", "frac": 0.4, "gravity": (0.0, -10.0), "stepbar": 10000, "damp": 0.04}
    assert [s.arguments for s in statements("ex8_dem_am_gen", "PLOT")] == [{"x": 2, "y": 1}]
    assert [s.arguments for s in statements("ex8_dem_am_push", "PLOT")] == [{"x": 2, "y": 1}]


def test_ductile_base(statements):
    ends = [s for s in statements("extens_ductile_patent", "PROP") if "rext" in s.arguments]
    assert [s.selection for s in ends] == [Group("wall_bom", "wall_mov0"), Group("wall_bom", "wall_mov1")]
    assert list(ends[0].arguments.items()) == [
        ("tolerate", 1e-6), ("rext", 0.4), ("ebmod", 2e8), ("gbmod", 2e8), ("tstrength", 2e100), ("sstrength", 4e7),
        ("fric", 0.3),
    ]  # fmt: skip
    assert statements("extens_ductile_patent", "GLINE")[0].arguments == {
        "p1": (10000.0, 1000.0), "p2": (25000.0, 1000.0), "rad": 80.0, "cratio": 0.4, "color": 3, "group": "wall_bom",
    }  # fmt: skip
    assert statements("extens_ductile_patent", "DRAW")[0].arguments == {"interval": 200, "bfill": True, "wall": True}
    assert statements("extens_ductile_patent", "SET")[0].arguments == {"disk": "off"}
    assert [s.get("file") for s in statements("extens_ductile_patent", "SAV")] == ["initxyr.sav", "sed5km.sav"]


def test_frames_of_the_run_with_erosion_and_sediment(manual_scripts):
    """Chapter 6.3 lists them: 42 frames, six of them _ini."""
    report = check.examine(read_script(manual_scripts / "push_add_del.py"))
    assert report.outputs["print"].files == 42
    assert [run.start for run in report.runs] == [0, 5000, 6000, 36000, 56000, 58000]


def test_steps_after_a_restart_file_need_what_it_holds(manual_scripts):
    erosion = read_script(manual_scripts / "syn_erosion.py").statements
    assert expected_steps(erosion) is None
    assert expected_steps(erosion, dt=0.05) == 60_000
