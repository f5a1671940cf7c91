"""Bodies of files: solids of STEP and BREP files, and closed shells of triangles of STL and DXF files (3DFACE).

STEP and BREP are read by OpenCASCADE through Gmsh in a process of its own (`python -m hpcdem.pre.mesh.cad`): what it
does with damaged files should not take the run with it. It writes each solid as BREP text, with the triangles of a
picture of it.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.pre.mesh import apart, optional
from hpcdem.pre.mesh import occ as shapes
from hpcdem.pre.mesh.solids import Brep, Shell

MOST_TRIANGLES = 20_000
"""Of a shell: each becomes a surface of OpenCASCADE."""
MOST_TEXT = 50_000_000
"""Characters of a solid: checkpoints hold them."""
SAME = 1e-7
"""Corners nearer than this part of the size are one."""
TURN = 24
"""Edges of the picture in a full turn."""
KINDS = (".step", ".stp", ".brep", ".stl", ".dxf")


def read(path: Path, layer: str | None = None) -> list[Any]:
    """The bodies of a file [m]; layer: only this one of a DXF file. HpcdemError, with its name, for what it lacks."""
    kind = path.suffix.lower()
    if not path.is_file():
        raise CommandError(f"{path}: there is no such file")
    if kind not in KINDS:
        raise CommandError(f"{path}: bodies are read from files {', '.join('*' + one for one in KINDS)}")
    if kind in (".stl", ".dxf"):
        return [_shell(path, _triangles(path) if kind == ".stl" else _faces(path, layer))]
    return _solids(path)


def _shell(path: Path, triangles: np.ndarray) -> Shell:
    if not np.isfinite(triangles).all() or not len(triangles):
        raise HpcdemError(f"{path}: there are no triangles, or corners that are not finite")
    if len(triangles) > MOST_TRIANGLES:
        raise HpcdemError(f"{path}: {len(triangles)} triangles, expected at most {MOST_TRIANGLES}: simplify the shell")
    corners = triangles.reshape(-1, 3)
    size = float(np.ptp(corners, axis=0).max())
    if size <= 0.0:
        raise HpcdemError(f"{path}: all corners lie in one point")
    from hpcdem.pre.mesh.imported import _merged

    of = _merged(corners, SAME * size).reshape(-1, 3)
    kept = of[(of != np.roll(of, 1, axis=1)).all(axis=1)]  # slivers that merging has made lines of
    kept, pieces = outwards(kept, corners)
    try:
        shell = Shell(tuple((float(x), float(y), float(z)) for x, y, z in corners[kept.ravel()]))
        shell.check()
    except CommandError as error:
        raise HpcdemError(f"{path}: {error}") from None
    if pieces > 1:
        raise HpcdemError(f"{path}: the triangles make {pieces} shells, expected one; DXF files have layers")
    return shell


def outwards(of: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, int]:
    """The triangles (k, 3), turned so that neighbours run along their common side opposite ways and each piece of them
    faces outwards; and how many pieces there are. corners: (n, 3) [m]."""
    of = of.copy()
    sides: dict[tuple[int, int], list[int]] = {}
    for t, row in enumerate(of.tolist()):
        for a, b in zip(row, row[1:] + row[:1], strict=True):
            sides.setdefault((min(a, b), max(a, b)), []).append(t)
    done = np.zeros(len(of), bool)
    pieces = 0
    for start in range(len(of)):
        if done[start]:
            continue
        pieces, piece, todo = pieces + 1, [], [start]
        done[start] = True
        while todo:
            t = todo.pop()
            piece.append(t)
            row = of[t].tolist()
            for a, b in zip(row, row[1:] + row[:1], strict=True):
                for other in sides[min(a, b), max(a, b)]:
                    if not done[other]:
                        theirs = of[other].tolist()
                        if (a, b) in zip(theirs, theirs[1:] + theirs[:1], strict=True):
                            of[other] = of[other, ::-1]
                        done[other] = True
                        todo.append(other)
        at = corners[of[piece]] - corners[of[piece[0], 0]]
        if (np.cross(at[:, 0], at[:, 1]) * at[:, 2]).sum() < 0.0:
            of[piece] = of[piece][:, ::-1]
    return of, pieces


def _triangles(path: Path) -> np.ndarray:
    """(k, 3, 3) of an STL file, text or binary."""
    meshio = optional.meshio()
    try:
        found = meshio.read(path, file_format="stl")
    except Exception as error:  # whatever a damaged file makes of the reader
        raise HpcdemError(f"{path}: this is not an STL file that can be read ({error})") from None
    parts = [np.asarray(block.data) for block in found.cells if block.type == "triangle"]
    return np.asarray(found.points, np.float64)[np.concatenate(parts)] if parts else np.empty((0, 3, 3))


def _faces(path: Path, layer: str | None) -> np.ndarray:
    """(k, 3, 3) of the 3DFACE entities of a DXF file; quads as two triangles."""
    ezdxf = optional.ezdxf()
    try:
        document = ezdxf.readfile(path)
    except (OSError, ezdxf.DXFError, UnicodeError, ValueError, KeyError, IndexError) as error:
        raise HpcdemError(f"{path}: this is not a DXF drawing that can be read ({error})") from None
    rows = []
    layers = set()
    for entity in document.modelspace().query("3DFACE"):
        layers.add(str(entity.dxf.layer))
        if layer is not None and str(entity.dxf.layer) != layer:
            continue
        a, b, c, d = (tuple(map(float, entity.dxf.get(f"vtx{k}"))) for k in range(4))
        rows.append((a, b, c))
        if d not in (a, c):
            rows.append((a, c, d))
    if not rows:
        known = ", ".join(f"'{name}'" for name in sorted(layers)) or "none"
        raise HpcdemError(f"{path}: there is no 3DFACE in layer '{layer}' (layers with some: {known})" if layer else
                          f"{path}: the drawing contains no 3DFACE")  # fmt: skip
    return np.array(rows)


def _solids(path: Path) -> list[Brep]:
    optional.gmsh()
    with tempfile.TemporaryDirectory(prefix="hpcdem-") as folder:
        into = Path(folder) / "bodies.json"
        apart.run("hpcdem.pre.mesh.cad", str(path), str(into), failed=f"{path}: no solid can be read from it")
        given = json.loads(into.read_text(encoding="utf-8"))
    if any(len(one["text"]) > MOST_TEXT for one in given):
        raise HpcdemError(f"{path}: a solid has more than {MOST_TEXT} characters")
    return [
        Brep(one["text"], tuple(map(tuple, one["corners"])), tuple(one["faces"]), one["name"]) for one in given
    ]  # fmt: skip


def _main(path: str, into: str) -> None:
    gmsh = shapes.begun()
    gmsh.option.setString("Geometry.OCCTargetUnit", "M")
    gmsh.option.setNumber("Geometry.OCCImportLabels", 1)
    occ = gmsh.model.occ
    found = occ.importShapes(path, highestDimOnly=True)
    occ.synchronize()
    volumes = gmsh.model.getEntities(3)
    if not volumes or any(dim != 3 for dim, _ in found):
        raise SystemExit("it has surfaces or lines, but no solid" if not volumes else "it has more than solids")
    names = [gmsh.model.getEntityName(dim, tag).rpartition("/")[2] for dim, tag in volumes]
    out = []
    with tempfile.TemporaryDirectory(prefix="hpcdem-") as folder:
        whole = Path(folder) / "whole.brep"
        gmsh.write(str(whole))
        for k, name in enumerate(names):
            gmsh.model.add(f"body {k}")
            occ.importShapes(str(whole))
            occ.synchronize()
            every = gmsh.model.getEntities(3)
            occ.remove([one for i, one in enumerate(every) if i != k], recursive=True)
            occ.synchronize()
            if occ.getMass(*every[k]) <= 0.0:
                raise SystemExit("a solid has no volume, or is inside out")
            one = Path(folder) / "one.brep"
            gmsh.write(str(one))
            corners, faces = _picture(gmsh)
            out.append({"text": one.read_text(encoding="ascii"), "corners": corners, "faces": faces, "name": name})
    Path(into).write_text(json.dumps(out), encoding="utf-8")


def _picture(gmsh: Any) -> tuple[list[list[float]], list[int]]:
    """Corners of the triangles of all faces, outwards, and the face of each."""
    gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", TURN)
    gmsh.model.mesh.generate(2)
    faces: list[int] = []
    tags, xyz, _ = gmsh.model.mesh.getNodes()
    place = np.zeros(int(tags.max()) + 1, np.int64)
    place[tags.astype(np.int64)] = np.arange(len(tags))
    at = xyz.reshape(-1, 3)
    parts = []
    for k, (dim, tag) in enumerate(gmsh.model.getBoundary(gmsh.model.getEntities(3), oriented=False)):
        kinds, _, nodes = gmsh.model.mesh.getElements(dim, tag)
        for kind, of in zip(kinds, nodes, strict=True):
            if kind == 2:
                parts.append(place[of.astype(np.int64)].reshape(-1, 3))
                faces += [k] * len(parts[-1])
    rows, _ = outwards(np.concatenate(parts), at)
    return at[rows.ravel()].tolist(), faces


if __name__ == "__main__":
    _main(sys.argv[1], sys.argv[2])
