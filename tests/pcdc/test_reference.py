"""What is on the reference page, and the table knows what the simulation knows."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest

from hpcdem.commands.fdem.recorded import MODEL, UNITS, WELL
from hpcdem.commands.fdem.records import _OF_MODEL
from hpcdem.core.errors import ScriptError
from hpcdem.lang.pcdc import check, trial
from hpcdem.lang.pcdc import table as t
from hpcdem.lang.pcdc.kinds import Unfit
from hpcdem.lang.pcdc.parser import parse
from hpcdem.lang.pcdc.trial import MODELS, python
from hpcdem.physics import supports
from hpcdem.physics.fdem.properties import Property
from hpcdem.physics.flow.values import QUANTITIES as OF_FLOW
from hpcdem.physics.flow.wells import QUANTITIES as OF_WELLS
from scripts.lib.pages.pcdc import IN_THE_PLANE, missing_in_space, page
from tests.conftest import ROOT


def test_every_row_is_on_the_page():
    text = page()
    for command in t.COMMANDS:
        assert f"\n## {command.name}\n" in text, command.name
        assert f"`{command.notation}`" in text or f"`pcdc {command.notation}`" in text
        for model in command.models:
            assert f"\n### {model.keyword.name}\n" in text
            assert model.notation in text
        for option in (*command.leading, *command.options):
            assert option.doc.replace("|", "\\|") in text, (command.name, option.name)


def test_what_is_there_in_three_dimensions_is_listed():
    listed = page().partition("## Three dimensions")[2]
    for command in t.COMMANDS:
        assert (f"| `{command.name}` |" in listed) == (3 in command.dims), command.name
        options = [o for o in command.options if o.dims == (2,)] if 3 in command.dims else []
        assert all(f"`{option.name}`" in listed for option in options)
    assert "`thermal-fluid`" in listed and "`free-field`" not in listed


def missing() -> list[str]:
    """Commands, models and keywords of the plane only, in the words of a script."""
    found = missing_in_space(t.PCDC)
    for command in t.COMMANDS:
        if 3 in command.dims:
            words = (*command.models, *command.options)
            found += [f"{command.name} {word.keyword.name}" for word in words if 3 not in word.dims]
    return found


@pytest.mark.parametrize("name", ["README.md", "README.zh.md"])
def test_the_readme_says_what_is_not_there_in_three_dimensions(name):
    """Shapes and meshes of the plane have others in their place; plane stress and plane strain mean nothing there."""
    section = (ROOT / name).read_text(encoding="utf-8")
    heading = r"^## (?:Not yet available|尚未支持的功能)$"
    section = re.split(heading, section, flags=re.MULTILINE)[1].partition("\n## ")[0]
    said = set(re.findall(r"`([a-z-]+(?: [a-z-]+)*)`", " ".join(section.split())))
    gone = [
        text
        for text in missing()
        if not text.startswith(("geometry create", "mesh create", "mesh structured", "element create", "model plane-"))
    ]
    assert [text for text in gone if not any(text.startswith(words) for words in said)] == []
    assert [words for words in said if not any(text.startswith(words) for text in gone)] == []
    for english, chinese in IN_THE_PLANE.items():
        if "free-field" not in english:
            assert (chinese if "zh" in name else english) in " ".join(section.split())


def test_what_is_refused_in_space_is_on_the_page():
    files = [*(ROOT / "hpcdem").rglob("*.py")]
    refused = {text for file in files for text in re.findall(r'refuse_in_space\("([^"]+)"\)', file.read_text("utf-8"))}
    assert refused and refused <= set(IN_THE_PLANE)


def test_tables_have_five_columns():
    rows = [line for line in page().splitlines() if line.startswith("| `") or line.startswith("| ...")]
    wide = [line for line in rows if line.replace("\\|", "").count("|") == 6]
    assert len(wide) > 150


def test_everything_has_a_meaning():
    for command in t.COMMANDS:
        assert command.doc and command.example, command.name
        for option in (*command.leading, *command.options, *(o for m in command.models for o in m.options)):
            assert option.doc, (command.name, option.name)


def test_models_have_the_properties_of_the_simulation():
    rows = {m.keyword.name: m for c in t.COMMANDS for m in c.models}
    for name, inner in MODELS.items():
        mine = {python(option.name) for option in rows[name].options if not option.refused}
        assert mine - {"np", "parameter"} == {p.name for p in inner.properties if not p.internal}, name


@pytest.mark.parametrize("model", [t.ISO_ELASTIC, t.CONTACT, t.COHESIVE], ids=lambda model: model.keyword.name)
def test_properties_are_declared_once(model):
    """Words and units are those of the simulation, and so are limits."""
    for option in model.options:
        if option.name == "np" or option.refused:
            continue
        one, (kind,) = model.of.property(python(option.name)), option.values
        assert (option.doc, option.unit) == (one.doc, one.unit)
        for bound, outside, itself in ((one.low, -math.inf, one.low_itself), (one.high, math.inf, True)):
            for value, fits in ((bound, itself), (math.nextafter(bound, outside), False)):
                if not fits or math.isinf(bound):
                    with pytest.raises(Unfit):
                        kind.check(value)
                else:
                    assert kind.check(value) == one.check(value) == value


def test_a_new_property_is_a_word_of_the_language(monkeypatch):
    """Declared with the model of the simulation it is parsed, limited, and told on the page, without a row here."""
    new = Property("tip_toughness", "MPa m0.5", "toughness of the tip", 2.0, low=1.0, high=3.0)
    inner = replace(t.COHESIVE.of, properties=(*t.COHESIVE.of.properties, new))
    model = replace(t.COHESIVE, options=t.declared(inner, "c{ohesion}"), of=inner)
    command = replace(t.PCDC.command("face-joint c-model"), models=(model,))
    table = t.Table((command, t.PCDC.command("element c-model")), t.RANGE_TERMS)
    monkeypatch.setitem(trial.MODELS, model.keyword.name, inner)

    def read(value: str):
        words = f"face-joint c-model c-i-c-i c 1 tensile-strength 1 gf1 1 gf2 1 tip-toughness {value}"
        return parse(words, "a.sc", 1, words, table).arguments["properties"]

    assert read("1.5")["tip-toughness"] == 1.5
    with pytest.raises(ScriptError, match=r"read '3\.5', expected a number from 1 to 3 for 'tip-toughness'"):
        read("3.5")
    row = next(line for line in page(table).splitlines() if line.startswith("| `tip-toughness`"))
    assert row.endswith("| MPa m0.5 | 2 | toughness of the tip |")


def test_histories_record_what_the_physics_have():
    theirs = {**supports.QUANTITIES, **OF_FLOW, WELL: OF_WELLS}
    for kind, of in theirs.items():
        assert UNITS[kind] == {name: unit for name, (unit, _) in of.items()}
    assert set(_OF_MODEL) == set(UNITS[MODEL])


def test_scripts_of_the_chinese_guide_are_read():
    text = (ROOT / "docs" / "pcdc.zh.md").read_text(encoding="utf-8")
    scripts = re.findall(r"^```python\n(.*?)^```", text, flags=re.MULTILINE | re.DOTALL)
    assert len(scripts) > 1
    for script in scripts:
        assert "warning" not in check.summary(script, "guide.sc")
