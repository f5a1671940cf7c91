"""Runs a ready-made model in a folder, for the cases of rock that cracks."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.io.frames import list_mesh_frames
from hpcdem.io.vtkhdf_mesh import MeshState, read_mesh_frame
from tests.conftest import Launcher, absent

PROGRAM = """
import dataclasses, json, sys
from hpcdem.cases import find
result = find(sys.argv[1])(**json.loads(sys.argv[2])).run(outdir="out")
print("RESULT", json.dumps(dataclasses.asdict(result)))
"""


@dataclass
class Study:
    """result: the fields of the case's result; state: the last frame; folder: of the results."""

    result: dict[str, Any]
    state: MeshState
    folder: Path

    @property
    def curve(self) -> np.ndarray:
        """(n, 2) of the result."""
        return np.array(self.result["curve"])

    def broken(self) -> tuple[np.ndarray, np.ndarray]:
        """(n, 2, 2) ends of broken joints [m], (n,) how each broke: 1 opened, 2 slid."""
        rows = self.state.of_joints["state"] == 3.0
        return self.state.points[self.state.joints[rows]], self.state.of_joints["mode"][rows]


def study(launch: Launcher, folder: Path, name: str, timeout: float = 600.0, **given: Any) -> Study:
    """Run the case with these parameters on one rank."""
    try:
        import gmsh  # noqa: F401
    except ImportError:
        absent("gmsh", "no package gmsh here: install the extra [mesh]")
    folder.mkdir(exist_ok=True)
    (folder / "study.py").write_text(PROGRAM)
    done = launch.python(1, "study.py", name, json.dumps(given), cwd=folder, timeout=timeout)
    assert done.returncode == 0, f"exit code {done.returncode}\n{done.stdout}{done.stderr}"
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    last = list_mesh_frames(folder / "out", name)[-1]
    return Study(json.loads(line.removeprefix("RESULT ")), read_mesh_frame(last.path, solid=True), folder / "out")
