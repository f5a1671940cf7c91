"""Mutants: which changes are made of a source, the choice, and a trial in a small tree."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

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


def test_the_table_and_going_on(tree: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli, "ROOT", tree)
    tried: list[str] = []

    def judge(copy: Any, mutant: seeds.Mutant, seconds: float) -> dict[str, object]:
        tried.append(mutant.name)
        outcome = "killed" if mutant.kind == "sign" else "survived"
        return {"mutant": mutant.name, "file": mutant.file, "outcome": outcome, "by": "", "seconds": 30.0}

    monkeypatch.setattr(cli, "judge", judge)
    record = tmp_path / "record.jsonl"

    def call(*words: str) -> str:
        from click.testing import CliRunner

        done = CliRunner().invoke(cli.main, ["part.py", "--record", str(record), *words])
        assert done.exit_code == 0, done.output
        return done.output

    call("--limit", "1")
    assert len(tried) == 1
    said = call()
    assert len(tried) == len(set(tried)) == 4, "each mutant once: sign, factor, and two constants"
    assert "| part.py | 1 | 3 | 0 | 2.0 |" in said and said.count("- part.py") == 3
    assert call("--table").strip() == said[said.index("| modules") :].strip()
    assert len(record.read_text().splitlines()) == 4 and all(map(json.loads, record.read_text().splitlines()))
