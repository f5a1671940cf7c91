"""Sections as text and for ParaView; what programs read is the .npz of `section.py`."""

from __future__ import annotations

import os

import numpy as np

from hpcdem.core.comm import SerialComm
from hpcdem.io import h5
from hpcdem.io.files import write_sections
from hpcdem.io.textnum import INT, Column, TextTable, sci
from hpcdem.post.section import Section

_TEXT = {
    "x": "x[m]", "y": "y[m]", "radius": "rad[m]", "color": "color",
    "pxx": "pxx[Pa]", "pxy": "pxy[Pa]", "pyy": "pyy[Pa]",
    "fxx": "Fxx", "fxy": "Fxy", "fyx": "Fyx", "fyy": "Fyy", "volumetric": "ev[%]", "distortional": "ed",
}  # fmt: skip


def write_out(path: str | os.PathLike, section: Section, since: str) -> None:
    """Write one row per particle; two header lines that begin with #. since: name of the frame at which F is 1."""
    p = section.particles
    width = max(11, len(str(int(np.max(p["gid"], initial=0)))) + 2)
    columns = [(Column("id", INT, width), p["gid"])]
    for name, word in _TEXT.items():
        kind = Column(word, INT, 7) if name == "color" else sci(word, 13 if name in "xy" else 9)
        columns.append((kind, p[name].astype(np.int64) if name == "color" else p[name]))
    words = "".join(c.name.rjust(c.width) for c, _ in columns)
    head = (
        f"# frame {section.name} step {section.step} time {section.time:.12g} s, stress over {section.average:.12g} m, "
        f"strain {'on the grid' if section.smooth else 'of nearest neighbours'} since {since}\n#{words[1:]}\n"
    )
    write_sections(path, SerialComm(), lambda: [head.encode(), TextTable(columns)])


def write_grid(path: str | os.PathLike, section: Section) -> None:
    """The fields as VTKHDF ImageData 2.0 (https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html): one
    point per node, z = 0."""
    nx, ny = len(section.x), len(section.y)
    with h5.writing(path, SerialComm()) as out:
        out.group(
            "VTKHDF",
            {
                "Version": np.array([2, 0], dtype=np.int64),
                "Type": np.bytes_("ImageData"),
                "WholeExtent": np.array([0, nx - 1, 0, ny - 1, 0, 0], dtype=np.int64),
                "Origin": np.array([section.x[0], section.y[0], 0.0]),
                "Spacing": np.full(3, section.size),
                "Direction": np.eye(3).ravel(),
            },
        )
        out.group("VTKHDF/PointData")
        for name, values in section.fields.items():
            out.whole(f"VTKHDF/PointData/{name}", values)  # flat: without the third axis
        out.group("VTKHDF/FieldData")
        out.whole("VTKHDF/FieldData/TimeValue", np.array([section.time]))
        out.whole("VTKHDF/FieldData/step", np.array([section.step], dtype=np.int64))
