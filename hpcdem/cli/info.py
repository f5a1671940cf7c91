"""`hpcdem info FILE|DIR ...`: what a file or a run is, its progress, and whether it is complete."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hpcdem.cli.common import HELP, PATH
from hpcdem.core.comm import Comm
from hpcdem.core.errors import HpcdemError
from hpcdem.runtime import run_folder

if TYPE_CHECKING:
    from hpcdem.runtime.progress import Log


@click.command(
    context_settings=HELP, no_args_is_help=True,
    epilog="Checkpoints are checked completely against their checksums. Exit code 1 if a file is damaged or unknown.",
)  # fmt: skip
@click.argument("paths", type=PATH, nargs=-1, required=True, metavar="FILE|DIR...")
@click.option("--json", "as_json", is_flag=True, help="One JSON object per line and path.")
@click.option("--all", "every", is_flag=True, help="For a folder: inspect all files, not only the newest ones.")
def info(**options: Any) -> None:
    """Show the contents of a checkpoint (.sav), a frame (.vtkhdf, .dat) or the output folder of a run."""


def work(comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """Inspect and print on rank 0. HpcdemError if something is damaged. Collective."""
    from hpcdem.io.agreed import on_first

    def inspect() -> int:
        from hpcdem.post import inventory

        bad = 0
        for path in options["paths"]:
            facts = of_folder(path, options["every"]) if path.is_dir() else _placed(inventory.of_file(path))
            bad += not facts["whole"]
            if options["as_json"]:
                click.echo(json.dumps({"path": str(path), **facts}))
            else:
                show(path, facts)
        return bad

    bad = on_first(comm, inspect)
    if bad:
        raise HpcdemError(f"{bad} of {len(options['paths'])} are damaged or unknown")


def _placed(facts: dict[str, Any]) -> dict[str, Any]:
    """The command at which a checkpoint was written, instead of the whole script."""
    from hpcdem.lang.zdem import parser

    script, position = facts.pop("script", ""), facts.pop("position", None)
    if script and position is not None:
        try:
            statements = parser.parse_text(script, "script").statements
            place = statements[position]
        except (HpcdemError, IndexError):  # a Python program, or a script of a later version
            return facts
        facts["at"] = f"line {place.line}, command {position + 1} of {len(statements)}: {place.text.strip()}"
    return facts


def show(path: Path, facts: dict[str, Any]) -> None:
    """A line with the verdict, and one per fact."""
    click.echo(f"{path}: {facts['kind']}, {'complete' if facts['whole'] else 'INCOMPLETE: ' + facts['why']}")
    for name, value in facts.items():
        if name not in ("kind", "whole", "why") and value not in (None, "", [], {}):
            click.echo(f"  {name.replace('_', ' '):<12} {_text(value)}")


def _text(value: Any) -> str:
    if isinstance(value, list):
        return "; ".join(map(_text, value))
    if isinstance(value, dict):
        return ", ".join(f"{name} {_text(v)}" for name, v in value.items())
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def of_folder(folder: Path, every: bool = False) -> dict[str, Any]:
    """Facts about the run that wrote into a folder. every: inspect all files, not only the last two checkpoints and the
    last frame.
    """
    from hpcdem.io.frames import left_out, list_frames, list_mesh_frames
    from hpcdem.post import inventory

    facts: dict[str, Any] = {"kind": "folder", "whole": True, "why": ""}
    wrong: list[str] = []
    try:
        record = run_folder.read(folder)
    except HpcdemError as failure:
        record = None
        wrong.append(str(failure))
    holder = run_folder.running(folder)
    if record is not None:
        facts |= {"kind": "run", "script": record.script, "began": record.began, "state": record.state}
        facts["on"] = f"{record.ranks} ranks x {record.threads} threads, hpcdem {record.version}"
        if record.state == "running" and holder is None:
            facts["state"] = "killed (its lock is free)"
    if holder is not None:
        facts["state"] = f"running: process {holder.get('pid', '?')} on {holder.get('host', '?')}"
    every_saved = sorted(folder.glob("*.sav"), key=lambda path: (_step(path.name), path.name))
    saved = [path for path in every_saved if not run_folder.is_older(path, record)]
    older = [path for path in every_saved if path not in saved]
    frames = [*list_frames(folder), *list_mesh_frames(folder)]
    if older:
        facts["older_checkpoints"] = _range(older, [_step(p.name) for p in older]) + ", of an earlier run"
    if others := left_out(folder):
        facts["older_frames"] = others
    facts["checkpoints"] = _range(saved, [_step(p.name) for p in saved])
    facts["frames"] = _range(frames, [f.step for f in frames])
    facts["unfinished"] = sorted(p.name for p in folder.glob("*.tmp"))
    inspected = [*saved, *(f.path for f in frames)] if every else [*saved[-2:], *(f.path for f in frames[-1:])]
    for path in inspected:
        seen = inventory.of_file(path)
        if not seen["whole"]:
            wrong.append(seen["why"])
    whole = [path for path in reversed(saved) if path not in inspected or inventory.of_file(path)["whole"]]
    if whole and (record is None or record.state != "done") and holder is None:
        facts["go_on_with"] = f"hpcdem resume {folder}"
    if wrong:
        facts |= {"whole": False, "why": "; ".join(wrong)}
    elif record is None and not saved and not frames:
        facts |= {"whole": False, "why": "no run has written into this folder"}
    return facts


def _step(name: str) -> int:
    found = re.search(r"(\d+)\.sav$", name)
    return int(found[1]) if found else -1


def _range(items: list, steps: list[int]) -> str:
    return f"{len(items)}, steps {min(steps)} to {max(steps)}" if items else ""
