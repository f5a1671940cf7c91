"""All short scripts of the ZDEM manual, whole, on 1, 2 and 4 ranks: every file that they write is the same to the bit.

Scripts that need what another one has written run after it, on as many ranks, with that file beside them. One line is
added to each: the state at its end is saved too (a CYC need not end at a frame).
"""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from hpcdem.io.frames import list_frames, read_frame
from tests.property.workers import Resident
from tests.rank_layouts import LAYOUTS, layouts
from tests.short_push import assert_same_files, contents

CHAINS: dict[str, dict[str, str | None]] = {
    "push": {
        "push": None,
        "syn_erosion": "push/data/0000006000.sav",
        "syn_sedimentaion": "push/data/0000006000.sav",
    },
    "pre_struct": {
        "pre_struct": None,
        "detachment": "pre_struct/init_xyr.dat",
        "palaeohigh": "pre_struct/init_xyr.dat",
    },
    "ex8": {"ex8_dem_am_gen": None, "ex8_dem_am_push": "ex8_dem_am_gen/ini_xyr.dat"},
    "extens_rigid": {"extens_rigid": None},
    "extens_ductile_patent": {"extens_ductile_patent": None},
    "push_add_del": {"push_add_del": None},
}
"""Scripts in the order in which they run, and the file each of them needs."""

QUICK = "push_add_del"
"""The chain whose run on one rank is looked at by quick tests; the others, and several ranks, are slow."""

LAST_STEP = {
    "push": 8_000, "syn_erosion": 10_000, "syn_sedimentaion": 10_600, "pre_struct": 5_000, "detachment": 6_000,
    "palaeohigh": 6_000, "ex8_dem_am_gen": 6_500, "ex8_dem_am_push": None, "extens_rigid": 15_400,
    "extens_ductile_patent": 6_900, "push_add_del": 12_600,
}  # fmt: skip
"""By CYC, and by the way and speed of the wall; None: it depends on the time step that is found."""


def run_script(resident: Resident, script: Path, folder: Path, needs: Path | None, ranks: int, *options: str) -> None:
    """Run a script of the manual in a new folder of its own, beside the file that it needs."""
    folder.mkdir(parents=True)
    text, at_the_end = re.subn(r"(?im)^stop$", "SAV end.sav\nSTOP", script.read_text())
    assert at_the_end == 1
    (folder / script.name).write_text(text)
    if needs is not None:
        shutil.copy(needs, folder)
    done = resident(ranks, folder / script.name, "--no-figure", *options, cwd=folder, timeout=600)
    assert done.returncode == 0, done.stdout + done.stderr


def run_chain(resident: Resident, chain: str, scripts: Path, folder: Path, ranks: int) -> Path:
    """Run the short scripts of a chain, each in a folder of its name."""
    for name, needs in CHAINS[chain].items():
        run_script(resident, scripts / "short" / f"{name}.py", folder / name, needs and folder / needs, ranks)
    return folder


@pytest.fixture(scope="module")
def on_one_rank(
    resident: Resident, manual_scripts: Path, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[[str], Path]]:
    """`on_one_rank("push")`: folder of a chain on one rank and one thread, run when first asked for."""
    folder = tmp_path_factory.mktemp("short")

    def of(chain: str) -> Path:
        if not (folder / chain).exists():
            run_chain(resident, chain, manual_scripts, folder / chain, 1)
        return folder / chain

    yield of
    shutil.rmtree(folder)


@pytest.mark.mpi
@pytest.mark.parametrize(
    ("chain", "ranks"),
    [pytest.param(chain, (2, 4)[k % 2], marks=pytest.mark.slow) for k, chain in enumerate(CHAINS)],
)
def test_same_files_on_more_ranks(
    on_one_rank: Callable[[str], Path], resident: Resident, manual_scripts: Path, tmp_path: Path, chain: str, ranks: int
) -> None:
    one, more = on_one_rank(chain), tmp_path / chain
    run_chain(resident, chain, manual_scripts, more, ranks)
    assert_same_files(one, more)
    shutil.rmtree(more)


@pytest.mark.mpi
@pytest.mark.parametrize("case", layouts(()))
def test_same_push_however_it_is_run(
    on_one_rank: Callable[[str], Path], manual_scripts: Path, resident: Resident, tmp_path: Path, case: str
) -> None:
    ranks, options = LAYOUTS[case]
    run_script(resident, manual_scripts / "short" / "push.py", tmp_path / "push", None, ranks, *options)
    assert_same_files(on_one_rank("push") / "push", tmp_path / "push")
    shutil.rmtree(tmp_path / "push")


