"""Mutants: which changes are made of a source, the choice, and a trial in a small tree."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests import suite
from tests.conftest import ROOT

sys.path.append(str(ROOT / "scripts" / "lib"))
from mutants import cli, seeds, trial

SOURCE = '''
LIMIT = 3


def total(values: list[float], first: int = 0) -> float:
    """Sum - of all."""
    found = 0.0
    for i in range(first, len(values)):
        if values[i] >= 0.0 and i < LIMIT:
            found += values[i] * 2.0
    if found == 1.0:
        raise ValueError(f"no {found - 1}")
    print("sum", found)
    return -found
'''


def changes(text: str) -> set[tuple[str, str, str]]:
    return {(m.kind, m.before, m.after) for m in seeds.of_source("a.py", text)}


def test_what_is_changed_of_a_source() -> None:
    found = changes(SOURCE)
    assert found == {
        ("constant", "0.0", "1.0"),
        ("constant", "2.0", "3.0"),
        ("constant", "1.0", "1.5"),
        ("comparison", " >= ", " > "),
        ("comparison", " < ", " <= "),
        ("comparison", " == ", " != "),
        ("comparison", " and ", " or "),
        ("index", "i", "i - 1"),
        ("statement", "found += values[i] * 2.0", "pass"),
        ("statement", 'print("sum", found)', "pass"),
        ("arguments", "first, len(values)", "len(values), first"),
        ("arguments", '"sum", found', 'found, "sum"'),
        ("factor", "*", "/"),
        ("sign", "-found", "(found)"),
    }, "no constant of a module, no message, no docstring, no default value"


def test_a_change_is_one_place_of_the_text() -> None:
    for mutant in seeds.of_source("a.py", SOURCE):
        text = mutant.applied(SOURCE)
        assert text != SOURCE and len(text) - len(SOURCE) == len(mutant.after) - len(mutant.before)
        compile(text, "a.py", "exec")
    with pytest.raises(ValueError, match=r"a\.py has changed"):
        mutant.applied(SOURCE[1:])


def test_letters_of_several_bytes_move_no_place() -> None:
    (mutant, *_) = [
        m for m in seeds.of_source("a.py", 'def f(a):\n    b = "长度" * a; c = a - 1\n') if m.kind == "sign"
    ]
    assert mutant.before == "-" and mutant.after == "+"


def test_the_choice_is_the_same_each_time_and_spread_over_the_modules(tmp_path: Path) -> None:
    for name in "abc":
        (tmp_path / f"{name}.py").write_text(SOURCE)
    chosen = seeds.choose(tmp_path, [""], 12, 1)
    assert chosen == seeds.choose(tmp_path, [""], 12, 1) and chosen != seeds.choose(tmp_path, [""], 12, 2)
    assert [sum(m.file == f"{name}.py" for m in chosen) for name in "abc"] == [4, 4, 4]
    assert len({m.kind for m in chosen}) >= 4 and len(set(chosen)) == 12
    assert len(seeds.choose(tmp_path, ["a.py"], 1000, 1)) == len(seeds.of_source("a.py", SOURCE))


@pytest.fixture
def tree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A project of one function with a test that looks at one of its two halves."""
    root = tmp_path / "root"
    (root / "tests").mkdir(parents=True)
    (root / "part.py").write_text("def f(a):\n    b = a + 1\n    return b\n\n\ndef g(a):\n    return a * 2.0\n")
    (root / "tests" / "test_part.py").write_text("import part\n\n\ndef test_f():\n    assert part.f(1) == 2\n")
    (root / "pyproject.toml").write_text('[tool.pytest.ini_options]\nmarkers = ["slow: s", "alone: a"]\n')
    for words in (["init", "-q"], ["add", "-A"]):
        subprocess.run(["git", *words], cwd=root, check=True)
    monkeypatch.setattr(suite, "tests_of", lambda files: ["tests/test_part.py"])
    monkeypatch.setattr(suite, "measured", lambda: {"seconds": {"tests/test_part.py": 1.0}, "reach": {}})
    return root


def test_mutants_on_trial(tree: Path, tmp_path: Path) -> None:
    copy = trial.Copy(tree, tmp_path / "copy").make()
    found = {}
    for mutant in seeds.of_source("part.py", (tree / "part.py").read_text()):
        if mutant.kind in ("sign", "factor"):
            entry = trial.judge(copy, mutant, 10.0)
            found[mutant.kind] = entry["outcome"], entry["by"]
    assert found == {"sign": ("killed", "tests/test_part.py::test_f"), "factor": ("survived", "")}
    assert (tmp_path / "copy" / "tree" / "part.py").read_text() == (tree / "part.py").read_text()


def test_a_test_that_fails_anyhow_kills_nothing(tree: Path, tmp_path: Path) -> None:
    (tree / "tests" / "test_part.py").write_text("def test_f():\n    assert 0\n")
    copy = trial.Copy(tree, tmp_path / "copy").make()
    (mutant,) = [m for m in seeds.of_source("part.py", (tree / "part.py").read_text()) if m.kind == "sign"]
    entry = trial.judge(copy, mutant, 10.0)
    assert entry["outcome"] == "survived" and entry["unsound"]


