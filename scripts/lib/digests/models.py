"""The models whose results are compared: small, but of every kind that there is."""

from __future__ import annotations

import os
import re
import shutil
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from bench.launch import ROOT, Layout, call, mpiexec

PROGRAM = Path(sys.executable).with_name("hpcdem")
AT_THE_END = "pcdc model save 'end.sav'\n"


@dataclass(frozen=True)
class Model:
    """Scripts run one after the other, each in a folder of its name.

    scripts: name -> text; files: name -> of another script's folder, what is copied beside the script before; made:
    name -> words of `hpcdem case` that write the script.
    """

    name: str
    scripts: dict[str, str] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    made: dict[str, list[str]] = field(default_factory=dict)

    def run(self, folder: Path, layout: Layout) -> None:
        """All scripts, in this folder. bench.launch.Failed with what was printed if one does not come to its end."""
        for name in (*self.scripts, *self.made):
            place = folder / name
            place.mkdir(parents=True)
            if name in self.made:
                script = place / f"{name}.sc"
                call([str(PROGRAM), "case", *self.made[name], "-o", script.name], place)
                script.write_text(script.read_text() + AT_THE_END)
            else:
                text = self.scripts[name]
                script = place / (f"{name}.sc" if re.search(r"^\s*pcdc ", text, re.M) else f"{name}.py")
                script.write_text(text)
            if name in self.files:
                shutil.copy(folder / self.files[name], place)
            command = [mpiexec(), "-n", str(layout.ranks), str(PROGRAM), script.name, "--no-figure", "-j",
                       str(layout.threads)]  # fmt: skip
            call(command, place)


def models() -> Iterator[Model]:
    """All of them; the scripts of ZDEM's manual where they are (HPCDEM_MANUAL_SCRIPTS, else beside the project)."""
    manual = Path(os.environ.get("HPCDEM_MANUAL_SCRIPTS", ROOT.parent / "shared" / "manual_scripts")) / "short"
    if manual.is_dir():
        for chain, needs in CHAINS.items():
            texts = {name: _saved_at_its_end((manual / f"{name}.py").read_text()) for name in needs}
            yield Model(f"manual-{chain}", texts, {name: file for name, file in needs.items() if file})
    yield Model("busy", {"busy": BUSY})
    yield Model("clumps", {"clumps": CLUMPS})
    yield Model("ucs", made={"ucs": ["ucs", "--size", "0.006", "--transits", "10", "--most-strain", "0.004"]})
    yield Model("brazilian", made={"brazilian": ["brazilian", "--size", "0.003", "--transits", "10"]})
    yield Model("tunnel", made={"tunnel": ["tunnel", "--size", "0.6", "--coarse", "6", "--reach", "6", "--joints",
                                           "--relax", "4", "--rest", "4"]})  # fmt: skip
    yield Model("fault", made={"fault": ["fault-injection", "--size", "4", "--coarse", "40", "--duration", "5",
                                         "--shut-in", "1", "--steps", "1500", "--rate", "2e-4", "--dilation",
                                         "5"]})  # fmt: skip
    yield Model("slope", made={"slope": ["slope"]})
    yield Model("coupled", {"coupled": _shortened((ROOT / "examples" / "rock_into_sand.sc").read_text())})


def _saved_at_its_end(text: str) -> str:
    return re.sub(r"(?im)^stop$", "SAV end.sav\nSTOP", text)


def _shortened(text: str) -> str:
    """The example of a boulder in sand in a tenth of its steps, with an account of energy and the state at its end."""
    text = text.replace("sand.cycle(40000)", "sand.cycle(8000)").replace("top + 0.04", "top + 0.002")
    text = text.replace("top + 0.39", "top + 0.352").replace("8000)", "1600)").replace("every 8000", "every 1600")
    return text.replace("print=8000", "print=1600") + AT_THE_END


CHAINS: dict[str, dict[str, str]] = {
    "push": {"push": "", "syn_erosion": "push/data/0000006000.sav", "syn_sedimentaion": "push/data/0000006000.sav"},
    "pre_struct": {"pre_struct": "", "detachment": "pre_struct/init_xyr.dat", "palaeohigh": "pre_struct/init_xyr.dat"},
    "ex8": {"ex8_dem_am_gen": "", "ex8_dem_am_push": "ex8_dem_am_gen/ini_xyr.dat"},
    "extens_rigid": {"extens_rigid": ""},
    "extens_ductile_patent": {"extens_ductile_patent": ""},
    "push_add_del": {"push_add_del": ""},
}
"""Scripts of the manual in the order in which they run, and the file each of them needs."""

BUSY = """\
START
SET disk off
BOX left 0.0 right 7000.0 bottom 0.0 height 4000.0
WALL id 0 nodes (0.0, 50.0) (6500.0, 50.0)
WALL id 1 nodes (50.0, 3900.0) (50.0, 50.0)
WALL id 2 nodes (6500.0, 50.0) (6500.0, 1400.0)
GEN num 2000 rad discrete 50.0 70.0 x (50.0, 6500.0) y (50.0, 3000.0) group bed
PROP density 2.5e3 fric 0.0 shear 2.9e9 poiss 0.2 damp 0.3 hertz
SET dt 0.04 gravity 0.0 -9.8 print 400 save 400 energy 200
HIST id 1 interval 100 kinetic
CYC 400
PROP ebmod 2e8 gbmod 2e8 tstrength 1e6 sstrength 2e6 fric 0.3
WALL id 1 fric 0.3 xv 8.0
IMPLE wall id 1 xmove 120.0 save 60.0 print 60.0
DEL range y {top}-300.0 {top}
GEN num 100 rad discrete 50.0 60.0 x (1500.0, 6000.0) y (1800.0, 3600.0) color red group rain
PROP density 2.2e3 fric 0.4 shear 2.9e9 poiss 0.2 damp 0.2 hertz range group rain
CYC 400
SAV end.sav
STOP
"""
"""Bonds that break, particles that come and go, a wall that pushes, all kinds of output."""

CLUMPS = """\
START
SET disk on
BOX left 0.0 right 40.0 bottom 0.0 height 40.0 kn=1e8 ks=1e8 fric 0.3
GEN num 400 rad discrete 0.4 0.5 x (0.0, 40.0) y (12.0, 38.0) group rain
GEN num 120 rad discrete 0.4 0.5 x (0.0, 40.0) y (0.0, 8.0) group floor
CLUMP group boulder RANGE x 5.0 9.0 y 14.0 17.0
CLUMP group rod RANGE x 20.0 26.0 y 20.0 21.5
PROP density 2.5e3 fric 0.4 kn=1e8 ks=5e7 damp 0.1
PROP ebmod 2e8 gbmod 2e8 tstrength 1e6 sstrength 2e6 range group floor
SET dt 1e-4 gravity 0.0 -9.8 print 4000 energy 2000
HIST id 1 interval 500 kinetic
CYC 20000
SAV end.sav
STOP
"""
"""Clumps that fall among discs onto a bonded bed."""
