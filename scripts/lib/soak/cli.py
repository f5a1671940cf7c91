"""The command line of scripts/soak."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
from bench.launch import LIBRARY, environment, mpiexec

from soak import judge

STEPS, EVERY = 2_000_000, 10_000


@click.command(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110})
@click.option("--steps", type=click.IntRange(200), default=STEPS, metavar="N", help=f"Steps in all [{STEPS}].")
@click.option(
    "--every", type=click.IntRange(100), metavar="N", help=f"Steps between lines [{EVERY}, or a tenth of all steps]."
)
@click.option("--ranks", type=click.IntRange(1), default=2, metavar="R", help="MPI ranks [2].")
@click.option("--json", "json_file", metavar="FILE", help="Put the lines there, not on standard output.")
@click.option("--folder", metavar="DIR", help="Results of the run [a temporary folder, removed at the end].")
@click.option("--leak", type=float, default=0.0, hidden=True, help="MB per line that rank 0 forgets to give back.")
def soak(steps: int, every: int | None, ranks: int, json_file: str | None, folder: str | None, leak: float) -> None:
    """Run some 250 particles for millions of steps while particles come and go, bonds break, a wall moves back and
    forth, strip boundaries follow an uneven load, and checkpoints are written and restored.

    A line of JSON tells every N steps what each rank holds (memory, objects, open files) and how the model is. At the
    end they are judged: nothing may grow, momentum and energy must stay in their bands. Exit code 1 if not.
    """
    every = every or max(min(EVERY, steps // 10), 100)
    job = {"steps": steps, "every": every, "leak": leak}
    rows: list[dict[str, Any]] = []
    with open(json_file, "w") if json_file else os.fdopen(os.dup(1), "w") as out:
        for row in rows_of(job, ranks, folder):
            rows.append(row)
            print(json.dumps(row), file=out, flush=True)
    faults = judge.faults(rows, steps)
    click.echo(judge.summary(rows), err=True)
    for fault in faults:
        click.echo(f"fault: {fault}", err=True)
    sys.exit(1 if faults else 0)


def rows_of(job: dict[str, Any], ranks: int, folder: str | None) -> Iterator[dict[str, Any]]:
    """The lines of a run as they come."""
    with tempfile.TemporaryDirectory(prefix="hpcdem-soak-") as name:
        place = Path(folder or name).absolute()
        place.mkdir(parents=True, exist_ok=True)
        (place / "job.json").write_text(json.dumps(job | {"folder": str(place)}))
        path = os.pathsep.join(filter(None, (str(LIBRARY), os.environ.get("PYTHONPATH"))))
        start = [mpiexec(), "-n", str(ranks)] if ranks > 1 else []
        command = [*start, sys.executable, "-m", "soak.worker", "job.json"]
        with subprocess.Popen(
            command, cwd=place, env=environment(PYTHONPATH=path), stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            text=True,
        ) as process:  # fmt: skip
            assert process.stdout is not None
            for line in process.stdout:
                if line.startswith("{"):
                    yield json.loads(line)
                else:
                    click.echo(line.rstrip(), err=True)
        if process.returncode:
            raise click.ClickException(f"the run ended with exit code {process.returncode}")


def main() -> None:
    """Start."""
    soak(prog_name="scripts/soak")
