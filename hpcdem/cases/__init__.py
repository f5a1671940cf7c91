"""Ready-made models: parameters in; a script, a model in the running session, or results out.

::

    from hpcdem.cases import UCS

    case = UCS(width=0.05, cohesion=12e6)
    case.script()          # the text of a script, complete and readable
    case.build()           # the model of that script in this run; continue with your own lines
    case.load()            # its loading; a small object of results
    case.run()             # both

What is executed is the text of the script, line by line, so the three cannot differ. `hpcdem case` writes the script.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from hpcdem.cases.base import Case

CASES = {
    "ucs": "UCS", "brazilian": "Brazilian", "tension": "DirectTension", "bend": "ThreePointBend", "slope": "Slope",
    "tunnel": "Tunnel", "stability": "SlopeStability", "wedge": "Wedge", "support": "Support", "pillar": "Pillar",
    "triaxial": "Triaxial", "tunnel-face": "TunnelFace",
    "creep": "Creep", "radial-flow": "RadialFlow", "dam-seepage": "DamSeepage", "dam-uplift": "DamUplift",
    "fault-injection": "FaultInjection", "penny-fracture": "PennyFracture",
    "hydraulic-fracture": "HydraulicFracture", "thermal-ring": "ThermalRing", "cracking-ring": "CrackingRing",
    "lauwerier": "Lauwerier", "doublet": "Doublet", "proppant-slot": "ProppantSlot",
    "proppant-bed": "ProppantBed", "proppant-closure": "ProppantClosure", "thermal-shock": "ThermalShock",
}  # fmt: skip
"""Classes by their names on the command line; the module of a class has its name, with _ for -."""
__all__ = ["CASES", "find", *CASES.values()]


def find(name: str) -> type[Case]:
    """Return the class of a case by its name on the command line. Raises KeyError for an unknown name."""
    return getattr(importlib.import_module(f"hpcdem.cases.{name.replace('-', '_')}"), CASES[name])


def __getattr__(name: str) -> Any:
    for case, made in CASES.items():
        if name == made:
            return find(case)
    raise AttributeError(f"module 'hpcdem.cases' has no attribute '{name}'; known: {', '.join(CASES.values())}")


def __dir__() -> list[str]:
    return sorted(__all__)
