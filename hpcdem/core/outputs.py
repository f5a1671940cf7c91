"""Files that a run of particles writes at intervals: the one table of kinds for the language, its checks and the loop.

A new kind is a row here, a field of its name in `physics.dem.settings.Settings`, and a method `write_NAME` of
`commands.dem.output.Snapshot`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Output:
    """what: description; files: their names, <step> has ten digits, and a frame before the first step of a command ends
    in _ini; size: bytes per particle, measured on a settled and bonded bed of 1255 particles (about 2.5 contacts each);
    sources: of the option of SET and of that of IMPLE, see `lang.zdem.table`."""

    what: str
    files: tuple[str, ...]
    size: int
    sources: tuple[str, str] = ("X", "X")


OUTPUTS: Mapping[str, Output] = {
    "save": Output("a restart file .sav", ("<step>.sav",), 260, ("R", "R")),
    "print": Output("a frame .dat and .vtkhdf", ("all_<step>.dat", "all_<step>.vtkhdf"), 2900, ("R", "R")),
    "ps": Output("a vector picture", ("all_<step>.ps",), 40, ("R", "R")),
    "vtk": Output("a .vtk file", ("all_<step>.vtk", "wall_<step>.vtk"), 190, ("R", "S")),
}
