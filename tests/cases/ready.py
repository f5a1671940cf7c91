"""Runs the script of a ready-made model (`hpcdem.cases`) as a user would, and reads its results back."""

from __future__ import annotations

import dataclasses
import importlib.util
import json
import shutil
from pathlib import Path
from typing import Any

from hpcdem.cases.base import Case
from tests.conftest import absent

STORE = """
import json
with open('results.json', 'w') if pcdc.rank == 0 else open('/dev/null', 'w') as file:
    json.dump({NAMES}, file)
"""


_DONE: dict[tuple[str, int], Path] = {}
"""Folders of what this process has run, by script and number of ranks."""


def results(resident: Any, folder: Path, case: Case, ranks: int = 1, more: str = "", timeout: float = 1800.0) -> Any:
    """The results of a case, as attributes; more: further lines, which may make further `results` of the script. What
    several tests of a file ask for is run once."""
    if case.needs:
        for name in ("gmsh", "shapely"):
            if importlib.util.find_spec(name) is None:
                absent(name, f"no package {name} here: install the extra [mesh]")
    names = [field.name for field in dataclasses.fields(case.result)]
    pairs = ", ".join(f"'{name}': {name}" for name in names)
    text = case.script() + "\nmore = {}\n" + more + STORE.replace("NAMES", f"{pairs}, **more")
    if (text, ranks) in _DONE:
        shutil.copytree(_DONE[text, ranks], folder, dirs_exist_ok=True)
    else:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{case.name}.sc").write_text(text)
        done = resident(ranks, "--no-figure", f"{case.name}.sc", cwd=folder, timeout=timeout)
        assert done.returncode == 0, done.stderr
        _DONE[text, ranks] = folder
    return Results(json.loads((folder / "results.json").read_text()))


class Results:
    """Values by name."""

    def __init__(self, values: dict[str, Any]) -> None:
        self.__dict__.update(values)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Results) and repr(vars(self)) == repr(vars(other))

    __hash__ = None  # type: ignore[assignment]
