"""Packages that not every installation has, by the command of the language that needs them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from hpcdem.pre.mesh import optional

EXTRA = optional.EXTRA
"""Extra of the package that installs all of them."""
NEEDED: Mapping[str, Callable[[str], tuple[optional.Load, ...]]] = {
    "mesh create": lambda file: (optional.gmsh, optional.shapely),
    **{
        f"element create {name}": lambda file: (optional.gmsh, optional.shapely)
        for name in ("geometry", "geometry-patch", "geometry-boundary", "hollow-circle")
    },
    "mesh import": optional.of_mesh,
    "geometry import": optional.of_drawing,
    "geometry export": optional.of_drawing,
}
"""Loaders of the packages for a file of this name; each raises HpcdemError with the install command if one is
missing."""
