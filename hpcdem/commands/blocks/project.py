"""What a script of blocks has at hand: the simulation, geometry layers, the mesh, groups, what is recorded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.errors import CommandError
from hpcdem.model.blocks.connectivity import Edges
from hpcdem.model.blocks.groups import ELEMENT, KINDS, Groups
from hpcdem.model.blocks.mesh import Mesh
from hpcdem.pre.mesh.geometry import Layers
from hpcdem.runtime import launch, run_folder

if TYPE_CHECKING:
    from hpcdem.blocks import Blocks
    from hpcdem.commands.blocks.charts import Chart
    from hpcdem.commands.blocks.histories import History
    from hpcdem.coupled import Coupled


class Project:
    """blocks: the simulation (its comm, log and stop are used); directory: where file names begin; outdir: folder of
    the results; job: what was started, for run.json; keep: numbered checkpoints that are kept, 0: all.

    layers: geometry; mesh: of all bodies, None before the first; groups: by kind of object; alive (ne,) bool: elements
    that are not null; histories, charts and frames (steps between two by name) that are kept up; framed: step of the
    last frame by name; dynamic: motion in time, not towards equilibrium; adapts: the
    time step may change during a run; networks: sets of fractures made so far; line:
    of the script, for the log; names: gives what a checkpoint shall hold of the script's own variables, place: and of
    the way to where the script is; progress: of the command that steps at this moment, see running.py; resumed: this
    run goes on from a checkpoint of the folder; told: when the log spoke last of a line of the script that steps;
    coupled: the particles that are stepped with the blocks; continues: the checkpoint from which they go on.
    """

    def __init__(self, blocks: Blocks, directory: Path | str = ".", outdir: Path | str = "data") -> None:
        self.blocks = blocks
        self.directory = Path(directory)
        self.outdir = Path(outdir)
        self.job: Any = None
        self.keep = 0
        self.line = 0
        self.folder_made = False
        self.names: Callable[[], dict[str, Any]] = dict
        self.place: Callable[[], dict[str, Any] | None] = lambda: None
        self.progress: dict[str, Any] | None = None
        self.resumed = False
        self.told: dict[int, float] = {}
        self.coupled: Coupled | None = None
        self.continues: Path | None = None
        self._forget()

    @property
    def comm(self) -> Any:
        """The communicator."""
        return self.blocks.comm

    @property
    def log(self) -> Any:
        """The log, or None."""
        return self.blocks.log

    @property
    def step(self) -> int:
        """Steps done."""
        return int(self.blocks.clock.step)

    def clear(self) -> None:
        """A new model."""
        if self.coupled is not None:
            self.coupled.release()
        self.coupled = self.continues = None
        self.blocks.clear()
        self._forget()

    def _forget(self) -> None:
        self.layers = Layers()
        self.mesh: Mesh | None = None
        self._edges: tuple[np.ndarray, Edges] | None = None
        self.alive = np.empty(0, bool)
        self.groups = {kind: Groups(kind) for kind in KINDS}
        self.histories: dict[str, History] = {}
        self.charts: dict[str, Chart] = {}
        self.frames: dict[str, int] = {}
        self.framed: dict[str, int] = {}
        self.dynamic = True
        self.adapts = False
        self.networks = 0
        self.taken = False
        self.in_use = False

    # ---- the mesh ------------------------------------------------------------------------------------------------

    def add_mesh(self, mesh: Mesh) -> None:
        """One more body. CommandError if models or conditions were assigned to the mesh already."""
        if self.in_use:
            raise CommandError(
                "the mesh has models or conditions already: all bodies are meshed before the first of them is assigned"
            )
        first = 0 if self.mesh is None else len(self.mesh.cells)
        self.mesh = mesh if self.mesh is None else joined(self.mesh, mesh)
        for set_name, of in mesh.groups.items():
            for name, numbers in of.items():
                self.groups[ELEMENT].assign(numbers + first, name, set_name)
        self.alive = np.concatenate([self.alive, np.ones(len(mesh.cells), bool)])
        self.taken = False

    def edges(self) -> Edges:
        """The edges of the mesh."""
        mesh = self.whole_mesh()
        if self._edges is None or self._edges[0] is not mesh.cells:
            self._edges = mesh.cells, mesh.edges()
        return self._edges[1]

    def whole_mesh(self) -> Mesh:
        """The mesh. CommandError if there is none."""
        if self.mesh is None:
            raise CommandError("there is no mesh yet: mesh create, mesh structured or mesh import comes first")
        return self.mesh

    def replace_mesh(self, mesh: Mesh) -> None:
        """The same points and elements with other cracks."""
        self.mesh = mesh
        self.taken = False

    def ready(self, use: bool = True) -> Blocks:
        """The simulation, with the mesh taken. use: something is assigned to it or it is run, so the mesh stays."""
        mesh = self.whole_mesh()
        if not self.taken:
            self.blocks.place_mesh(mesh)  # each body was checked; those that touch have points in the same places
            self.taken = True
        self.in_use = self.in_use or use
        return self.blocks

    def positions(self) -> np.ndarray:
        """(np, 2) where the nodes are now [m]; NaN where there is none any more."""
        mesh = self.whole_mesh()
        if not self.taken or self.step == 0:
            return mesh.points
        return np.column_stack([self.blocks.values(f"position_{axis}") for axis in "xy"])

    # ---- files ---------------------------------------------------------------------------------------------------

    def path(self, name: str) -> Path:
        """A file of the script: beside it, unless the name says otherwise."""
        return self.directory / name

    def folder(self) -> Path:
        """The folder of the results, made and locked on the first call. Collective."""
        if not self.folder_made:
            job = self.job or run_folder.Job()
            locked = run_folder.enter(self.outdir, self.comm, job, launch.version(), self.resumed)
            self.folder_made = True
            if not locked and self.log is not None:
                why = f"the file system of {self.outdir} has no locks"
                self.log.warn_once("lock", f"{why}: nobody will notice if two runs write there at once")
        return self.outdir


def joined(one: Mesh, other: Mesh) -> Mesh:
    """Two bodies in one mesh: numbers of the second follow those of the first, equal names are united, nothing is
    merged."""
    n_points, n_cells = len(one.points), len(one.cells)
    groups = {s: dict(of) for s, of in one.groups.items()}
    for set_name, of in other.groups.items():
        mine = groups.setdefault(set_name, {})
        for name, numbers in of.items():
            mine[name] = np.concatenate([mine.get(name, np.empty(0, np.int64)), numbers + n_cells])
    layers = dict(one.layers)
    for name, pairs in other.layers.items():
        layers[name] = np.concatenate([layers.get(name, np.empty((0, 2), np.int64)), pairs + n_points])
    sets = one.crack_sets.max(initial=-1) + 1
    return Mesh.of(
        np.concatenate([one.points, other.points]),
        np.concatenate([one.cells, np.where(other.cells >= 0, other.cells + n_points, -1)]),
        groups,
        layers,
        np.concatenate([one.cracks, other.cracks + n_points]),
        np.concatenate([one.crack_sets, other.crack_sets + sets]),
    )
