"""What the tasks look at: versions, digests, memory, contacts."""

from __future__ import annotations

import hashlib
import platform
import resource
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import hpcdem


def no_first_frame(sim: hpcdem.Simulation) -> None:
    """CYC begins with a frame; for a bed of a million it takes longer than the measurement."""
    sim.engine.last_frame = (sim.steps, True)


def contacts(sim: hpcdem.Simulation) -> int:
    """Touching pairs of the whole model."""
    from hpcdem.commands.dem import output

    return int(output.HISTORIES["contacts"][1](sim.engine))


def digest(sim: hpcdem.Simulation) -> str:
    """The same if the positions are, to the last bit, whatever the layout."""
    return hashlib.sha256(b"".join(c.tobytes() for c in sim.gather("x", "y"))).hexdigest()[:16]


def versions() -> dict[str, str]:
    """What it was computed with."""
    import numba
    import numpy

    from hpcdem.runtime import launch

    cpu = platform.processor() or platform.machine()
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        cpu = next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), cpu)
    except OSError:
        pass
    try:
        mpi = launch.mpi_library()
    except ImportError:
        mpi = "none"
    return {
        "hpcdem": launch.version(), "python": platform.python_version(), "numpy": numpy.__version__,
        "numba": numba.__version__, "mpi": mpi, "cpu": cpu,
    }  # fmt: skip


def solver_arrays(sim: hpcdem.Simulation) -> int:
    """Bytes of all numpy arrays that the engine holds, those inside its parts too; views are counted once."""
    return sum(array.nbytes for _, array in arrays(sim.engine))


def arrays(whole: Any, name: str = "") -> list[tuple[str, Any]]:
    """All numpy arrays in an object of hpcdem and in its parts, each once, with where they are found."""
    import numpy as np

    seen: set[int] = set()
    found: list[tuple[str, Any]] = []

    def look(at: str, thing: Any) -> None:
        if id(thing) in seen:
            return
        seen.add(id(thing))
        if isinstance(thing, np.ndarray):
            if isinstance(thing.base, np.ndarray):
                look(at, thing.base)
            else:
                found.append((at, thing))
        elif isinstance(thing, dict):
            for key, part in thing.items():
                look(f"{at}.{key}", part)
        elif isinstance(thing, list | tuple):
            names = getattr(thing, "_fields", range(len(thing)))
            for key, part in zip(names, thing):
                look(f"{at}.{key}", part)
        elif type(thing).__module__.startswith("hpcdem"):
            slots = {key: getattr(thing, key, None) for kind in type(thing).__mro__ for key in _slots(kind)}
            for key, part in {**slots, **getattr(thing, "__dict__", {})}.items():
                look(f"{at}.{key}", part)

    look(name, whole)
    return found


def _slots(kind: type) -> tuple[str, ...]:
    slots = kind.__dict__.get("__slots__", ())
    return (slots,) if isinstance(slots, str) else tuple(slots)


def peak() -> int:
    """Most memory of this process since `forget_peak` [B]."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) * 1024
    except (OSError, StopIteration):
        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def forget_peak() -> None:
    """From here on `peak` counts again, where the kernel allows it."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        pass
