"""What meshing needs and not every machine has."""

from __future__ import annotations

import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.pre.mesh import optional
from tests.conftest import absent


@pytest.fixture
def gmsh():
    """For tests that mesh with gmsh (and cut lines with shapely)."""
    try:
        optional.shapely()
        return optional.gmsh()
    except HpcdemError as error:
        absent("gmsh", str(error))


@pytest.fixture
def shapely():
    """For tests of areas and fracture networks."""
    try:
        return optional.shapely()
    except HpcdemError as error:
        absent("gmsh", str(error))


@pytest.fixture
def meshio():
    """For tests of the import."""
    try:
        return optional.meshio()
    except HpcdemError as error:
        absent("gmsh", str(error))


@pytest.fixture
def ezdxf():
    """For tests of drawings."""
    try:
        return optional.ezdxf()
    except HpcdemError as error:
        absent("gmsh", str(error))
