"""The tectonic examples: shortened they run to their figure; whole, they make the structure their header describes.

Structures are measured on particles followed by their id from the first frame of the deformation to the last frame.
The numbers asked for are looser than those in the headers: single faults may move by some hundred metres when the
order of sums changes, the style of the structure may not.
"""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from hpcdem.io.frames import list_frames, read_frame
from tests.conftest import ROOT
from tests.property.workers import Resident

NAMES = (
    "detachment",
    "basement_high",
    "extension_rigid",
    "extension_ductile",
    "fault",
    "sedimentation_erosion",
    "growth_strata",
    "foreland",
)
QUICK = ("basement_high", "extension_ductile", "sedimentation_erosion", "foreland")
"""Of which a shortened run is made every time: with these all commands of the examples are carried out."""


# --- shortened -------------------------------------------------------------------------------------------------


def shortened(text: str) -> str:
    """A script with a twentieth of the steps of CYC and a hundredth of the ways of IMPLE."""
    text = re.sub(r"^CYC (\d+)", lambda m: f"CYC {max(1, int(m[1]) // 20)}", text, flags=re.MULTILINE)
    return re.sub(r"\b(xmove|print|save) (-?\d+\.\d+)", lambda m: f"{m[1]} {float(m[2]) / 100}", text)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in NAMES]
)
def test_shortened_example_runs_to_its_figure(resident: Resident, tmp_path: Path, name: str) -> None:
    """Every command of the example is carried out, and the figure shows the last state."""
    text = (ROOT / "examples" / f"{name}.py").read_text()
    assert re.search(r"^IMPLE .* xmove -?\d+\.\d+ ", text, flags=re.MULTILINE)
    (tmp_path / f"{name}.py").write_text(shortened(text))
    done = resident(1, tmp_path / f"{name}.py")
    assert done.returncode == 0, done.stdout + done.stderr
    figure = re.findall(r"^figure: (\S+)$", done.stdout, flags=re.MULTILINE)
    assert figure and Path(figure[0]).stat().st_size > 10_000
    assert int(Path(figure[0]).stem[4:14]) >= list_frames(tmp_path / "data")[-1].step
    # Each GEN has made particles, and each bed and block has found some.
    groups = set(re.findall(r"\bgroup (\w+)", re.sub("#.*", "", text)))
    last = Run.of(tmp_path / "data").last
    found = {last["names"][k] for k in np.unique(last["group"])}
    assert groups == {name if name in groups else name.rstrip("0123456789") for name in found}  # episodes


# --- whole -----------------------------------------------------------------------------------------------------


