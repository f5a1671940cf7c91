"""What a script was told comes back, to the bit, so that it takes the same way a second time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from hpcdem.core.errors import CommandError, HpcdemError, ScriptError, UsageError
from hpcdem.lang.pcdc import journal
from hpcdem.lang.pcdc.journal import COMMAND, ERROR, NAMES, READ, Journal, decoded, encoded

BOX = "pcdc mesh structured (0,0) (4,2) cells 4 2 diagonal right\n"
LOOP = (
    BOX + "pcdc history create 't' model value time every 5\n"
    "while pcdc.time < 0.35:\n    pcdc model step 10\n    print('at', pcdc.cycle)\n"
    "try:\n    pcdc geometry delete 'x'\nexcept Exception as error:\n    told = str(error)\n"
    "load = pcdc.history('t')\nplaces = pcdc.values('node', 'position-x', y=(1.9, 3.1))\n"
    "pcdc model step [int(10 * load[-1, 1])]\nlast = pcdc.cycle\n"
)


@pytest.mark.parametrize(
    "value",
    [0.1, -0.0, math.inf, 5e-324, 3, True, "text", np.arange(6.0).reshape(2, 3), np.array([], np.int64),
     np.array([1, -(2**60)]), np.array([True]), {"a": 1.5, "b": -math.inf}, (0.1, (2, "x")), {-3: (0.5, 1.0)},
     np.array(["rock", ""]), np.float64(0.1).item()],
)  # fmt: skip
def test_answers_come_back_to_the_bit(value):
    found = decoded(encoded(value))
    assert type(found) is type(value)
    if isinstance(value, np.ndarray):
        assert found.dtype == value.dtype and found.shape == value.shape and found.tobytes() == value.tobytes()
    else:
        assert repr(found) == repr(value)


def test_not_a_number_comes_back():
    assert math.isnan(decoded(encoded(math.nan))) and np.isnan(decoded(encoded(np.array([math.nan])))[0])


@pytest.mark.parametrize(
    "text",
    ["", "[]", '["array","O",[1],""]', '["array","<f8",[2],"eJw="]', '["array","<f8",[-1],"AAAA"]', '["float","x"]',
     '["float"]', '["other",1]', "3", '["array","<f8",[1],"%%%"]', '["dict",[1]]'],
)  # fmt: skip
def test_damaged_answers_are_refused(text):
    with pytest.raises(UsageError, match="damaged"):
        decoded(text)


def past_of(bench, text: str, commands: int) -> list:
    """The journal of a script up to the command of this number, as a checkpoint in it holds it."""
    bench(text)
    entries = bench.interpreter.journal.entries
    at = [k for k, entry in enumerate(entries) if entry[0] == COMMAND]
    return [list(entry) for entry in entries[: at[commands - 1] + 1]]


def again(bench, text: str, past: list) -> None:
    bench.interpreter.run(bench.interpreter.read(text, "script.sc"), past)


@pytest.mark.parametrize("commands", [3, 4, 6, 8])
def test_commands_up_to_the_last_are_passed_over_and_queries_are_answered(bench, tmp_path, capsys, commands):
    from tests.pcdc.fake import Bench

    past = past_of(bench, LOOP, commands)
    told = capsys.readouterr().out.splitlines()
    other = Bench(tmp_path)
    # What the project is restored from: here it is put back by hand.
    other(BOX + "pcdc history create 't' model value time every 5\n")
    steps = min(commands - 3, 4) * 10
    other.project.histories["t"].rows += [row for row in bench.project.histories["t"].rows if row[0] <= steps]
    other.blocks.clock.step, other.blocks.clock.time = steps, steps * 0.01
    other.project.ready()
    other.blocks.calls.clear()
    again(other, LOOP, past)
    assert other["last"] == bench["last"] == other.blocks.clock.step and other["told"] == bench["told"]
    assert (other["load"] == bench["load"]).all() and (other["places"] == bench["places"]).all()
    assert not other.blocks.told("place_mesh") and sum(a[0] for a, _ in other.blocks.told("advance")) == 44 - steps
    assert capsys.readouterr().out.splitlines() == told[min(commands - 3, 4) :]
    assert other.interpreter.journal.entries == bench.interpreter.journal.entries


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("cells 4 2", "cells 4 3", "script.sc:1: pcdc mesh structured"),
        ("step 10\n", "step 11\n", "script.sc:4: pcdc model step 11"),
        ("pcdc.time < 0.35", "len([1]) + 1", "script.sc:4: "),  # a look less
        ("pcdc geometry delete 'x'", "pcdc geometry delete 'y'", "script.sc:7: "),
    ],
)
def test_a_script_that_takes_another_path_is_reported(bench, tmp_path, old, new, line):
    from tests.pcdc.fake import Bench

    past = past_of(bench, LOOP, 8)
    assert old in LOOP
    with pytest.raises(HpcdemError) as caught:
        again(Bench(tmp_path), LOOP.replace(old, new), past)
    assert line in str(caught.value) and "its path depends on" in str(caught.value)


def test_lines_that_were_not_carried_out_may_be_changed(bench, tmp_path):
    from tests.pcdc.fake import Bench

    past = past_of(bench, LOOP, 4)
    other = Bench(tmp_path)
    other(BOX + "pcdc history create 't' model value time every 5\n")
    text = LOOP.replace("pcdc geometry delete 'x'", "pcdc model step 7").replace("told = str(error)", "raise")
    again(other, "# a comment\n\n" + text + "done = True\n", past)
    assert other["done"]


def test_names_of_a_restored_file_come_back_without_the_file(bench, tmp_path):
    from tests.pcdc.fake import Bench

    bench("m_a = 1.5\ndef m_f(x):\n    return x + m_a\npcdc model save 'a.sav'\n")
    text = "pcdc model restore 'a.sav'\n" + BOX + "y = m_f(2)\npcdc model step [int(m_a * 4)]\n"
    past = past_of(Bench(tmp_path), text, 3)
    assert [entry[0] for entry in past] == [COMMAND, NAMES, COMMAND, COMMAND]
    (tmp_path / "a.sav").unlink()
    other = Bench(tmp_path)
    other(BOX)
    again(other, text, past)
    assert other["y"] == 3.5 and other.blocks.clock.step == 6


def test_errors_of_queries_are_raised_again():
    first = Journal()

    def fails():
        raise CommandError("no such quantity")

    with pytest.raises(CommandError):
        first.query(fails)
    first.note(COMMAND, 1)
    assert first.entries[0] == [ERROR, "CommandError", "", 0, "no such quantity"]
    second = Journal()
    second.replay(first.entries)
    with pytest.raises(CommandError, match="no such quantity"):
        second.query(lambda: 1 / 0)
    assert second.meet(1) and not second.replays and second.query(lambda: 7) == 7


def test_too_much_to_keep_is_reported_and_refused(bench, monkeypatch):
    monkeypatch.setattr(journal, "MOST", 1000)
    bench(BOX + "for i in range(40):\n    x = pcdc.values('node', 'position-x')\n    pcdc model step 1\n")
    assert bench.interpreter.journal.lost and not bench.interpreter.journal.entries
    assert sum("--resume no longer works" in line for line in bench.blocks.log.lines) == 1
    assert bench.project.place()["journal"] is None


def test_damaged_journals_are_refused():
    for entries in ([], [[READ, "[]"]], [[COMMAND, 1], [NAMES, {}]]):
        with pytest.raises(UsageError, match="damaged"):
            Journal().replay(entries)


def test_errors_of_a_script_keep_their_line():
    one = Journal()
    one.note(COMMAND, 5)
    one.note_error(ScriptError("a.sc", 3, "text"))
    one.note(COMMAND, 6)
    other = Journal()
    other.replay(one.entries)
    with pytest.raises(ScriptError, match=r"a.sc:3: text"):
        other.meet(5)
    assert other.meet(6)
