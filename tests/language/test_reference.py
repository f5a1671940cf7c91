"""What is on the reference page of ZDEM (that it is current: tests/docs/test_pages.py)."""

from __future__ import annotations

from hpcdem.lang.zdem import table as t
from scripts.lib.pages.zdem import page


def test_every_row_is_on_the_page():
    text = page()
    for command in t.COMMANDS:
        assert f"\n## {command.name}\n" in text
        for option in (*command.leading, *command.options):
            assert option.doc in text or command.same_as or option.kind is t.FLAG, (command.name, option.name)


def test_what_is_not_carried_out_is_marked():
    assert "not carried out" not in page()
    import dataclasses

    some = dataclasses.replace(t.ZDEM, commands=(dataclasses.replace(t.COMMANDS[0], executed=False),))
    assert "**not supported yet**" in page(some)


def test_tables_have_six_columns():
    rows = [line for line in page().splitlines() if line.startswith("| `")]
    assert rows and all(line.replace("\\|", "").count("|") == 7 for line in rows)
