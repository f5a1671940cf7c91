"""Packages that not every installation has, by the command of the language that needs them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from hpcdem.pre.mesh import optional

NEEDED: Mapping[str, Callable[[], object]] = {
    "mesh create": optional.gmsh,
    "mesh import": optional.meshio,
    "geometry import": optional.ezdxf,
}
"""What loads each; HpcdemError, with the way to get it, where it is missing."""
