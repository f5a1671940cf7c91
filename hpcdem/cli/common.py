"""Parts that all programs share: parsing a command line, starting the ranks, ending together."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from hpcdem.core import chinese
from hpcdem.core.errors import HpcdemError
from hpcdem.runtime import launch, shutdown

if TYPE_CHECKING:
    from hpcdem.core.comm import Comm
    from hpcdem.runtime.progress import Log

HELP = {"help_option_names": ["-h", "--help", "--hlep"], "max_content_width": 110}
HELP_WORDS = {"-h", "--help", "--hlep"}
"""Options that show the help; the misspelt one is that of the manual."""
PATH = click.Path(path_type=Path)


class Finite(click.ParamType):
    """A number that is neither nan nor infinite, from low to high. above: low itself is none of them."""

    name = "float"

    def __init__(self, low: float = -math.inf, high: float = math.inf, above: bool = False) -> None:
        self.low, self.high, self.above = low, high, above

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        found = float(click.FLOAT.convert(value, param, ctx))
        if not math.isfinite(found) or not self.low <= found <= self.high or (self.above and found == self.low):
            self.fail(f"{value} is not a number{self._limits()}", param, ctx)
        return found

    def _limits(self) -> str:
        if self.high < math.inf:
            return f" from {self.low:g} to {self.high:g}"
        return "" if self.low == -math.inf else f" above {self.low:g}" if self.above else f" from {self.low:g} on"


FINITE, POSITIVE = Finite(), Finite(0.0, above=True)


def read_command_line(command: click.Command, program: str, words: list[str]) -> dict[str, Any]:
    """Values of the options; prints and leaves for --help, --version and for what is not understood."""
    in_chinese = chinese.wanted(encoding=getattr(sys.stdout, "encoding", None))
    if in_chinese and (HELP_WORDS & {*words} or (command.no_args_is_help and not words)):
        from hpcdem.cli.chinese import help_page

        click.echo(help_page(command, program))
        raise SystemExit(0 if words else 2)
    try:
        return command.make_context(program, words).params
    except click.exceptions.Exit as done:
        raise SystemExit(done.exit_code) from None
    except click.ClickException as error:
        error.show()
        if chinese.wanted() and (text := chinese.meaning(error.format_message())):
            click.echo(text, err=True)
        raise SystemExit(error.exit_code) from None


@contextmanager
def messages_only() -> Iterator[None]:
    """Report errors that the user can correct by their message only, and exit; used before MPI starts."""
    try:
        yield
    except HpcdemError as error:
        click.echo(shutdown.describe(error).text, err=True)
        sys.exit(error.exit_code)


def run_program(
    command: click.Command, program: str, words: list[str], work: Callable[[Comm, Log, dict[str, Any]], None]
) -> NoReturn:
    """Run a program that reads finished runs: read its command line, start the ranks, call `work(comm, log, options)`
    on each, end together. An option called "threads" is the number of threads per rank.
    """
    with messages_only(), launch.one_voice():
        options = read_command_line(command, program, words)
        launch.prepare_environment(options.get("threads") or launch.threads_by_default())
        comm = launch.start_mpi()

    def together() -> None:
        from hpcdem.runtime.progress import Log

        work(comm, Log(comm.rank), options)

    shutdown.leave(shutdown.run_together(comm, together))


class Words(click.ParamType):
    """Words with commas between them."""

    name = "list"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return [w for w in (word.strip() for word in value.split(",")) if w] if isinstance(value, str) else value