@pytest.mark.parametrize(
    ("chain", "name"),
    [
        pytest.param(chain, name, marks=() if chain == QUICK else pytest.mark.slow)
        for chain, scripts in CHAINS.items()
        for name in scripts
    ],
)
def test_the_run_is_worth_comparing(on_one_rank: Callable[[str], Path], chain: str, name: str) -> None:
    """It took all of its steps, and some particle has gone further than its size."""
    folder = on_one_rank(chain) / name
    end = contents(folder / "end.sav")
    if LAST_STEP[name] is not None:
        assert json.loads(str(end["@state"]))["clock"]["step"] == LAST_STEP[name]
    first = read_frame(list_frames(folder / "data")[0].path, ("particles",)).tables["particles"].columns
    _, then, now = np.intersect1d(first["gid"], end["particles/gid"], assume_unique=True, return_indices=True)
    assert len(now) > 300
    way = np.hypot(*(end[f"particles/{axis}"][now] - first[axis][then] for axis in "xy"))
    assert way.max() > 2.0 * first["radius"].max()


# ---- names of the output -----------------------------------------------------------------------------------------

PUBLISHED_NAMES = """
    0000000000_ini 0000001000 0000002000 0000003000 0000004000 0000005000 0000005000_ini 0000006000 0000006000_ini
    0000016000 0000026000 0000036000 0000036000_ini 0000046000 0000056000 0000056000_ini 0000056100 0000056200
    0000056300 0000056400 0000056500 0000056600 0000056700 0000056800 0000056900 0000057000 0000057100 0000057200
    0000057300 0000057400 0000057500 0000057600 0000057700 0000057800 0000057900 0000058000 0000058000_ini 0000068000
    0000078000 0000088000 0000098000 0000108000
""".split()
"""Frames of push_add_del.py as chapter 6.3.2 of the manual lists them."""

PUSH_ADD_DEL = [
    ("CYC", 5_000, 1_000), ("CYC", 1_000, 1_000), ("IMPLE", 30_000, 10_000), ("IMPLE", 20_000, 10_000),
    ("CYC", 2_000, 100), ("IMPLE", 50_000, 10_000),
]  # fmt: skip
"""Its commands, their steps, and the steps between frames."""

SHORT_PUSH_ADD_DEL = [
    ("CYC", 1_500, 500), ("CYC", 500, 500), ("IMPLE", 3_000, 1_000), ("IMPLE", 2_000, 1_000), ("CYC", 600, 100),
    ("IMPLE", 5_000, 1_000),
]  # fmt: skip


def frame_names(commands: list[tuple[str, int, int]]) -> list[str]:
    """Rule of the manual: an _ini frame as a command begins; CYC then counts steps of the model, IMPLE its own."""
    names, now = [], 0
    for command, steps, every in commands:
        names.append(f"{now:010d}_ini")
        first = now if command == "IMPLE" else 0
        names += [f"{step:010d}" for step in range(now + 1, now + steps + 1) if (step - first) % every == 0]
        now += steps
    return names


def frames_on_disk(data: Path, suffix: str) -> list[str]:
    """Names without ``all_`` and suffix."""
    return sorted(path.stem.removeprefix("all_") for path in data.glob(f"all_*{suffix}"))


def test_rule_gives_the_published_names() -> None:
    assert len(PUBLISHED_NAMES) == 42
    assert sorted(frame_names(PUSH_ADD_DEL)) == sorted(PUBLISHED_NAMES)


@pytest.mark.parametrize("suffix", [".dat", ".vtkhdf"])
def test_names_of_the_short_run(on_one_rank: Callable[[str], Path], suffix: str) -> None:
    data = on_one_rank("push_add_del") / "push_add_del" / "data"
    assert frames_on_disk(data, suffix) == sorted(frame_names(SHORT_PUSH_ADD_DEL))


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.mpi
def test_names_of_the_whole_run(resident: Resident, manual_scripts: Path, tmp_path: Path) -> None:
    run_script(resident, manual_scripts / "push_add_del.py", tmp_path / "whole", None, 2)
    for suffix in (".dat", ".vtkhdf"):
        assert frames_on_disk(tmp_path / "whole" / "data", suffix) == sorted(PUBLISHED_NAMES)
    shutil.rmtree(tmp_path / "whole")
