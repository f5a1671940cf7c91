"""Laws of pairs of discs that users write, in a Python file of their own.

    from hpcdem import PairProperty, pair_law

    @pair_law(properties=[PairProperty("pull", "N", "largest tension", mix="least")])
    def sticky(u, fs, sliding, dt, kn, ks, fric, pull):
        fn = kn * u - pull
        limit = fric * kn * u
        return fn, min(max(fs + ks * sliding * dt, -limit), limit)

A law is compiled by numba. It is called once per step for each pair of discs that touch and returns their normal force
[N], positive in compression, their shear force [N], and then its state variables in the order of their declaration. Its
arguments are numbers by these names:

- u: overlap [m], not negative; fs: its shear force after the step before, 0 when discs begin to touch;
- its state variables, as they are after the step before; initial values when discs begin to touch;
- sliding: speed that strains the shear spring [m/s]; approach: speed at which the overlap grows [m/s]; two_rt: 4 Ra Rb
  / (Ra + Rb) [m]; dt: time step [s];
- kn, ks, fric, shear, poiss, and its own properties, each of the two discs mixed: kn and ks as springs in series, the
  smaller fric, the mean of shear and poiss, its own as they say.

`stiffness`, a number [N/m] or a function of these properties, is what dFn/du and dFs/ds are never above; without it the
kn and ks of the pair. The time step follows from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.dem.materials import OWN
from hpcdem.physics.user_files import (
    MARK,
    Declared,
    StateVariable,
    UnknownLaw,
    Wrong,
    agreed,
    check_what_returns,
    checked,
    law_of,
    made_of,
    numba_message,
    stiffness_of,
)
from hpcdem.runtime import kept

if TYPE_CHECKING:
    from hpcdem.physics.model import Model

FORCES = ("fn", "fs")
OVERLAP = 1e-9
"""Of 2 Rt, for the slope of a law where discs begin to touch."""


def _series(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Two springs in series, as laws.series_stiffness rounds it."""
    with np.errstate(invalid="ignore"):
        return np.where((a <= 0.0) | (b <= 0.0), 0.0, a * b / (a + b))


MIXES: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "mean": lambda a, b: 0.5 * (a + b),
    "series": _series,
    "least": np.minimum,
    "greatest": np.maximum,
}
"""How the properties of two discs become one of their contact."""
BASE = {"kn": "series", "ks": "series", "fric": "least", "shear": "mean", "poiss": "mean"}
"""Properties that discs have anyway, and their mixes."""


@dataclass(frozen=True)
class PairProperty:
    """A property that a law declares: bounds include low and high themselves, without a default it must be given; mix:
    one of MIXES."""

    name: str
    unit: str
    doc: str = ""
    default: float | None = None
    low: float = 0.0
    high: float = math.inf
    mix: str = "mean"


class _Declared(Declared):
    """A law of pairs."""


