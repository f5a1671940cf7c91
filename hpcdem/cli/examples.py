"""`hpcdem examples`: the examples that come with hpcdem, listed or copied."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path
from typing import Any, NoReturn

import click
from rich.console import Console
from rich.table import Table

from hpcdem.cli.common import HELP, PATH, messages_only, read_command_line
from hpcdem.core.errors import EXIT_OK, UsageError
from hpcdem.core.nearest import hint

SUFFIXES = (".py", ".sc")
PLACES = (Path(__file__).resolve().parents[2] / "examples", Path(sys.prefix) / "share" / "hpcdem" / "examples")
"""Folders of the examples in a source tree, and in an installed package."""


@click.command(context_settings=HELP, epilog="Then: hpcdem NAME.py. The first lines of each example describe it.")
@click.argument("name", required=False)
@click.option("--into", type=PATH, default=Path(), metavar="DIR", help="Destination folder [the current one].")
def examples(**options: Any) -> None:
    """List the examples; with NAME, copy one of them, with the files it reads."""


def start(words: list[str]) -> NoReturn:
    """The program."""
    with messages_only():
        given = read_command_line(examples, "hpcdem examples", words)
        if given["name"] is None:
            show()
        else:
            for path in copied(given["name"], given["into"]):
                click.echo(path)
    sys.exit(EXIT_OK)


def folder() -> Path:
    """Return the folder of the examples."""
    for place in PLACES:
        if place.is_dir():
            return place
    raise UsageError(f"the examples are not installed: neither {PLACES[0]} nor {PLACES[1]} exists")


def scripts() -> dict[str, Path]:
    """The examples by name."""
    return {path.stem: path for path in sorted(folder().iterdir()) if path.suffix in SUFFIXES}


def title(path: Path) -> str:
    """The first sentence of an example's text."""
    lines = path.read_text(encoding="utf-8").splitlines()
    text: list[str] = []
    for line in lines:
        words = line.strip().lstrip('#"').strip()
        if not words or set(words) == {"-"}:
            break
        text.append(words)
    return re.split(r"(?<=[.?!])\s", " ".join(text) + " ")[0].strip().rstrip(":.") if text else ""


def show() -> None:
    """Print the list."""
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    for path in scripts().values():
        table.add_row(path.name, title(path))
    Console(width=max(100, Console().width)).print(table)
    click.echo("\nCopy one to this folder: hpcdem examples NAME")


def copied(name: str, into: Path) -> list[Path]:
    """Copy an example and the files beside it that its text names; existing files stay. Returns the copies."""
    known = scripts()
    path = known.get(Path(name).stem)
    if path is None:
        raise UsageError(f"{name}: unknown example{hint(name, known) or '.'} Known: {', '.join(known)}")
    text = path.read_text(encoding="utf-8")
    others = [other for other in folder().iterdir() if other.is_file() and other.suffix not in SUFFIXES]
    files = [path, *(other for other in sorted(others) if other.name in text)]
    for target in (into / file.name for file in files):
        if target.exists():
            raise UsageError(f"{target} exists and is not overwritten: choose another folder with --into DIR")
    into.mkdir(parents=True, exist_ok=True)
    return [Path(shutil.copy(file, into / file.name)) for file in files]
