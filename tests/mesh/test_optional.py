"""What is said where a package for meshing is missing or cannot be loaded."""

from __future__ import annotations

import json
import os
import sys
from types import ModuleType

import pytest

from hpcdem.core.errors import HpcdemError
from hpcdem.lang.pcdc import check
from hpcdem.pre.mesh import apart, geometry, optional
from hpcdem.pre.mesh.dxf import read_dxf
from hpcdem.pre.mesh.imported import import_mesh
from hpcdem.pre.mesh.triangulate import MeshSettings, Region, triangulate


@pytest.mark.parametrize("name", ["shapely", "gmsh", "meshio", "ezdxf"])
def test_a_missing_package_is_named_with_the_command_that_installs_it(monkeypatch, name):
    monkeypatch.setitem(sys.modules, name, None)  # what Python itself does to forbid an import
    with pytest.raises(HpcdemError, match=rf"needs the package {name}, which .* -m pip install -e '.*\[mesh\]'"):
        getattr(optional, name)()


def test_missing_libraries_of_the_system_are_named(monkeypatch, tmp_path):
    """What loading the gmsh wheel does on a bare machine."""
    said = "libGLU.so.1: cannot open shared object file: No such file or directory"
    (tmp_path / "gmsh.py").write_text(f"raise OSError({said!r})\n")
    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(HpcdemError, match=r"libGLU\.so\.1: cannot open .*apt install libglu1-mesa libxrender1"):
        optional.gmsh()
    monkeypatch.delitem(sys.modules, "gmsh", raising=False)


def test_a_wheel_without_its_library(monkeypatch):
    monkeypatch.setitem(sys.modules, "gmsh", ModuleType("gmsh"))
    with pytest.raises(HpcdemError, match="lacks its library libgmsh"):
        optional.gmsh()


def test_an_old_shapely(monkeypatch):
    old = ModuleType("shapely")
    old.__version__ = "1.8.5"
    monkeypatch.setitem(sys.modules, "shapely", old)
    with pytest.raises(HpcdemError, match=r"shapely 2\.0 or newer, here is 1\.8\.5"):
        optional.shapely()


def test_those_who_need_one_say_so(monkeypatch, tmp_path):
    for name in ("gmsh", "meshio", "ezdxf"):
        monkeypatch.setitem(sys.modules, name, None)
    (tmp_path / "m.vtk").write_text("")
    layers = geometry.Layers()
    layers.add("o", geometry.rectangle((0, 0), (1, 1)))
    with pytest.raises(HpcdemError, match="Meshing of arbitrary outlines needs the package gmsh"):
        triangulate(layers, MeshSettings([Region("o")], 0.5))
    with pytest.raises(HpcdemError, match="Import of mesh files needs the package meshio"):
        import_mesh(tmp_path / "m.vtk")
    with pytest.raises(HpcdemError, match="Import of DXF drawings needs the package ezdxf"):
        read_dxf(tmp_path / "m.dxf")


def test_a_script_is_refused_at_its_first_line_that_needs_a_missing_package(monkeypatch):
    script = check.read(
        "x = 1\npcdc mesh structured (0,0) (1,1) cells 1 1\npcdc mesh import 'a.inp'\npcdc mesh import 'a.vtu'\n"
        "pcdc mesh create from-layer 'a' size 1\npcdc mesh create from-layer 'b' size 1\n",
        "script.sc",
    )
    check.packages(script)
    for name, line in (("meshio", 4), ("gmsh", 5)):
        with monkeypatch.context() as without:
            without.setitem(sys.modules, name, None)
            with pytest.raises(HpcdemError, match=rf"^script\.sc:{line}: .*needs the package {name}"):
                check.packages(script)


def test_all_that_is_missing_is_reported_at_once_and_by_check(monkeypatch):
    for name in ("gmsh", "shapely", "ezdxf"):
        monkeypatch.setitem(sys.modules, name, None)
    text = "pcdc geometry import 'a.dxf' as-layer 'a'\n" + "pcdc mesh create from-layer 'a' size 1\n" * 2
    with pytest.raises(HpcdemError) as found:
        check.packages(check.read(text, "script.sc"))
    said = str(found.value)
    assert said.startswith("script.sc:1: ") and said.count("pip install") == 1
    assert [said.count(f"the package {name},") for name in ("ezdxf", "gmsh", "shapely")] == [1, 1, 1]
    (warned,) = [line for line in check.summary(text, "script.sc").splitlines() if "package" in line]
    assert warned.startswith("warning: line 1: ") and warned.count("the package") == 3


def test_a_process_apart_finds_the_modules_of_this_one_and_is_in_no_group_of_it(tmp_path, monkeypatch):
    (tmp_path / "here").mkdir()
    (tmp_path / "json.py").write_text("raise SystemExit('a script of the user')")
    (tmp_path / "here" / "asked.py").write_text(
        "import json, os, pathlib, sys\npathlib.Path(sys.argv[1]).write_text(json.dumps([os.getpgrp(), __name__]))"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path / "here")
    monkeypatch.setattr("sys.path", [one for one in sys.path if one])
    apart.run("asked", str(tmp_path / "out"), failed="not asked")
    group, name = json.loads((tmp_path / "out").read_text())
    assert group != os.getpgrp() and name == "__main__"
    with pytest.raises(HpcdemError, match=r"not there: .*nowhere"):
        apart.run("nowhere", failed="not there")
