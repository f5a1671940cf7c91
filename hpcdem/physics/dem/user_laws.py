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

`stiffness`, a number [N/m] or a function of these properties, is an upper bound of dFn/du and dFs/ds (default: the kn
and ks of the pair). The time step follows from it. `energy`, a function of u, fs, two_rt, state variables and
properties, returns what a contact stores [J] in its normal and in its shear direction; without it no account of energy
can be kept.

A model may have several laws (`ModelLaws`). Pairs of discs with one law follow it; a law for pairs of discs with two
different laws is assigned separately.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcdem.core.errors import CommandError
from hpcdem.physics.dem.materials import MOST_LAWS, OWN
from hpcdem.physics.user_files import (
    MARK,
    Declared,
    StateVariable,
    UnknownLaw,
    Wrong,
    agreed,
    check_what_returns,
    checked,
    in_turn,
    law_of,
    made_of,
    report,
    stiffness_of,
)
from hpcdem.runtime import kept

if TYPE_CHECKING:
    from hpcdem.engine.model import Model
    from hpcdem.physics.dem.kernels import user_pairs

FORCES = ("fn", "fs")
STORES = ("normal", "shear")
"""What an energy function returns."""
STORING = ("u", "fs", "two_rt")
"""Its arguments, besides state variables and properties."""
LINEAR, HERTZ = "linear", "hertz"
"""Built-in laws, by name."""
BUILT_IN = {LINEAR: 0, HERTZ: -1}
"""Their numbers; those of the user are 1, 2, ..."""
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


@dataclass(frozen=True)
class _Declared(Declared):
    """A law of pairs; energy: what a contact stores."""

    energy: Callable[..., Any] | None = None


