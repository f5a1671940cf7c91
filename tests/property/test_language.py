"""What the language is, is in its table alone: any model that is written by it is read, however it is written, and its
plan is what is done."""

from __future__ import annotations

import re
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hpcdem.core.errors import ScriptError
from hpcdem.lang import detect
from hpcdem.lang.zdem import check
from hpcdem.lang.zdem import table as t
from hpcdem.lang.zdem.lexer import read_lines
from hpcdem.lang.zdem.parser import Script, parse_text
from tests.property.grammar import MISTAKES, Model, good_models, models, same_but_noisy
from tests.tables import each

ALWAYS_THE_SAME = settings(
    max_examples=30, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)


def same(one: Script, other: Script) -> bool:
    """Two scripts say the same."""
    return len(one.statements) == len(other.statements) and all(
        a.same_as(b) for a, b in zip(one.statements, other.statements)
    )


@ALWAYS_THE_SAME
@given(good_models())
def test_a_good_model_is_read_and_its_lines_are_its_statements(model: Model) -> None:
    """The text of the statements is a script that says the same, and so is its own text."""
    script = parse_text(model.text)
    assert detect.kind(model.text.encode()) == "zdem"
    once = parse_text("\n".join(statement.text for statement in script.statements))
    assert same(script, once)
    assert [s.text for s in parse_text("\n".join(s.text for s in once.statements)).statements] == [
        s.text for s in once.statements
    ]
    check.summary(script)


@ALWAYS_THE_SAME
@given(good_models(), st.data())
def test_it_does_not_matter_how_it_is_written(model: Model, data: st.DataObject) -> None:
    assert same(parse_text(model.text), parse_text(same_but_noisy(data.draw, model.lines)))


@ALWAYS_THE_SAME
@given(good_models(), st.data())
def test_words_may_be_shortened_to_three_letters(model: Model, data: st.DataObject) -> None:
    """Names of rows only: words of fixed choices (discrete, lsm, left) are written out."""
    names = {row.full for command in t.COMMANDS for row in (command, *command.leading, *command.options)} | {"range"}
    kept = {"left", "right", "both", "wall", "hist", "plot"}

    def shortened(word: str) -> str:
        low = word.lower()
        if low not in names - kept or len(low) <= 3:
            return word
        least = 5 if low.endswith(("stress", "strain")) else 3  # gstress, gstrain: as many as tell them apart
        return word[: data.draw(st.integers(least, len(word)))]

    lines = []
    for line in model.lines:
        first, *words = line.split(" ")
        keep = first in ("SAV", "EXP", "LOAD", "CLUMP")
        chosen = ["group", "color"]  # what follows is a name of the user's, `ball` too
        whole = ["group"] if first == "HIST" else []  # there it is no keyword but part of a value
        new = [
            w if keep or before in chosen or w in whole else shortened(w) for before, w in zip([first, *words], words)
        ]
        lines.append(" ".join([shortened(first), *new]))
    assert same(parse_text(model.text), parse_text("\n".join(lines)))


changes = st.lists(
    st.tuples(st.integers(0, 10**6), st.integers(0, 20), st.binary(max_size=6) | st.sampled_from([b"\n", b"1e999"])),
    min_size=1, max_size=3,
)  # fmt: skip


@ALWAYS_THE_SAME
@given(models(), changes)
def test_a_spoilt_model_is_read_or_refused(model: Model, how: list[tuple[int, int, bytes]]) -> None:
    """ScriptError or statements, whatever is written over it."""
    source = model.text.encode()
    for at, length, put in how:
        at %= len(source) + 1
        source = source[:at] + put + source[at + length :]
    try:
        check.summary(parse_text(source))
        assert detect.kind(source) in ("zdem", "pcdc", "python")
    except ScriptError as error:
        assert error.line >= 1 and "\n" not in str(error)
    try:
        lines = list(read_lines(source, "s"))
    except ScriptError:
        return
    assert all(token.text for line in lines for token in line.tokens)


def test_the_models_use_every_word_of_the_language() -> None:
    """A command or option that is new in the table must be put into the grammar, too."""
    used: set[tuple[str, str]] = set()
    terms: set[str] = set()

    def collect(text: str) -> None:
        table: Any = t.ZDEM
        for line in read_lines(text.encode(), "s"):
            command = table.command(line.tokens[0].word)
            used.add((command.name, ""))
            words = [token.word for token in line.tokens[1:]]
            in_range = False
            for word in words:
                if table.range_row.accepts(word):
                    in_range = True
                elif in_range:
                    term = t.find(word, table.range_terms)[0]
                    terms.update({term.name} if term else ())
                else:
                    option = command.option(word) or next((o for o in command.leading if o.accepts(word)), None)
                    used.update({(command.name, option.name)} if option else ())
            used.update((command.name, option.name) for option in command.leading if option.kind is not t.FLAG)

    @settings(max_examples=1000, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(good_models())
    def body(model: Model) -> None:
        collect(model.text)
        if model.cut is not None:
            for half in model.halves():
                collect(half.text)

    body()
    known = {(command.name, "") for command in t.COMMANDS}
    known |= {(command.name, o.name) for command in t.COMMANDS for o in (*command.leading, *command.options)}
    # INIT is another name of PROP; what it takes is drawn there.
    known -= {("INIT", option.name) for command in t.COMMANDS if command.name == "INIT" for option in command.options}
    # A law of the user goes with a Python file, and not with bonds: tests/parallel/test_pair_laws.py.
    known -= {("PROP", "law"), ("PROP", "between"), ("PROP", "parameter")}
    # A section goes with a drawing: tests/section/test_commands.py.
    known -= {one for one in known if one[0] == "SECTION"}
    # Surface processes need a settled bed: tests/surface.
    known -= {one for one in known if one[0] == "SURFACE"}
    # A base that bends needs walls or rows below all discs: tests/cases/flexing_base.
    known -= {one for one in known if one[0] == "FLEXURE"} | {("HIST", "deflection")}
    # Periodic sides exclude side walls and clumps: tests/cases/periodic.
    known -= {one for one in known if one[0] == "PERIODIC"} | {("HIST", name) for name in ("sxx", "syy", "sxy")}
    assert sorted(known - used) == []
    assert {term.name for term in t.RANGE_TERMS} - terms == set()


@each("name", MISTAKES)
def test_every_mistake_can_be_made(name: str) -> None:
    """On any model, and most of them make another script of it."""
    other: list[bool] = []

    @settings(max_examples=4, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
    @given(st.data())
    def body(data: st.DataObject) -> None:
        from tests.property.grammar import Maker, _good

        maker = Maker(data.draw)
        before = _good(maker)
        MISTAKES[name](maker)
        other.append(tuple(maker.lines) != before.lines)
        assert "{" not in " ".join(line for line in maker.lines if not re.search(r"\{(top|left|right|bottom)\}", line))

    body()
    assert any(other)
