"""The reference page of the PCDC language, made from the table."""

from __future__ import annotations

from collections.abc import Sequence

from hpcdem.lang.pcdc.table import PCDC, RECORDED, Command, Model, Option, Table
from scripts.lib.pages.markdown import escaped, first_sentence, overview, wrapped

_TOP = """\
# PCDC commands

This page is generated from `hpcdem/lang/pcdc/table.py` and `hpcdem/physics/fdem/properties.py` by `./scripts/pages`; do
not edit it.

## Rules of scripts

- A script is written in Python; lines whose first word is `pcdc` are commands, also in loops and functions. `pcdc`
  cannot name a variable. A backslash, or three dots, at the end of a line continues the command in the next line; `#`
  begins a comment.
- hpcdem checks all commands, and the Python between them, before anything runs, and reports the first wrong line with
  file, line and text. `hpcdem --check script.sc` only makes this check.
- Vectors may be written without brackets, `0,-9.8`, and lists with commas, as in PCDC's online help
  ([all its commands](pcdc_online.md), [complete scripts](from_pcdc.md)).
- Words may be shortened: letters in braces may be omitted, from the right, in each part of a word. `a{s}-l{ayer}`
  accepts `as-layer`, `a-l` and `as-lay`. Upper and lower case are equivalent. An ambiguous word is rejected, and the
  message lists the candidates.
- Values are numbers, texts in quotes, `on` and `off` (`true`, `yes`, `false`, `no`), and vectors `(x,y)`. A value, or a
  part of one, may be a Python expression in square brackets: `[m_R/12]`, `([i],0)`, `'layer [i]'`. In a text, `[[` and
  `]]` stand for brackets.
- `<f>` is a number, `<i>` a whole number, `<s>` a text, `<v>` a vector. If `table <s>` is accepted, the value can be a
  function of time.
- Any consistent system of units works; units in the tables are SI. Objects are numbered from 0, as in the output.
  Tension is positive.
- Input files, and those of `model save`, are named relative to the folder of the script. All other files are written to
  the folder of the results (`data` next to the script, or `--outdir`). `history export` and `chart export` reject a
  relative name that leads out of this folder (`../x.csv`). No command overwrites the script or an input file.
- A script is a program that runs with your rights and can change your files. Run only scripts that you trust.
- A run that was stopped by `--time-limit` or a signal resumes with `--resume` at the same point, also in a loop or a
  function ([how](running.md#stopping-and-resuming)); a checkpoint is written every half hour (`--autosave`).
- Every rank executes the Python of a script; all ranks execute each command together, and must reach the same commands
  with the same values. `print` prints once. `math` and `Vector` are available without an import; the random numbers of
  Python and numpy start from the same seed on all ranks.

## Python

`pcdc` is also an object: `pcdc.time`, `pcdc.cycle`, `pcdc.ratio`, `pcdc.energies`, `pcdc.solved`, `pcdc.rank`;
`pcdc.node(7).displacement.X`, `pcdc.element(3).stress_yy`, `pcdc.joint(12).opening`;
`pcdc.numbers('element', group='rock', set='domain')`, `pcdc.values('node', 'velocity-x', geometry='rim')`,
`pcdc.total('node', 'reaction-y', group='top', set='bc')`, `pcdc.history('load')` (rows of step, time, value). All ranks
must make a query together.

`model save` also stores the global variables whose names begin with `m_` (numbers, texts, truth values, Vectors) and
the functions `def m_...`, as source text. `model restore` restores both. The functions then belong to the script like
any other, so restore only files whose author you trust as much as that of a script. Restoring does not execute them:
only a plain `def` is accepted, without decorator or annotations, and with plain values as defaults.
"""

_RANGE = """\
## range

A range is written at the end of the line and limits a command to some objects; without it the command applies to all.
An object is selected if it satisfies all terms. A range that selects nothing is an error.

A range selects present objects only: elements that were not removed, their nodes and faces, and the joints between
them. Two kinds of commands also apply to removed elements: `group`, and `element c-model`, which reinstates them.

`x`, `y` and `geometry` refer to positions in the mesh, not to displaced positions, so a line of a script selects the
same objects before and after a stage of loading. With `present` they refer to the current positions: the centre of an
element, a node, both ends of a face or joint.
"""


def page(table: Table = PCDC) -> str:
    """The whole page, in Markdown."""
    said = {command.name: first_sentence(command.doc) for command in table.commands}
    parts = [_TOP, overview("Commands", "| command | effect |", said)]
    parts += [_command(command) for command in table.commands]
    parts += [_RANGE, _options(table.range_terms), "", *_models(table), _recorded(), _dimensions(table)]
    return "\n".join(parts).rstrip("\n") + "\n"


def _command(command: Command) -> str:
    origin = "in the manual" if command.manual else "hpcdem's own"
    lines = [f"## {command.name}", "", f"`pcdc {command.notation}` ({origin})", "", _told(command), "", "```"]
    lines += [*_syntax(command), "```", ""]
    if command.leading or command.options:
        lines += [_options(command.options, command.leading), ""]
    if command.models:
        names = ", ".join(f"[{m.keyword.name}](#{m.keyword.name})" for m in command.models)
        lines += [f"Models: {names}.", ""]
    lines += ["Example:" if len(command.example) == 1 else "Examples:", "", "```", *command.example, "```", ""]
    return "\n".join(lines)


