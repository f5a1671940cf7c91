"""Words in the manual's notation: what may be left out, what is ambiguous."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pytest

from hpcdem.lang.pcdc.keywords import HasKeyword, Keyword, beginning, matching
from hpcdem.lang.pcdc.table import PCDC, PROPERTY, RANGE, SET, distinct
from tests.tables import each


@pytest.mark.parametrize(
    ("notation", "read", "refused"),
    [
        ("geom{etry}", "geom geome geomet geometr geometry GEOMETRY Geom", "geo geometrys geom-etry g"),
        ("a{s}-l{ayer}", "as-layer a-l as-l a-layer a-lay AS-Layer", "as aslayer a- -l as-layer-x asx-layer"),
        ("c{ontact}-m{ohr}-c{oulomb}", "contact-m-c c-m-c contact-mohr-coulomb con-mo-cou", "contact-mc c-m x-m-c"),
        ("p{enalty}-n{ormal}", "pen-normal p-n penalty-norm", "pen normal pen-s penx-n"),
        ("mech{anical}-iso-e{lastic}", "mech-iso-e mechanical-iso-elastic mech-iso-elas", "mec-iso-e mech-is-e"),
        ("m{echanical}-s{tress}-b{oundary}-c{ondition}", "m-s-b-c mech-stress-b-c", "m-s-b s-b-c"),
        ("s{tress}-x{x}", "s-x s-xx stress-x stress-xx", "stress-xxx s-y"),
        ("d{amping}-t", "damping-t d-t", "d d-b damping-tt"),
        ("gf1", "gf1 GF1", "gf g gf11"),
    ],
)
def test_the_rule(notation, read, refused):
    word = Keyword(notation)
    assert [text for text in read.split() if not word.accepts(text)] == []
    assert [text for text in refused.split() if word.accepts(text)] == []


def test_other_spellings():
    word = Keyword("a{perature}-min{umum}", ("a{perature}-min{imum}", "a{perture}-min{imum}"))
    for typed in ("aperature-minumum", "aperature-minimum", "aperture-minimum", "a-min", "aper-mini"):
        assert word.accepts(typed), typed
    assert word.name == "aperature-minumum" and not word.accepts("aperture-maximum")


@pytest.mark.parametrize("notation", ["{etry}", "a{s", "a{s}b", "a--b", "", "a{s}-", "Geom{etry}", "a b"])
def test_what_is_no_notation(notation):
    with pytest.raises(ValueError, match="no keyword in the manual's notation"):
        Keyword(notation)


class Row:
    def __init__(self, notation: str) -> None:
        self.keyword = Keyword(notation)


def test_ambiguity_and_exact_words():
    rows = [Row("mode{l}"), Row("mo{ve}"), Row("mod{e}")]
    assert [r.keyword.name for r in matching("mode", rows)] == ["mode"]  # written in full
    assert [r.keyword.name for r in matching("model", rows)] == ["model"]
    assert [r.keyword.name for r in matching("mov", rows)] == ["move"]
    assert matching("m", rows) == [] and len(beginning("m", rows)) == 3


def choices() -> Iterator[tuple[str, Sequence[HasKeyword]]]:
    """Every set of words among which the parser chooses."""
    depths = max(len(spelling.words) for spelling in PCDC.spellings)
    for depth in range(depths):
        for start in dict.fromkeys(
            spelling.words[:depth] for spelling in PCDC.spellings if len(spelling.words) > depth
        ):
            words = distinct([spelling for spelling in PCDC.spellings if spelling.words[:depth] == start], depth)
            ended = [spelling.command for spelling in PCDC.spellings if spelling.words == start]
            models = ended[0].models if ended else ()
            yield " ".join(w.name for w in start) or "pcdc", [*words, *models]
    for command in PCDC.commands:
        for options, name in [
            (command.options, command.name),
            *((m.options, f"{command.name} {m.keyword.name}") for m in command.models),
        ]:
            rows = [*options, PROPERTY, RANGE] if command.models or command.properties else [*options, RANGE]
            yield name, rows
            for option in options:
                yield f"{name} {option.name}", [*option.more, *(o for o in rows if o is not option)]
    yield "range", PCDC.range_terms
    yield "range group", [*PCDC.range_terms[2:], SET]


CHOICES = list(choices())
IN_THE_MANUAL = {"m-p", "t"}
"""m{atrix}-p{ermeability} and m{atrix}-p{orosity}: refused with both as candidates. t{ime} after a part of model query,
and t{hermal}: the time of the part before."""


def test_there_are_many():
    assert len(CHOICES) > 150


@each(("where", "rows"), CHOICES, ids=[name for name, _ in CHOICES])
def test_no_word_is_ambiguous_when_its_compulsory_letters_are_typed(where, rows):
    for row in rows:
        # `size` after refine-layer is that of the layer: words that belong to another come first in the parser.
        same = [r for r in rows if r.keyword.name == row.keyword.name]
        for typed in {row.keyword.name, row.keyword.shortest()} - IN_THE_MANUAL:
            found = matching(typed, rows)
            assert [r for r in found if r not in same] == [], f"{where}: '{typed}' may also mean others"
            assert row in found or found == same[:1]
