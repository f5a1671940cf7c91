"""scripts/bench scaling: the model at its limits, parts found again from made-up lines, the page it writes."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from hpcdem.runtime.kept import cache_base
from tests.conftest import ROOT, run

sys.path.insert(0, str(ROOT / "scripts" / "lib"))

from bench.launch import Failed
from bench.scaling import fit, measure, report
from bench.scaling.model import (
    ETHERNET,
    FABRIC,
    HERE,
    ROW,
    Model,
    Parts,
    TooMany,
    between,
    blocks,
    powers,
    reduction,
    strips,
)
from bench.workloads import Bed

TRUE = Parts(
    fixed=1e-5, sizes=(600.0, 12500.0, 100000.0), particle=(3e-8, 3.2e-8, 4e-8), heights=(69.0, 3125.0),
    tall=(1.0, 1.2), force=0.8, slots=2.75, ghost_slots=1.25, look=(8e-6, 5e-9), rebuild=(4e-4, 2e-7),
    exchange=(1e-6, 1.5e-6, 1e-10), reduce=2e-6, waits=6.0, per_rank=5e-6, pack=6e-9, company=1.1, frame=5e-6,
    frame_b=1500.0, arrays_b=420.0, width=1.38, looks=0.04, looks_pushed=0.1, rebuilds_pushed=0.01,
)  # fmt: skip
MACHINES = (HERE, FABRIC, ETHERNET)


def line(n: int, ranks: int, *, tall: bool = False, pushed: bool = False, fitted: bool = True) -> dict:
    """What would be measured of a bed if the model were true."""
    height = 3125 if tall else 69
    columns = round(n / height)
    model = Model(n, columns, max(1, round(n / columns / TRUE.width**2)))
    looks, rebuilds = (0.1, 0.01) if pushed else (0.04, 0.0)
    step = strips(TRUE, model, ranks, looks=looks, rebuilds=rebuilds)
    bare = strips(TRUE, model, ranks, looks=0.0)
    left = [model.height * (r > 0) for r in range(ranks)]
    kind = "push-" if pushed else "tall-" if tall else "bed-"
    own = step.own + step.sharing
    return {
        "kind": "bed", "name": f"{kind}{n}", "ranks": ranks, "repeat": 0, "fit": fitted, "tall": tall, "pushed": pushed,
        "particles": n, "columns": columns, "steps": 100, "step_s": step.seconds, "median_s": step.seconds,
        "cpu_s": ranks * (own + step.fixed), "force_s": 0.8 * own, "move_s": 0.2 * own, "busy": 1.0, "looks": looks,
        "look_s": 8e-6 + 5e-9 * n / ranks, "rebuilds": rebuilds, "rebuilds_all": rebuilds,
        "rebuild_s": strips(TRUE, model, ranks, looks=0.0, rebuilds=1.0).seconds - bare.seconds,
        "owned": [-(-columns // ranks) * model.height] * ranks, "left": left,
        "ghosts": [model.height * min(2, (r > 0) + (r < ranks - 1)) for r in range(ranks)],
        "slots": [(TRUE.slots * n + sum(left) * TRUE.ghost_slots) / ranks] * ranks,
        "waits": {"step": 1, "look": 1, "rebuild": 6}, "arrays_b": 420.0, "cpu": "none", "python": "3",
        "mpi": "none",
    } | ({"frame_s": 5e-6 * n, "frame_b": 1500 * n} if n == 100000 and not tall else {})  # fmt: skip


@pytest.fixture
def lines() -> list[dict]:
    """A whole measurement in which the model is true."""
    rows = [line(n, 1) for n in (150, 600, 12500, 100000)] + [line(100000, 1, tall=True)]
    rows += [line(n, 2) for n in (600, 12500, 100000)]
    rows += [line(2500, p, fitted=False) for p in (1, 2)] + [line(12500, p, pushed=True, fitted=False) for p in (1, 2)]
    rows += [line(12500, p, fitted=False) for p in (3, 4)]
    start, message, byte = TRUE.exchange
    for n, m in [(8, 1), (64, 1), (512, 1), (4096, 1), (32768, 1), (16, 2), (32, 4), (64, 8)]:
        rows.append({"kind": "exchange", "rows": n, "messages": m, "s": start + message * m + byte * ROW * n})
    rows.append({"kind": "reduce", "s": TRUE.reduce})
    rows += [{"kind": "migrate", "of": p, "s": 1e-4 + TRUE.per_rank * p} for p in (64, 1024)]
    rows.append({"kind": "pack", "rows": 1000, "s": 1000 * TRUE.pack})
    return rows


def test_fit_finds_the_parts_again(lines):
    """Every parameter from lines that follow from them; a slower repeat changes nothing."""
    lines += [row | {"step_s": 3.0 * row["step_s"], "repeat": 1} for row in lines if row["kind"] == "bed"]
    found = fit.fitted(lines)
    for field in dataclasses.fields(Parts):
        got, true = getattr(found, field.name), getattr(TRUE, field.name)
        loose = field.name in ("particle", "fixed", "tall", "company", "heights")  # curve between two sizes
        assert got == pytest.approx(true, rel=0.03 if loose else 1e-3), field.name


def test_checks_of_a_true_model(lines):
    """What was not fitted is foretold; counts and processor time stand for ranks without a core of their own."""
    found = fit.checks(fit.fitted(lines), lines)
    assert {c.what for c in found if c.ranks <= 2} == {"step", "rebuild", "ghosts", "slots", "largest share"}
    assert {c.what for c in found if c.ranks > 2} == {"processor time", "ghosts", "slots", "largest share"}
    assert all(abs(c.error) < 0.05 for c in found if c.what != "processor time"), found


def test_missing_lines_are_named(lines):
    """A measurement that was cut short."""
    with pytest.raises(Failed, match="lack a pushed bed"):
        fit.fitted([r for r in lines if not r.get("pushed")])
    with pytest.raises(Failed, match="the parts alone"):
        fit.fitted([r for r in lines if r["kind"] != "reduce"])


def test_one_rank_has_no_company():
    """Its step is its own work and nothing else."""
    model = Model(12500, 181, 36)
    step = strips(TRUE, model, 1, looks=0.0)
    assert step.seconds == pytest.approx(1e-5 + 12500 * 3.2e-8 * between(model.height, TRUE.heights, TRUE.tall))
    assert step.sharing == step.imbalance == step.ghosts == step.exchange == 0.0
    assert blocks(TRUE, model, 1, looks=0.0) == step


@pytest.mark.parametrize("machine", MACHINES, ids=lambda m: m.name)
@pytest.mark.parametrize("cut", [strips, blocks])
def test_limits(machine, cut):
    """Efficiency is at most 1, no part is negative, and more ranks never have more than their number is worth."""
    for n in (1e5, 1e7, 1e9):
        model = Model.bed(n, 5, TRUE.width)
        for ranks in powers(min(4096, model.columns)):
            step = cut(TRUE, model, ranks, machine, 0.1, 0.01)
            assert 0.0 < step.efficiency <= 1.0
            assert all(getattr(step, name) >= -1e-12 * step.seconds for name in report.PARTS)
            assert step.seconds >= step.own >= model.particles / ranks * min(TRUE.particle)


def test_more_ranks_than_columns():
    """Are refused, as by the program; blocks go on until cells run out."""
    model = Model(1000, 10, 10)
    strips(TRUE, model, 10)
    with pytest.raises(TooMany, match="11 ranks, but 10 columns"):
        strips(TRUE, model, 11)
    blocks(TRUE, model, 20)
    with pytest.raises(TooMany):
        blocks(TRUE, model, 101)


def test_whole_columns():
    """Ten columns on four ranks: one has three."""
    step = strips(TRUE, Model(69000, 10, 3600), 4, looks=0.0)
    assert (step.own + step.sharing + step.imbalance) / (step.own + step.sharing) == pytest.approx(3 / 2.5)


def test_beds():
    """Square cells: four times the particles, columns twice as many and twice as high."""
    small, large = (Model.bed(n, 5, 1.38) for n in (1e6, 4e6))
    assert large.columns == pytest.approx(2 * small.columns, rel=1e-2)
    assert large.height == pytest.approx(2 * small.height, rel=1e-2)
    assert small.columns == int(math.sqrt(5e6) / 1.38) and small.columns == pytest.approx(5 * small.rows, abs=5)


def test_networks():
    """A node's own ranks do not use the network; beyond it a slower network is slower."""
    model = Model.bed(1e7, 5, TRUE.width)
    seconds = [strips(TRUE, model, 1024, m).seconds for m in MACHINES]
    assert seconds == sorted(seconds) and seconds[0] < seconds[2]
    assert strips(TRUE, model, 64, FABRIC) == strips(TRUE, model, 64, ETHERNET)
    assert reduction(TRUE, FABRIC, 1) == 0.0 and reduction(TRUE, FABRIC, 64) == pytest.approx(6 * TRUE.reduce)
    assert reduction(TRUE, FABRIC, 128) == pytest.approx(7 * TRUE.reduce + FABRIC.latency)


