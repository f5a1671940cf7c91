"""The scripts and keywords that the PCDC manual prints. The manual is not part of this project."""

from __future__ import annotations

import os
import re
from pathlib import Path

import pytest

from hpcdem.lang.pcdc import table as t
from hpcdem.lang.pcdc.keywords import Keyword, matching
from hpcdem.lang.pcdc.source import read
from tests.conftest import ROOT, absent


@pytest.fixture(scope="module")
def manual() -> str:
    """The text of the manual."""
    path = Path(os.environ.get("HPCDEM_PCDC_MANUAL", ROOT.parent / "shared" / "seeds" / "pcdc_manual.txt"))
    if not path.is_file():
        absent("pcdc_manual", "no manual of PCDC here: set HPCDEM_PCDC_MANUAL to its text")
    return path.read_text(encoding="utf-8")


def commands(manual: str) -> list[str]:
    """The lines of the manual that are commands. Two are broken by the width of the page or by its typesetting."""
    lines = manual.replace("pen-normal\n[m_c_pen_norm]", "pen-normal [m_c_pen_norm]").replace("\\_", "_").split("\n")
    return [line.strip() for line in lines if re.match(r"\s*pcdc [a-z]", line)]


def test_every_printed_command_is_read(manual):
    found = commands(manual)
    assert len(found) >= 15
    names = set()
    for line in found:
        script = read(f"i = 1\nm_c_pen_shear = m_c_pen_norm = 1e11\nm_c_fric = 30\n{line}\n", "manual.sc")
        names.add(script.statements[0].command.name)
    assert names == {
        "model new", "model save", "model restore", "model time-step", "model option", "geometry create polyline",
        "node reset velocity", "node reset displacement", "element reset state", "element c-model",
        "element-face c-model",
    }  # fmt: skip
    assert names == {c.name for c in t.COMMANDS if c.manual}


def test_the_definition_of_the_manual_is_that_of_the_table(manual):
    for notation in ("geom{etry}", "cr{eate}", "a{s}-l{ayer}"):
        assert notation in manual
    words = t.PCDC.command("geometry create polyline").words
    # the online help allows `c` for the second
    assert [word.notation for word in words] == ["geom{etry}", "c{reate}", "p{olyline}"]


SLIPS = {
    "F{friction}": "f{riction}", "c{cohesion}": "c{ohesion}", "t{ensile}-s{strength}": "t{ensile}-s{trength}",
    "K{elvin}-s{train}-xx": "k{elvin}-s{train}-xx", "K{elvin}-s{train}-yy": "k{elvin}-s{train}-yy",
    "K{elvin}-s{train}-xy": "k{elvin}-s{train}-xy", "k{elvin}- v{iscosity}": "k{elvin}-v{iscosity}",
    "p{penalty}-o{overlay}": "p{enalty}-o{verlay}", "p{penalty}-n{ormal}": "p{enalty}-n{ormal}",
    "p{penalty}-s{hear}": "p{enalty}-s{hear}", "Gf1": "gf1", "Gf2": "gf2",
    "s{hear}-s{tiffness}-r{ock}-b{oilt}": "s{hear}-s{tiffness}-r{ock}-b{olt}",
    "c{ohesion}-g{rout}-b{oilt}": "c{ohesion}-g{rout}-b{olt}",
    "f{riction}-g{rout}-b{oilt}": "f{riction}-g{rout}-b{olt}",
}  # fmt: skip
"""What the manual's tables print, and what is meant."""
THREE_D = re.compile(r"-z|-[xy]z|\(3D\)")


def printed_tables(manual: str) -> dict[str, list[str]]:
    """Keywords of the manual's tables by the number of the table, with LaTeX taken out."""
    found: dict[str, list[str]] = {}
    lines = iter(manual.split("\n"))
    number = ""
    for line in lines:
        heading = re.match(r"\s*表\s*(\d+) ", line)
        if heading:
            number = heading[1]
        elif line.lstrip().startswith("|") and number:
            text = line.replace("\\{", "{").replace("\\}", "}").replace("$", "").replace("<table>", "")
            text = text.replace("y{ield-f{orce}}", "y{ield}-f{orce}")
            words = re.findall(r"(?<![\w{])[A-Za-z]+\{[a-z]+\}(?:-\s?[A-Za-z]+(?:\{[a-z]+\})?)*", text)
            found.setdefault(number, []).extend(words)
        elif line.startswith("#"):
            number = ""
    return found


def test_keywords_of_the_printed_tables_are_in_the_table(manual):
    models = {m.number: m for c in t.COMMANDS for m in c.models if m.number}
    checked = 0
    for number, words in printed_tables(manual).items():
        for word in words:
            meant = SLIPS.get(word, word).replace(" ", "")
            if THREE_D.search(meant):
                continue
            full = Keyword(meant.lower()).name
            assert matching(full, models[number].options), f"table {number}: {word}"
            checked += 1
    assert checked >= 60 and set(models) == {str(n) for n in range(1, 22)}
