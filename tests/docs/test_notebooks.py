"""Notebooks of examples/: small they are carried out by a kernel to their end, whole they say what they show."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.docs import notebooks

SHORTER = {
    "thrust_belt": {"way": "40.0", "length": "3e3", "thickness": "800.0"},
    "ucs": {"size": "0.0125"},
    "ensemble": {"seeds": '"1:2"', "way": "400.0"},
}


@pytest.fixture(autouse=True)
def packages() -> None:
    for name in ("nbclient", "ipykernel", "pandas", "xarray"):
        pytest.importorskip(name, reason="the extras [notebook] and [dev]")


def said(book: object) -> str:
    """All that the cells printed."""
    return "".join(o.get("text", "") for cell in book.cells for o in cell.get("outputs", []))  # type: ignore[attr-defined]


def shown(book: object) -> set[str]:
    """Kinds of what the cells showed."""
    outputs = [o for cell in book.cells for o in cell.get("outputs", [])]  # type: ignore[attr-defined]
    return {kind for output in outputs for kind in output.get("data", {})}


def test_each_has_a_shorter_form() -> None:
    assert set(notebooks.NAMES) == set(SHORTER)


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.parametrize("name", SHORTER)
def test_shortened_notebook_runs_to_its_end(name: str, tmp_path: Path) -> None:
    book = notebooks.carried_out(name, tmp_path, **SHORTER[name])
    assert {"image/png", "text/html"} <= shown(book)
    if name == "thrust_belt":
        bars = [o for cell in book.cells for o in cell.get("outputs", []) if "<progress" in str(o.get("data", ""))]
        assert len(bars) == 3, "one for each cycle and imple"


@pytest.mark.slow
@pytest.mark.nightly
def test_whole_ucs_says_its_strength(tmp_path: Path) -> None:
    found = re.search(
        r"strength (\S+) MPa, after Mohr and Coulomb (\S+) MPa", said(notebooks.carried_out("ucs", tmp_path))
    )
    assert found and float(found[1]) == pytest.approx(float(found[2]), rel=0.02)


@pytest.mark.parametrize("name", SHORTER)
def test_the_stored_notebook_was_carried_out(name: str) -> None:
    """In order, to its end, without an error; no place of a machine is in it."""
    import nbformat

    book = nbformat.read(notebooks.FOLDER / f"{name}.ipynb", 4)
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    assert all(o.output_type != "error" for cell in code for o in cell.outputs)
    assert not re.search(r"/(?:home|root|tmp|work)/", said(book)) and {"image/png"} <= shown(book)
