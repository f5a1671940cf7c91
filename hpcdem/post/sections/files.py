"""The numbers behind the pictures: text tables of true stress and strain, and grids for GMT."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hpcdem.io.agreed import atomic_path
from hpcdem.post.section import UNITS, Section

DRAWN = {
    "invariant": ("distortional", "1", lambda v: v * abs(v)),
    "difference": ("shear", "Pa", lambda v: 2.0 * v),
}
"""Fields as pages draw them: signed J2, whose root is the distortional strain, and s1 - s2."""
GRIDS = ("volumetric", "distortional", "mean", "shear", *DRAWN)


def write_tables(section: Section, folder: Path) -> None:
    """strain_<name>.out: x y volumetric distortional invariant; stress_<name>.out: x y mean shear s1 s2 direction
    difference.

    One line per node, row by row from the bottom, NaN where there is no material. SI units, named in the first line;
    stress positive in compression, shear: half of the difference s1 - s2, direction: angle of s1 from the x axis,
    anticlockwise.
    """
    x, y = np.meshgrid(section.x, section.y)
    f = section.fields
    mean, shear = f["mean"], f["shear"]
    _write(
        folder / f"strain_{section.name}.out",
        {
            "x[m]": x,
            "y[m]": y,
            "volumetric[%]": f["volumetric"],
            "distortional[1]": f["distortional"],
            "invariant[1]": _drawn(section, "invariant"),
        },
    )
    _write(
        folder / f"stress_{section.name}.out",
        {"x[m]": x, "y[m]": y, "mean[Pa]": mean, "shear[Pa]": shear, "s1[Pa]": mean + shear, "s2[Pa]": mean - shear,
         "direction[rad]": f["direction"], "difference[Pa]": _drawn(section, "difference")},
    )  # fmt: skip


def _drawn(section: Section, name: str) -> np.ndarray:
    """A field, or what is drawn of one."""
    if name not in DRAWN:
        return section.fields[name]
    field, _, value = DRAWN[name]
    return value(section.fields[field])


def _write(path: Path, columns: dict[str, np.ndarray]) -> None:
    rows = np.stack([values.reshape(-1) for values in columns.values()], axis=1)
    line = " ".join(["%.10g"] * rows.shape[1]) + "\n"
    text = "# " + " ".join(columns) + "\n" + "".join(line % tuple(row) for row in rows.tolist())
    with atomic_path(path) as temporary, open(temporary, "w", encoding="ascii", newline="\n") as file:
        file.write(text.replace("nan", "NaN"))


def write_grids(section: Section, folder: Path) -> None:
    """<name>_<field>.grd for each of GRIDS: x (m), y (m), z in SI units, as netCDF 3 after the COARDS conventions,
    which is a grid file of GMT, node-registered."""
    from scipy.io import netcdf_file

    for name in GRIDS:
        with atomic_path(folder / f"{section.name}_{name}.grd") as temporary:
            with netcdf_file(temporary, "w") as file:
                file.Conventions = "COARDS"
                file.title = f"{name} of {section.name}"
                for axis, values in (("x", section.x), ("y", section.y)):
                    file.createDimension(axis, len(values))
                    variable = file.createVariable(axis, "f8", (axis,))
                    variable[:] = values
                    variable.long_name, variable.units = axis, "m"
                    if len(values):
                        variable.actual_range = np.array([values[0], values[-1]])
                z = file.createVariable("z", "f8", ("y", "x"))
                z[:] = _drawn(section, name)
                z.long_name, z.units = name, DRAWN[name][1] if name in DRAWN else UNITS[name]
                z._FillValue = np.float64(np.nan)
