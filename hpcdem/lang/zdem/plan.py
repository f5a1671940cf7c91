"""Steps of every CYC and IMPLE of a script, and lines that cannot work, found without running it.

The statements are followed as the solver will follow them, knowing only what stands in the script. After RESTORE the
time step, the walls and the histories of the file are not known here; they count as unknown, not as missing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath

from hpcdem.core.fields import BOX_IDS
from hpcdem.core.outputs import OUTPUTS
from hpcdem.io.dat import is_frame
from hpcdem.lang.zdem.lexer import LARGEST_WHOLE
from hpcdem.lang.zdem.statement import Statement, find

BENDING = "bases that bend (FLEXURE)"

Velocity = tuple[float | None, float | None]


@dataclass(frozen=True)
class Run:
    """One CYC or IMPLE. index: of its statement; start: step it begins at; steps: number of steps; None where unknown.

    every: steps between outputs of each of OUTPUTS, 0 is off, None unknown; counted from step 0 for CYC, from the start
    of the command for IMPLE, which also writes a frame at its end.
    """

    index: int
    start: int | None
    steps: int | None
    every: Mapping[str, int | None]
    imple: bool = False

    def files(self, kind: str) -> int | None:
        """Files of one kind that the command writes; frames with the one at its start. None if unknown.

        CYC counts from step 0; where the start is unknown, after RESTORE or some IMPLE, this is `rough`.
        """
        every, steps = self.every[kind], self.steps
        frame = kind == "print"
        if every == 0:
            return frame + (frame and self.imple)
        if every is None or steps is None:
            return None
        if self.imple:
            return frame + steps // every + (frame and steps % every > 0)
        start = self.start or 0
        return frame + (start + steps) // every - start // every

    def rough(self, kind: str) -> bool:
        """Return whether `files` may be one too few because the step at the start is unknown."""
        every, steps = self.every[kind], self.steps
        return bool(every and steps and steps % every) and self.start is None and not self.imple


@dataclass
class _Known:
    """Facts known at a point of the script. complete: the calculation began in this script, nothing is hidden."""

    complete: bool = True
    step: int | None = 0
    dt: float | None = None
    has_step_rule: bool = False
    walls: dict[int, Velocity] = field(default_factory=dict)
    boxed: bool = False
    periodic: bool = False
    not_periodic: str = ""
    energy: bool = False
    pressure: bool = False
    histories: set[int] = field(default_factory=set)
    every: dict[str, int | None] = field(default_factory=lambda: dict.fromkeys(OUTPUTS, 0))


def follow(
    statements: Iterable[Statement], dt: float | None = None, walls: Mapping[int, Velocity] | None = None
) -> list[Run]:
    """List all runs of a script in order. Raises ScriptError at a line that refers to a missing object.

    dt [s] and walls (id -> velocity [m/s]): what a restored state is known to hold, if the script begins with RESTORE.
    """
    known, runs = _Known(), []
    for index, statement in enumerate(statements):
        match statement.command:
            case "RESTORE":
                known = _Known(False, _step_in_name(statement.get("file")), dt, True, dict(walls or {}))
                known.every = dict.fromkeys(OUTPUTS)
            case "LOAD" if _names_a_frame(statement):
                known = _Known(False, None, None, True, every=dict.fromkeys(OUTPUTS, 0))
            case "PROP" if statement.get("xp") or statement.get("yp"):
                known.pressure = True
                _no_energy_with_pressure(statement, known)
            case "HIST":
                known.histories.add(statement.get("id"))
            case "CYC" | "IMPLE":
                runs.append(_run(index, statement, known))
                steps = runs[-1].steps
                known.step = None if known.step is None or steps is None else known.step + steps
            case name if name in _FOLLOWED:
                _FOLLOWED[name](statement, known)
    return runs


def expected_steps(
    statements: Sequence[Statement], dt: float | None = None, walls: Mapping[int, Velocity] | None = None
) -> int | None:
    """Steps of the whole script, None if that depends on something the script does not say (frac, a restored state)."""
    steps = [run.steps for run in follow(statements, dt, walls)]
    return None if any(n is None for n in steps) else sum(n for n in steps if n is not None)


def _periodic(statement: Statement, known: _Known) -> None:
    if "x" not in statement.arguments:
        return  # whether the sides are periodic already may depend on a restored state
    if known.periodic:
        raise statement.error("the sides of this model are periodic already")
    if known.not_periodic:
        raise statement.error(f"{known.not_periodic} do not support periodic sides (PERIODIC)")
    known.periodic = True
    for side in ("left", "right"):
        known.walls.pop(BOX_IDS[side], None)


def _clump(statement: Statement, known: _Known) -> None:
    _not_periodic(statement, known, "clumps")


def _not_periodic(statement: Statement, known: _Known, what: str) -> None:
    """Note what excludes PERIODIC, or refuse it after PERIODIC."""
    if known.periodic:
        raise statement.error(f"{what} do not support periodic sides (PERIODIC)")
    known.not_periodic = known.not_periodic or what


def _names_a_frame(statement: Statement) -> bool:
    """Return whether LOAD reads a frame, which contains walls and a time step; False if the file does not exist yet."""
    path = find(Path(statement.file).parent, statement.get("file"))
    return path is not None and is_frame(path)


def _step_in_name(file: str) -> int | None:
    """ZDEM names restart files after the step: 0000046000.sav."""
    stem = PurePath(file).stem
    return int(stem) if stem.isascii() and stem.isdigit() and len(stem) == 10 else None


def _set(statement: Statement, known: _Known) -> None:
    for name, value in statement.arguments.items():
        if name in ("dt", "frac"):
            known.dt, known.has_step_rule = (value if name == "dt" else None), True
        elif name == "energy":
            known.energy = value > 0
            _no_energy_with_pressure(statement, known)
        elif name in OUTPUTS:
            known.every[name] = max(value, 0)


def _no_energy_with_pressure(statement: Statement, known: _Known) -> None:
    if known.energy and known.pressure:
        raise statement.error("the energy budget (SET energy) does not support xp and yp; use one of them")


def _box(statement: Statement, known: _Known) -> None:
    taken = [] if known.boxed else [i for i in BOX_IDS.values() if i in known.walls]
    if taken:
        raise statement.error(f"the sides of BOX are walls 100 to 103, and wall {taken[0]} exists already; renumber it")
    if known.periodic:
        raise statement.error("BOX has walls at its left and right side: it must precede PERIODIC, which removes them")
    known.boxed = True
    known.walls.update(dict.fromkeys(BOX_IDS.values(), (0.0, 0.0)))


def _wall(statement: Statement, known: _Known) -> None:
    wall = statement.get("id")
    if "nodes" in statement.arguments and known.boxed and wall in BOX_IDS.values():
        raise statement.error(f"wall {wall} is a side of BOX, and only BOX can move it; choose another id")
    if "nodes" in statement.arguments:
        known.walls[wall] = (0.0, 0.0)
    elif wall not in known.walls and known.complete:
        raise statement.error(f"there is no wall {wall} yet ({_walls(known)}); nodes make one")
    if "delete" in statement.arguments:
        if known.boxed and wall in BOX_IDS.values():
            raise statement.error(f"wall {wall} is a side of BOX, which cannot be deleted")
        known.walls.pop(wall, None)
        return
    x, y = known.walls.get(wall, (None, None))
    known.walls[wall] = (statement.get("xv", x), statement.get("yv", y))


def _flexure(statement: Statement, known: _Known) -> None:
    wall = statement.get("wall", (None,))[0]
    if wall is not None and known.boxed and wall in BOX_IDS.values():
        raise statement.error(f"wall {wall} is a side of BOX, which cannot bend; create a WALL above it")
    if wall is not None and wall not in known.walls and known.complete:
        raise statement.error(f"there is no wall {wall} ({_walls(known)})")
    if wall is not None and "off" not in statement.arguments and any(known.walls.get(wall, ())):
        raise statement.error(f"wall {wall} has a velocity; the plate alone can move it")
    if "off" not in statement.arguments:
        _not_periodic(statement, known, BENDING)
    elif known.not_periodic == BENDING:
        known.not_periodic = ""  # perhaps; the command itself knows


def _plot(statement: Statement, known: _Known) -> None:
    for axis in ("x", "y"):
        if known.complete and statement.get(axis) not in known.histories:
            raise statement.error(f"no history {statement.get(axis)} yet; create it with HIST")


_FOLLOWED: dict[str, Callable[[Statement, _Known], None]] = {
    "SET": _set, "BOX": _box, "PERIODIC": _periodic, "CLUMP": _clump, "WALL": _wall, "FLEXURE": _flexure, "PLOT": _plot,
}  # fmt: skip


def _run(index: int, statement: Statement, known: _Known) -> Run:
    if statement.command == "CYC":
        run = Run(index, known.step, statement.get("steps"), dict(known.every))
    else:
        run = _imple(index, statement, known)
    if not known.has_step_rule:
        raise statement.error("there is no time step yet; use SET DT or SET frac")
    return run


def _imple(index: int, statement: Statement, known: _Known) -> Run:
    wall = statement.get("id")
    if wall not in known.walls and known.complete:
        raise statement.error(f"there is no wall {wall} ({_walls(known)})")
    axis = 0 if "xmove" in statement.arguments else 1
    speed = known.walls.get(wall, (None, None))[axis]
    if speed == 0.0:
        raise statement.error(f"wall {wall} does not move; give it a velocity with WALL id {wall} {'xy'[axis]}v")

    def steps_for(distance: float) -> int | None:
        if speed is None or known.dt is None:
            return None
        per_step = abs(speed) * known.dt
        steps = abs(distance) / per_step if per_step > 0.0 else math.inf
        if steps > LARGEST_WHOLE:
            raise statement.error(f"{abs(distance):g} m would need {steps:g} steps")
        return math.floor(steps + 0.5)

    every: dict[str, int | None] = {}
    for name in OUTPUTS:
        distance = statement.get(name, 0.0)
        steps = steps_for(distance) if distance > 0.0 else 0
        every[name] = max(1, steps) if steps is not None and distance > 0.0 else steps
    return Run(index, known.step, steps_for(statement.get("xmove", statement.get("ymove"))), every, imple=True)


def _walls(known: _Known) -> str:
    return "walls so far: " + (", ".join(str(i) for i in sorted(known.walls)) or "none")
