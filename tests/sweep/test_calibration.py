"""Blind recovery of known parameters through a cheap forward model; what targets cannot tell."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.runtime.progress import Log
from hpcdem.sweep import driver
from hpcdem.sweep import plan as plans
from hpcdem.sweep.calibration import Target, calibrate
from hpcdem.sweep.calibration_report import write
from hpcdem.sweep.design import Range
from hpcdem.sweep.emulator import fit
from hpcdem.sweep.forward import Forward, Measured, read_settings

RANGES = {"ebmod": Range(1e9, 1e11, log=True), "tstrength": Range(1e6, 1e8, log=True), "fric": Range(0.0, 1.0)}


def measured(ebmod, tstrength, fric):
    """Like a bonded specimen: modulus, tensile strength and compressive strength."""
    return np.array([0.6 * ebmod * (1 + 0.1 * fric), 0.4 * tstrength, tstrength * (2.5 + 3.0 * fric)])


def forward(points, seeds=2, noise=0.02):
    found = []
    for u in points:
        values = measured(1e9 * 100.0 ** u[0], 1e6 * 100.0 ** u[1], u[2])
        random = np.random.default_rng(np.round(u * 1e6).astype(int))
        found.append(values * np.exp(noise * random.normal(size=(seeds, 3))))
    return np.array(found)


def logs(points):
    return np.log(forward(points))


KNOWN = [(3e10, 1e7, 0.5), (5e9, 3e6, 0.2), (6e10, 4e7, 0.8), (1.5e10, 2e7, 0.35), (8e9, 6e6, 0.65)]


@pytest.mark.parametrize("true", [KNOWN[0], *(pytest.param(one, marks=pytest.mark.slow) for one in KNOWN[1:])])
def test_blind_recovery(true):
    targets = [Target(n, v, 0.03) for n, v in zip(("E", "tension", "UCS"), np.log(measured(*true)))]
    result = calibrate(logs, RANGES, targets, first=12, rounds=2, batch=4)
    unit = np.array([np.log10(true[0] / 1e9) / 2.0, np.log10(true[1] / 1e6) / 2.0, true[2]])
    middle, spread = result.samples.mean(axis=0), result.samples.std(axis=0)
    assert (np.abs(middle - unit) < 3.0 * spread).all(), (middle, spread, unit)
    assert (spread < 0.12).all() and len(result.points) == 12 + 2 * 4
    assert not [text for text in result.cautions() if "out of reach" in text]
    assert result.best["ebmod"] == pytest.approx(true[0], rel=0.15)
    influence = np.abs(result.sensitivity())
    assert influence[0].argmax() == 0 and influence[1].argmax() == 1


def test_what_the_targets_cannot_determine():
    only = lambda points: np.log(forward(points))[:, :, 2:]  # noqa: E731
    result = calibrate(only, RANGES, [Target("UCS", float(np.log(4e7)), 0.03)], first=12, rounds=1, batch=4)
    told = " ".join(result.cautions())
    assert "the targets do not determine ebmod" in told and "the targets do not determine tstrength" not in told


def test_a_target_out_of_reach_and_failed_runs():
    target = [Target("E", float(np.log(1e13)), 0.03)]
    one = lambda points: np.log(0.6e9 * 100.0**points)[:, None, :]  # noqa: E731
    told = " ".join(calibrate(one, {"ebmod": RANGES["ebmod"]}, target, first=6, rounds=1, batch=2).cautions())
    assert "target E cannot be reached" in told and "ebmod lies at the upper end" in told
    with pytest.raises(UsageError, match="first = 3: 1 parameters need at least 4 points"):
        calibrate(one, {"ebmod": RANGES["ebmod"]}, target, first=3)
    with pytest.raises(HpcdemError, match="target E: 0 of 6 runs gave a number"):
        calibrate(lambda points: np.full((len(points), 1, 1), np.nan), {"ebmod": RANGES["ebmod"]}, target, first=6)
    with pytest.raises(UsageError, match="tolerance above 0"):
        Target("E", 1.0, 0.0)


def test_whole_numbers_stay_whole():
    seen = []

    def runs(points):
        seen.extend(whole.at(min(float(u), 1.0 - 1e-12)) for u in points[:, 0])
        return np.floor(points * 4.0)[:, None, :]

    whole = Range(2, 5, whole=True)
    result = calibrate(runs, {"layers": whole}, [Target("t", 3.0, 0.1)], first=8, rounds=1, batch=2)
    assert result.best == {"layers": 5} and set(result.parameters[:, 0].tolist()) <= {2, 3, 4, 5} == set(seen)


def test_the_emulator_against_a_known_function():
    random = np.random.default_rng(1)
    points = random.random((40, 2))
    of = lambda p: np.sin(3.0 * p[:, 0]) + p[:, 1] ** 2  # noqa: E731
    emulator = fit(points, of(points))
    at = random.random((200, 2))
    mean, variance = emulator(at)
    assert np.abs(mean - of(at)).max() < 0.02
    assert (np.abs(mean - of(at)) < 6.0 * np.sqrt(variance) + 1e-3).all()
    noisy = fit(np.repeat(points, 3, axis=0), np.repeat(of(points), 3) + 0.1 * random.normal(size=120))
    assert noisy.noise == pytest.approx(0.1, rel=0.25)
    assert emulator.noise < 1e-3


# --- scripts --------------------------------------------------------------------------------------------------------

PULL = """\
START
ebmod = 1e8
tstrength = 1e5
BOX left -2 right 6 bottom -2 height 4
SET disk on
SET dt 1e-4
BALL id 0 x 0.0 y 0.0 rad 0.5
BALL id 1 x 1.0 y 0.0 rad 0.5
PROP density 1000 kn 1e6 ks 1e6
PROP ebmod {ebmod} gbmod 1e8 tstrength {tstrength} sstrength 1e7
FIX x y spin
PROP xv 0.05 RANGE id 1
HIST ID 1 INTERVAL 5, energy
HIST ID 2 INTERVAL 5, bonds
CYC 600
"""
"""Two discs are pulled apart until their bond breaks."""
SETTINGS = """\
[[test]]
script = "pull.py"
[[test.target]]
name = "energy"
history = "hist_1"
y = "energy [J]"
of = "max"
value = 143.6
tolerance = 7.0
[[test.target]]
name = "life"
history = "hist_2"
y = "bonds [1]"
of = "mean"
value = 0.325
tolerance = 0.015
[parameters]
ebmod = "1e8:1e9:log"
tstrength = "1e5:6e5:log"
[search]
first = 8
rounds = 1
batch = 3
[write]
lines = ["PROP ebmod {ebmod:.4g} tstrength {tstrength:.4g}"]
"""
"""The targets are those of a run with ebmod 3e8 and tstrength 3e5."""


def written(folder, text=SETTINGS):
    (folder / "pull.py").write_text(PULL)
    (folder / "pull.toml").write_text(text)
    return folder / "pull.toml"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('of = "max"', 'of = "most"', "of = 'most': expected max, min, end, mean, slope"),
        ('of = "max"', 'of = "slope"', "target energy: a slope needs x"),
        ("tolerance = 7.0", "", "has no tolerance"),
        ("tolerance = 7.0", "tolerance = 0.0", "tolerance above 0"),
        ("value = 143.6", "value = -1.0\nlog = true", "a logarithm needs a value above 0"),
        ("ebmod = ", "young = ", "young: .*pull.py has no such parameter"),
        ('"1e8:1e9:log"', '"1e9"', "expected LOW:HIGH or LOW:HIGH:log"),
        ("first = 8", "first = 0", "search.first = 0"),
        ("{ebmod:.4g}", "{young}", "'young'; parameters are ebmod, tstrength"),
        ("[search]", "[seek]", "unknown key 'seek'"),
        ('name = "life"', 'name = "energy"', "two targets have the same name"),
        ('"pull.py"', '"none.py"', "none.py: No such file"),
        ('"pull.py"', '"pull.py"\nseeds = 3', "test.seeds = 3: expected a list of different whole numbers"),
        ('"pull.py"', '"pull.py"\nseeds = [1, 1]', "expected a list of different whole numbers"),
        ('"pull.py"', '"pull.py"\nranks = 0', "test.ranks = 0: expected a whole number above 0"),
        ('of = "max"', 'of = "max"\npart = ["a", 1]', "target.part = .* expected two numbers"),
        ('lines = ["PROP ebmod {ebmod:.4g} tstrength {tstrength:.4g}"]', 'lines = "PROP"', "expected a list of texts"),
    ],
)
def test_settings_that_make_no_sense(tmp_path, old, new, message):
    path = written(tmp_path, SETTINGS.replace(old, new, 1))
    with pytest.raises(HpcdemError, match=message):
        read_settings(path)


def test_missing_settings(tmp_path):
    with pytest.raises(HpcdemError, match=r"none\.toml: cannot read the settings: No such file or directory$"):
        read_settings(tmp_path / "none.toml")


def test_numbers_of_a_history(tmp_path):
    x = np.linspace(0.0, 1.0, 101)
    y = np.where(x < 0.6, 50.0 * x, 30.0 - 20.0 * (x - 0.6))
    rows = "".join(f"{a!r},{b!r}\n" for a, b in zip(x.tolist(), y.tolist()))
    (tmp_path / "h.csv").write_text("strain,stress\n" + rows)
    target = Target("E", 1.0, 1.0)

    def number(of):
        return Measured(target, "h", "stress", "strain", of, log=False).read(tmp_path)

    assert number("max") == pytest.approx(30.0) and number("end") == pytest.approx(22.0)
    assert number("slope") == pytest.approx(50.0) and number("min") == 0.0
    with pytest.raises(UsageError, match=r"target E: .* has no none.csv \(h\)"):
        Measured(target, "none", "stress").read(tmp_path)
    with pytest.raises(UsageError, match="has no column 'force'"):
        Measured(target, "h", "force").read(tmp_path)


def test_members_that_failed_are_tried_again_by_the_next_call_only(tmp_path, monkeypatch):
    settings = read_settings(written(tmp_path))
    left = []

    def run(plan, log, jobs, tries, without):
        left.append(sorted(without))
        for member in plan.members:
            (member.folder / "state.json").write_text('{"state": "failed"}')
        return {member.name: member.state for member in plan.members}

    monkeypatch.setattr("hpcdem.sweep.driver.run", run)
    model = Forward(settings, tmp_path / "out", Log())
    for _ in range(2):
        assert np.isnan(model(np.array([[0.2, 0.3], [0.5, 0.5]]))).all()
    assert left == [[], ["0000", "0001"]]
    monkeypatch.undo()
    plan = plans.load(tmp_path / "out" / "test_1")
    assert set(driver.run(plan, Log(), 1, 1, {"0000", "0001"}).values()) == {"failed"}


@pytest.mark.slow
def test_blind_recovery_through_runs(tmp_path):
    """Both parameters of the bond are found within their spread; a repetition only reads the runs, to the same page."""
    settings = read_settings(written(tmp_path))
    pages = []
    for _ in range(2):
        model = Forward(settings, tmp_path / "out", Log(), jobs=1)
        result = calibrate(model, settings.ranges, settings.targets, **settings.search)
        write(result, settings, tmp_path / "out")
        pages.append((tmp_path / "out" / "calibration.md").read_bytes())
    unit = np.log([3.0, 3.0]) / np.log([10.0, 6.0])
    assert (np.abs(result.samples.mean(axis=0) - unit) < 2.0 * result.samples.std(axis=0)).all()
    assert (tmp_path / "out" / "calibrated.txt").read_text().startswith("PROP ebmod ")
    assert pages[0] == pages[1] and len(list((tmp_path / "out" / "test_1").glob("00*"))) == 11
