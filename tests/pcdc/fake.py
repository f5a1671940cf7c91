"""A simulation of blocks that computes nothing: it notes what it is told, for tests of the language."""

from __future__ import annotations

import json
from contextlib import nullcontext
from functools import partial
from inspect import isfunction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from hpcdem.commands.fdem import Project
from hpcdem.core.clock import Clock
from hpcdem.core.comm import SerialComm
from hpcdem.core.errors import CommandError
from hpcdem.core.timers import Timers
from hpcdem.lang.pcdc.execute import Interpreter
from hpcdem.physics.fdem import changes, convergence, diagnostics, equilibrium, saved_state
from hpcdem.physics.fdem.connectivity import centroids
from hpcdem.physics.fdem.convergence import Watch
from hpcdem.physics.fdem.equilibrium import Balanced
from hpcdem.physics.fdem.mesh import Mesh
from hpcdem.physics.fdem.properties import MODELS, Rows
from hpcdem.physics.fdem.settings import Options
from hpcdem.physics.fdem.state import Creep
from hpcdem.physics.fdem.surface_loads import SurfaceLoads
from hpcdem.physics.fdem.tables import Table


class Noted:
    """The log of a test."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def info(self, text: str) -> None:
        self.lines.append(text)

    def warn(self, text: str) -> None:
        self.lines.append(f"warning: {text}")

    def warn_once(self, key: str, text: str) -> None:
        self.warn(text)

    def at(self, step: int, name: str, first: int, last: float) -> None:
        """Where the run is."""


class FakeBlocks:
    """`hpcdem.physics.fdem.simulation.Blocks` with the functions on it (see `_note`), as far as the commands use them.

    calls: (name, arguments) in order; the time step is 0.01, the ratio falls as 1 / step, a node moves by (time, 2
    time), reactions are 1 and 2 per node."""

    def __init__(self, comm: Any = None, outdir: Path | str = "data") -> None:
        self.comm = comm or SerialComm()
        self.log, self.stop, self.outdir = Noted(), None, Path(outdir)
        self.timers, self.surface_loads = Timers(), ()
        self.calls: list[tuple[str, tuple, dict]] = []
        self.clear()

    def reported_time(self) -> float:
        return self.clock.time

    def changing_tables(self) -> list[str]:
        return []

    def clusters(self) -> tuple[np.ndarray, np.ndarray]:
        """Nothing parts: the node of a corner is its point."""
        assert self.mesh is not None
        return self.mesh.cells, np.arange(len(self.mesh.points))

    def clear(self) -> None:
        self.local = SimpleNamespace(passes=0)
        self.event_rows: list[Any] = []
        self.joint_row = np.zeros(0)
        self.mesh: Mesh | None = None
        self.clock, self.creep = Clock(), Creep()
        self.tables: dict[str, Table] = {}
        self.options, self.surface_loads = Options(), SurfaceLoads()

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)

        def noted(*args: Any, **kwargs: Any) -> None:
            self.calls.append((name, args, kwargs))

        return noted

    def told(self, name: str) -> list[tuple[tuple, dict]]:
        """Arguments of all calls of a method."""
        return [(args, kwargs) for called, args, kwargs in self.calls if called == name]

    @property
    def element_row(self) -> np.ndarray:
        assert self.mesh is not None
        return np.ones(len(self.mesh.cells), np.int64)

    @property
    def partner(self) -> np.ndarray:
        assert self.mesh is not None
        return self.mesh.face_partners()

    @property
    def element_rows(self) -> Any:
        """One material, with the moduli that it was given last."""
        rows = Rows()
        for (_, name, given), _ in self.told("element_model")[-1:]:
            rows.row(MODELS[name], MODELS[name].complete(given))
        return rows

    def place_mesh(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.calls.append(("place_mesh", (mesh,), {}))

    def table(self, name: str, pairs: Any) -> None:
        self.tables[name] = Table.of(pairs, name)

    def remove_table(self, name: str) -> None:
        del self.tables[name]

    def close_model(self) -> None:
        """Ready to step: the time step is known."""
        self.clock.dt = self.clock.dt or 0.01

    def advance(self, steps: int) -> int:
        assert steps > 0
        self.calls.append(("advance", (steps,), {}))
        self.close_model()
        self.local.passes += steps
        self.clock.step += steps
        self.clock.time = self.clock.step * 0.01
        return 0

    def solve_elastic(self, **how: Any) -> Balanced:
        self.calls.append(("solve_elastic", (), how))
        self.clock.step += how["cycles"]
        return Balanced(1e-11, 3, 1, 42, "direct")

    def unbalanced_ratio(self) -> float:
        return 1.0 / max(self.clock.step, 1)

    def watch(self, *how: Any) -> Watch:
        """What is looked at on the way to a ratio."""
        self.calls.append(("watch", how, {}))
        return Watch(0, 0, self.clock.step)

    def deep_overlaps(self) -> int:
        return 0

    def joint_counts(self) -> tuple[int, int, int]:
        return 7, 2, 1

    def values(self, name: str, numbers: Any = None) -> np.ndarray:
        assert self.mesh is not None
        t = self.clock.time
        stem, _, axis = name.rpartition("_")
        on_nodes = {"position", "displacement", "velocity", "reaction"}
        if stem in on_nodes:
            k = "xy".index(axis)
            moved = np.full(len(self.mesh.points), (k + 1) * t)
            found = {
                "position": self.mesh.points[:, k] + moved, "displacement": moved,
                "velocity": np.full(len(moved), k + 1.0), "reaction": np.full(len(moved), k + 1.0),
            }[stem]  # fmt: skip
        elif name in ("stress_xx", "stress_yy"):
            found = centroids(self.mesh.points, self.mesh.cells)[:, int(name == "stress_yy")]
        else:
            raise CommandError(f"there is no quantity {name}")
        return found if numbers is None else found[numbers]

    def corner_values(self, name: str, corners: Any = None) -> np.ndarray:
        assert self.mesh is not None
        at = np.column_stack([self.values(f"{name}_{axis}") for axis in "xy"])
        return np.where((self.mesh.cells >= 0)[:, :, None], at[self.mesh.cells], np.nan).reshape(-1, 2)

    def total(self, name: str, numbers: Any = None) -> float:
        return float(self.values(name, numbers).sum())

    def probe(self, name: str, numbers: Any = None) -> Any:
        """Asks this simulation every time."""
        return FakeProbe(self, name, np.array(numbers))

    def crack_rows(self) -> list[Any]:
        return self.event_rows

    def one_moment(self) -> Any:
        return nullcontext()

    def save(self, path: Path | str, extra: Any = None) -> None:
        mesh = self.mesh
        state = {"extra": extra, "step": self.clock.step, "tables": {k: t.pairs() for k, t in self.tables.items()}}
        if mesh is not None:
            state["mesh"] = [mesh.points.tolist(), mesh.cells.tolist(), {k: v.tolist() for k, v in mesh.layers.items()}]
        Path(path).write_text(json.dumps(state, allow_nan=False))

    def restore(self, path: Path | str) -> dict[str, Any]:
        try:
            state = json.loads(Path(path).read_text())
        except OSError:
            raise CommandError(f"{path}: there is no such file") from None
        self.clear()
        self.clock.step, self.clock.time = state["step"], state["step"] * 0.01
        for name, pairs in state["tables"].items():
            self.table(name, pairs)
        if "mesh" in state:
            points, cells, layers = state["mesh"]
            self.mesh = Mesh.of(points, cells, None, layers)
        return state["extra"]


def _note(module: Any) -> None:
    """Let the functions of a module that act on a model of blocks ask a `FakeBlocks` by their name."""

    def noted(name: str, function: Any) -> Any:
        def call(sim: Any, *args: Any, **kwargs: Any) -> Any:
            return (getattr(sim, name) if isinstance(sim, FakeBlocks) else partial(function, sim))(*args, **kwargs)

        return call

    for name, function in list(vars(module).items()):
        if isfunction(function) and function.__module__ == module.__name__ and name[0] != "_":
            setattr(module, name, noted(name, function))


for _one in (changes, convergence, diagnostics, equilibrium, saved_state):
    _note(_one)


class FakeProbe:
    """`hpcdem.physics.fdem.probes.Probe` of a fake simulation."""

    def __init__(self, sim: FakeBlocks, name: str, numbers: np.ndarray) -> None:
        self.sim, self.name, self.numbers, self.local = sim, name, numbers, sim.local

    def find(self) -> None:
        """Nothing is to be found."""

    def reduced(self, how: str, seen: Any = None) -> float:
        values = self.sim.values(self.name, self.numbers)
        made = {"sum": np.sum, "mean": np.mean, "minimum": np.min, "maximum": np.max, "": lambda found: found[0]}
        return float(made[how](values))


class Bench:
    """A script on a fake simulation, or on `blocks`: `bench("pcdc model new")` runs a text; blocks, project and the
    names of the script can be looked at."""

    def __init__(self, folder: Path, comm: Any = None, blocks: Any = None) -> None:
        self.blocks = blocks or FakeBlocks(comm)
        self.project = Project(self.blocks, folder, folder / "data")  # type: ignore[arg-type]
        self.interpreter = Interpreter(self.project)
        self.count = 0

    def __call__(self, text: str) -> Bench:
        self.count += 1
        name = "script.sc" if self.count == 1 else f"script{self.count}.sc"
        self.interpreter.run(self.interpreter.read(text, name))
        return self

    def __getitem__(self, name: str) -> Any:
        return self.interpreter.namespace[name]
