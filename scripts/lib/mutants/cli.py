"""The program: choose mutants, try those that have not been tried, print the table."""

from __future__ import annotations

import json
import tempfile
import threading
from collections import Counter, defaultdict
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import click

from hpcdem.runtime import kept
from mutants.seeds import Mutant, choose
from mutants.trial import Copy, judge
from tests import suite

ROOT = Path(__file__).resolve().parents[3]
PLACES = ("hpcdem/physics", "hpcdem/lang", "hpcdem/halo", "hpcdem/io", "hpcdem/decomp", "hpcdem/numerics")


@click.command()
@click.argument("places", nargs=-1)
@click.option("--count", default=600, show_default=True, help="Number of mutants.")
@click.option("--seed", default=1, show_default=True, help="Seed of the choice.")
@click.option("--seconds", default=120.0, show_default=True, help="Time of tests that each may take [s].")
@click.option("--jobs", default=1, show_default=True, help="Mutants at the same time.")
@click.option("--limit", default=None, type=int, help="Stop after so many new trials.")
@click.option("--record", default="mutants.jsonl", show_default=True, help="File of results; what is in it is skipped.")
@click.option("--list", "only_list", is_flag=True, help="List the mutants and try none.")
@click.option("--table", is_flag=True, help="Print the table of the recorded results and try none.")
def main(
    places: tuple[str, ...],
    count: int,
    seed: int,
    seconds: float,
    jobs: int,
    limit: int | None,
    record: str,
    only_list: bool,
    table: bool,
) -> None:
    """Change the sources in small ways, one at a time, and see which tests notice.

    PLACES are files or folders of the package, by default physics, lang, halo, io, decomp and numerics. Each mutant is
    tried in a copy of the tree with the tests that can notice it, the most specific first. Results are appended to a
    file as they come: the same command resumes.
    """
    file = Path(record)
    done = [json.loads(line) for line in file.read_text().splitlines()] if file.is_file() else []
    if table:
        click.echo(as_table(done))
        return
    mutants = choose(ROOT, list(places or PLACES), count, seed)
    if only_list:
        click.echo("\n".join(mutant.name for mutant in mutants))
        return
    if not suite.measured()["seconds"]:
        raise click.ClickException("the durations of the tests are not known: run ./scripts/test once")
    tried = {entry["mutant"] for entry in done}
    new = [mutant for mutant in mutants if mutant.name not in tried][:limit]
    lock = threading.Lock()
    store, _ = kept.store_of({})
    with tempfile.TemporaryDirectory(prefix="mutants-") as folder:
        free = [Copy(ROOT, Path(folder) / str(k), store if store.is_dir() else None).make() for k in range(jobs)]

        def one(mutant: Mutant) -> None:
            with lock:
                copy = free.pop()
            entry = judge(copy, mutant, seconds)
            with lock:
                free.append(copy)
                done.append(entry)
                with file.open("a") as out:
                    out.write(json.dumps(entry) + "\n")
                click.echo(f"{entry['outcome']:<9}{entry['seconds']:6.0f} s  {mutant.name}  {entry['by']}")

        with ThreadPoolExecutor(jobs) as pool:
            list(pool.map(one, new))
    click.echo(as_table(done))


def as_table(done: list[dict]) -> str:
    """Killed and survived by module in Markdown, then the mutants that survived."""
    rows: dict[str, Counter[str]] = defaultdict(Counter)
    spent: Counter[str] = Counter()
    for entry in done:
        name = entry["file"].rpartition("/")[0] or entry["file"]
        rows[name][entry["outcome"]] += 1
        spent[name] += entry["seconds"]
    lines = ["| modules | killed | survived | untested | minutes |", "|---|---|---|---|---|"]
    for name in sorted(rows):
        row = rows[name]
        lines.append(f"| {name} | {row['killed']} | {row['survived']} | {row['untested']} | {spent[name] / 60:.1f} |")
    alive = [entry["mutant"] for entry in done if entry["outcome"] != "killed"]
    if alive:
        lines += ["", "Survivors:", *(f"- {name}" for name in sorted(alive))]
    return "\n".join(lines)
