"""Which faults are made, in which order, and what came of each."""

from __future__ import annotations

import random
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from statistics import median
from typing import Any

from faults import model, runs
from faults.case import Case, Skipped, World
from faults.kinds import KINDS, Kind

Row = dict[str, Any]
RARE = 40
"""Of so many faults one is of a kind that takes long."""
WEIGHTS = (6, 3, 1)
"""How often a run has one, two, three ranks."""
FIRST_ONLY = ("a new run in an old folder", "Slurm: --signal=USR1", "Slurm: requeue")
CHAINED = (
    "kill a rank", "SIGTERM", "SIGUSR1", "--time-limit", "disk full", "disk error",
    "kill in a row of a series", "kill in a write of a checkpoint", "kill at flush or rename", ".sav cut",
    "clock of the disk jumps",
)  # fmt: skip
"""Kinds that may follow another fault in the run that goes on."""


def say(text: str) -> None:
    """To the terminal, while it goes on."""
    print(text, file=sys.stderr, flush=True)


def plan(number: int, seed: int, kinds: list[Kind], most_ranks: int) -> list[tuple[int, list[Kind], tuple[int, ...]]]:
    """(seed, kinds one after the other, ranks of the runs) of each case: all kinds in turn, rare ones seldom."""
    often = [k for k in kinds if not k.rare and k.least <= most_ranks] or [k for k in kinds if k.least <= most_ranks]
    rare = [k for k in kinds if k.rare and k not in often]
    found = []
    for index in range(number):
        rng = random.Random(f"{seed}-{index}")
        if rare and index % RARE == RARE - 1:
            first = rare[(index // RARE) % len(rare)]
        else:
            first = often[(index - index // RARE) % len(often)]
        chain = [first]
        while len(chain) < 3 and rng.random() < 0.15 and first.name not in FIRST_ONLY:
            chain.append(KINDS[rng.choice(CHAINED)])
        most = min([most_ranks, *(k.most for k in chain)])
        several = tuple(rng.choices(range(n, most + 1), WEIGHTS[n - 1 : most])[0] for n in (first.least, 1, 1))
        if several[0] == 1 and rng.random() < 0.7:  # most runs on one rank stay so, which is quick
            several = (1, 1, 1)
        found.append((index, chain, several))
    return found


def carry_out(world: World, seed: int, index: int, chain: list[Kind], ranks: tuple[int, ...]) -> Row:
    """One case: its faults, and the way to the end. Only what came before the end of a run counts as a fault."""
    began = time.monotonic()
    rng = random.Random(f"{seed}-{index}-case")
    case = Case(world, rng, world.folder / f"case{index:04d}", ranks)
    if runs.has_option("--keep") and rng.random() < 0.25:
        case.options += ["--keep", "3"]
    skipped, made = "", []
    try:
        for kind in chain:
            if case.done():  # some kinds go on to the end: then there is nothing left to be disturbed
                break
            before = len(case.moments)
            kind.call(case)
            made += [kind.name] if len(case.moments) > before else []
        case.finish()
    except Skipped as why:
        skipped = str(why)
    except Exception:
        case.problem("a mistake of the campaign: " + " ".join(traceback.format_exc().split("\n")[-6:]))
    result = "skipped" if skipped else "failed" if case.problems else "refused" if case.refused else "survived"
    if not skipped and result == "survived" and not made:
        result = "missed"
    case.close(keep=result == "failed")
    return {
        "model": world.reference.model.key, "kind": (made or [chain[0].name])[0], "chain": made[1:],
        "seed": f"{seed}-{index}", "ranks": list(ranks),
        "moments": case.moments, "lost": case.lost, "result": result, "why": [skipped] if skipped else case.problems,
        "folder": str(case.folder) if result == "failed" else "", "seconds": round(time.monotonic() - began, 2),
    }  # fmt: skip


def campaign(
    number: int,
    seed: int,
    kinds: list[Kind],
    add: Callable[[Row], None],
    jobs: int = 2,
    most_ranks: int = 3,
    models: tuple[str, ...] = ("particles",),
) -> list[Row]:
    """All cases, of these models by turns; those whose runs have one rank several at a time. add: is handed each result
    as it comes."""
    if runs.mpiexec() is None:
        most_ranks = 1
    folder = Path(tempfile.mkdtemp(prefix="hpcdem-faults-"))
    worlds = []
    for key in models:
        of = model.MODELS[key]
        reference = model.undisturbed(folder / key / "reference", of)
        worlds.append(World(reference, model.undisturbed(folder / key / "other", of, of.other), folder, most_ranks))
        say(f"undisturbed run of {key}: {reference.seconds:.1f} s; cases in {folder}")
    rows: list[Row] = []
    lock = threading.Lock()

    def one(index: int, chain: list[Kind], ranks: tuple[int, ...]) -> None:
        # So many kinds come by turns that each of them meets each of the models.
        world = worlds[(index + index // len(kinds)) % len(worlds)]
        row = carry_out(world, seed, index, chain, ranks)
        with lock:
            rows.append(row)
            add(row)

    cases = plan(number, seed, kinds, most_ranks)
    alone = [case for case in cases if set(case[2]) == {1} and not case[1][0].rare]
    with ThreadPoolExecutor(jobs) as pool:
        for future in [pool.submit(one, *case) for case in alone]:
            future.result()
    for case in cases:
        if case not in alone:
            one(*case)
    for world in worlds:
        if world.cluster is not None and not isinstance(world.cluster, str):
            world.cluster.stop()
    if not any(row["result"] == "failed" for row in rows):
        import shutil

        shutil.rmtree(folder, ignore_errors=True)
    return rows


def steps_lost(rows: list[Row]) -> tuple[float, int]:
    """Median and largest number of steps that were done twice."""
    lost = [row["lost"] for row in rows if row["result"] == "survived"]
    return (median(lost), max(lost)) if lost else (0, 0)
