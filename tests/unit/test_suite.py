"""The suite's knowledge of itself: which tests a change can break, the time left, the summary."""

from __future__ import annotations

import json
import subprocess
import sys
from collections import Counter
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests import suite
from tests.conftest import ROOT
from tests.tables import each


def test_files_of_tests_that_a_change_can_break() -> None:
    found = suite.tests_of(["hpcdem/core/units.py"])
    assert "tests/unit/test_units.py" in found[:20]
    found = suite.tests_of(["tests/unit/test_suite.py", "hpcdem/no/such_module.py", "slurm/no_such.sbatch"])
    assert found[0] == "tests/unit/test_suite.py" and len(found) < 9


def test_those_of_the_same_subject_come_before_the_others() -> None:
    found = suite.tests_of(["hpcdem/physics/heat/implicit.py"])
    by_name = [test for test in found if "heat" in test]
    direct = [test for test in found if "hpcdem.physics.heat.implicit" in suite.reached(test)[0]]
    others = [test for test in found if test not in direct and not suite._words(test) & {"heat", "implicit"}]
    assert by_name and others and max(map(found.index, [*by_name, *direct])) < min(map(found.index, others))


def test_what_is_imported_through_others_is_reached(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    for name, text in {
        "hpcdem/__init__.py": "",
        "hpcdem/low.py": "",
        "hpcdem/high.py": "from hpcdem import low",
        "hpcdem/late.py": "def f():\n    from hpcdem import low",
        "tests/test_high.py": "from hpcdem.high import anything",
        "tests/test_late.py": "def test_it():\n    import hpcdem.late",
    }.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.setattr(suite, "ROOT", tmp_path)
    monkeypatch.setattr(suite, "measured", lambda: {"seconds": {}, "reach": {"tests/test_late.py": ["hpcdem.far"]}})
    suite.imports.cache_clear(), suite._path.cache_clear()
    try:
        assert suite.tests_of(["hpcdem/low.py"]) == ["tests/test_high.py"]
        assert suite.tests_of(["hpcdem/late.py"]) == ["tests/test_late.py"]
        assert suite.tests_of(["hpcdem/far.py"]) == ["tests/test_late.py"], "as a program that it started has loaded it"
    finally:
        suite.imports.cache_clear(), suite._path.cache_clear()


def test_the_time_of_a_change_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(suite, "seconds_of", lambda file: {"a": 100.0, "b": 50.0, "c": 10.0}[file])
    assert suite.within(["b", "a", "c"], 70.0) == (["b", "c"], ["a"])
    assert suite.within(["a", "b"], 70.0) == (["a"], ["b"]), "one runs however long it takes"


def test_a_worker_stays_with_the_kernels_it_has_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two workers in turn: long files first, another family when one's own is done."""
    seconds = {"blocks/test_a": 9.0, "unit/test_d": 1.0, "heat/test_b": 8.0, "space/test_c": 5.0, "laws/test_e": 4.0}
    monkeypatch.setattr(suite, "seconds_of", lambda file: seconds[file.removeprefix("tests/")])
    left, families, order = [f"tests/{name}" for name in seconds], {}, ""
    for node in "ababa":
        left.remove(file := suite.next_file(left, families, node))
        order += file[-1]
    assert order == "acbed"


def test_the_time_left(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(suite, "seconds_of", lambda file: {"a": 30.0, "b": 10.0}[file])
    own = suite.Suite(SimpleNamespace(workerinput={}))  # type: ignore[arg-type]
    own.asked, own.done = Counter({"a": 3, "b": 1}), Counter({"a": 1})
    assert own.left(20.0) == "25 %, about 1:00 min left"
    own.outcomes["failed"] = 2
    assert own.left(20.0).endswith("left, 2 failed")


def part(**given: Any) -> str:
    plain = {
        "part": "p",
        "seconds": 61.0,
        "outcomes": {},
        "skipped": {},
        "failed": {},
        "left_out": {},
        "files": {},
        "exit": 0,
    }
    return json.dumps(plain | given)


def test_one_summary_of_all_parts(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: Any) -> None:
    monkeypatch.setattr(suite, "MEASURED", tmp_path / "kept" / "suite.json")
    reach = tmp_path / "reach"
    for name in ("tests+a.py", "tests+b.py", "resident"):
        (reach / name).mkdir(parents=True)
    (reach / "tests+a.py" / "1").write_text("hpcdem\nhpcdem.core")
    (reach / "tests+b.py" / "resident").touch()
    (reach / "resident" / "1").write_text("hpcdem\nhpcdem.io")
    (tmp_path / "1.json").write_text(
        part(part="side by side", outcomes={"passed": 7}, files={"tests/a.py": 3.0}, left_out={"slow": 4, "nightly": 3})
    )
    (tmp_path / "2.json").write_text(
        part(part="one by one", outcomes={"passed": 1, "failed": 1, "skipped": 2}, skipped={"no lmp": 2},
             left_out={"slow": 1}, failed={"tests/a.py::test_x": "assert 1 == 2"}, files={"tests/a.py": 1.0})
    )  # fmt: skip
    assert suite.summary(tmp_path) == 1
    said = capsys.readouterr().out
    assert said.splitlines()[-1] == "8 passed, 1 failed, 2 skipped"
    assert "2 x no lmp" in said and "4 slow tests" in said and "assert 1 == 2" in said and "1:01 min" in said
    assert "not run: 3 nightly tests (./scripts/test --nightly)" in said
    assert "./scripts/test 'tests/a.py::test_x'" in said
    kept = json.loads(suite.MEASURED.read_text())
    assert kept["seconds"] == {"tests/a.py": 4.0}
    assert kept["reach"] == {"tests/a.py": ["hpcdem", "hpcdem.core"], "tests/b.py": ["hpcdem", "hpcdem.io"]}


def test_a_run_writes_down_what_it_found(tmp_path: Path) -> None:
    """On two workers; a pytest that a test starts is no part of it."""
    (tmp_path / "test_two.py").write_text(
        "import os, subprocess, sys, pytest\n"
        "def test_good(): assert 'HPCDEM_TEST_RESULTS' not in os.environ\n"
        "def test_bad(): assert 1 == 2\n"
        "def test_starts_one(): subprocess.run([sys.executable, '-c', 'import hpcdem.core.units'], check=True)\n"
        "@pytest.mark.slow\ndef test_slow(): pass\n"
        "def test_none(): pytest.skip('no such thing')\n"
    )
    results = tmp_path / "results"
    command = [sys.executable, "-m", "pytest", "-p", "tests.suite", "-p", "no:cacheprovider", "--rootdir", tmp_path]
    env = suite.os.environ | {"HPCDEM_TEST_RESULTS": str(results), "PYTHONPATH": str(ROOT), "HPCDEM_TEST_PART": "two"}
    words = ["-n", "2", "-m", "not slow", "-o", "markers=slow: slow"]
    subprocess.run([*command, *words], cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    (record,) = [json.loads(path.read_text()) for path in results.glob("*.json")]
    assert record["part"] == "two" and record["exit"] == 1 and record["left_out"] == {"slow": 1}
    assert record["outcomes"] == {"passed": 2, "failed": 1, "skipped": 1}
    assert record["skipped"] == {"no such thing": 1} and list(record["failed"]) == ["test_two.py::test_bad"]
    (loaded,) = (results / "reach" / "test_two.py").glob("*")
    assert "hpcdem.core.units" in loaded.read_text().split()


def test_a_table_in_one_test_names_each_row_that_fails() -> None:
    @each(("number", "square"), [(2, 4), (3, 10), (4, 15)])
    def of(number: int, square: int) -> None:
        assert number * number == square

    with pytest.raises(pytest.fail.Exception) as caught:
        of()
    said = str(caught.value)
    assert (
        said.startswith("2 of 3") and "\n3, 10: AssertionError" in said and "\n4, 15: " in said and "2, 4" not in said
    )
