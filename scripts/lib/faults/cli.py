"""The command line of scripts/faults."""

from __future__ import annotations

import json
import os
import sys
import time
from collections import Counter
from pathlib import Path

import click

from faults.model import MODELS

HELP = {"help_option_names": ["-h", "--help"], "max_content_width": 110}


@click.command(context_settings=HELP)
@click.option("--number", type=click.IntRange(1), default=100, metavar="N", help="Runs that are disturbed [100].")
@click.option("--seed", type=int, default=1, metavar="S", help="Of all that is random [1].")
@click.option("--kind", "names", multiple=True, metavar="K", help="Only kinds that begin so; several times.")
@click.option("--json", "json_file", metavar="FILE", help="Add a JSON line per run to FILE.")
@click.option("--report", "page", metavar="FILE", help="Write the table into FILE, between its markers.")
@click.option("--from", "lines_file", metavar="FILE", help="Make the report of these JSON lines; nothing is run.")
@click.option("--jobs", type=click.IntRange(1), default=2, metavar="J", help="Runs of one rank at a time [2].")
@click.option("--ranks", type=click.IntRange(1, 3), default=3, metavar="R", help="Most ranks of a run [3].")
@click.option("--model", "models", multiple=True, type=click.Choice(list(MODELS)),
              help="What is run, by turns [all].")  # fmt: skip
@click.option("--list", "lists", is_flag=True, help="The kinds of fault.")
def faults(
    number: int, seed: int, names: tuple[str, ...], json_file: str | None, page: str | None, lines_file: str | None,
    jobs: int, ranks: int, models: tuple[str, ...], lists: bool,
) -> None:  # fmt: skip
    """Disturb runs of a small model, go on with them, and compare their end with that of the undisturbed run, bit by
    bit. Exit code 1 if one of them was lost. See docs/reliability.md."""
    from faults import report
    from faults.campaign import campaign, say
    from faults.kinds import KINDS
    from faults.runs import mpi_name

    if lists:
        for k in KINDS.values():
            click.echo(f"{k.name:32} {k.about}")
        return
    chosen = [k for k in KINDS.values() if not names or k.name.startswith(names)]
    if not chosen:
        raise click.UsageError(f"no kind begins with {', '.join(names)}; --list shows them")
    began = time.monotonic()

    def add(row: dict) -> None:
        chain = f"{row['model']}: " + " + ".join([row["kind"], *row["chain"]])
        say(f"{row['result']:9} {row['seconds']:5.1f} s  {chain} (ranks {row['ranks']}, steps {row['moments']})")
        for why in row["why"]:
            say(f"          {why}")
        if json_file:
            with open(json_file, "a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")

    if lines_file:
        rows = [json.loads(line) for line in Path(lines_file).read_text().splitlines()]
    else:
        rows = campaign(number, seed, chosen, add, jobs, ranks, models or tuple(MODELS))
    minutes = (time.monotonic() - began if not lines_file else sum(row["seconds"] for row in rows)) / 60.0
    say(", ".join(f"{n} {name}" for name, n in Counter(row["result"] for row in rows).items()) + f"; {minutes:.1f} min")
    if page:
        setting = {
            "seed": rows[0]["seed"].split("-")[0],
            "minutes": minutes,
            "cores": os.cpu_count(),
            "mpi": mpi_name(),
        }
        report.into(Path(page), report.text(rows, setting))
    sys.exit(any(row["result"] == "failed" for row in rows))


def main() -> None:
    """Start."""
    faults(prog_name="scripts/faults")
