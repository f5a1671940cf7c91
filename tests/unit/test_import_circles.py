"""No module of the package imports itself by way of others: at its top, in functions, and for annotations alone."""

from __future__ import annotations

import sys
from graphlib import CycleError, TopologicalSorter

import grimp
import pytest


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
