"""Whole sweeps: exact answers, other processes killed, what is refused, reports."""

from __future__ import annotations

import csv
import itertools
import math
import os
import shutil
import signal
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import hpcdem
from hpcdem.cli import sweep as program
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.io.lock import holder_of
from hpcdem.sweep import driver
from hpcdem.sweep.plan import DONE, RUNNING, read_json
from tests.conftest import end, popen, run, until
from tests.short_push import parametrised_push, ranks_of

FALL = """\
gravity = 9.8
START
SET seed 1
SET disk off, dt 0.001, gravity (0, -{gravity})
BOX left 0 right 10 bottom -100 height 300
GEN num 1 rad discrete 0.5 x (2 8) y (50 90)
PROP density 1000
HIST id 1 interval 100 kinetic
CYC 500
STOP
"""
STRETCH = """\
shear = 10e9
pcdc mesh structured (0,0) (1,1) cells 2 2
pcdc element c-model mech-iso-e property density 2500 bulk 20e9 shear [shear]
pcdc model option dynamic off collision off
pcdc node boundary mech-vel-b-c velocity-x 0 range x -0.01 0.01
pcdc node boundary mech-vel-b-c velocity-y 0 range y -0.01 0.01
pcdc element-face boundary m-s-b-c stress-xx 5e6 range x 0.99 1.01
pcdc element-face boundary m-s-b-c stress-yy -5e6 range y 0.99 1.01
pcdc history create 'u' node nearest (1,1) value displacement-x
pcdc model solve elastic
pcdc model step 1
"""


def call(*words: object, cwd: Path, code: int = 0) -> str:
    """`hpcdem sweep WORDS`; what it prints."""
    done = run([sys.executable, "-m", "hpcdem", "sweep", *map(str, words)], cwd=cwd)
    assert done.returncode == code, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.fixture
