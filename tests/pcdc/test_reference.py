"""The committed reference page is the one the table makes, and the table knows what the simulation knows."""

from __future__ import annotations

from pathlib import Path

from hpcdem.commands.fdem.records import UNITS
from hpcdem.lang.pcdc import table as t
from hpcdem.lang.pcdc.reference import page
from hpcdem.lang.pcdc.trial import MODELS, python
from hpcdem.physics.fdem import groups as g

PAGE = Path(__file__).resolve().parents[2] / "docs" / "pcdc_reference.md"


def test_the_page_is_current():
    advice = "make it anew: python -m hpcdem.lang.pcdc.reference > docs/pcdc_reference.md"
    assert PAGE.read_text(encoding="utf-8") == page(), advice


def test_every_row_is_on_the_page():
    text = page()
    for command in t.COMMANDS:
        assert (f"\n## {command.name}\n" in text) != bool(command.later), command.name
        assert f"`{command.notation}`" in text or f"`pcdc {command.notation}`" in text
        for model in command.models:
            assert (f"\n### {model.keyword.name}\n" in text) != bool(model.later)
            assert model.notation in text
        for option in (*command.leading, *command.options):
            assert command.later or option.later or option.doc.replace("|", "\\|") in text, (command.name, option.name)


def test_what_comes_later_is_listed():
    listed = page().partition("## Not there yet")[2]
    for command in t.COMMANDS:
        for row in (command, *command.models, *command.options):
            assert not row.later or (row.notation in listed and row.later in listed), row.notation


def test_tables_have_five_columns():
    rows = [line for line in page().splitlines() if line.startswith("| `") or line.startswith("| ...")]
    wide = [line for line in rows if line.replace("\\|", "").count("|") == 6]
    assert len(wide) > 150


def test_everything_has_a_meaning():
    for command in t.COMMANDS:
        assert command.later or (command.doc and command.example), command.name
        for option in (
            *command.leading,
            *command.options,
            *(o for m in command.models if not m.later for o in m.options),
        ):
            assert command.later or option.later or option.doc, (command.name, option.name)


def test_models_have_the_properties_of_the_simulation():
    rows = {m.keyword.name: m for c in t.COMMANDS for m in c.models if not m.later}
    for name, inner in MODELS.items():
        mine = {python(option.name) for option in rows[name].options}
        assert mine - {"np"} == {p.name for p in inner.properties}, name


def test_histories_record_what_the_verbs_can():
    kinds = {"node": g.NODE, "element": g.ELEMENT, "joint": g.JOINT, "model": "model"}
    for kind, values in t.RECORDED.items():
        assert {python(name): unit for name, unit in values.items()} == UNITS[kinds[kind]]