@dataclass(frozen=True)
class PairLaw:
    """A law of a file. name: FILE:FUNCTION and a digest of its text; place: its file and line, for messages; kept:
    what names the folder of what is made of it, None if that must not be kept; kernel: compiled, and what it takes, see
    kernels/user_pairs.py."""

    name: str
    place: str
    declared: _Declared
    kept: tuple[str, ...] | None
    kernel: user_pairs.Kernel

    @property
    def title(self) -> str:
        """FILE:FUNCTION."""
        return self.name.partition(MARK)[0]

    @property
    def properties(self) -> tuple[PairProperty, ...]:
        """Properties that the law declares."""
        return self.declared.properties

    @property
    def initial(self) -> list[float]:
        """State variables of a contact that begins."""
        return [state.initial for state in self.declared.state]

    def of_pairs(self, mixed: dict[str, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
        """Return for pairs of materials with these properties (m,) each: the table (m, columns) of the kernel, and
        bounds (m, 2) of dFn/du and dFs/ds [N/m]. CommandError if the law makes no sense with them."""
        bounds = np.stack([mixed["kn"], mixed["ks"]], axis=1)
        stiff = stiffness_of(self.declared, self.place, mixed, "N/m")
        if stiff is not None:
            bounds[:] = stiff[:, None]
        self._check_slopes(mixed, bounds)
        return np.array([mixed[name] for name in self.kernel.columns]).T, bounds

    def _check_slopes(self, mixed: Mapping[str, np.ndarray], bounds: np.ndarray) -> None:
        """CommandError unless the law is finite where discs begin to touch, and no stiffer than it says."""
        states = {state.name: state.initial for state in self.declared.state}
        names = self.kernel.arguments
        for q in range(len(bounds)):
            values = {name: float(value[q]) for name, value in mixed.items()} | states
            values |= {"fs": 0.0, "two_rt": 1.0, "sliding": 0.0, "approach": 0.0, "dt": 0.0}
            described = ", ".join(f"{name} {values[name]:g}" for name in names if name in mixed) or "no properties"
            found = [
                self.kernel.law(*(overlap if name == "u" else values[name] for name in names))
                for overlap in (0.0, OVERLAP)
            ]
            for name, value in zip((*FORCES, *states), found[0]):
                if not math.isfinite(value):
                    raise CommandError(
                        f"{self.place} gives {name} {value:g} where discs begin to touch, with {described}"
                    )
            slope = (found[1][0] - found[0][0]) / OVERLAP
            if not slope <= bounds[q, 0] * (1.0 + 1e-6) + 1e-12 * abs(found[0][0]) / OVERLAP:
                raise CommandError(
                    f"{self.place}: dFn/du is {slope:g} N/m where discs begin to touch, with {described}, above its "
                    f"stiffness {bounds[q, 0]:g} N/m, which sets the time step: give pair_law a larger stiffness="
                )


class ModelLaws:
    """The user laws of a model. Their numbers, in the column law of materials, are 1, 2, ... in the order in
    which they were given to discs, and never change their meaning.

    between: for two numbers, the lower first, of discs that touch: the number of the law of such pairs, and values of
    the properties that it declares.
    """

    def __init__(self) -> None:
        self.laws: tuple[PairLaw, ...] = ()
        self.between: dict[tuple[int, int], tuple[int, tuple[float, ...]]] = {}
        self.loops: user_pairs.Loops | None = None

    def __bool__(self) -> bool:
        return bool(self.laws)

    @property
    def titles(self) -> str:
        """Titles of all laws, for messages."""
        return ", ".join(law.title for law in self.laws)

    def unaccounted(self) -> str:
        """Return the title of the first law that declares no stored energy; empty if all declare it."""
        return next((law.title for law in self.laws if law.declared.energy is None), "")

    def number(self, name: str) -> int:
        """Number of the law with a full name; 0 if the model does not have it."""
        return next((k for k, law in enumerate(self.laws, 1) if law.name == name), 0)

    def named(self, title: str) -> int:
        """The number of a law, or built-in one, FILE:FUNCTION. CommandError if the model does not have it."""
        if title in BUILT_IN:
            return BUILT_IN[title]
        short = f"{Path(title.rpartition(':')[0]).name}:{title.rpartition(':')[2]}"
        found = [k for k, law in enumerate(self.laws, 1) if law.title == short]
        if found:
            return found[-1]
        known = ", ".join((*BUILT_IN, *(one.title for one in self.laws)))
        raise CommandError(f"no disc has the law {title}; available: {known}")

    def title_of(self, material: Any) -> str:
        """The law of discs of a row of materials."""
        if material["law"] > 0.0:
            return self.laws[int(material["law"]) - 1].title
        return HERTZ if material["hertz"] else LINEAR

    def add(self, law: PairLaw) -> int:
        """Return the number of a law, a new one if necessary."""
        if not self.number(law.name):
            if len(self.laws) == MOST_LAWS:
                raise CommandError(f"a model can have at most {MOST_LAWS} user laws, and has that many")
            self.take((*self.laws, law))
        return self.number(law.name)

    def take(self, laws: tuple[PairLaw, ...]) -> None:
        """These laws; their loops are compiled by `compile_loops`."""
        self.laws, self.loops = laws, _loops_of(laws) if laws else None

    def compile_loops(self, sim: Model) -> None:
        """Compile the force loop of these laws for the threads of the model, unless compiled already. Collective."""
        done = (tuple(law.name for law in self.laws), sim.threads)
        if self.loops is None or not sim.comm.any(done not in _COMPILED):
            return
        loops = self.loops
        file, _, functions = self.titles.partition(":")
        report(sim, "loop of law", file, functions, in_turn(sim.comm, lambda: _compile(loops, sim.threads)))
        _COMPILED.add(done)

    @property
    def memory(self) -> int:
        """Columns of what a contact remembers."""
        return 1 + max(len(law.declared.state) for law in self.laws) if self.laws else 0

    @property
    def initial(self) -> np.ndarray:
        """State variables of contacts that begin (laws, states)."""
        out = np.zeros((len(self.laws), self.memory - 1))
        for row, law in zip(out, self.laws):
            row[: len(law.initial)] = law.initial
        return out

    def mixed(self, materials: np.ndarray) -> bool:
        """Return whether some pairs of materials have no common law."""
        return bool(np.isnan(self.which(materials)).any())

    def which(self, materials: np.ndarray) -> np.ndarray:
        """Numbers (n, n) of the laws of all pairs of materials; NaN if they have none in common."""
        own = np.where(materials["law"] > 0.0, materials["law"], -materials["hertz"])
        out = np.where(own[:, None] == own[None, :], own[:, None], math.nan)
        for (a, b), (number, _) in self.between.items():
            for first, second in ((a, b), (b, a)):
                out[np.ix_(own == first, own == second)] = number
        return out

    def tables(self, materials: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return for all pairs of materials: properties (n*n, columns), of its law each, and bounds (n, n, 2) of dFn/du
        and dFs/ds [N/m]. CommandError if a law makes no sense with them."""
        n, which = len(materials), self.which(materials).reshape(-1)
        table = np.zeros((n * n, max(len(law.kernel.columns) for law in self.laws)))
        bounds = np.zeros((n * n, 2))
        own = materials["law"]
        same = (own[:, None] == own[None, :]).reshape(-1)
        base = {name: _mixed(materials, name, mix) for name, mix in BASE.items()}
        for k, law in enumerate(self.laws, 1):
            sets = [(same, {p.name: _mixed(materials, OWN[c], p.mix) for c, p in enumerate(law.properties)})]
            for (a, b), (number, values) in self.between.items():
                if number == k:
                    given = {p.name: np.full(n * n, value) for p, value in zip(law.properties, values)}
                    sets.append((self._meet(materials, a, b), given))
            for rows, of_law in sets:
                at = np.flatnonzero(rows & (which == k))
                if len(at):
                    mixed = {name: value[at] for name, value in (base | of_law).items()}
                    table[at, : len(law.kernel.columns)], bounds[at] = law.of_pairs(mixed)
        return table, bounds.reshape(n, n, 2)

    @staticmethod
    def _meet(materials: np.ndarray, a: int, b: int) -> np.ndarray:
        """Flags (n*n,) of pairs of materials with the laws a and b."""
        own = np.where(materials["law"] > 0.0, materials["law"], -materials["hertz"])
        one = (own[:, None] == a) & (own[None, :] == b)
        return (one | one.T).reshape(-1)

    def state(self) -> dict[str, Any]:
        """The laws as JSON values."""
        between = [[*pair, number, list(values)] for pair, (number, values) in self.between.items()]
        return {"names": [law.name for law in self.laws], "between": between}

    @staticmethod
    def restored(state: dict[str, Any]) -> ModelLaws:
        """Restore from the state of a checkpoint. UnknownLaw unless its laws were named in this run."""
        found = state.get("pair_laws") or {"names": [state["pair_law"]] if state.get("pair_law") else []}
        out = ModelLaws()
        out.take(tuple(_known(name) for name in found["names"]))
        for a, b, number, values in found.get("between", ()):
            out.between[a, b] = number, tuple(values)
        return out


def _mixed(materials: np.ndarray, column: str, mix: str) -> np.ndarray:
    """A property of all pairs of materials (n*n,)."""
    return MIXES[mix](materials[column][:, None], materials[column][None, :]).reshape(-1)


LAWS: dict[str, PairLaw] = {}
"""Those that were named in this process."""
TOGETHER: dict[tuple[str, ...], user_pairs.Loops] = {}
"""The loops of the laws of a model, by their names."""
_COMPILED: set[tuple[tuple[str, ...], int]] = set()
"""Of which laws the force loop is compiled in this process, for so many threads."""


def pair_law(
    properties: Sequence[PairProperty] = (),
    state: Sequence[StateVariable] = (),
    stiffness: float | Callable[..., float] | None = None,
    energy: Callable[..., Any] | None = None,
) -> Callable[[Callable[..., Any]], Declared]:
    """Declares a function as law of pairs of discs: properties of its own, state variables of contacts, what it is
    never stiffer than [N/m], a number or a function of properties (by their names), and a function of what a contact
    stores [J]."""
    return lambda function: _Declared(
        getattr(function, "py_func", function), tuple(properties), tuple(state), stiffness,
        getattr(energy, "py_func", energy),
    )  # fmt: skip


def load(sim: Model, path: Path, law: str) -> PairLaw:
    """The law 'file.py:function' of a file, checked, on all ranks from the text that rank 0 reads. CommandError with
    file and line. Collective."""

    def take(text: str, path: str, name: str, function: str) -> PairLaw:
        if name not in LAWS:
            LAWS[name] = _made(text, path, name, function)
        return LAWS[name]

    return agreed(sim, path, law, "law", take)


def _made(text: str, path: str, name: str, function: str) -> PairLaw:
    """The law of a text. Wrong."""
    declared = law_of(text, path, name, function, _Declared, "pair_law")
    from numba import njit

    from hpcdem.physics.dem.kernels import user_pairs

    line, own = declared.line, declared.properties
    arguments = checked(declared, PairProperty, tuple(BASE), user_pairs.GIVEN, ("u", "fs"))
    if len(own) > len(OWN):
        raise Wrong(line, f"the law declares {len(own)} properties; at most {len(OWN)} are allowed")
    for one in own:
        if one.mix not in MIXES:
            raise Wrong(line, f"property '{one.name}': mix is '{one.mix}', expected {', '.join(MIXES)}")
        if one.default is not None and not one.low <= one.default <= one.high:
            raise Wrong(line, f"property '{one.name}': its default {one.default:g} is out of its bounds")
    states = tuple(state.name for state in declared.state)
    columns = [name for name in (*BASE, *(p.name for p in own)) if name in arguments]
    energy, of_energy = None, []
    if declared.energy is not None:
        of_energy = _of_energy(declared, columns, states)
        energy = njit(error_model="numpy", nogil=True)(declared.energy)
        columns += [name for name in of_energy if name not in (*columns, *states, *STORING)]
    columns += columns[:1] * (-len(columns) % 4) or ["kn"] * (4 if not columns else 0)
    law = njit(error_model="numpy", nogil=True)(declared.function)
    kernel = user_pairs.Kernel(law, tuple(arguments), states, tuple(columns), energy, tuple(of_energy))
    values = made_of(law, path)
    stored = made_of(energy, path) if energy is not None else ""
    kept_as = None if values is None or stored is None else (name, values, stored, repr(kernel[1:4]), repr(of_energy))
    check_what_returns(law, len(arguments), (*FORCES, *states), path, line)
    if energy is not None:
        check_what_returns(energy, len(of_energy), STORES, path, _line(declared.energy), "energy")
    return PairLaw(name, f"{Path(path).name}:{line}: law '{function}'", declared, kept_as, kernel)


def _of_energy(declared: _Declared, columns: Sequence[str], states: Sequence[str]) -> list[str]:
    """The names of the arguments of an energy function. Wrong."""
    function: Any = declared.energy
    code = getattr(function, "__code__", None)
    if code is None:
        raise Wrong(declared.line, f"energy must be a function, got {function!r}")
    known = (*STORING, *states, *BASE, *(p.name for p in declared.properties))
    takes = list(inspect.signature(function).parameters)
    for name in takes:
        if name not in known:
            raise Wrong(
                _line(function), f"'{name}' is not an argument of an energy function; available: {', '.join(known)}"
            )
    return takes


def _line(function: Any) -> int:
    return int(function.__code__.co_firstlineno)


def _loops_of(laws: tuple[PairLaw, ...]) -> user_pairs.Loops:
    """The loops of laws that stand in one model; what is compiled of them is taken from the store, or goes into it."""
    from hpcdem.physics.dem.kernels import user_pairs

    names = tuple(law.name for law in laws)
    if names not in TOGETHER:
        loops = TOGETHER[names] = user_pairs.loops([law.kernel for law in laws])
        made = [law.kept for law in laws]
        if None not in made:
            place = kept.folder(*sum((m or () for m in made), ()))
            one, several = loops.forces.one, loops.forces.several
            for what, kernel in zip(("one", "several", "stored", "lost"), (one, several, loops.stored, loops.lost)):
                kept.keep(kernel, place, f"pairs_{what}")
    return TOGETHER[names]


def _compile(loops: user_pairs.Loops, threads: int) -> None:
    """The force loop, with arguments of the types that it will have."""
    places, slots, rows = np.zeros(1, np.int64), np.zeros(0, np.int32), np.zeros((0, 8))
    nothing = np.zeros(0)
    loops.forces.on(threads)(
        0, rows, rows.view(np.int64), places, places, places, places, places, places, slots, slots, nothing, slots,
        nothing, np.zeros((0, 4)), np.zeros((1, 4)), np.zeros((1, 4)), 1, 0.0, True, rows,
        np.zeros((1, 4)), np.zeros((0, 1)), np.zeros((1, 0)), 0.0,
    )  # fmt: skip


def _known(name: str) -> PairLaw:
    """The law that a checkpoint names. UnknownLaw unless it was named in this run, with the same text."""
    if name in LAWS:
        return LAWS[name]
    title = name.partition(MARK)[0]
    other = any(law.title == title for law in LAWS.values())
    raise UnknownLaw(
        f"the checkpoint has discs with the law {title}, "
        + (
            f"but {title.rpartition(':')[0]} has changed since: a run cannot resume with a changed law"
            if other
            else f"which this script does not use: add a line PROP law {title}"
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
