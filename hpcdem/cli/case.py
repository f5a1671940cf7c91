"""`hpcdem case NAME`: the script of a ready-made model."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from hpcdem.cli.common import HELP, PATH, run_program
from hpcdem.core import chinese
from hpcdem.core.comm import Comm

if TYPE_CHECKING:
    from hpcdem.cases.base import Case
    from hpcdem.runtime.progress import Log

PROGRAM = "hpcdem case"
OWN = ("output", "force")
"""Options that are not parameters of the case."""


def start(words: list[str]) -> NoReturn:
    """The program, to its end."""
    from hpcdem.cases import CASES, find

    if words[:1] and words[0] in CASES:
        kind = find(words[0])
        run_program(command(kind), f"{PROGRAM} {kind.name}", words[1:], lambda comm, log, o: work(kind, comm, log, o))
    run_program(listing(words), PROGRAM, words, show)


def listing(words: list[str]) -> click.Command:
    """`hpcdem case` without a name that it knows."""
    from hpcdem.cases import CASES, find

    titles = "\n\n".join(f"\b\n{name:12s} {find(name).title}" for name in CASES)
    return click.Command(
        PROGRAM, context_settings=HELP, help=f"Write the script of a ready-made model.\n\n{titles}",
        params=[click.Argument(["name"], required=False, callback=_known)],
        epilog="hpcdem case NAME --help lists its parameters. From Python: docs/cases.md.",
    )  # fmt: skip


def _known(context: click.Context, argument: click.Parameter, value: str | None) -> str | None:
    from hpcdem.cases import CASES

    if value is not None:
        raise click.UsageError(f"unknown case '{value}'; known: {', '.join(CASES)}")
    return value


def show(comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """The list of cases, in the language of the user."""
    from hpcdem.cases import CASES, find

    if comm.rank == 0:
        in_chinese = chinese.wanted(encoding=getattr(sys.stdout, "encoding", None))
        for name in CASES:
            title = find(name).title
            click.echo(f"{name:12s} {(in_chinese and chinese.known('case', title)) or title}")


def command(kind: type[Case]) -> click.Command:
    """The command line of a case: an option per parameter."""
    from hpcdem.cases.base import chooses, number, unit_of

    options: list[click.Parameter] = []
    for name, field in kind.model_fields.items():
        word, unit = name.replace("_", "-"), unit_of(field)
        doc = f"{str(field.description)[:1].upper()}{str(field.description)[1:]}"
        if isinstance(field.default, bool):
            default = "yes" if field.default else "no"
            options.append(click.Option([f"--{word}/--no-{word}", name], default=None, help=f"{doc} [{default}]."))
            continue
        shown = field.default if chooses(field) else number(field.default)
        measured = f" {unit}" if unit not in ("", "1") else ""
        options.append(click.Option([f"--{word}", name], metavar="X", help=f"{doc} [{shown}{measured}]."))
    options += [
        click.Option(["-o", "--output"], type=PATH, metavar="FILE", help=f"The script; - prints it [{kind.name}.sc]."),
        click.Option(["--force"], is_flag=True, help="Replace an existing file."),
    ]
    return click.Command(kind.name, context_settings=HELP, params=options, help=f"{kind.title}: write its script.")


def work(kind: type[Case], comm: Comm, log: Log, options: dict[str, Any]) -> None:
    """Collective: write the script, on rank 0. UsageError on all ranks."""
    from hpcdem.core.errors import ScriptError, UsageError
    from hpcdem.io.agreed import atomic_path, on_first

    given = {name: value for name, value in options.items() if name not in OWN and value is not None}
    try:
        case = kind(**given)
    except ScriptError as error:
        raise UsageError(error.message) from None
    path: Path = options["output"] or Path(f"{kind.name}.sc")

    def write() -> None:
        if str(path) == "-":
            click.echo(case.script(), nl=False)
            return
        if path.exists() and not options["force"]:
            raise UsageError(f"{path} exists: use --force to replace it, or -o for another name")
        if not path.parent.is_dir():
            raise UsageError(f"cannot write {path}: folder {path.parent} not found")
        with atomic_path(path) as temporary:
            Path(temporary).write_text(case.script(), encoding="utf-8")
        click.echo(f"{path}: {case.title}; run it with hpcdem {path}")

    on_first(comm, write)