def _told(command: Command) -> str:
    """What a command does, that it does nothing here or is refused, and other words for it."""
    parts = [command.doc]
    if command.idle:
        parts.append(f"It is accepted but has no effect, which the log reports once: {command.idle}.")
    if command.refused:
        parts.append(f"It is rejected: {command.refused}.")
    if command.also:
        parts.append(f"Also accepted: {', '.join(f'`{words}`' for words in command.also)}.")
    return " ".join(parts)


def _syntax(command: Command) -> list[str]:
    words = ["pcdc", command.notation]
    words += [_pattern(option) if option.required else f"[{_pattern(option)}]" for option in command.leading]
    if command.models:
        words.append("<model> [prop{erty}] <keyword> <value> ...")
    elif command.properties or (len(command.options) > 4 and not any(o.required for o in command.options)):
        words.append("<keyword> <value> ...")
    else:
        for option in command.options:
            word = f"{option.notation} {_pattern(option)}".strip()
            words.append(word if option.required else f"[{word}]")
    if command.ranged:
        words.append("[ran{ge} ...]")
    return wrapped(words)


def _options(options: Sequence[Option], values: Sequence[Option] = ()) -> str:
    """A table of values that stand alone, and of keywords with those that may follow them."""
    rows = ["| keyword | value | unit | default | meaning |", "|---|---|---|---|---|"]
    for option in values:
        rows.append(_row(option, "", named=True))
    for option in options:
        rows.append(_row(option, f"`{option.notation}`"))
        rows += [_row(inner, f"... `{inner.notation}`") for inner in option.more]
    return "\n".join(rows)


def _row(option: Option, word: str, named: bool = False) -> str:
    pattern = _pattern(option)
    also = f"; also accepted: {', '.join(f'`{w}`' for w in option.also)}" if option.also else ""
    several = "; may be repeated" if option.repeated else ""
    default = "required" if option.required and not named else option.default
    cells = [word, f"`{pattern}`" if pattern else "", option.unit, default, option.doc + several + also]
    return "| " + " | ".join(escaped(cell) for cell in cells) + " |"


def _pattern(option: Option) -> str:
    patterns = ["<what>" if len(kind.words) > 8 else kind.pattern for kind in option.values]
    return " ".join(patterns)


def _models(table: Table) -> list[str]:
    lines = ["## Models and conditions", ""]
    for command in table.commands:
        for model in command.models:
            lines += _model(model, command)
    return lines


def _model(model: Model, command: Command) -> list[str]:
    origin = f"table {model.number} of the manual; " if model.number else ""
    also = f"; also accepted: {', '.join(f'`{w}`' for w in model.also)}" if model.also else ""
    title = f"`{model.notation}` ({origin}`pcdc {command.name}`{also})"
    lines = [f"### {model.keyword.name}", "", title, "", model.doc]
    if model.one_of:
        lines[-1] += " Needed: " + " or ".join(" and ".join(names) for names in model.one_of) + "."
    return [*lines, "", *([_options(model.options), ""] if model.options else [])]


def _recorded() -> str:
    rows = ["## Quantities of histories", "", "| object | value | unit |", "|---|---|---|"]
    rows += [f"| {kind} | `{name}` | {unit} |" for kind, of in RECORDED.items() for name, unit in of.items()]
    return "\n".join([*rows, ""])


IN_THE_PLANE = {"free-field": "自由场边界", "discs that touch blocks": "与块体接触的圆盘"}
"""What no word of the table tells, in English and Chinese: refused as it is met, before the run."""


def missing_in_space(table: Table) -> list[str]:
    """Commands that are not there in three dimensions."""
    return [command.name for command in table.commands if 3 not in command.dims]


def _dimensions(table: Table) -> str:
    """What is there in three dimensions."""
    rows = [
        "## Three dimensions",
        "",
        "After `pcdc model new dim 3` vectors have three components. The commands in the table are available with all ",
    ]
    rows[-1] += "keywords except those in the column *not available*; anything else is rejected before the script runs."
    rows += ["", f"Not available: the commands {', '.join(f'`{name}`' for name in missing_in_space(table))}, and"]
    rows[-1] += f" {', '.join(IN_THE_PLANE)}."
    rows += ["", "| command | models | not available | in three dimensions only |", "|---|---|---|---|"]
    for command in table.commands:
        if 3 not in command.dims:
            continue
        models = [model for model in command.models if 3 in model.dims]
        options = [*command.options, *(option for model in models for option in model.options)]
        of = [", ".join(f"`{option.name}`" for option in options if option.dims == dims) for dims in ((2,), (3,))]
        here = ", ".join(f"`{model.keyword.name}`" for model in models)
        rows.append(f"| `{command.name}` | {here} | {of[0]} | {'all' if 2 not in command.dims else of[1]} |")
    return "\n".join([*rows, ""])
