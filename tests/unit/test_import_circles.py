"""No module of the package imports itself by way of others: at its top, in functions, and for annotations alone."""

from __future__ import annotations

import sys
from graphlib import CycleError, TopologicalSorter

import grimp
import pytest

from tests.conftest import ROOT


def circle(package: str) -> list[str]:
    """Modules that import each other in turn, the first one last again; empty if there are none."""
    graph = grimp.build_graph(package, cache_dir=None)
    try:
        TopologicalSorter({name: graph.find_modules_directly_imported_by(name) for name in graph.modules}).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def test_the_package_has_no_circle():
    assert circle("hpcdem") == []


@pytest.mark.parametrize("tool", ["bench", "digests", "faults", "soak"])
def test_the_tools_have_no_circle(tool, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "scripts" / "lib")
    assert circle(tool) == []


@pytest.mark.parametrize(
    "way",
    [
        "from tied.a import f",
        "def g():\n    from tied import a",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from tied.a import f",
    ],
    ids=["top", "function", "annotation"],
)
def test_a_circle_is_found(way, tmp_path, monkeypatch):
    folder = tmp_path / "tied"
    folder.mkdir()
    for name, text in {"__init__": "", "a": "import tied.b\n", "b": "import tied.c\n", "c": way + "\n"}.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    try:
        assert set(circle("tied")) == {"tied.a", "tied.b", "tied.c"}
    finally:
        sys.modules.pop("tied", None)


def top_folders() -> set[str]:
    """Folders and modules directly in the package."""
    package = ROOT / "hpcdem"
    found = {path.stem for path in package.iterdir() if path.suffix == ".py" or (path / "__init__.py").exists()}
    return found - {"__init__", "__main__"}


def test_few_folders_import_each_other():
    """At most 80 pairs of folders, of which one imports the other."""
    graph, folders = grimp.build_graph("hpcdem", cache_dir=None), top_folders()
    pairs = {
        (name.split(".")[1], other.split(".")[1])
        for name in graph.modules
        if name.count(".")
        for other in graph.find_modules_directly_imported_by(name)
        if other.count(".")
    }
    pairs = {(one, other) for one, other in pairs if one != other and one in folders}
    assert 40 < len(pairs) <= 80, sorted(pairs)


def test_the_top_floor_has_few_folders_and_a_short_plan():
    """At most 18 of them, each on the plan of ARCHITECTURE.md, which a newcomer reads in one go."""
    rooms = top_folders()
    text = (ROOT / "ARCHITECTURE.md").read_text(encoding="utf-8")
    plan = text.split("```")[1]
    assert 10 < len(rooms) <= 18
    assert [room for room in sorted(rooms) if room not in plan] == []
    assert len(text.splitlines()) <= 150