def test_blocks_pay_where_columns_are_high():
    """A square model on many ranks; on two ranks there is nothing to gain."""
    model = Model.bed(1e7, 1, TRUE.width)
    assert blocks(TRUE, model, 1024, FABRIC).seconds < strips(TRUE, model, 1024, FABRIC).seconds
    assert blocks(TRUE, model, 2, HERE).seconds >= strips(TRUE, model, 2, HERE).seconds


@pytest.mark.figures
def test_page(lines, tmp_path):
    """Text around the markers stays; tables have as many cells as names; figures are there. Twice gives the same."""
    page, file = tmp_path / "scaling.md", tmp_path / "lines.json"
    file.write_text("".join(json.dumps(row) + "\n" for row in lines))
    page.write_text(f"# Title\n\n{report.BEGIN}\nold\n{report.END}\n\nafter\n")
    report.report(file, page, tmp_path / "figures")
    text = page.read_text()
    assert text.startswith(f"# Title\n\n{report.BEGIN}\n\n### Parts") and text.endswith(f"{report.END}\n\nafter\n")
    assert "\nold\n" not in text and "refused: " in text and "nan" not in text and "inf" not in text
    width = 0
    for row in text.splitlines():
        cells = row.count("|") if row.startswith("|") else 0
        assert cells in (0, width) or not width, row
        width = cells
    for name in ("scaling_strong.jpg", "scaling_weak.jpg"):
        assert f"](figures/{name})" in text and (tmp_path / "figures" / name).stat().st_size > 10000
    report.report(file, page, tmp_path / "figures")
    assert page.read_text() == text
    page.write_text("no markers")
    with pytest.raises(Failed, match="needs the lines"):
        report.report(file, page, tmp_path / "figures")


