"""The project of a script of blocks: the simulation, geometry layers, the mesh, groups, and records."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.commands.fdem.records import Chart, History
from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.physics.fdem import diagnostics
from hpcdem.physics.fdem.connectivity import Edges
from hpcdem.physics.fdem.groups import DEFAULT, ELEMENT, FACE, JOINT, KINDS, NODE, Groups
from hpcdem.physics.fdem.mesh import Mesh, check
from hpcdem.physics.fdem.sides import SIDE
from hpcdem.pre.mesh.geometry import Layers
from hpcdem.runtime import launch, run_folder

if TYPE_CHECKING:
    from hpcdem.commands.dem.cycles import Due
    from hpcdem.physics.coupling.model import Coupled
    from hpcdem.physics.fdem.simulation import Blocks
    from hpcdem.pre.mesh.remade import Remade


class Project:
    """A model of blocks and the state of the program or script that controls it.

    blocks: the simulation (its comm, log and stop are used); directory: folder to which file names are relative;
    outdir: output folder; job: the command that was started, for run.json; keep: number of checkpoints to keep, 0: all.

    Model. dim: dimensions of space; layers: geometry; mesh: of all bodies, None before the first; added: nodes [m] and
    elements not yet part of the mesh; groups: by kind of object; alive (ne,) bool: elements that are not null; hidden
    (ne,) bool: elements skipped by pictures and ranges; networks: number of fracture sets made so far; units: declared
    system (core.units.SYSTEMS), "" none.

    Output. histories, charts, frames (interval in steps by name); framed: step of the last frame by name; cracks_filed:
    number of broken joints already written, None: the file of this model does not exist yet.

    Steps. run_time: limit of model solve [s], 0: none; began: origin of run_time by part (clocks.PARTS); check_every:
    steps between two evaluations of the ratio, 0: default; step_table: name of a table of the time step over time, ""
    none; relative: tables whose times count from the moment at which a condition begins to use them; dynamic: motion
    in time instead of towards equilibrium; adapts: the time step may change during a run; solved: outcome of the last
    `model solve`: reason, ratio and steps.

    Script. line: present line, for the log; names: returns the variables of the script to be saved in a checkpoint;
    place: returns the path to the present position in the script; progress: of the present command that steps, see
    running.py; stepping: name of that command, "" none; logged_at: time of the last log entry by line of the script;
    inputs: files that the script reads, by real path, with a description; made: files written by name.

    Restart. resumed: this run resumes from a checkpoint of the folder; restored: checkpoint that the script named, and
    its step; calls_lost: that checkpoint has no methods of particles; resume_advice: how to resume from a checkpoint of
    a run without a script, "": model restore.

    Particles. coupled: particles stepped with the blocks; continues: checkpoint from which they continue; asleep:
    number of their `Simulation`, which is empty until then; due: output due in the present command.
    """

    def __init__(self, blocks: Blocks, directory: Path | str = ".", outdir: Path | str = "data") -> None:
        self.blocks = blocks
        self.directory = Path(directory)
        self.outdir = Path(outdir)
        self.job: Any = None
        self.keep = run_folder.Retention()
        self.line = 0
        self.folder_made = False
        self.names: Callable[[], dict[str, Any]] = dict
        self.place: Callable[[], dict[str, Any] | None] = lambda: None
        self.progress: dict[str, Any] | None = None
        self.resumed = False
        self.restored: tuple[Path, int] | None = None
        self.logged_at: dict[int, float] = {}
        self.coupled: Coupled | None = None
        self.continues: Path | None = None
        self.inputs: dict[str, str] = {}
        self.made: set[str] = set()
        self.asleep: int | None = None
        self.calls_lost = False
        self.due: Due | None = None
        self.stepping = ""
        self.resume_advice = ""
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
        """Number of steps taken."""
        return int(self.blocks.clock.step)

    @property
    def count(self) -> int:
        """Count steps for periodic tasks: creep steps in a static run with creep."""
        return self.blocks.creep.steps if "creep" in (self.progress or {}) else self.step

    def refuse_inside(self, what: str) -> None:
        """Raise CommandError in a function that is called during a command that steps."""
        if self.stepping:
            raise CommandError(f"{what} cannot be used by a function that is called during model {self.stepping}")

    def clear(self, dim: int = 2) -> None:
        """Start a new model in two or three dimensions."""
        self.refuse_inside("model new")
        if self.coupled is not None:
            self.coupled.release()
        self.coupled = self.continues = None
        self.blocks.clear()
        self._forget()
        self.dim = dim

    def _forget(self) -> None:
        self.layers = Layers()
        self.mesh: Mesh | None = None
        self.added: tuple[list[tuple[float, ...]], list[tuple[int, ...]]] = [], []
        self.dim = 2
        self._edges: tuple[np.ndarray, Edges] | None = None
        self.alive, self.hidden = np.empty((2, 0), bool)
        self.groups = {kind: Groups(kind) for kind in KINDS}
        self.histories: dict[str, History] = {}
        self.cracks_filed: int | None = None
        self.charts: dict[str, Chart] = {}
        self.frames: dict[str, int] = {}
        self.framed: dict[str, int] = {}
        self.dynamic = True
        self.adapts = False
        self.run_time = 0.0
        self.began: dict[str, float] = {}
        self.check_every = 0
        self.step_table = ""
        self.relative: set[str] = set()
        self.networks = 0
        self.units = ""
        self.solved: dict[str, Any] = {}
        self.taken = False
        self.in_use = False

    # ---- the mesh ------------------------------------------------------------------------------------------------

    def add_mesh(self, mesh: Mesh) -> None:
        """Add a body. CommandError if models or conditions were assigned to the mesh already."""
        self.refuse_in_use("all bodies are meshed")
        self.take_added()
        if mesh.dim != self.dim:
            raise CommandError(
                f"the mesh has {mesh.dim} dimensions, the model {self.dim}: use model new dim {mesh.dim}"
            )
        before, groups = self.mesh, self.groups[ELEMENT]
        first = 0 if before is None else len(before.cells)

        def make() -> tuple[Mesh | None, Groups, np.ndarray, np.ndarray]:
            for set_name, of in mesh.groups.items():
                for name, numbers in of.items():
                    groups.assign(numbers + first, name, set_name)
            alive = np.concatenate([self.alive, np.ones(len(mesh.cells), bool)])
            hidden = np.concatenate([self.hidden, np.zeros(len(mesh.cells), bool)])
            return None if before is None else joined(before, mesh), groups, alive, hidden

        made, self.groups[ELEMENT], self.alive, self.hidden = self.comm.per_node(make)
        self.mesh = mesh if made is None else made
        self.taken = False

    def refuse_in_use(self, what: str) -> None:
        """CommandError if models or conditions were assigned to the mesh already."""
        if self.in_use:
            raise CommandError(
                f"the mesh has models or conditions already: {what} before the first of them is assigned"
            )

    def refit(self, made: Remade) -> None:
        """Use the mesh after bodies were glued, or elements cut or deleted: groups and histories of merged, cut or
        renumbered objects continue. A merged point belongs to the group of its lowest-numbered original point.
        """
        before, mesh, number = self.whole_mesh(), made.mesh, made.points
        self.replace_mesh(mesh)
        self.alive, self.hidden = self.alive[made.parent], self.hidden[made.parent]
        old, parent, n = before.cells.reshape(-1), np.repeat(made.parent, 4), len(mesh.points)

        def sides(numbers: np.ndarray) -> np.ndarray:
            """Present positions of these sides (sides.py)."""
            corner = numbers - SIDE
            corner = corner[number[old[corner]] >= 0]
            return SIDE + np.flatnonzero(
                np.isin(parent * n + mesh.cells.reshape(-1), corner // 4 * n + number[old[corner]])
            )

        for sets in self.groups[NODE].sets.values():
            lowest = np.full(len(mesh.points), len(number))
            for members in sets.values():
                members = members[members < SIDE]
                members = members[number[members] >= 0]
                np.minimum.at(lowest, number[members], members)
            for name, members in sets.items():
                side, members = members[members >= SIDE], members[members < SIDE]
                members = members[number[members] >= 0]
                sets[name] = np.append(np.unique(number[members[lowest[number[members]] == members]]), sides(side))
        edges = self.edges()

        def faces(numbers: np.ndarray, joints: bool) -> np.ndarray:
            """Present positions of these faces or joints."""
            points, of = made.moved.faces(before.face_points(numbers))
            at = mesh.find_edges(edges, points)
            good = (at >= 0) & (edges.inner[at] | ~np.bool_(joints))
            both, of = edges.faces[at[good]], of[good]
            own = made.parent[both // 4] == (numbers // 4)[of][:, None]
            if joints:
                return np.unique(both[:, 0])
            return np.unique(np.where(own[:, 0], both[:, 0], both[:, 1])[own.any(axis=1)])

        moved: dict[str, Callable[[np.ndarray], np.ndarray]] = {
            NODE: lambda numbers: np.append(
                np.setdiff1d(number[numbers[numbers < SIDE]], [-1]), sides(numbers[numbers >= SIDE])
            ),
            ELEMENT: lambda numbers: np.flatnonzero(np.isin(made.parent, numbers)),
            FACE: lambda numbers: faces(numbers, False),
            JOINT: lambda numbers: faces(numbers, True),
        }
        for kind in (ELEMENT, FACE, JOINT):
            for sets in self.groups[kind].sets.values():
                sets.update((name, moved[kind](members)) for name, members in sets.items() if len(members))
        first = np.full(len(before.cells), -1)  # a piece of an element that was cut keeps its number
        first[made.parent[::-1]] = np.arange(len(made.parent))[::-1]
        moved[ELEMENT] = lambda numbers: first[numbers][first[numbers] >= 0]
        for history in self.histories.values():
            if history.kind in moved:
                history.numbers = moved[history.kind](np.array(history.numbers, np.int64)).tolist()

    def edges(self) -> Edges:
        """The edges of the mesh."""
        mesh = self.whole_mesh()
        if self._edges is None or self._edges[0] is not mesh.cells:
            self._edges = mesh.cells, mesh.edges()
        return self._edges[1]

    def take_added(self) -> None:
        """Add nodes and elements given one by one to the mesh. Raises CommandError that names an invalid one."""
        points, cells = self.added
        if not points and not cells:
            return
        known = self.mesh
        self.added = [], []

        def make() -> Mesh:
            at = np.array(points, np.float64).reshape(-1, self.dim)
            new = np.array([[*cell, -1] if len(cell) == 3 else cell for cell in cells], np.int64).reshape(-1, 4)
            if known is not None:
                at, new = np.concatenate([known.points, at]), np.concatenate([known.cells, new])
            mesh = Mesh.of(at, new) if known is None else replace(known, points=at, cells=new)
            check(mesh, "model add")
            return mesh

        try:
            mesh = self.comm.per_node(make)
        except HpcdemError as error:
            raise CommandError(str(error)) from None
        count = len(cells)
        self.mesh, self.taken = mesh, False
        self.alive = np.concatenate([self.alive, np.ones(count, bool)])
        self.hidden = np.concatenate([self.hidden, np.zeros(count, bool)])
        self.groups[ELEMENT].assign(range(len(mesh.cells) - count, len(mesh.cells)), DEFAULT)

    def whole_mesh(self) -> Mesh:
        """Return the mesh. Raises CommandError if missing."""
        self.take_added()
        if self.mesh is None:
            raise CommandError("no mesh yet: use mesh create, mesh structured or mesh import first")
        return self.mesh

    def replace_mesh(self, mesh: Mesh) -> None:
        """Replace the mesh by one with equal points and elements and other cracks."""
        self.mesh = mesh
        self.taken = False

    def ready(self, use: bool = True) -> Blocks:
        """Return the simulation with the mesh loaded. use: models or conditions are assigned or the model is run, so
        the mesh can no longer change.
        """
        mesh = self.whole_mesh()
        if not self.taken:
            self.blocks.place_mesh(mesh)  # each body was checked; those that touch have points in the same places
            self.taken = True
        self.in_use = self.in_use or use
        return self.blocks

    def positions(self) -> np.ndarray:
        """Return the present positions of the nodes (np, dim) [m]; NaN where removed."""
        mesh = self.whole_mesh()
        if not self.taken or self.step == 0:
            return mesh.points
        axes = "xyz"[: mesh.dim]
        return np.column_stack([diagnostics.values(self.blocks, f"position_{axis}") for axis in axes])

    def corner_positions(self) -> np.ndarray:
        """Return the present positions of the corners, element * 4 + k, (4 ne, dim) [m]; NaN where removed.
        Collective.
        """
        mesh = self.whole_mesh()
        if not self.taken or self.step == 0:
            return np.where((mesh.cells >= 0)[:, :, None], mesh.points[mesh.cells], np.nan).reshape(-1, mesh.dim)
        return diagnostics.corner_values(self.blocks, "position")

    # ---- files ---------------------------------------------------------------------------------------------------

    def path(self, name: str) -> Path:
        """Return the path of a file of the script, relative to the folder of the script."""
        return self.directory / name

    def to_read(self, name: str, what: str = "") -> Path:
        """Return the path of an input file of the script. It is then protected from being overwritten, unless this run
        wrote it.
        """
        path = self.path(name)
        real = os.path.realpath(path)
        if real not in self.made:
            self.inputs.setdefault(real, what or f"'{name}', which this run has read")
        return path

    def to_write(self, path: Path) -> Path:
        """Check the path of an output file. Raises CommandError if it is the script or an input file."""
        real = os.path.realpath(path)
        if real in self.inputs:
            raise CommandError(f"{path} would overwrite {self.inputs[real]}; choose another name")
        self.made.add(real)
        return path

    def result(self, name: str) -> Path:
        """Return the path of a result, relative to the output folder."""
        return self.outdir / name

    def folder(self) -> Path:
        """Return the output folder, created and locked on the first call. Collective."""
        if not self.folder_made:
            job = self.job or run_folder.Job()
            locked = run_folder.enter(self.outdir, self.comm, job, launch.version(), self.resumed, self.restored)
            self.folder_made = True
            if self.log is not None:
                self.log.place = self.outdir
            if not locked and self.log is not None:
                why = f"the file system of {self.outdir} has no locks"
                self.log.warn_once("lock", f"{why}: two runs that write there at the same time cannot be detected")
        return self.outdir


def joined(one: Mesh, other: Mesh) -> Mesh:
    """Join two bodies in one mesh: numbers of the second follow those of the first; groups and layers of equal names
    are united; no points are merged.
    """
    n_points, n_cells = len(one.points), len(one.cells)
    groups = {s: dict(of) for s, of in one.groups.items()}
    for set_name, of in other.groups.items():
        mine = groups.setdefault(set_name, {})
        for name, numbers in of.items():
            mine[name] = np.concatenate([mine.get(name, np.empty(0, np.int64)), numbers + n_cells])
    layers = dict(one.layers)
    for name, pairs in other.layers.items():
        layers[name] = np.concatenate([layers.get(name, np.empty((0, one.dim), np.int64)), pairs + n_points])
    sets, behind = one.crack_sets.max(initial=-1) + 1, np.append(np.full(one.macro.corners, n_points), n_cells)
    return Mesh.of(
        np.concatenate([one.points, other.points]),
        np.concatenate([one.cells, np.where(other.cells >= 0, other.cells + n_points, -1)]),
        groups,
        layers,
        np.concatenate([one.cracks, other.cracks + n_points]),
        np.concatenate([one.crack_sets, other.crack_sets + sets]),
        np.concatenate([one.macros, other.macros + behind]),
    )
