"""Bodies of files: solids of STEP and BREP files, and closed shells of triangles of STL and DXF files (3DFACE).

STEP and BREP are read by OpenCASCADE through Gmsh in a process of its own (`python -m hpcdem.pre.mesh.cad`): what it
does with damaged files should not take the run with it. It writes each solid as BREP text, with the triangles of a
picture of it.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.core.errors import CommandError, HpcdemError
from hpcdem.numerics.clusters import spots
from hpcdem.pre.mesh import apart, dxf, optional
from hpcdem.pre.mesh import occ as shapes
from hpcdem.pre.mesh.solids import Brep, Shell

MOST_TRIANGLES = 20_000
"""Largest number of triangles of a shell: each becomes a surface of OpenCASCADE."""
MOST_TEXT = 50_000_000
"""Largest number of characters of a solid, since checkpoints hold them."""
SAME = 1e-7
"""Distance over the size of the solid below which corners are one."""
TURN = 24
"""Number of edges of the picture in a full circle."""
KINDS = (".step", ".stp", ".brep", ".stl", ".dxf")


def read(path: Path, layer: str | None = None, scale: float | None = None, notes: list[str] | None = None) -> list[Any]:
    """Read the bodies of a file [m]. layer: only this one of a DXF file; scale: metres per unit of the file (STEP and
    DXF files define theirs); notes: receives messages. HpcdemError with the file name if something is missing.
    """
    notes = [] if notes is None else notes
    kind = path.suffix.lower()
    if not path.is_file():
        raise CommandError(f"{path}: there is no such file")
    if kind not in KINDS:
        raise CommandError(f"{path}: bodies are read from files {', '.join('*' + one for one in KINDS)}")
    if scale is not None and not 0.0 < scale < math.inf:
        raise CommandError(f"scale must be above 0, got {scale:g}")
    if kind in (".step", ".stp"):
        if scale is not None:
            raise CommandError(
                f"{path}: STEP files define their unit and are converted to metres: scale applies to other files only"
            )
        return _solids(path, 1.0)
    if kind == ".dxf":
        return [_shell(path, _faces(path, layer, scale, notes))]
    taken = 1.0 if scale is None else scale
    notes.append(
        f"files *{kind} define no unit: 1 unit = {taken:g} m, "
        + ("set by scale" * (scale is not None) or "interpreted as metres")
    )
    return [_shell(path, taken * _triangles(path, notes))] if kind == ".stl" else _solids(path, taken)


def _shell(path: Path, triangles: np.ndarray) -> Shell:
    if not np.isfinite(triangles).all() or not len(triangles):
        raise HpcdemError(f"{path}: no triangles, or corners that are not finite")
    if len(triangles) > MOST_TRIANGLES:
        raise HpcdemError(f"{path}: {len(triangles)} triangles, expected at most {MOST_TRIANGLES}: simplify the shell")
    corners = triangles.reshape(-1, 3)
    size = float(np.ptp(corners, axis=0).max())
    if size <= 0.0:
        raise HpcdemError(f"{path}: all corners coincide")
    of = spots(corners, SAME * size).reshape(-1, 3)
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
    """Return the triangles (k, 3), oriented so that neighbours traverse their common side in opposite directions and
    each piece faces outwards, and the number of pieces. corners: (n, 3) [m].
    """
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


def _triangles(path: Path, notes: list[str]) -> np.ndarray:
    """(k, 3, 3) of an STL file, text or binary; bytes after the last triangle are ignored, with a note."""
    content = path.read_bytes()
    count = int.from_bytes(content[80:84], "little") if len(content) >= 84 else 0
    whole = 84 + 50 * count
    before, facet, _ = content.lower().partition(b"facet")
    text = before.lstrip()[:5] == b"solid" and bool(facet) and b"\0" not in before
    if text and len(content) != whole:  # binary files may begin with the same word
        words = content[: content.lower().rfind(b"endsolid") + 8].decode("ascii", "replace").lower().split()
        rows = [words[k + 1 : k + 4] for k, word in enumerate(words) if word == "vertex"]
        ends = "endsolid" in words and len(rows) == 3 * words.count("endfacet")
        try:
            corners = np.array(rows, np.float64).reshape(-1, 3, 3)
        except ValueError:
            ends, corners = False, np.empty((0, 3, 3))
        if not ends:
            raise HpcdemError(f"{path}: not a readable STL file: a facet is damaged, or the end is missing")
        return corners
    if len(content) < whole or not count:
        held = max(len(content) - 84, 0) // 50
        raise HpcdemError(
            f"{path}: not a readable STL file: neither text with facets nor binary (its header declares {count} "
            f"triangles, it has {held})"
        )
    if len(content) > whole:
        notes.append(f"ignored {len(content) - whole} bytes after the last triangle")
    table = np.frombuffer(
        content, np.dtype([("normal", "<f4", (3,)), ("at", "<f4", (3, 3)), ("more", "<u2")]), count, 84
    )
    return table["at"].astype(np.float64)


def _faces(path: Path, layer: str | None, scale: float | None, notes: list[str]) -> np.ndarray:
    """(k, 3, 3) [m] of the 3DFACE entities of a DXF file, in blocks too; quads as two triangles."""
    document = dxf.opened(path)
    unit = dxf.metres(document, scale, notes)
    rows = []
    layers = set()
    for entity, own in dxf.flat(document.modelspace(), str(path)):
        if entity.dxftype() != "3DFACE":
            continue
        layers.add(own)
        if layer is not None and own != layer:
            continue
        a, b, c, d = (tuple(map(float, entity.dxf.get(f"vtx{k}"))) for k in range(4))
        rows.append((a, b, c))
        if d not in (a, c):
            rows.append((a, c, d))
    if not rows:
        known = ", ".join(f"'{name}'" for name in sorted(layers)) or "none"
        raise HpcdemError(f"{path}: layer '{layer}' has no 3DFACE (layers with some: {known})" if layer else
                          f"{path}: the drawing contains no 3DFACE")  # fmt: skip
    return unit * np.array(rows)


def _solids(path: Path, scale: float) -> list[Brep]:
    optional.gmsh()
    with tempfile.TemporaryDirectory(prefix="hpcdem-") as folder:
        into = Path(folder) / "bodies.json"
        apart.run(
            "hpcdem.pre.mesh.cad", str(path), str(into), repr(scale), failed=f"{path}: contains no readable solid"
        )
        given = json.loads(into.read_text(encoding="utf-8"))
    if any(len(one["text"]) > MOST_TEXT for one in given):
        raise HpcdemError(f"{path}: a solid has more than {MOST_TEXT} characters")
    return [
        Brep(one["text"], tuple(map(tuple, one["corners"])), tuple(one["faces"]), one["name"]) for one in given
    ]  # fmt: skip


def _main(path: str, into: str, scale: float) -> None:
    gmsh = shapes.begun()
    gmsh.option.setString("Geometry.OCCTargetUnit", "M")
    gmsh.option.setNumber("Geometry.OCCImportLabels", 1)
    occ = gmsh.model.occ
    found = occ.importShapes(path, highestDimOnly=True)
    if scale != 1.0:
        occ.dilate(found, 0.0, 0.0, 0.0, scale, scale, scale)
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
    _main(sys.argv[1], sys.argv[2], float(sys.argv[3]))