@dataclass(frozen=True)
class PairLaw:
    """A law of a file. name: FILE:FUNCTION and a digest of its text; place: its file and line, for messages; columns:
    of the table of properties; kernel, loop, loop_threaded: compiled, see kernels/user_pairs.py."""

    name: str
    place: str
    declared: Declared
    arguments: tuple[str, ...]
    columns: tuple[str, ...]
    kernel: Any
    loop: Any
    loop_threaded: Any

    @property
    def title(self) -> str:
        """FILE:FUNCTION."""
        return self.name.partition(MARK)[0]

    @property
    def properties(self) -> tuple[PairProperty, ...]:
        """Those of its own."""
        return self.declared.properties

    @property
    def memory(self) -> int:
        """Columns of what a contact remembers."""
        return 1 + len(self.declared.state)

    @property
    def initial(self) -> np.ndarray:
        """State variables of a contact that begins."""
        return np.array([state.initial for state in self.declared.state])

    def tables(self, materials: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of all pairs of materials: properties (n*n, columns), and bounds (n, n, 2) of dFn/du and dFs/ds [N/m].
        CommandError if the law makes no sense with them."""
        n = len(materials)
        own = {p.name: (OWN[k], p.mix) for k, p in enumerate(self.properties)}
        columns = {name: (name, mix) for name, mix in BASE.items()} | own
        mixed = {
            name: MIXES[mix](materials[column][:, None], materials[column][None, :]).reshape(-1)
            for name, (column, mix) in columns.items()
        }
        both = np.flatnonzero((materials["law"][:, None] > 0.0) & (materials["law"][None, :] > 0.0))
        bounds = np.stack([mixed["kn"], mixed["ks"]], axis=1)
        if len(both):
            stiff = stiffness_of(self.declared, self.place, {k: value[both] for k, value in mixed.items()}, "N/m")
            if stiff is not None:
                bounds[both] = stiff[:, None]
        self._look(mixed, bounds, both)
        return np.ascontiguousarray(np.array([mixed[name] for name in self.columns]).T), bounds.reshape(n, n, 2)

    def _look(self, mixed: Mapping[str, np.ndarray], bounds: np.ndarray, which: np.ndarray) -> None:
        """CommandError unless the law is finite where discs begin to touch, and no stiffer than it says. which: rows of
        the tables that have it."""
        states = {state.name: state.initial for state in self.declared.state}
        for q in which:
            values = {name: float(value[q]) for name, value in mixed.items()} | states
            values |= {"fs": 0.0, "two_rt": 1.0, "sliding": 0.0, "approach": 0.0, "dt": 0.0}
            told = ", ".join(f"{name} {values[name]:g}" for name in self.arguments if name in mixed) or "no properties"
            found = [
                self.kernel(*(overlap if name == "u" else values[name] for name in self.arguments))
                for overlap in (0.0, OVERLAP)
            ]
            for name, value in zip((*FORCES, *states), found[0]):
                if not math.isfinite(value):
                    raise CommandError(f"{self.place} gives {name} {value:g} where discs begin to touch, with {told}")
            slope = (found[1][0] - found[0][0]) / OVERLAP
            if not slope <= bounds[q, 0] * (1.0 + 1e-6) + 1e-12 * abs(found[0][0]) / OVERLAP:
                raise CommandError(
                    f"{self.place}: dFn/du is {slope:g} N/m where discs begin to touch, with {told}, above its "
                    f"stiffness {bounds[q, 0]:g} N/m, by which the time step is found: stiffness= of pair_law says more"
                )


LAWS: dict[str, PairLaw] = {}
"""Those that were named in this process."""


def pair_law(
    properties: Sequence[PairProperty] = (),
    state: Sequence[StateVariable] = (),
    stiffness: float | Callable[..., float] | None = None,
) -> Callable[[Callable[..., Any]], Declared]:
    """Declares a function as law of pairs of discs: properties of its own, state variables of contacts, and what it is
    never stiffer than [N/m], a number or a function of properties (by their names)."""
    return lambda function: _Declared(
        getattr(function, "py_func", function), tuple(properties), tuple(state), stiffness
    )


def load(sim: Model, path: Path, law: str) -> PairLaw:
    """The law 'file.py:function' of a file, checked and compiled for the threads of this run, on all ranks from the
    text that rank 0 reads. CommandError with file and line. Collective."""

    def take(text: str, path: str, name: str, function: str) -> PairLaw:
        found = LAWS.get(name) or _made(text, path, name, function)
        _compile(found, sim.threads)
        LAWS[name] = found
        return found

    return agreed(sim, path, law, "law", take)


def _made(text: str, path: str, name: str, function: str) -> PairLaw:
    """The law of a text. Wrong."""
    declared = law_of(text, path, name, function, _Declared, "pair_law")
    from numba import njit

    from hpcdem.physics.dem.kernels import user_pairs

    line, own = declared.line, declared.properties
    arguments = checked(declared, PairProperty, tuple(BASE), user_pairs.GIVEN, ("u", "fs"))
    if len(own) > len(OWN):
        raise Wrong(line, f"the law declares {len(own)} properties; at most {len(OWN)} are possible")
    for one in own:
        if one.mix not in MIXES:
            raise Wrong(line, f"property '{one.name}': mix is '{one.mix}', expected {', '.join(MIXES)}")
        if one.default is not None and not one.low <= one.default <= one.high:
            raise Wrong(line, f"property '{one.name}': its default {one.default:g} is out of its bounds")
    kernel = njit(error_model="numpy", nogil=True)(declared.function)
    states = [state.name for state in declared.state]
    columns = [name for name in (*BASE, *(p.name for p in own)) if name in arguments]
    columns += columns[:1] * (-len(columns) % 4) or ["kn"] * (4 if not columns else 0)
    one_thread, several = user_pairs.loops(kernel, arguments, states, columns)
    values = made_of(kernel, path)
    if values is not None:
        place = kept.folder(name, values, repr((arguments, states, columns)))
        kept.keep(one_thread, place, "pairs")
        kept.keep(several, place, "pairs_threaded")
    check_what_returns(kernel, len(arguments), (*FORCES, *states), path, line)
    where = f"{Path(path).name}:{line}: law '{function}'"
    return PairLaw(name, where, declared, tuple(arguments), tuple(columns), kernel, one_thread, several)


def _compile(law: PairLaw, threads: int) -> None:
    """The force loop, with arguments of the types that it will have."""
    from numba.core.errors import NumbaError

    places, slots, rows = np.zeros(1, np.int64), np.zeros(0, np.int32), np.zeros((0, 8))
    nothing = np.zeros(0)
    try:
        (law.loop if threads == 1 else law.loop_threaded)(
            0, rows, rows.view(np.int64), places, places, places, places, places, places, slots, slots, nothing, slots,
            nothing, np.zeros((0, 4)), np.zeros((1, 4)), np.zeros((1, 4)), 1, 0.0, True, rows,
            np.zeros((1, len(law.columns))), np.zeros((0, law.memory)), law.initial, 0.0,
        )  # fmt: skip
    except NumbaError as error:
        raise Wrong(law.declared.line, numba_message(error)) from None


def restored(name: str | None) -> PairLaw | None:
    """The law that a checkpoint names. UnknownLaw unless it was named in this run, with the same text."""
    if name is None or name in LAWS:
        return None if name is None else LAWS[name]
    title = name.partition(MARK)[0]
    other = any(law.title == title for law in LAWS.values())
    raise UnknownLaw(
        f"the checkpoint has discs with the law {title}, "
        + (
            f"of another text of {title.rpartition(':')[0]}: with a changed law a run does not go on"
            if other
            else f"which this script has not named: PROP law {title} in any line of it does"
        )
    )


def given(law: PairLaw, parameters: Mapping[str, float], whole: bool) -> dict[str, float]:
    """Columns of materials for these properties of a law; whole: defaults too. CommandError."""
    names = {p.name: k for k, p in enumerate(law.properties)}
    strange = [name for name in parameters if name not in names]
    if strange:
        raise CommandError(f"the law {law.title} has no property '{strange[0]}'; it has {', '.join(names) or 'none'}")
    out = {}
    for name, k in names.items():
        one = law.properties[k]
        value = parameters.get(name, one.default if whole else None)
        if value is None:
            if whole:
                raise CommandError(f"the law {law.title} needs {name} [{one.unit}]: parameter {name} <value>")
            continue
        if not (math.isfinite(value) and one.low <= value <= one.high):
            raise CommandError(f"{name} is {value:g}, expected a number from {one.low:g} to {one.high:g} {one.unit}")
        out[OWN[k]] = float(value)
    return out