def refused(tmp_path, monkeypatch, capsys) -> Callable[..., str]:
    """`hpcdem sweep WORDS` in this process, for what is refused before anything runs; what it prints."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(program.launch, "prepare_environment", lambda threads: (threads, []))

    def refuse(*words: str) -> str:
        with pytest.raises(SystemExit) as left:
            program.start(list(words))
        assert left.value.code == 2
        return "".join(capsys.readouterr())

    return refuse


def table(path: Path) -> list[dict[str, str]]:
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


# --- what the members answer -------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def fallen(tmp_path_factory) -> Path:
    """Balls that fall with three gravities, two seeds each, and the report."""
    folder = tmp_path_factory.mktemp("fall")
    (folder / "fall.py").write_text(FALL)
    said = call("fall.py", "--set", "gravity=1,2,4", "--seed", "1:2", cwd=folder)
    assert "6 done" in said
    call("report", "fall_sweep", cwd=folder)
    return folder / "fall_sweep"


def test_members_have_folders_parameters_and_scripts_of_their_own(fallen):
    values = [read_json(fallen / f"{k:04d}" / "parameters.json", None) for k in range(6)]
    assert values == [{"gravity": g, "seed": s} for g in (1, 2, 4) for s in (1, 2)]
    assert "gravity = 4\n" in (fallen / "0005" / "fall.py").read_text()
    assert "SET seed 2\n" in (fallen / "0005" / "fall.py").read_text()
    assert all((fallen / f"{k:04d}" / "data" / "hist_1.csv").exists() for k in range(6))


def test_statistics_are_those_of_falling_balls(fallen):
    """Kinetic energy m (g t)² / 2 with t the time of the steps that have been done: mean, spread and quantiles of the
    three values by hand, over time and against gravity."""
    mass = 4.0 / 3.0 * math.pi * 0.5**3 * 1000.0
    rows = [row for row in table(fallen / "report" / "bands.csv") if row["table"] == "hist_1"]
    measure = rows[0]["measure"]
    by_group = {g: [row for row in rows if row["gravity"] == g] for g in ("all", "1", "2", "4")}
    assert [float(row["at"]) for row in by_group["all"]] == pytest.approx([0.1 * k for k in range(1, 6)])
    for row in by_group["all"]:
        energies = [0.5 * mass * (g * float(row["at"])) ** 2 for g in (1.0, 1.0, 2.0, 2.0, 4.0, 4.0)]
        assert float(row["mean"]) == pytest.approx(sum(energies) / 6, rel=1e-9)
        assert float(row["spread"]) == pytest.approx(np.std(energies, ddof=1), rel=1e-9)
        assert float(row["q50"]) == pytest.approx(energies[2], rel=1e-9)
        assert float(row["q25"]) == pytest.approx(energies[0] + 0.25 * (energies[2] - energies[0]), rel=1e-9)
        assert (row["members"], row["axis"]) == ("6", "time[s]")
    assert [float(row["mean"]) / float(by_group["1"][-1]["mean"]) for g in "124" for row in by_group[g][-1:]] == (
        pytest.approx([1.0, 4.0, 16.0], rel=1e-9)
    )
    assert all(float(row["spread"]) < 1e-9 * float(row["mean"]) for row in by_group["4"])
    found = table(fallen / "report" / "correlation.csv")
    ranked = next(row for row in found if row["measure"] == f"hist_1.{measure} end")
    assert float(ranked["rank_correlation"]) == pytest.approx(1.0) and ranked["members"] == "6"


def test_a_report_draws_bands_and_dependence(fallen):
    names = {path.name for path in (fallen / "report").glob("*.png")}
    assert {"bands_hist_1.png", "against_gravity_hist_1.png"} <= names
    call("report", fallen, "layers", "--format", "pdf", "-o", fallen / "other", cwd=fallen)
    assert not list((fallen / "other").glob("*.png")) and list((fallen / "other").glob("*.pdf"))
    assert not any(row["table"] == "wedge" for row in table(fallen / "other" / "bands.csv"))


def test_parquet_is_written_or_refused_by_name(fallen, tmp_path):
    try:
        import pyarrow.parquet
    except ModuleNotFoundError:
        assert "pyarrow is not installed" in call("report", fallen, "--tables", "parquet", cwd=tmp_path, code=1)
        return
    call("report", fallen, "--tables", "csv,parquet", "--format", "none", "-o", tmp_path, cwd=tmp_path)
    read = pyarrow.parquet.read_table(tmp_path / "members.parquet").to_pydict()
    assert [float(row["gravity"]) for row in table(tmp_path / "members.csv")] == read["gravity"] == [1, 1, 2, 2, 4, 4]


@pytest.mark.slow
def test_a_pcdc_script_from_a_file_of_settings(tmp_path):
    """Pure shear: strain s / 2G, so that the largest displacement of each member is known."""
    (tmp_path / "stretch.sc").write_text(STRETCH)
    (tmp_path / "settings.toml").write_text('script = "stretch.sc"\noutput = "runs"\n[set]\nshear = [10e9, 20e9]\n')
    call("settings.toml", "--set", "shear=5e9,10e9", "--plan", cwd=tmp_path)
    call("settings.toml", cwd=tmp_path)
    sweep = hpcdem.Sweep.open(tmp_path / "runs")
    assert [m.values["shear"] for m in sweep.members] == [5e9, 10e9, 20e9], "what is new comes after what was there"
    report = sweep.report(formats=())
    (ends,) = (values for name, values in report.members.items() if name.startswith("history_u.") and "end" in name)
    assert ends == pytest.approx([5e6 / (2 * g) for g in (5e9, 10e9, 20e9)], rel=1e-6)


# --- killed, stopped, taken up again ------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_sweep_survives_kills_and_its_report_is_that_of_an_undisturbed_one(tmp_path):
    """One sweep runs through. Of the other a member is killed as it runs, then the driver while members wait for their
    turn, then all is taken up."""
    for name in ("quiet", "killed"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "push.py").write_text(parametrised_push(8000))
    words = ["push.py", "--seed", "1:2", "--set", "friction=0.1,0.4"]
    call(*words, cwd=tmp_path / "quiet")
    folder = tmp_path / "killed" / "push_sweep"
    first = popen([sys.executable, "-m", "hpcdem", "sweep", *words], cwd=tmp_path / "killed")
    try:
        until(lambda: any((folder / "0000" / "data").glob("*.sav")))
        victims = ranks_of(folder / "0000")
        assert victims
        for pid in victims:
            os.kill(pid, signal.SIGKILL)
        until(lambda: read_json(folder / "0000" / "state.json", {"tries": 0})["tries"] == 2)
        first.send_signal(signal.SIGKILL)
        first.wait()
    finally:
        running = [k for k in sorted(folder.glob("0*")) if holder_of(k) is not None]
        end(first)
    assert running, "members go on without the driver"
    said = call(*words, cwd=tmp_path / "killed")
    members = hpcdem.Sweep.open(folder).members
    assert all(member.state == DONE for member in members) and f"{len(members)} done" in said
    assert "--resume" not in said
    assert (
        "resum" in (folder / "0000" / "out.log").read_text()
        or "checkpoint" in (folder / "0000" / "out.log").read_text()
    )
    for name in ("quiet", "killed"):
        call("report", "push_sweep", "--format", "none", cwd=tmp_path / name)
    for sheet in ("members", "bands", "parameters"):
        one, other = (tmp_path / name / "push_sweep" / "report" / f"{sheet}.csv" for name in ("quiet", "killed"))
        assert one.read_bytes() == other.read_bytes(), sheet
    assert len(table(one)) > 20


def test_a_driver_that_is_asked_to_stop_lets_members_save_and_continues(tmp_path):
    (tmp_path / "push.py").write_text(parametrised_push(40000))
    words = ["push.py", "--set", "friction=0.1,0.4", "--jobs", "1"]
    first = popen([sys.executable, "-m", "hpcdem", "sweep", *words], cwd=tmp_path)
    until(lambda: any((tmp_path / "push_sweep/0000/data").glob("*.sav")))
    assert "already runs this sweep" in call(*words, cwd=tmp_path, code=2)
    assert [one.state for one in hpcdem.Sweep.open(tmp_path / "push_sweep").members] == [RUNNING, "waiting"]
    first.terminate()
    out, err = first.communicate(timeout=60)
    assert first.returncode == 85, out + err + (tmp_path / "push_sweep/0000/out.log").read_text()
    assert read_json(tmp_path / "push_sweep/0000/state.json", None)["state"] == "stopped"
    assert "no member is done" in call("report", "push_sweep", cwd=tmp_path, code=1)


def test_a_member_that_fails_is_named_and_the_others_are_reported(tmp_path):
    (tmp_path / "one.py").write_text(
        "import sys\nfrom pathlib import Path\nn = 1\nPath('began').touch()\nsys.exit(n)\n"
    )
    said = call("one.py", "--set", "n=0,3", "--tries", "3", cwd=tmp_path, code=1)
    assert "0001 (n=3) ended with 3: see one_sweep/0001/out.log" in said and "1 done, 1 failed" in said
    state = read_json(tmp_path / "one_sweep/0001/state.json", None)
    assert (state["tries"], state["code"]) == (3, 3)
    call("one_sweep", "--tries", "1", cwd=tmp_path, code=1)
    assert read_json(tmp_path / "one_sweep/0001/state.json", None)["tries"] == 4
    assert read_json(tmp_path / "one_sweep/0000/state.json", None)["tries"] == 1, "what is done is not run again"


# --- how many at once ------------------------------------------------------------------------------------------


def test_there_are_never_more_processes_than_cores(tmp_path, monkeypatch):
    (tmp_path / "fall.py").write_text(FALL)
    plan = hpcdem.Sweep(tmp_path / "fall.py", seed="1:9", ranks=2, threads=3).plan
    monkeypatch.setattr("hpcdem.runtime.launch.cores", lambda: 16)
    assert driver.jobs_at_once(plan, None) == 2 and driver.jobs_at_once(plan, 1) == 1
    with pytest.raises(UsageError, match=r"3 at once with 2 ranks of 3 threads are 18 .* 16 cores"):
        driver.jobs_at_once(plan, 3)


@pytest.mark.slow
@pytest.mark.mpi
def test_members_of_several_ranks_have_the_same_bits(fallen, tmp_path):
    if len(os.sched_getaffinity(0)) < 2:
        pytest.skip("two ranks want two cores")
    (tmp_path / "fall.py").write_text(FALL)
    call("fall.py", "--set", "gravity=4", "--seed", "2", "--ranks", "2", cwd=tmp_path)
    assert "2 ranks" in (tmp_path / "fall_sweep/0000/out.log").read_text()
    one, other = fallen / "0005/data/hist_1.csv", tmp_path / "fall_sweep/0000/data/hist_1.csv"
    assert one.read_bytes() == other.read_bytes()


@pytest.mark.slow
def test_jobs_limit_how_many_run(tmp_path):
    """Programs that note when they began and ended: with one at once they do not overlap."""
    note = "open('when', 'w').write(f'{began} {time.time()}')\n"
    (tmp_path / "wait.py").write_text(f"import time\nn = 0\nbegan = time.time()\ntime.sleep(0.3 + 0 * n)\n{note}")
    call("wait.py", "--set", "n=1:3", "--jobs", "1", cwd=tmp_path)
    spans = sorted(tuple(map(float, path.read_text().split())) for path in tmp_path.glob("wait_sweep/*/when"))
    assert len(spans) == 3 and all(a[1] <= b[0] for a, b in itertools.pairwise(spans))


# --- refused before anything runs ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["--set", "gravty=1"], "did you mean 'gravity'?"),
        (["--set", "gravity"], "expected NAME=VALUES"),
        (["--set", "gravity=much"], "a number is expected"),
        (["--set", "gravity=1", "--set", "gravity=2"], "given twice"),
        (["--seed", "1:2", "--set", "seed=3"], "seed is given twice"),
        (["--set", "gravity=1:2", "--latin", "2", "--sobol", "2"], "either --latin or --sobol"),
        (["--seed", "1:2", "--sampling-seed", "3"], "--sampling-seed requires"),
        (["--seed", "1:2", "--jobs", "0"], "expected auto or a number"),
        (["--seed", "1:2", "--jobs", "5000"], "5000 at once"),
        (["--seed", "1:2", "--sbatch", "time=1"], "--sbatch requires --slurm"),
        (["--seed", "1:2", "--with", "nothing.dat"], "there is no such file"),
        (["--seed", "-1"], "SET"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(tmp_path, refused, words, why):
    (tmp_path / "fall.py").write_text(FALL)
    assert why in refused("fall.py", *words)
    assert not list(tmp_path.glob("fall_sweep/*/data"))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("seed = '1:2'", "script = FILE is missing"),
        ("script = 'fall.py'\nseeds = 3", "unknown key 'seeds'"),
        ("script = 'fall.py'\nseed = ", "settings.toml: "),
        ("script = 'fall.py'\nset = 3", "set is a table"),
        ("script = 'fall.py'\nranks = 'many'", "many"),
        ("script = 'fall.py'\n[set]\ngravity = {a = 1}", "a number, a word or a list"),
    ],
)
def test_wrong_settings_are_refused(tmp_path, refused, text, why):
    (tmp_path / "fall.py").write_text(FALL)
    (tmp_path / "settings.toml").write_text(text)
    assert why in refused("settings.toml")


def test_a_folder_that_holds_another_sweep_is_refused(tmp_path):
    script = tmp_path / "fall.py"
    script.write_text(FALL)
    first = hpcdem.Sweep(script, seed="1:2")
    assert hpcdem.Sweep(script, seed="1:3").new == 1 and len(first.members) == 2
    with pytest.raises(UsageError, match="a sweep over seed, not gravity"):
        hpcdem.Sweep(script, {"gravity": "1,2"})
    with pytest.raises(UsageError, match="samples of a different kind"):
        hpcdem.Sweep(script, {"gravity": "1.0:2.0"}, seed="1", latin=2)
    script.write_text(FALL.replace("CYC 500", "CYC 400"))
    with pytest.raises(UsageError, match=r"a different version of fall\.py"):
        hpcdem.Sweep(script, seed="1:2")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.txt").touch()
    with pytest.raises(UsageError, match="not empty"):
        hpcdem.Sweep(script, seed="1:2", folder=tmp_path / "full")


@pytest.mark.parametrize(
    "change", ['"script": "../fall.py"', '"script": "-c"', '"ranks": "1"', '"ranks": 0', '"more": 1']
)
def test_a_damaged_record_is_refused(tmp_path, change):
    (tmp_path / "fall.py").write_text(FALL)
    record = hpcdem.Sweep(tmp_path / "fall.py", seed="1:2").folder / "sweep.json"
    name = change.split(":")[0]
    lines = [line for line in record.read_text().splitlines() if not line.strip().startswith(name)]
    record.write_text("\n".join(["{", f" {change},", *lines[1:]]))
    with pytest.raises(HpcdemError, match="damaged"):
        hpcdem.Sweep.open(record.parent)


@pytest.mark.slow
def test_files_that_the_script_reads_are_found_in_each_member(tmp_path):
    (tmp_path / "table.txt").write_text("7")
    (tmp_path / "one.py").write_text("import sys\nn = 1\nassert open('table.txt').read() == '7' and n\n")
    assert "2 done" in call("one.py", "--set", "n=1:2", "--with", "table.txt", cwd=tmp_path)
    shutil.rmtree(tmp_path / "one_sweep")
    call("one.py", "--set", "n=1:2", "--tries", "1", cwd=tmp_path, code=1)
