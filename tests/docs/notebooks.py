"""Notebooks of examples/: carried out in a kernel of this Python. `python -m tests.docs.notebooks [NAME]` renews
what they show."""

from __future__ import annotations

import os
import re
import shutil
import sys
import tempfile
from pathlib import Path
from typing import Any

from tests.conftest import sources
from tests.docs.pages import ROOT

FOLDER = ROOT / "examples" / "notebooks"
NAMES = tuple(path.stem for path in sources("examples/notebooks", "*.ipynb"))


def carried_out(name: str, folder: Path, **changes: str) -> Any:
    """The notebook with its outputs, carried out in a folder. changes: of `word = value` in it."""
    import nbformat
    from nbclient import NotebookClient

    book = nbformat.read(FOLDER / f"{name}.ipynb", 4)
    left = set(changes)
    for cell in book.cells:
        for word, value in changes.items():
            cell.source, found = re.subn(rf"\b{word} = [^,\s]+", f"{word} = {value}", cell.source, count=1)
            left -= {word} if found else set()
    assert not left, f"not in {name}: {left}"
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH", ""))))
    os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    kernel = Path(folder) / "kernels" / "python3"
    kernel.mkdir(parents=True)
    (kernel / "kernel.json").write_text(
        f'{{"argv": ["{sys.executable}", "-m", "ipykernel_launcher", "-f", "{{connection_file}}"], '
        '"display_name": "Python 3", "language": "python"}'
    )
    os.environ["JUPYTER_PATH"] = str(folder)
    NotebookClient(book, timeout=1200, kernel_name="python3", resources={"metadata": {"path": str(folder)}}).execute()
    return book


def renew(name: str) -> None:
    """Carry a notebook out whole and keep what it shows, without places and times."""
    import nbformat

    folder = Path(tempfile.mkdtemp())
    book = carried_out(name, folder)
    for cell in book.cells:
        cell.metadata.pop("execution", None)
    book.metadata["language_info"] = {"name": "python"}
    nbformat.write(book, FOLDER / f"{name}.ipynb")
    shutil.rmtree(folder)


if __name__ == "__main__":
    for one in sys.argv[1:] or NAMES:
        renew(one)
