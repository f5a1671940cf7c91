"""Packages that only meshing needs, imported when used, with a sentence on what to do where one is missing."""

from __future__ import annotations

import contextlib
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

from hpcdem.core.errors import HpcdemError
from hpcdem.core.section_files import IMAGES

ROOT = Path(__file__).resolve().parents[3]
EXTRA = f"{sys.executable} -m pip install " + (
    f"-e '{ROOT}[mesh]'" if (ROOT / "pyproject.toml").is_file() else "'hpcdem[mesh]'"
)
"""The command that adds what is missing, for a source tree or for an installed package."""
Load = Callable[[], ModuleType]
GMSH_LIBRARIES = "libglu1-mesa libxrender1 libxcursor1 libxft2 libxinerama1"


def shapely() -> ModuleType:
    """The package shapely (2.0 or newer): which lines cross, what lies inside."""

    def load() -> ModuleType:
        import shapely

        return shapely

    module = _wanted("shapely", "Geometry in the plane", load)
    if int(module.__version__.split(".")[0]) < 2:
        raise HpcdemError(f"meshing needs shapely 2.0 or newer, here is {module.__version__}: {EXTRA}")
    return module


def gmsh() -> ModuleType:
    """The package gmsh."""

    def load() -> ModuleType:
        import gmsh

        return gmsh

    module = _wanted("gmsh", "Meshing of arbitrary outlines", load)
    if not hasattr(getattr(module, "lib", None), "gmshInitialize"):
        raise HpcdemError(f"the package gmsh lacks its library libgmsh: reinstall it, {EXTRA}")
    return module


def gmsh_started() -> ModuleType:
    """The package gmsh, initialised. It resets SIGPIPE to its default; a later write to a closed pipe or socket would
    end the process without a message, so Python's choice is restored."""
    module = gmsh()
    module.initialize(["hpcdem"], readConfigFiles=False, interruptible=False)
    with contextlib.suppress(AttributeError, ValueError):  # no SIGPIPE on Windows; only the main thread may set it
        signal.signal(signal.SIGPIPE, signal.getsignal(signal.SIGPIPE))
    return module


def meshio() -> ModuleType:
    """The package meshio."""

    def load() -> ModuleType:
        import meshio

        return meshio

    return _wanted("meshio", "Import of mesh files", load)


def ezdxf() -> ModuleType:
    """The package ezdxf."""

    def load() -> ModuleType:
        import ezdxf

        return ezdxf

    return _wanted("ezdxf", "Import of DXF drawings", load)


def pyshp() -> ModuleType:
    """The package pyshp, whose module is shapefile."""

    def load() -> ModuleType:
        import shapefile

        return shapefile

    return _wanted("shapefile", "Import of shapefiles", load, "pyshp")


def svgelements() -> ModuleType:
    """The package svgelements."""

    def load() -> ModuleType:
        import svgelements

        return svgelements

    return _wanted("svgelements", "Import of SVG drawings", load)


OWN_READERS = (".msh", ".inp")
"""Mesh files that need no package."""


def of_mesh(file: str) -> tuple[Load, ...]:
    """Return the packages needed to read a mesh file, by its ending."""
    ending = Path(file).suffix.lower()
    return (meshio,) if ending and ending not in OWN_READERS else ()


def of_drawing(file: str) -> tuple[Load, ...]:
    """Return the packages needed to read a drawing or a file of bodies, by its ending."""
    ending = Path(file).suffix.lower()
    return _OF_DRAWINGS.get(ending, ())


_OF_DRAWINGS: dict[str, tuple[Load, ...]] = {
    ".dxf": (ezdxf,),
    ".svg": (svgelements,),
    ".shp": (pyshp,),
    **dict.fromkeys((".step", ".stp", ".brep"), (gmsh,)),
    **dict.fromkeys((".geojson", ".json", *IMAGES), (shapely,)),
}


def _wanted(name: str, what: str, load: Callable[[], ModuleType], package: str = "") -> ModuleType:
    """package: the name of the package where it is not that of the module."""
    try:
        return load()
    except ModuleNotFoundError as error:
        lacks = "is not installed" if error.name == name else f"lacks {error.name}"
        raise HpcdemError(f"{what} needs the package {package or name}, which {lacks}: {EXTRA}") from error
    except (ImportError, OSError) as error:
        # The gmsh wheel carries a program with windows and asks for libraries of the system.
        hint = f": libraries of the system are missing (Debian, Ubuntu: apt install {GMSH_LIBRARIES})"
        raise HpcdemError(
            f"{what} needs the package {name}, which cannot be loaded ({error}){hint if name == 'gmsh' else ''}"
        ) from error
