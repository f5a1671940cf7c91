"""The figure of examples/rock_into_sand.sc: the boulder and the sand at four moments.

`python scripts/lib/coupled_figure.py [FOLDER]` runs the script (under a minute) and draws into docs/figures.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from PIL import Image

from hpcdem.io.frames import list_frames, list_mesh_frames, read_frame
from hpcdem.io.vtkhdf_mesh import read_mesh_frame
from hpcdem.post import blocks, layers

ROOT = Path(__file__).resolve().parents[2]
EXAMPLE = ROOT / "examples" / "rock_into_sand.sc"
NAME = "rock_into_sand.png"
CM = 1.0 / 2.54
FONT = 8.0


def run(folder: Path, text: str) -> None:
    """Run the script in a folder."""
    (folder / EXAMPLE.name).write_text(text)
    subprocess.run([sys.executable, "-m", "hpcdem", "--no-figure", EXAMPLE.name], cwd=folder, check=True,
                   stdout=subprocess.DEVNULL)  # fmt: skip


def draw(folder: Path, x: tuple[float, float] = (0.4, 2.2), y: tuple[float, float] = (0.0, 1.0)) -> Any:
    """The last four frames of the boulder, each with the sand of the same moment: those of the sand that are as many
    frames from the last one. Part of the plane from ... to ... [m]."""
    rocks = list_mesh_frames(folder / "data", "boulder")[-4:]
    beds = [frame for frame in list_frames(folder / "sand") if not frame.ini][-len(rocks) :]
    states = [read_mesh_frame(rock.path) for rock in rocks]
    figure, panels = plt.subplots(2, 2, figsize=(17 * CM, 11.5 * CM), layout="constrained", sharex=True, sharey=True)
    for axes, state, bed, letter in zip(panels.flat, states, beds, "abcd", strict=True):
        layers.balls(read_frame(bed.path), axes)
        blocks.cracks(axes, state, FONT, 8.0 / (x[1] - x[0]))
        if axes is not panels.flat[0] and axes.get_legend() is not None:
            axes.get_legend().remove()
        axes.set(xlim=x, ylim=y, aspect="equal")
        axes.set_title(f"({letter}) {1e3 * state.time:.0f} ms", loc="left", fontsize=FONT)
    for axes in panels[1]:
        axes.set_xlabel("x (m)")
    for axes in panels[:, 0]:
        axes.set_ylabel("y (m)")
    return figure


def main(folder: Path, text: str | None = None) -> Path:
    """Run, draw; the path of the figure."""
    with tempfile.TemporaryDirectory() as work, matplotlib.rc_context({"font.size": FONT, "axes.linewidth": 0.6}):
        run(Path(work), EXAMPLE.read_text() if text is None else text)
        figure = draw(Path(work))
        figure.savefig(folder / NAME, dpi=150)
        plt.close(figure)
    with Image.open(folder / NAME) as picture:  # few colours: a third of the bytes
        picture.convert("RGB").quantize(64).save(folder / NAME, optimize=True)
    return folder / NAME


if __name__ == "__main__":
    print(main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs" / "figures"))