SOURCES = """
from numba import njit


def f(a):
    return a + 1


def g(a):
    return a * 2.0


def adder(b):
    def add(a):
        return a - b

    return add


def at_once():
    return 7


@njit
def kernel(a):
    return 3 * a


def nowhere(a):
    return -a


def forever(a):
    while a > 0:
        a -= 1
    return a


SUM = at_once()
minus = adder(2)
"""
TESTS = """
import part


def test_f():
    assert part.f(1) == 2 and part.g(0.0) == 0.0


def test_of_an_import():
    assert part.SUM == 7


def test_inner():
    assert part.minus(5) == 3 and part.adder(1)(5) == 4


def test_loop():
    assert part.forever(2) == 0


def test_kernel():
    assert part.kernel(2) == 6


def test_fails_anyhow():
    assert part.f(1) == part.g(1.0) + 1
"""
CONFTEST = """
import gc


def pytest_collection_finish(session):
    gc.freeze()
"""


@pytest.mark.slow
def test_the_table_and_going_on(tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A function, one in a function that a factory has made before, one that an import has called, one that no test
    calls, one that hangs, a kernel, which is a plain function here; in tests that keep what there is from the garbage
    collector."""
    (tree / "part.py").write_text(SOURCES)
    (tree / "conftest.py").write_text(CONFTEST)
    subprocess.run(["git", "add", "-A"], cwd=tree, check=True)
    (tree / "tests" / "test_part.py").write_text(TESTS)
    monkeypatch.setattr(cli, "ROOT", tree)
    monkeypatch.setattr(cli, "PLACES", ("part.py",))
    monkeypatch.setattr(cli, "REACH", tmp_path / "reach")
    record = tmp_path / "record.jsonl"

    def call(*words: str) -> list[dict]:
        done = CliRunner().invoke(cli.main, ["part.py", "--record", str(record), *words])
        assert done.exit_code == 0, done.output
        return cli.read(record)

    assert len(call("--limit", "1")) == 1
    found = {(e["mutant"].split("::")[1].split()[0], e["kind"]): (e["outcome"], e["by"]) for e in call()}
    assert found["f", "sign"] == ("killed", "tests/test_part.py::test_f")
    assert found["g", "factor"] == ("survived", "")
    assert found["adder.<locals>.add", "sign"] == ("killed", "tests/test_part.py::test_inner")
    assert found["at_once", "constant"] == ("killed", "tests/test_part.py::test_of_an_import")
    assert found["nowhere", "sign"] == ("untested", "")
    assert found["kernel", "factor"] == ("killed", "tests/test_part.py::test_kernel")
    assert found["forever", "statement"] == ("killed", "tests/test_part.py::test_loop"), "it ends by its time"
    first = record.read_text()
    call()
    assert record.read_text() == first and (tree / "part.py").read_text() == SOURCES
    table = CliRunner().invoke(cli.main, ["--record", str(record), "--table"]).output
    survived = sum(outcome == "survived" for outcome, _ in found.values())
    assert f"| {survived} | " in table and "- part.py::g factor '*' -> '/' in 'return a * 2.0'" in table


def test_what_has_a_reason_is_not_tried_again(tmp_path: Path) -> None:
    """Of each mutant the last result counts; a reason, which people add, stays with it."""
    record = tmp_path / "record.jsonl"
    entries = [("b", "survived", "equal"), ("a", "survived", None), ("a", "killed", None)]
    lines = [
        {"mutant": m, "file": "x/y.py", "outcome": o, "by": "", "seconds": 1.0} | ({"reason": r} if r else {})
        for m, o, r in entries
    ]
    record.write_text("".join(json.dumps(line) + "\n" for line in lines))
    cli.tidy(record)
    kept = [json.loads(line) for line in record.read_text().splitlines()]
    assert [(e["mutant"], e["outcome"], e.get("reason")) for e in kept] == [
        ("a", "killed", None),
        ("b", "survived", "equal"),
    ]
    assert "| x | 1 | 0 | 1 | 0 | 0.0 |" in cli.as_table(kept) and "Survivors" not in cli.as_table(kept)


LANES = """
from numba import njit
import numpy as np
from hpcdem.numerics import lanes as L
from hpcdem.io import digits


@njit
def all_of_them(table, lanes, out):
    i = (np.uint64(0), np.uint64(8), np.uint64(16), np.uint64(8))
    j = (np.uint64(4), np.uint64(20), np.uint64(0), np.uint64(12))
    L.differences(lanes, L.lane(0), table, j, i)
    L.two_columns(lanes, L.lane(4), table, i)
    L.four_columns(lanes, L.lane(6), table, j)
    L.put_two_columns(table, j, lanes, L.lane(0))
    L.put_four_columns(table, i, lanes, L.lane(5))
    L.add_in_turn(table, i, j, lanes, L.lane(1))
    digits._store4(out, 1, np.uint32(0x31323334))
    digits._store8(out, 7, np.uint64(0x3132333435363738))
    return L.no_farther(1.0, 1.0), L.no_farther(2.0, 1.0), L.as_bits(-2.5), L.as_number(-1)


L.lane = njit(L.lane)
table, lanes, out = np.sin(np.arange(32.0)), np.cos(np.arange(12.0 * L.CAPACITY)), np.zeros(16, np.uint8)
print(all_of_them(table, lanes, out), table.tolist(), lanes.sum(), bytes(out))
"""


def test_what_is_for_the_compiler_only_does_the_same_in_plain_python() -> None:
    said = []
    for words, env in (
        (["-c", LANES], {}),
        (["-c", "from mutants import plain; plain.install()" + LANES], trial.PLAIN),
    ):
        env = os.environ | env | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "scripts" / "lib")])}
        done = subprocess.run([sys.executable, *words], env=env, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        said.append(done.stdout)
    assert said[0] == said[1] != ""
