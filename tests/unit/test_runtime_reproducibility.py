"""Fingerprints of tables, lines of states, and their comparison."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.numerics.fingerprint import as_text, of_rows
from hpcdem.runtime import reproducibility
from hpcdem.runtime.progress import Log

A, B = "0123456789abcdef" * 2, "f" * 32


def columns(n: int = 1000) -> list[np.ndarray]:
    random = np.random.default_rng(1)
    return [random.normal(size=n), np.arange(n), random.integers(-5, 5, n)]


def test_order_and_shares_do_not_matter():
    table = columns()
    order = np.random.default_rng(2).permutation(len(table[0]))
    whole = of_rows(table)
    assert (of_rows([c[order] for c in table]) == whole).all()
    parts = [of_rows([c[order[k::3]] for c in table]) for k in range(3)]
    assert (np.sum(parts, axis=0, dtype=np.uint64) == whole).all()
    assert len(as_text(whole)) == 32


@pytest.mark.parametrize("change", ["last bit", "swap", "sign of zero", "other column", "row twice"])
def test_a_difference_shows(change):
    table = columns()
    table[0][3] = 0.0
    before = of_rows(table)
    if change == "last bit":
        table[0][7] = np.nextafter(table[0][7], 9.0)
    elif change == "swap":
        table[0][[1, 2]] = table[0][[2, 1]]
    elif change == "sign of zero":
        table[0][3] = -0.0
    elif change == "other column":
        table = [table[1], table[0], table[2]]
    else:
        table = [np.append(c, c[-1]) for c in table]
    after = of_rows(table)
    assert (before != after).all(), "both words see it"


def test_nobody_is_zero():
    assert as_text(of_rows([np.empty(0), np.empty(0, np.int64)])) == "0" * 32


def written(tmp_path: Path, *rows: str) -> Path:
    path = tmp_path / "log.txt"
    path.write_text("hpcdem 0.1.0 | 1 rank\n" + "\n".join(rows) + "\n")
    return path


def test_lines_and_back(tmp_path):
    parts = {"particles": A, "contacts": B}
    rows = [reproducibility.line(10, 1, parts), reproducibility.line(20, 2, {"walls": A}), "step 20 | CYC 100%"]
    assert rows[0] == f"state 10: particles={A} contacts={B}"
    assert reproducibility.read(written(tmp_path, *rows)) == {(1, 10): parts, (2, 20): {"walls": A}}


def test_the_last_word_on_a_step_counts(tmp_path):
    path = written(tmp_path, reproducibility.line(10, 1, {"walls": A}), reproducibility.line(10, 1, {"walls": B}))
    assert reproducibility.read(path) == {(1, 10): {"walls": B}}


@pytest.mark.parametrize("text", ["", "state 10: particles=12\n", "state x: walls=" + A, "\x00\xff"])
def test_a_log_without_states_is_refused(tmp_path, text):
    path = tmp_path / "log.txt"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(UsageError, match="expected the log of a run with --check-reproducible"):
        reproducibility.read(path)


def test_a_log_that_cannot_be_read(tmp_path):
    with pytest.raises(UsageError, match=r"--against .*: cannot read it"):
        reproducibility.read(tmp_path)


def test_the_first_difference_ends_it():
    out = io.StringIO()
    expected = {(1, step): {"particles": A, "contacts": A} for step in (10, 20, 30)}
    check = reproducibility.Reproduction(10, Log(stream=out), expected, "old.txt")
    model = check.new_model()
    check.see(model, 10, {"particles": A, "contacts": A})
    check.see(model, 15, {"particles": B, "contacts": A})  # not in the log: nothing to compare with
    with pytest.raises(
        HpcdemError, match=r"step 20 is the first that differs from old\.txt: different contacts .* 1 states"
    ):
        check.see(model, 20, {"particles": A, "contacts": B})
    assert f"state 20: particles={A} contacts={B}" in out.getvalue()


@pytest.mark.parametrize(("seen", "said"), [((10, 20), "2 states agree with old.txt"), ((5,), "no state in")])
def test_the_end(seen, said):
    out = io.StringIO()
    expected = {(1, step): {"particles": A} for step in (10, 20)}
    check = reproducibility.Reproduction(5, Log(stream=out), expected, "old.txt")
    for step in seen:
        check.see(check.models or check.new_model(), step, {"particles": A})
    check.close()
    assert said in out.getvalue()


def test_rows_of_one_column_and_of_none() -> None:
    one = np.array([1.0, 2.0, -3.0])
    assert of_rows([one]).tolist() != of_rows([2.0 * one]).tolist()
    assert of_rows([]).tolist() == [0, 0] == of_rows([one[:0], one[:0]]).tolist()
