"""A small ZDEM script that shows most of the program in a second or two, and the comparison of two of its runs."""

from __future__ import annotations

import os
from pathlib import Path

import h5py
import numpy as np

from hpcdem.runtime.run_folder import RECORD

HDF5 = (".vtkhdf", ".sav")

SHORT_PUSH = """\
# Some 300 particles settle in a box 4 km wide; then the left wall pushes them.
START
SET disk off
BOX left 0.0 right 4200.0 bottom 0.0 height 4000.0 kn=0 ks=0 fric 0.0
WALL ID 0, NODES ( 0.0 , 10.0 ) ( 4100.0 , 10.0 ), kn=0 ks=0 fric 0.0 COLOR black
WALL ID 1, NODES ( 10.0 , 3000.0 ) ( 10.0 , 10.0 ), kn=0 ks=0 fric 0.0 COLOR blue
WALL ID 2, NODES ( 4100.0 , 10.0 ) ( 4100.0 , 3000.0 ), kn=0 ks=0 fric 0.0 COLOR red
GEN NUM 300 rad discrete 60.0 80.0, x ( 10.0, 4100.0 ), y ( 10.0, 3000.0 ), COLOR yellow GROUP bed
PROP density 2.5e3, fric 0.0, shear 2.9e9, poiss 0.2, damp 0.4, hertz
SET DT 5e-2, GRAVITY 0.0, -9.8
CYC 400
PROP ebmod 2e8 gbmod 2e8 tstrength 2e7 sstrength 4e7 fric 0.3
WALL id 1 xv 2.0
SET print {steps} vtk {steps} save {steps}
CYC {steps}
STOP
"""


def write_push(folder: Path, steps: int) -> Path:
    """The script, in a folder of its own: results go into `data` beside it."""
    folder.mkdir()
    script = folder / "push.py"
    script.write_text(SHORT_PUSH.format(steps=steps))
    return script


def parametrised_push(steps: int) -> str:
    """The same for sweeps, with the parameters `friction` and `seed`, four frames and eight checkpoints."""
    text = SHORT_PUSH.format(steps=steps).replace("fric 0.3", "fric {friction}")
    text = text.replace("START\n", "friction = 0.3\nSTART\nSET seed 1\n")
    return text.replace(f"SET print {steps} vtk {steps} save {steps}", f"SET print {steps // 4} save {steps // 8}")


def ranks_of(folder: Path) -> list[int]:
    """Processes that run push.py in a folder; no launchers."""
    found = []
    for place in Path("/proc").glob("[0-9]*"):
        try:
            words = (place / "cmdline").read_bytes().split(b"\0")
            if os.path.samefile(place / "cwd", folder) and b"push.py" in words and b"srun" not in words:
                found.append(int(place.name))
        except OSError:
            continue
    return found


def contents(path: Path) -> dict[str, np.ndarray]:
    """All datasets and attributes of an HDF5 file by their path."""
    found: dict[str, np.ndarray] = {}

    def visit(name: str, item: h5py.Group | h5py.Dataset) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = np.asarray(item[()])
        found.update({f"{name}@{key}": np.asarray(value) for key, value in item.attrs.items()})

    with h5py.File(path, "r") as file:
        visit("", file)
        file.visititems(visit)
    return found


def assert_same_files(one: Path, other: Path) -> None:
    """Two folders hold the same files with the same content: HDF5 dataset by dataset, all others byte by byte.
    Only run.json is another for every run."""
    names = files(one)
    assert names and names == files(other)
    for name in names:
        a, b = one / name, other / name
        if a.name == RECORD or a.read_bytes() == b.read_bytes():
            continue
        assert a.suffix in HDF5, name
        left, right = contents(a), contents(b)
        assert left.keys() == right.keys(), name
        assert not [k for k in left if left[k].tobytes() != right[k].tobytes()], name


def files(folder: Path) -> list[str]:
    """Paths of all files below a folder, relative to it, in order."""
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def assert_same_end(one: Path, other: Path, patterns: tuple[str, ...] = ("*.vtkhdf", "*.sav")) -> None:
    """The newest frame and checkpoint of two runs hold the same bits."""
    for pattern in patterns:
        mine, yours = (sorted((folder / "data").glob(pattern)) for folder in (one, other))
        assert mine and mine[-1].name == yours[-1].name
        a, b = contents(mine[-1]), contents(yours[-1])
        assert a.keys() == b.keys()
        different = [name for name in a if a[name].tobytes() != b[name].tobytes()]
        assert not different, f"{mine[-1].name} differs in {different}"
