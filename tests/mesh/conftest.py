"""What meshing needs and not every machine has."""

from __future__ import annotations

import signal

import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.pre.mesh import optional
from tests.conftest import absent


@pytest.fixture
def gmsh():
    """For tests that mesh with gmsh (and cut lines with shapely). SIGPIPE, which gmsh takes, is given back."""
    try:
        optional.shapely()
        yield optional.gmsh()
    except HpcdemError as error:
        absent("gmsh", str(error))
    signal.signal(signal.SIGPIPE, signal.getsignal(signal.SIGPIPE))


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
