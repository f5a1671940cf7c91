"""Every value of the language can be a Python expression in brackets: the whole table, row by row."""

from __future__ import annotations

import pytest

from hpcdem.core.errors import ScriptError
from hpcdem.lang.pcdc import kinds, trial
from hpcdem.lang.pcdc.parser import parse
from hpcdem.lang.pcdc.table import PCDC, Command, Model, Option
from hpcdem.physics.fdem.tables import Drawn, Over
from tests.tables import each

SAMPLES: dict[str, tuple[str, object]] = {
    "<f>": ("0.25", 0.25), "<f>|table <s>|function <s>": ("0.25", 0.25),
    "<f>|table <s> over x|y|z|field <s>": ("0.25", 0.25),
    "<f>|table <s> over x|y|z|temperature|moisture|field <s>": ("0.25", 0.25),
    "<f>|table <s> over x|y|z|plastic-strain|field <s>": ("0.25", 0.25),
    "<f>|table <s> over x|y|z|plastic-strain|temperature|moisture|field <s>": ("0.25", 0.25),
    "<i>": ("2", 2), "[<i>]": ("3", 3), "3": ("3", 3),
    "0|1": ("1", 1), "0|1|2": ("2", 2), "5|6|12": ("6", 6), "2|3": ("2", 2), "<s>": ("'a'", "a"),
    "on|off": ("on", True), "<v>": ("(1,2)", (1, 2)), "(<f>,<f>)": ("(1,2)", (1, 2)), "[<v>]": ("(1,2)", (1, 2)),
    "<f>|table <s>": ("0.25", 0.25), "[<f>]": ("0.25", 0.25), "[on|off]": ("on", True),
    "<f>|<v>|table <s>": ("0.25", 0.25), "<f> <f>, <f> <f> ...": ("0 1 2 3", [0, 1, 2, 3]),
    "<v> <v> [...]": ("(0,0) (1,0)", [(0, 0), (1, 0)]),
    "<v> <v> ...": ("(0,0) (1,0) (1,1)", [(0, 0), (1, 0), (1, 1)]), "<s> ...": ("'a' 'b'", ["a", "b"]),
}  # fmt: skip
"""By the pattern of a kind: as it is written, and as an expression gives it."""


def fits(kind: kinds.Kind, value: object) -> bool:
    try:
        kind.check(value)
    except kinds.Unfit:
        return False
    return True


class Writer:
    """Writes a line, with every value as it is (expressions False) or as an expression, v[0], v[1], ..."""

    def __init__(self, expressions: bool, dim: int) -> None:
        self.expressions, self.dim, self.values = expressions, dim, []

    def value(self, kind: kinds.Kind) -> str:
        if self.dim == 3 and kind.pattern in ("<v>", "[<v>]"):
            text, value = "(1,2,3)", (1, 2, 3)
        elif self.dim == 3 and kind.pattern == "<v> <v> [...]":
            text, value = "(0,0,0) (1,0,0)", [(0, 0, 0), (1, 0, 0)]
        elif self.dim == 3 and "tet" in kind.words:
            text, value = "tet", "tet"
        else:
            text, value = self._sample(kind)
        if not self.expressions:
            return text
        self.values.append(value)
        return f"[v[{len(self.values) - 1}]]"

    @staticmethod
    def _sample(kind: kinds.Kind) -> tuple[str, object]:
        text, value = SAMPLES[kind.pattern] if kind.pattern in SAMPLES else (kind.words[0], kind.words[0])
        if text == "0.25" and not fits(kind, value):
            return "1.5", 1.5
        if text == "'a'" and not fits(kind, value):
            word = next(one for one in ("iso", "x=1.5") if fits(kind, one))
            return f"'{word}'", word
        return text, value

    def option(self, option: Option) -> str:
        """A keyword with its values and all that may follow it."""
        words = [option.name, *(self.value(kind) for kind in option.values if self.dim in kind.dims)]
        if option.name == "in-circle":
            return " ".join(words)  # either the values or the words behind
        if option.name == "not":
            return "not id 3"
        return " ".join(words + [self.option(more) for more in option.more if self.dim in more.dims])


def _without(options: tuple[Option, ...], dim: int, *names: str) -> list[Option]:
    return [o for o in options if o.name not in names and dim in o.dims and not getattr(o, "refused", "")]


EXCLUDING = {
    "model time-step": ("value", "mass-scaling"), "mesh glue": ("between",), "output image": ("full",),
    "geometry create circle": ("center", "radius"),
    "model solve": (
        "time", "elastic", "cycles", "solver", "steps", "hydraulic", "thermal", "dt", "steady", "auto",
    ),
    "history create": ("id", "nearest", "mean", "minimum", "sum", "variable", "well"),
    "bolt create polyline": ("length",), "flow-node initial": ("saturation",),
    "well stage": ("pressure", "shut-in"),
    "chart add": ("values", "x", "y"), "field create": ("weibull", "lognormal"), "output vtk": ("off",),
}  # fmt: skip
"""Keywords that do not go with the others of their command."""
EXCLUDING_IN_SPACE = {**EXCLUDING, "chart add": ("values",)}


def rows(dim: int) -> list[tuple[str, Command, Model | None, Option | None, int]]:
    """Every command; every model of those that have some; every command with a range once per term of it."""
    found = []
    for command in PCDC.commands:
        if dim not in command.dims or command.refused:
            continue
        models = [m for m in command.models if dim in m.dims] or [None]
        found += [(f"{command.name} {m.keyword.name if m else ''}".strip(), command, m, None, dim) for m in models]
        for term in PCDC.range_terms if command.ranged else ():
            fits = not term.only or command.ranged in (*term.only, "any")
            fits &= command.name != "chart add" or dim == 2  # range goes with what is there in the plane only
            if fits and dim in term.dims:
                found.append((f"{command.name} range {term.name}", command, models[0], term, dim))
    return [(f"{name} in {dim} dimensions" if dim == 3 else name, *row) for name, *row in found]


