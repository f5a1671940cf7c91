"""Every path of PCDC's online help has the state that the table says: it acts, it is an alias, it has no effect, or it
is refused by name."""

from __future__ import annotations

import pytest

from hpcdem.lang.pcdc.table import PCDC
from scripts.lib.pages import online


def test_all_paths_are_there():
    counts = {dim: sum(dim in row.dims for row in online.rows()) for dim in (2, 3)}
    assert counts == {2: 573, 3: 528}


@pytest.mark.parametrize("first", dict.fromkeys(row.path[0] for row in online.rows()))
def test_each_path_has_its_state(first):
    advice = "renew it: ./scripts/pages"
    for row in online.rows():
        if row.path[0] == first:
            for dim, said in zip(row.dims, row.states, strict=True):
                found, why = online.state(row, dim)
                assert online.STATES[found] == online.STATES[said], f"{row.lines(dim)} in {dim}-D: {why} ({advice})"


def test_a_refusal_says_what_to_do():
    refused = [online.state(row, dim)[1] for row in online.rows() for dim in row.dims
               if online.state(row, dim)[0] == online.REFUSED]  # fmt: skip
    assert all((" is rejected" in why and ": " in why) or " is for t" in why for why in refused)


def test_a_state_that_is_wrong_is_found(monkeypatch):
    row = next(row for row in online.rows() if row.words == ("model", "gravity"))
    assert online.state(row, 2) == (online.ACTS, "")
    without = tuple(command for command in PCDC.commands if command.name != "model gravity")
    monkeypatch.setattr(online, "PCDC", type(PCDC)(without, PCDC.range_terms))
    assert online.state(row, 2)[0] == online.MISSING
