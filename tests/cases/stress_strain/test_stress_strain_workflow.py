"""Chapter 6 of the ZDEM manual, word for word, on its short scripts: which files there are, and what is in them."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy

from hpcdem.io.frames import list_frames
from hpcdem.post.section import Section, read_section
from tests.cases.stress_strain.chapter6 import PICKED, SIGMA1, Chapter, bash, chapter, job, tree
from tests.conftest import ROOT, Launcher, mpi_command
from tests.short_push import assert_same_files

pytestmark = [pytest.mark.figures, pytest.mark.slow]  # quick: unit/test_strain_stress_folder.py, test_zdem2jpg.py
FIELDS = ("volumetric", "distortional", "mean", "shear")


@pytest.fixture
def manual(manual_scripts: Path, tmp_path_factory: pytest.TempPathFactory) -> Chapter:
    """The chapter, run when first asked for."""
    return chapter(manual_scripts, tmp_path_factory.getbasetemp())


def expected_tree(names: list[str], series: set[str]) -> dict[str, set[str]]:
    """ss of frames with these names (all_<step>), by folder, after one call of zdemss. series: its pages of all."""
    pages = {f"{name}_strain_stress" for name in names} | {f"series_{kind}" for kind in series}
    return {
        "data": {f"{name}.{kind}" for name in names for kind in ("out", "npz", "vtkhdf")},
        "data2ps": {f"{what}_{name}.out" for name in names for what in ("strain", "stress")},
        "Tmp": {f"{name}_{field}.grd" for name in names for field in (*FIELDS, "invariant", "difference")},
        "ps": {f"{page}.ps" for page in pages},
        ".": {f"{page}.jpg" for page in pages},
    }


def parted(kinds: tuple[str, ...], parts: int) -> set[str]:
    """Names of pages of series that fill several sheets."""
    return {f"{kind}_{k + 1}" for kind in kinds for k in range(parts)} if parts > 1 else set(kinds)


def section(folder: Path, step: str) -> Section:
    return read_section(folder / "ss" / "data" / f"all_{step}.npz")


def by_height(section: Section, name: str, edges: np.ndarray) -> np.ndarray:
    """Mean of a field between heights [m]."""
    rows = np.digitize(section.y, edges) - 1
    return np.array([np.nanmean(section.fields[name][rows == k]) for k in range(len(edges) - 1)])


def bands(section: Section, part: float, least: int) -> list[tuple[float, bool, np.ndarray]]:
    """Connected regions of at least `least` nodes of one sign with |distortional strain| above `part` of its maximum,
    the largest first: angle of the long axis [degrees], whether the strain is positive, the nodes (x, y) (n, 2)."""
    columns, rows, strain = section.mean_strain()
    strain = np.nan_to_num(strain)
    x, y = np.meshgrid(columns, rows)
    found = []
    for clockwise in (True, False):
        signed = strain if clockwise else -strain
        names, count = scipy.ndimage.label(signed > part * np.abs(strain).max())
        for k in range(1, count + 1):
            nodes = np.stack([x[names == k], y[names == k]], axis=1)
            if len(nodes) >= least:
                axis = np.linalg.eigh(np.cov(nodes.T))[1][:, 1]
                found.append((float(np.degrees(np.arctan(axis[1] / axis[0]))), clockwise, nodes))
    return sorted(found, key=lambda band: -len(band[2]))


# -- files --------------------------------------------------------------------------------------------------------


@pytest.mark.slow  # the same programs as in job2, which is quick
def test_job_detachment_writes_the_tree_of_the_manual(manual: Chapter) -> None:
    data = manual.detachment / "data"
    names = [file.path.stem for file in list_frames(data)]
    assert names == ["all_0000000000_ini"] + [f"all_{step:010d}" for step in range(1000, 6001, 1000)]
    assert {path.stem for path in data.glob("*.jpg")} >= set(names)
    kinds = ("deformation", *FIELDS)
    found = tree(data / "ss")
    parts = len([name for name in found["."] if name.startswith("series_mean")])
    assert found == expected_tree(names, parted(kinds, parts))


def test_job1_draws_every_frame_and_job2_writes_the_tree_of_the_manual(manual: Chapter) -> None:
    data, datass = manual.push / "data", manual.push / "datass"
    assert {path.stem for path in data.glob("*.jpg")} == {path.stem for path in data.glob("*.dat")}
    names = [f"all_{step}" for step in PICKED]
    found = tree(datass / "ss")
    parts = len([name for name in found["."] if name.startswith("series_mean")])
    expected = expected_tree(names, parted(("deformation", *FIELDS), parts))
    # 6.4 has drawn two panels per page, with bars over the second; deformation is the same as before.
    bars = {f"{name}_sigma1" for name in names} | {f"series_{s}" for s in parted(("distortional_sigma1",), parts)}
    expected["."] |= {f"{page}.jpg" for page in bars}
    expected["ps"] |= {f"{page}.ps" for page in bars}
    assert found == expected
    assert {path.name for path in datass.glob("*.*")} == {f"{name}.dat" for name in names}


def test_the_tables_hold_numbers_of_the_moved_model(manual: Chapter) -> None:
    """--xmove and --ymove bring the corner of the model from (1000, 1000) to the origin."""
    for what, columns in (("strain", 5), ("stress", 8)):
        table = np.loadtxt(manual.push / "datass" / "ss" / "data2ps" / f"{what}_all_{PICKED[-1]}.out")
        assert table.shape[1] == columns
        known = table[np.isfinite(table[:, 2:]).all(axis=1)]
        assert len(known) > 400
        assert known[:, 0].min() == pytest.approx(1000.0, abs=201.0)  # the wall has moved 1 km
        assert known[:, 0].max() == pytest.approx(10000.0, abs=201.0)
        assert known[:, 1].min() == pytest.approx(0.0, abs=201.0)


@pytest.mark.slow  # as are the jobs of tests/slurm/test_chapter6.py; quick: unit/test_strain_stress_folder.py
@pytest.mark.mpi
def test_job2_writes_the_same_bytes_on_four_ranks(manual: Chapter, tmp_path: Path) -> None:
    shutil.copytree(manual.push / "datass", tmp_path / "datass", ignore=shutil.ignore_patterns("ss"))
    bash(manual.text("job2.sh", " ".join([*mpi_command(4), ""])) + job(f"srun -n 1 {SIGMA1}", ""), tmp_path)
    assert_same_files(manual.push / "datass", tmp_path / "datass")


# -- content ------------------------------------------------------------------------------------------------------


def test_strain_of_the_short_push_is_a_thrust_near_the_wall(manual: Chapter) -> None:
    """A band, or a conjugate pair, through the whole bed near the wall; the sign is that of a thrust of this dip. The
    foreland is only compressed. (Which of the two dips wins is chance: a bed that differs by rounding may choose the
    other.)"""
    first, last = section(manual.push / "datass", PICKED[0]), section(manual.push / "datass", PICKED[-1])
    assert np.nanmax(np.abs(first.fields["distortional"])) == 0.0  # strain is since this one
    x, _, strain = last.mean_strain()
    strain = np.abs(strain)
    assert np.nanmax(strain) > 0.5
    found = bands(last, 0.05, 20)  # of the largest strain, which single particles reach
    assert [clockwise for _, clockwise, _ in found] in ([True], [False], [True, False], [False, True])
    assert all(25.0 < abs(angle) < 75.0 and clockwise == (angle > 0.0) for angle, clockwise, _ in found)
    nodes = np.concatenate([nodes for *_, nodes in found])
    assert np.ptp(nodes[:, 1]) > 1500.0
    assert nodes[:, 0].max() < 5000.0
    assert np.nanmedian(strain[:, x > 7000.0]) < 0.1 * np.nanmax(strain)


def test_sediments_have_no_strain_before_they_are_pushed(manual: Chapter) -> None:
    """They are new in the frame at rest, and what is cut off leaves no trace."""
    cut, rest = section(manual.push / "datass", PICKED[2]), section(manual.push / "datass", PICKED[4])
    new = ~np.isin(rest.particles["gid"], cut.particles["gid"])
    assert new.sum() > 100
    assert not rest.particles["distortional"][new].any() and not rest.particles["volumetric"][new].any()
    before = section(manual.push / "datass", PICKED[1])
    assert not np.isin(before.particles["gid"][before.particles["y"] > 2080.0], cut.particles["gid"]).any()


def test_stress_grows_with_depth_and_towards_the_wall(manual: Chapter) -> None:
    edges = np.arange(0.0, 2001.0, 500.0)
    settled, pushed = section(manual.push / "datass", PICKED[0]), section(manual.push / "datass", PICKED[2])
    for name in ("mean", "shear"):
        assert (np.diff(by_height(settled, name, edges)) < 0.0).all()
        assert (np.diff(by_height(pushed, name, edges)) < 0.0).all()
        rows, wall = pushed.y < 1000.0, pushed.walls["p1"][pushed.walls["id"] == 1][0, 0]
        near, far = (pushed.fields[name][np.ix_(rows, (pushed.x > wall + a) & (pushed.x < wall + a + 2000.0))] for a in
                     (0.0, 7000.0))  # fmt: skip
        assert np.nanmean(near) > 1.3 * np.nanmean(far)


@pytest.mark.slow
def test_stress_grows_with_depth_where_a_detachment_is_weak(manual: Chapter) -> None:
    folder = manual.detachment / "data"
    assert (np.diff(by_height(section(folder, "0000006000"), "mean", np.arange(500.0, 2001.0, 500.0))) < 0.0).all()


@pytest.mark.slow
@pytest.mark.mpi
def test_thrusts_of_the_example_are_bands_of_their_sign(launch: Launcher, tmp_path: Path) -> None:
    """examples/push.py, whole, with five seeds, as the number of bands of one run is chance: bands across the beds,
    positive where they rise to the right (forethrusts), negative where they rise to the left; the strongest is a
    forethrust, and conjugates have less strain."""
    text = (ROOT / "examples" / "push.py").read_text()
    assert "SET seed 20\n" in text
    forethrusts = []
    for seed in (20, 1, 2, 3, 4):
        folder = tmp_path / str(seed)
        chosen = folder / "datass"
        chosen.mkdir(parents=True)
        (folder / "push.py").write_text(text.replace("SET seed 20\n", f"SET seed {seed}\n"))
        done = launch(2, folder / "push.py", "--no-figure", timeout=900)
        assert done.returncode == 0, done.stdout + done.stderr
        for file in list_frames(folder / "data"):
            if file.step > 8000 or (file.step == 8000 and file.path.stem.endswith("_ini")):
                shutil.copy(file.path, chosen)
        done = launch(2, "-s", chosen)
        assert done.returncode == 0, done.stdout + done.stderr
        last = read_section(max((chosen / "ss" / "data").glob("*.npz")))
        found = bands(last, 0.1, 40)
        assert found and all(clockwise == (angle > 0.0) for angle, clockwise, _ in found)
        assert found[0][1]
        _, _, strain = last.mean_strain()
        assert (strain > 1.0).sum() > 2 * (strain < -1.0).sum() > 0
        forethrusts.append(sum(clockwise for _, clockwise, _ in found))
    assert sum(forethrusts) > len(forethrusts)  # here and there two thrust sheets
