"""The reference page of the PCDC language, made from the table."""

from __future__ import annotations

from collections.abc import Sequence

from hpcdem.lang.pcdc.table import PCDC, RECORDED, Command, Model, Option, Table
from scripts.lib.pages.markdown import escaped, first_sentence, overview, wrapped

_TOP = """\
# PCDC commands

This page is made from `hpcdem/lang/pcdc/table.py` and `hpcdem/physics/fdem/properties.py`; do not edit it
(`./scripts/pages`).

## How a script is read

- A script is Python in which lines whose first word is `pcdc` are commands, in loops and functions too. `pcdc` is no
  name for a variable. A command that goes on in the next line ends with a backslash; `#` begins a comment.
- All commands, and the Python between them, are read before anything runs; the first wrong line is reported with file,
  line and text. `hpcdem --check script.sc` stops there.
- Three dots at the end of a line go on with the next, too. Vectors may stand without brackets, `0,-9.8`, and lists with
  commas: this is how PCDC's online help writes ([all its words](pcdc_online.md), [whole scripts](from_pcdc.md)).
- Words may be shortened: what stands in braces may be left out, from the right, in each part of a word:
  `a{s}-l{ayer}` is read in `as-layer`, `a-l` and `as-lay`. Upper and lower case are the same. A word that may mean
  several is refused with the candidates.
- Values are numbers, texts in quotes, `on` and `off` (`true`, `yes`, `false`, `no`), vectors `(x,y)`. Where a value, or
  a part of one, is an expression of Python it stands in square brackets: `[m_R/12]`, `([i],0)`, `'layer [i]'`. In a
  text `[[` and `]]` are brackets.
- `<f>` a number, `<i>` a whole number, `<s>` a text, `<v>` a vector; where `table <s>` may stand the value is a
  function of time.
- Units: any consistent set; those in the tables are SI. Numbers of objects begin at 0, as in the output. Tension is
  positive.
- Files that are read, and those of `model save`, are named relative to the folder of the script. All else goes to the
  folder of the results (`data` beside the script, or `--outdir`): frames, histories, what `history export` and `chart
  export` write, whose names do not lead out of it (`../x.csv`) unless they are whole paths. Nothing is written over the
  script, nor over a file that the run has read and not made itself.
- A script is a program: it runs with your rights and can do to your files what you can. Run those that you trust.
- A run that was stopped, by `--time-limit` or a signal, goes on with `--resume` where it was, also in a loop or a
  function ([how](running.md#stopping-and-going-on)); there is a checkpoint every half hour (`--autosave`).
- The Python of a script runs on every rank; commands are carried out by all ranks together, which must come to the same
  commands with the same values. `print` prints once. `math` and `Vector` are there without an import; the random
  numbers of Python and of numpy begin with the same seed on all ranks.

## Python

`pcdc` is also an object: `pcdc.time`, `pcdc.cycle`, `pcdc.ratio`, `pcdc.energies`, `pcdc.solved`, `pcdc.rank`;
`pcdc.node(7).displacement.X`, `pcdc.element(3).stress_yy`, `pcdc.joint(12).opening`;
`pcdc.numbers('element', group='rock', set='domain')`, `pcdc.values('node', 'velocity-x', geometry='rim')`,
`pcdc.total('node', 'reaction-y', group='top', set='bc')`, `pcdc.history('load')` (rows of step, time, value). Every
look is made by all ranks together.

`model save` also keeps the global variables whose names begin with `m_` (whole and other numbers, texts, truth values,
Vectors) and the functions `def m_...`, as the text of their `def`. `model restore` brings them back: the functions are
then part of the script like any other, so restore files only from where you would take a script from. Restoring itself
runs nothing of them: only a plain `def` is accepted, without decorator or annotations, and with plain values as
defaults.
"""

_RANGE = """\
## range

Stands last on the line and limits a command to some objects; without it the command acts on all. All terms must hold.
A range that chooses nothing is an error.

It chooses among what is there: elements that were not taken out, nodes and faces of these, joints between two of
them. Two kinds of commands reach what was taken out too: `group`, and `element c-model`, which brings elements back.

`x`, `y` and `geometry` go by the places in the mesh, wherever things have moved since: a line of a script means the
same objects before and after a stage of loading. With `present` they go by where things are at that moment: the
centre of an element, a node, both ends of a face or joint.
"""


def page(table: Table = PCDC) -> str:
    """The whole page, in Markdown."""
    said = {command.name: first_sentence(command.doc) for command in table.commands}
    parts = [_TOP, overview("Commands", "| command | what it does |", said)]
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
        parts.append(f"It is read and has no effect here, which the log says once: {command.idle}.")
    if command.refused:
        parts.append(f"It is rejected: {command.refused}.")
    if command.also:
        parts.append(f"Also read: {', '.join(f'`{words}`' for words in command.also)}.")
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
    also = f"; also read: {', '.join(f'`{w}`' for w in option.also)}" if option.also else ""
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
    also = f"; also read: {', '.join(f'`{w}`' for w in model.also)}" if model.also else ""
    title = f"`{model.notation}` ({origin}`pcdc {command.name}`{also})"
    lines = [f"### {model.keyword.name}", "", title, "", model.doc]
    if model.one_of:
        lines[-1] += " Needed: " + " or ".join(" and ".join(names) for names in model.one_of) + "."
    return [*lines, "", *([_options(model.options), ""] if model.options else [])]


def _recorded() -> str:
    rows = ["## What histories record", "", "| object | value | unit |", "|---|---|---|"]
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
        "After `pcdc model new dim 3` vectors have three components, and these commands ",
    ]
    rows[-1] += "are there, with all of their words but those that are named; others are refused before anything runs."
    rows += ["", f"Not there are the commands {', '.join(f'`{name}`' for name in missing_in_space(table))}; nor are"]
    rows[-1] += f" {', '.join(IN_THE_PLANE)}."
    rows += ["", "| command | models | not there | in three dimensions only |", "|---|---|---|---|"]
    for command in table.commands:
        if 3 not in command.dims:
            continue
        models = [model for model in command.models if 3 in model.dims]
        options = [*command.options, *(option for model in models for option in model.options)]
        of = [", ".join(f"`{option.name}`" for option in options if option.dims == dims) for dims in ((2,), (3,))]
        here = ", ".join(f"`{model.keyword.name}`" for model in models)
        rows.append(f"| `{command.name}` | {here} | {of[0]} | {'all' if 2 not in command.dims else of[1]} |")
    return "\n".join([*rows, ""])