@dataclass
class Run:
    """Columns of the particles before the deformation and at the end, plus `names` of groups and `walls` x by id."""

    first: dict
    last: dict

    @classmethod
    def of(cls, folder: Path) -> Run:
        """The frame with which the first IMPLE began, just before the first one printed on its way, and the last."""
        frames = list_frames(folder)
        moving = next(k for k, f in enumerate(frames) if not f.ini)
        return cls(cls._columns(frames[moving - 1].path), cls._columns(frames[-1].path))

    @staticmethod
    def _columns(path: Path) -> dict:
        frame = read_frame(path, ("particles",))
        columns = dict(frame.tables["particles"].columns)
        columns["names"] = frame.group_names
        columns["walls"] = {int(k): p[0] for k, p in zip(frame.walls["id"], frame.walls["p1"])}
        return columns

    def follow(self) -> tuple[np.ndarray, ...]:
        """x0 y0 x1 y1 group of all particles that are there in both frames; group as names."""
        _, a, b = np.intersect1d(self.first["gid"], self.last["gid"], return_indices=True)
        names = np.array(self.last["names"])[self.last["group"][b]]
        return self.first["x"][a], self.first["y"][a], self.last["x"][b], self.last["y"][b], names

    def of_group(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """x y of a group in the last frame."""
        chosen = self.last["group"] == self.last["names"].index(name)
        return self.last["x"][chosen], self.last["y"][chosen]


def whole(resident: Resident, tmp_path: Path, name: str) -> Run:
    """The example as it is, on two ranks."""
    done = resident(2, ROOT / "examples" / f"{name}.py", "--outdir", tmp_path / "data", timeout=1800)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "figure: " in done.stdout
    return Run.of(tmp_path / "data")


def profile(x: np.ndarray, y: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Mean y between neighbouring edges; nan where there are fewer than three particles."""
    where = np.digitize(x, edges) - 1
    return np.array([y[where == k].mean() if (where == k).sum() > 2 else np.nan for k in range(len(edges) - 1)])


def dip(x: np.ndarray, y: np.ndarray) -> float:
    """Inclination of the line through the points against the horizontal [degrees], positive where it rises with x."""
    return float(np.degrees(np.arctan(np.polyfit(x, y, 1)[0])))


def front(x: np.ndarray, y: np.ndarray, levels: np.ndarray, side: float) -> tuple[np.ndarray, np.ndarray]:
    """The border of a set of points: quantile `side` of x in each interval of y, and the middles of the intervals."""
    rows = [x[(y >= a) & (y < b)] for a, b in itertools.pairwise(levels)]
    assert all(map(len, rows)), "no particles at some height"
    return np.array([np.quantile(row, side) for row in rows]), (levels[:-1] + levels[1:]) / 2


def detachment(run: Run) -> None:
    """Folds as far as the far end, about as high as at the wall, with steep limbs on both sides."""
    x0, y0, x, y, group = run.follow()
    wall = run.last["walls"][1]
    assert wall == pytest.approx(6000.0, abs=5.0)
    bed = (y0 > 1140.0) & (y0 < 1460.0)
    height = profile(x[bed], y[bed], np.arange(6000.0, 24001.0, 500.0)) - y0[bed].mean()
    thirds = [height[k : k + 12] for k in (0, 12, 24)]
    assert all(t.max() > 400.0 and t.max() - t.min() > 350.0 for t in thirds)
    slopes = np.diff(height) / 500.0
    assert (slopes > 0.3).sum() >= 2 and (slopes < -0.3).sum() >= 2
    # Salt moved into the cores of the folds.
    salt = group == "salt"
    top = np.array([np.quantile(y[salt & (x >= a) & (x < a + 500.0)], 0.98) for a in np.arange(6000.0, 24000.0, 500.0)])
    assert (top > 800.0).sum() >= 3 and np.median(top) < 700.0
    # All of the cover is shortened, not only what lies near the wall: half of the way is still made at half length.
    middle = bed & (abs(x0 - 12000.0) < 300.0)
    assert 1500.0 < (x - x0)[middle].mean() < 4500.0


def basement_high(run: Run) -> None:
    """Before the high: thrusts and uplift; behind it: next to nothing."""
    x0, y0, x, y, group = run.follow()
    high = group == "high"
    assert high.sum() > 200 and abs(x - x0)[high].max() < 1e-6 and abs(y - y0)[high].max() < 1e-6
    top = y0 > 2000.0
    before, behind = top & (x0 < 10500.0), top & (x0 > 15500.0)
    assert (y - y0)[before].mean() > 700.0
    assert abs(y - y0)[behind].mean() < 0.1 * (y - y0)[before].mean()
    assert (x - x0)[behind].mean() < 0.1 * (x - x0)[before].mean()
    # A thrust: a bed lies above itself over more than 500 m at the slope of the high.
    red = (y0 > 1100.0) & (y0 < 1350.0) & ~high
    upper, lower = red & (y > 1900.0), red & (y < 1450.0) & (x0 > 11000.0)
    assert x[upper].max() - x[lower].min() > 500.0


def extension_rigid(run: Run) -> None:
    """Two whole shoulders, 3 km apart, conjugate normal faults between them, three fills thickest where it sank."""
    x0, y0, x, y, group = run.follow()
    cover = group == "cover"
    levels = np.arange(400.0, 2801.0, 300.0)
    still = cover & (np.hypot(x - x0, y - y0) < 60.0)
    moved = cover & (np.hypot(x - x0 - 3000.0, y - y0) < 60.0)
    left = dip(*front(x[still], y[still], levels, 0.99))
    right = dip(*front(x[moved], y[moved], levels, 0.01))
    assert -75.0 < left < -45.0 and 40.0 < right < 75.0
    # The old surface has sunk by more than a kilometre; the shoulders stand.
    surface = cover & (y0 > 2800.0)
    sunk = y0 - y
    assert np.median(sunk[surface & (x > 8000.0) & (x < 9000.0)]) > 1200.0
    assert abs(np.median(sunk[surface & (x < 5000.0)])) < 20.0 and abs(np.median(sunk[surface & (x > 15000.0)])) < 20.0
    # Fills are older below younger, and each is thicker above the step than towards the right border.
    middles = []
    for name in ("fill1", "fill2", "fill3"):
        fx, fy = run.of_group(name)
        middles.append(fy[(fx > 8000.0) & (fx < 9000.0)].mean())
        assert fx.min() > 5500.0 and fx.max() < 14500.0
    assert middles[0] + 200.0 < middles[1] and middles[1] + 200.0 < middles[2]
    fx = np.concatenate([run.of_group(f"fill{k}")[0] for k in (1, 2, 3)])
    assert ((fx > 8000.0) & (fx < 9000.0)).sum() > 2 * ((fx > 12000.0) & (fx < 13000.0)).sum()


def extension_ductile(run: Run) -> None:
    """An evenly stretched base row, tilted blocks of both senses above it, and fills that thicken against faults."""
    x0, y0, x, y, group = run.follow()
    row = np.sort(x[group == "middle"])
    gaps = np.diff(row)
    assert gaps.mean() == pytest.approx(60.0 * 12.0 / 8.0, rel=0.02) and gaps.std() < 0.05 * gaps.mean()
    assert np.ptp(y[group == "middle"]) < 1e-6
    # Tilts of the upper marker bed, in windows of 600 m that have turned as one piece.
    bed = (y0 > 1600.0) & (y0 < 1900.0) & (group == "cover")
    tilts = []
    for a in np.arange(2000.0, 10401.0, 200.0):
        p = bed & (x0 >= a) & (x0 < a + 600.0)
        slope, rise = np.polyfit(x[p], (y - y0)[p], 1)
        if np.std((y - y0)[p] - slope * x[p] - rise) < 30.0:
            tilts.append(np.degrees(np.arctan(slope)))
    assert max(tilts) > 8.0 and min(tilts) < -6.0
    ends = [dip(x[p], (y - y0)[p]) for p in (bed & (x0 < 2000.0), bed & (x0 > 11000.0))]
    assert max(map(abs, ends)) < 3.0
    # Thickness of the first fill, from the area of its particles.
    fx, _ = run.of_group("fill1")
    count, _ = np.histogram(fx, np.arange(500.0, 12501.0, 500.0))
    assert count.max() > 3 * max(1, np.quantile(count, 0.2))
    fy = run.of_group("fill2")[1]
    assert len(fy) > len(fx) * 0.5 and fy.mean() > run.of_group("fill1")[1].mean() + 200.0


def fault(run: Run) -> None:
    """A monocline as high as the throw; the fault has cut the lowest bed and not the highest, which is folded."""
    x0, y0, x, y, group = run.follow()
    hang, foot, cover = (group == k for k in ("hang", "foot", "cover"))
    throw, heave = 1430.0, 1200.0
    assert (y - y0)[hang] == pytest.approx(throw, rel=0.01) and (x0 - x)[hang] == pytest.approx(heave, rel=0.01)
    assert abs(y - y0)[foot].max() < 1e-6
    edge = dip(*front(x[hang], y[hang], np.arange(100.0, 2501.0, 300.0), 0.02))
    assert edge == pytest.approx(-50.0, abs=4.0)
    top = cover & (y0 > 2600.0)
    assert np.median((y - y0)[top & (x > 6000.0)]) == pytest.approx(throw, rel=0.05)
    assert abs(np.median((y - y0)[top & (x < 1500.0)])) < 60.0
    # How far each bed lies above itself, right of the foremost hanging-wall part, left of the last footwall part.
    overlap = []
    for low in (1100.0, 1700.0, 2300.0):
        bed = cover & (y0 > low) & (y0 < low + 300.0)
        upper, lower = bed & (y - y0 > 0.8 * throw), bed & (y - y0 < 0.1 * throw)
        overlap.append(np.quantile(x[lower], 0.99) - np.quantile(x[upper], 0.01))
    assert overlap[0] > 700.0 and overlap[0] > overlap[1] > overlap[2]
    # The highest bed is drawn out but not cut: it has particles on all heights between its two sides.
    red = np.sort(y[cover & (y0 > 2300.0) & (y0 < 2600.0)])
    assert np.diff(red).max() < 100.0


def sedimentation_erosion(run: Run) -> None:
    """Crests cut down to old beds; deposits end against the first thrust and are lifted by a younger one in front."""
    x0, y0, x, y, _group = run.follow()
    wall = run.last["walls"][1]
    # The last erosion, at 3200 m, and what rises when the load is off; single grains are thrown higher (seeds: by 54 to
    # 126 m).
    assert np.quantile(run.last["y"], 0.999) < 3300.0
    gone = 1.0 - np.isin(run.first["gid"], run.last["gid"]).mean()
    assert 0.02 < gone < 0.25
    # Near the wall rock of the lower half crops out: what lay above has been thrust up and cut off.
    outcrop = (y > 2900.0) & (x < wall + 3000.0)
    assert (y0[outcrop] < 1500.0).sum() > 20
    (ax, ay), (bx, by) = run.of_group("deposit1"), run.of_group("deposit2")
    assert min(ax.min(), bx.min()) > wall + 1500.0
    regional = ax > 17000.0, bx > 17000.0
    assert ay[regional[0]].mean() == pytest.approx(2150.0, abs=100.0)
    assert by[regional[1]].mean() == pytest.approx(2450.0, abs=150.0)
    height = profile(ax, ay, np.arange(9000.0, 17001.0, 500.0)) - ay[regional[0]].mean()
    assert np.nanmax(height) > 400.0
    assert np.arange(9250.0, 17000.0, 500.0)[np.nanargmax(height)] > wall + 3000.0


def growth_strata(run: Run) -> None:
    """Growth strata are arched over a young fold in the foreland and thin towards it, the youngest most; rock of the
    first thrust lies over the oldest ones."""
    x, y = run.of_group("growth1")
    regional = np.median(y[x > 18500.0])
    height = profile(x, y, np.arange(9000.0, 18001.0, 500.0)) - regional
    crest = np.arange(9250.0, 18000.0, 500.0)[np.nanargmax(height)]
    assert np.nanmax(height) > 200.0

    def density(names: tuple[str, ...], a: float, b: float) -> float:
        """Discs of groups per metre."""
        return sum(((at >= a) & (at < b)).sum() for at, _ in map(run.of_group, names)) / (b - a)

    every = tuple(f"growth{k}" for k in range(1, 7))
    assert density(every, crest - 500.0, crest + 500.0) < 0.92 * density(every, 18500.0, 19800.0)
    assert density(every[-1:], crest - 500.0, crest + 500.0) < 0.5 * density(every[-1:], 18500.0, 19800.0)
    rock_x, rock_y = run.of_group("rock")
    over = [((np.abs(rock_x - a) < 100.0) & (rock_y > b + 150.0)).any() for a, b in zip(x, y)]
    assert sum(over) > 10


def foreland(run: Run) -> None:
    """A wedge at the wall; the base below it sinks by some hundred metres, and rises a little in front of the basin."""
    wall = run.last["walls"][1]
    x, y = run.of_group("sand")
    assert wall == pytest.approx(7000.0, abs=1.0)
    assert y[x < wall + 3000.0].max() > y[x > 40000.0].max() + 700.0
    lowest = np.array([y[(x > a) & (x <= a + 3000.0)].min() for a in np.arange(wall, 57000.0, 3000.0)]) - 150.0
    assert lowest[0] < -350.0 and (lowest[:8] < lowest[-1] - 50.0).all()
    assert lowest.max() < 100.0
    assert lowest.argmax() > 10


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.mpi
@pytest.mark.parametrize("name", NAMES)
def test_whole_example_makes_its_structure(resident: Resident, tmp_path: Path, name: str) -> None:
    """The claims of the header, measured."""
    globals()[name](whole(resident, tmp_path, name))
