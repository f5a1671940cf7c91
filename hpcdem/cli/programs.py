"""The commands `hpcdem NAME ...`: one table for the dispatch, `hpcdem --help` and suggestions for typing errors."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from hpcdem.core.nearest import hint, nearest


class Program(NamedTuple):
    """module: in hpcdem.cli, with a function `start(words)`, or, where `reads_only` is set, a command of its name and
    `work` (see cli.start); use: its arguments; line: what it does."""

    name: str
    use: str
    line: str
    module: str = ""
    reads_only: bool = False


GROUPS: dict[str, tuple[Program, ...]] = {
    "Run": (
        Program("resume", "[DIR]", "resume an interrupted run from its newest checkpoint"),
        Program("console", "", "interactive PCDC commands and Python", "console"),
        Program("sweep", "SCRIPT", "run a script for many parameter values and report statistics", "sweep"),
        Program("calibrate", "SETTINGS.toml", "find parameters that reproduce measured properties", "calibrate"),
    ),
    "Look": (
        Program("view", "DIR", "open a run or a script in the browser", "view"),
        Program("draw", "DIR", "draw frames as in the window", "draw", reads_only=True),
        Program("movie", "DIR", "make a film of a run", "movie", reads_only=True),
        Program("info", "FILE", "show the contents of a frame or a checkpoint", "info", reads_only=True),
    ),
    "Measure": (
        Program(
            "measure",
            "DIR [WHAT]",
            "measure a finished run: wedge, cracks, fluid, faults, ...",
            "measure",
            reads_only=True,
        ),
        Program("-s", "DIR", "stress and strain of the frames of a finished run"),
    ),
    "Make": (
        Program("case", "[NAME]", "write the script of a ready-made model", "case"),
        Program("examples", "[NAME]", "list the examples, or copy one to this folder", "examples"),
        Program(
            "section", "FILE", "inspect or convert a geological section, extract horizons", "section", reads_only=True
        ),
        Program("grade", "FILE", "generate grains from a grading curve", "grade_page"),
    ),
    "Manage": (
        Program("doctor", "", "report problems of this machine or job and the commands that fix them", "doctor"),
        Program("warmup", "", "compile the kernels in advance"),
    ),
}
BY_NAME = {program.name: program for group in GROUPS.values() for program in group}


FIRST = """\
hpcdem: discrete elements for rock and sand. Usage: hpcdem SCRIPT, or hpcdem COMMAND ...

  hpcdem examples             list the examples; hpcdem examples push.py copies one to this folder
  hpcdem --check SCRIPT       check a script and print what it would do
  hpcdem SCRIPT               run it; results go to data beside it (Ctrl-C saves and stops, --resume continues)
  hpcdem view data            see the results in the browser, also during the run
  hpcdem view --run SCRIPT    also with an editor and a console
  hpcdem doctor               report problems of this machine and the commands that fix them

hpcdem --help lists all commands and options."""
"""Text of `hpcdem` without arguments: a page that fits on a screen."""


def suggestion(word: str) -> str:
    """Suggest a command for a `word` that is no script, if it resembles one."""
    if "." in word or "/" in word:
        path = Path(word)
        there = [one.name for one in path.parent.glob("*") if one.suffix in (".py", ".sc")]
        return hint(path.name, there) or "; hpcdem examples lists the examples"
    near = nearest(word, BY_NAME)
    return f" and no such command; did you mean hpcdem {near}?" if near else " and no such command; see hpcdem --help"