def test_the_page_has_its_markers():
    """And every figure that it shows is in the folder."""
    text = report.PAGE.read_text(encoding="utf-8")
    assert text.count(report.BEGIN) == text.count(report.END) == 1
    assert all(name in text for name in ("scaling_strong.jpg", "scaling_weak.jpg"))
    assert (report.FIGURES / "scaling_strong.jpg").exists() and (report.FIGURES / "scaling_weak.jpg").exists()


def test_numbers():
    """As the page writes them."""
    assert [report.count(n) for n in (1e5, 1e9, 12500, 16)] == ["10⁵", "10⁹", "12 500", "16"]
    assert [report.took(s) for s in (2.0, 1.5e-3, 2.25e-6, 3.5e-9)] == ["2 s", "1.5 ms", "2.25 µs", "3.5 ns"]
    assert [report.three(v) for v in (22949.0, 0.12345)] == ["22 900", "0.123"]
    assert [report.lasts(v) for v in (30.0, 7200.0, 1e8)] == ["30 s", "2 h", "3.2 years"]
    assert report.took(7690.0) == "2.1 h" and report.lasts(1.5e7) == "174 d"


@pytest.mark.slow
@pytest.mark.mpi
def test_measures_a_tiny_bed(tmp_path):
    """The whole way on one and two ranks with beds of a few hundred particles: lines that hold what the fit needs."""
    paths = os.pathsep.join(filter(None, (str(ROOT / "scripts" / "lib"), os.environ.get("PYTHONPATH"))))
    env = {"XDG_CACHE_HOME": str(tmp_path), "NUMBA_CACHE_DIR": str(cache_base()), "PYTHONPATH": paths}
    bed, k = Bed(150, 2), np.arange(150)
    across = int(bed.unit_length / 100.0)
    x, y = 50.0 + 100.0 * (k % across), 49.5 + 99.0 * (k // across)
    np.savez(tmp_path / "unit.npz", x=x, y=y, r=np.full(150, 50.0))
    cases = [
        dataclasses.asdict(measure.Case(bed, settled=False, tall=tall))
        | {"name": "tiny", "file": "", "parent": str(tmp_path / "unit.npz")}
        for tall in (False, True)
    ]
    program = tmp_path / "go.py"
    program.write_text(
        "import json, pathlib\nfrom bench import launch\n"
        f"rows = launch.ours('scaling', launch.Layout(2), cases=json.loads({json.dumps(cases)!r}), repeat=0)['lines']\n"
        "pathlib.Path('rows.json').write_text(json.dumps(rows))\n"
    )
    done = run([sys.executable, str(program)], tmp_path, env=env)
    assert done.returncode == 0, done.stderr
    rows = json.loads(Path(tmp_path / "rows.json").read_text())
    beds = [r for r in rows if r["kind"] == "bed"]
    assert [r["particles"] for r in beds] == [300, 300] and beds[1]["columns"] < beds[0]["columns"]
    for row in beds:
        assert sum(row["owned"]) == 300 and len(row["ghosts"]) == 2 and min(row["ghosts"]) > 0
        assert row["waits"]["step"] == 1 and row["waits"]["look"] == 1 and row["waits"]["rebuild"] > 2
        assert 0.0 < row["step_s"] <= row["median_s"] and row["rebuild_s"] > 0.0 and row["busy"] >= 1.0
    kinds = [r["kind"] for r in rows if r["kind"] != "bed"]
    assert kinds.count("exchange") == len(measure.ROWS) + len(measure.MESSAGES) - 1
    assert {"reduce", "migrate", "pack"} <= set(kinds)
    assert all(r["s"] > 0.0 for r in rows if r["kind"] != "bed")
