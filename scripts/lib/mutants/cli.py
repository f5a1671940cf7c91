"""The program: choose mutants, try those that have not been tried, print the table."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from dataclasses import asdict
from pathlib import Path

import click

from hpcdem.runtime import kept
from mutants.seeds import choose
from mutants.trial import PLAIN, Copy, judge

ROOT = Path(__file__).resolve().parents[3]
PLACES = ("hpcdem/physics", "hpcdem/lang", "hpcdem/halo", "hpcdem/io", "hpcdem/decomp", "hpcdem/numerics")


REACH = ROOT / ".pytest_cache" / "mutants"
"""Folder: what tests call and how long they take, with kernels of each sort, as measured on this machine."""
RANKS = {"killed": 0, "survived": 1, "untested": 2}
RECORD = Path(__file__).with_name("results.jsonl")


@click.command()
@click.argument("places", nargs=-1)
@click.option("--count", default=600, show_default=True, help="Number of mutants to choose from all modules.")
@click.option("--seed", default=1, show_default=True, help="Seed of the choice.")
@click.option("--seconds", default=2.5, show_default=True, help="Processor time of tests that each may take [s].")
@click.option("--limit", default=None, type=int, help="Stop after so many new trials.")
@click.option("--tests", multiple=True, help="Files or folders of tests; by default all.")
@click.option("--record", default=str(RECORD), help="File of results; what is in it is skipped.")
@click.option("--again", is_flag=True, help="Try once more what has survived without a reason on record.")
@click.option(
    "--kernels",
    type=click.Choice(["compiled", "plain", "anew"]),
    help="Only what Python calls, or only the others; anew: as programs run, kernels compiled again, minutes each.",
)
@click.option("--measure", is_flag=True, help="Measure what the tests call, and try no mutant.")
@click.option("--list", "only_list", is_flag=True, help="List the mutants and try none.")
@click.option("--table", is_flag=True, help="Print the table of the recorded results and try none.")
def main(
    places: tuple[str, ...],
    count: int,
    seed: int,
    seconds: float,
    limit: int | None,
    tests: tuple[str, ...],
    record: str,
    again: bool,
    kernels: str | None,
    measure: bool,
    only_list: bool,
    table: bool,
) -> None:
    """Change the sources in small ways, one at a time, and see which tests notice.

    PLACES restrict what is tried to files or folders of the package; the mutants are chosen from physics, lang, halo,
    io, decomp and numerics. Tests run in one process in a copy of the tree, with compiled kernels for what Python calls
    and then with kernels as plain functions: which functions each of them calls is measured first, and a mutant meets
    those that call its function, the most specific ones first. Results are appended to a file as they come: the same
    command resumes.
    """
    file = Path(record)
    done = read(file)
    if table:
        click.echo(as_table(done))
        return
    mutants = [] if measure else choose(ROOT, list(PLACES), count, seed)
    if places:
        mutants = [m for place in places for m in mutants if f"{m.file}/".startswith(f"{place.rstrip('/')}/")]
    if only_list:
        click.echo("\n".join(mutant.name for mutant in mutants))
        return
    entries = {entry["mutant"]: entry for entry in done}
    known = {"killed"} if again else {"killed", "survived"}
    settled = {name for name, entry in entries.items() if entry["outcome"] in known or entry.get("reason")}
    mutants = [mutant for mutant in mutants if mutant.name not in settled][:limit]
    known_lines = len(lines_of(file))
    with tempfile.TemporaryDirectory(prefix="mutants-", ignore_cleanup_errors=True) as folder:
        store, _ = kept.store_of({})
        copy = Copy(ROOT, Path(folder), store if kernels == "anew" and store.is_dir() else None).make()
        if kernels == "anew":
            for mutant in mutants:
                entry = judge(copy, mutant, 20.0 * seconds)
                with file.open("a") as out:
                    out.write(json.dumps(entry) + "\n")
                click.echo(f"{entry['outcome']:<9}{entry['seconds']:6.0f} s  {mutant.name}  {entry['by']}")
        else:
            for sort in [kernels] if kernels else ["compiled", "plain"]:
                job = {
                    "root": str(copy.place / "tree"),
                    "reach": str(REACH / f"{sort}.jsonl"),
                    "record": str(file.absolute()),
                    "tests": list(tests or ["tests"]),
                    "only_measure": measure,
                    "mutants": [asdict(mutant) for mutant in mutants],
                    "seconds": seconds,
                    "kernels": sort,
                }
                REACH.mkdir(parents=True, exist_ok=True)
                (copy.place / "job.json").write_text(json.dumps(job))
                words = [sys.executable, "-m", "mutants.inside", str(copy.place / "job.json")]
                paths = [str(copy.place / "tree"), *(str(Path(__file__).parents[up]) for up in (1, 3))]
                env = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
                if sort == "plain":
                    env |= PLAIN | {"NUMBA_CACHE_DIR": str(copy.place / "kernels")}
                env.pop("HPCDEM_TEST_RESULTS", None)
                subprocess.run(words, cwd=copy.place / "tree", env=env, check=False)
                tried = {entry["mutant"] for entry in lines_of(file)[known_lines:]}
                mutants = [mutant for mutant in mutants if mutant.name not in tried]
    if not measure:
        tidy(file)
        click.echo(as_table(read(file)))


def read(file: Path) -> list[dict]:
    """The results, of each mutant the best that is known, of equal ones the last: a later trial may have had fewer
    tests."""
    found: dict[str, dict] = {}
    for entry in lines_of(file):
        known = found.get(entry["mutant"], entry)
        if RANKS[entry["outcome"]] <= RANKS[known["outcome"]]:
            reason = {"reason": known["reason"]} if "reason" in known and entry["outcome"] != "killed" else {}
            found[entry["mutant"]] = reason | entry
    return list(found.values())


def lines_of(file: Path) -> list[dict]:
    """What is in a file of results, as it came."""
    return list(map(json.loads, file.read_text(encoding="utf-8").splitlines())) if file.is_file() else []


def tidy(file: Path) -> None:
    """Keep of each mutant one result only, sorted by name: two people's results merge."""
    found = sorted(read(file), key=lambda entry: entry["mutant"])
    file.write_text("".join(json.dumps(entry, ensure_ascii=False) + "\n" for entry in found), encoding="utf-8")


def as_table(done: list[dict]) -> str:
    """Killed and survived by module in Markdown, then the mutants that survived and have no reason on record."""
    rows: dict[str, Counter[str]] = defaultdict(Counter)
    spent: Counter[str] = Counter()
    for entry in done:
        name = entry["file"].rpartition("/")[0] or entry["file"]
        outcome = "explained" if entry["outcome"] != "killed" and entry.get("reason") else entry["outcome"]
        for row in (name, "all"):
            rows[row][outcome] += 1
            spent[row] += entry["seconds"]
    lines = [
        "| modules | killed | survived | survived, with a reason | no quick test | minutes |",
        "|---|---|---|---|---|---|",
    ]
    for name in sorted(rows, key=lambda name: (name == "all", name)):
        counts = [rows[name][outcome] for outcome in ("killed", "survived", "explained", "untested")]
        lines.append(f"| {name} | {' | '.join(map(str, counts))} | {spent[name] / 60:.1f} |")
    alive = [entry["mutant"] for entry in done if entry["outcome"] != "killed" and not entry.get("reason")]
    if alive:
        lines += ["", "Survivors:", *(f"- {name}" for name in sorted(alive))]
    return "\n".join(lines)