def written(command: Command, model: Model | None, term: Option | None, writer: Writer) -> str:
    """One line with all its keywords."""
    excluding = EXCLUDING if writer.dim == 2 else EXCLUDING_IN_SPACE
    left_out = excluding.get(command.name, ())
    words = [command.name, *(writer.value(k) for o in command.leading if o.name not in left_out for k in o.values)]
    options = command.options if model is None else model.options
    if model is not None:
        words += [model.keyword.name, *(writer.value(kind) for o in model.leading for kind in o.values)]
        words += ["property"] * bool(model.options)
    words += [writer.option(o) for o in _without(options, writer.dim, *left_out)]
    if term is not None:
        words += ["range", writer.option(term)]
    return " ".join(words)


ROWS = rows(2) + rows(3)


@each(("command", "model", "term", "dim"), [row[1:] for row in ROWS], ids=[row[0] for row in ROWS])
def test_every_value_can_be_an_expression(command, model, term, dim, monkeypatch):
    """The same line, written out and with expressions, is the same command in the end; whether its values make sense
    together is no matter."""
    monkeypatch.setattr(trial, "check", lambda *_: None)
    plain, with_brackets = Writer(False, dim), Writer(True, dim)
    one = parse(written(command, model, term, plain), "a.sc", 1, "a", PCDC, dim=dim).resolve(())
    text = written(command, model, term, with_brackets)
    statement = parse(text, "a.sc", 1, text, PCDC, dim=dim)
    known = {"v": with_brackets.values}
    other = statement.resolve(tuple(eval(code, known) for code in statement.expressions))
    assert other == one and len(statement.expressions) == len(with_brackets.values)


def test_the_table_is_walked_whole():
    """Every kind of value of every row has a sample."""
    assert len(ROWS) > 150
    patterns = {
        kind.pattern
        for _, c, m, t, _ in ROWS
        for o in (*c.leading, *(m.options if m else c.options))
        for kind in o.values
    }
    assert set(SAMPLES) - {"[<i>]"} <= patterns


@pytest.mark.parametrize("text", ["table [v] over [a]", "table '[v]' over [a]", "field [v]", "field 'bl[w]'"])
def test_what_varies_from_place_to_place(text):
    words = f"element property young {text}"
    statement = parse(words, "a.sc", 1, words, PCDC)
    arguments, _ = statement.resolve(
        tuple({"v": "blast", "w": "ast", "a": "y"}[code] for code in statement.expressions)
    )
    assert arguments["young"] == (Over("blast", 1) if "table" in text else Drawn("blast"))


@pytest.mark.parametrize("name", ["[v]", "'[v]'", "'bl[w]'"])
def test_names_of_tables_too(name):
    words = f"node boundary mech-vel-b-c velocity-x table {name} range group '[v]' set [v]"
    statement = parse(words, "a.sc", 1, words, PCDC)
    arguments, terms = statement.resolve(tuple({"v": "blast", "w": "ast"}[code] for code in statement.expressions))
    assert arguments["properties"]["velocity-x"] == kinds.TableName("blast")
    assert terms == (("group", {"value": "blast", "set": "blast"}),)


@pytest.mark.parametrize(
    ("words", "values", "message"),
    [("history create 'h' [v] value [w] id 1", ("node", "damage"), "a history of node can follow displacement"),
     ("history create 'h' [v] value [w]", ("element", "stress-xx"), "needs one of id, nearest and range"),
     ("history create 'h' [v] value [w] range x 0 1 sum", ("node", "position-x"), "read 'sum'"),
     ("history create 'h' [v] value [w] max", ("model", "time"), "a history of the model does not accept maximum"),
     ("history create 'h' [v] value [w] max", ("cell", "time"), "expected one of node, element, joint, bolt-node"),
     ("model new dim [v]", (4,), "expected 2 or 3"),
     ("model time-step auto [v] value 1e-6", (True,), "value and auto on cannot be combined"),
     ("node boundary mech-m-b-c type [v] range id 1", (0.5,), "read 0.5 from '[v]', expected 0 free, 1 fixed or 2")],
)  # fmt: skip
def test_what_expressions_give_is_held_to_the_same_rules(words, values, message):
    with pytest.raises(ScriptError) as caught:
        statement = parse(words, "a.sc", 4, words, PCDC)
        statement.resolve(values)
    assert str(caught.value).startswith(f"a.sc:4: {words}") and message in str(caught.value)


def test_histories_by_expressions_record(bench):
    """On the simulation: object and value are names of variables; without a range all objects count."""
    bench("pcdc mesh structured (0,0) (4,2) cells 4 2 diagonal right group 'rock' set 'domain'\n"
          "for kind, what in (('node', 'position-x'), ('element', 'stress-xx')):\n"
          "    pcdc history create 'largest [what]' [kind] value [what] maximum every [5 * 2]\n"
          "pcdc model step 20\n"
          "found = pcdc.history('largest position-x'), pcdc.history('largest stress-xx')\n")  # fmt: skip
    nodes, elements = bench["found"]
    assert nodes[:, 0].tolist() == [10, 20] and nodes[-1, 2] == pytest.approx(4.0 + 0.2)
    assert elements[-1, 2] == bench.project.mesh.centroids()[:, 0].max()
