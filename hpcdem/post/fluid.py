"""Fluid in pictures of blocks: channels coloured by what is in them, the wider the more they are open."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcdem.io.vtkhdf_mesh import MeshState

DRY = "#b9b4aa"
WET = 0.5
"""Saturation below which channels are drawn as dry."""
LEAST = 0.3
"""Width of the narrowest channel over that of the widest."""


@dataclass(frozen=True)
class Shown:
    """A picture of channels. column: of the frame; unit: in SI; dry: dry channels have a value too; colours: name in
    matplotlib, chosen for contrast with pale rock.
    """

    column: str
    unit: str
    title: str
    dry: bool
    colours: str

    def values(self, state: MeshState) -> np.ndarray:
        """Return the values of joints (nj,); NaN for joints that are not channels."""
        found = np.abs(state.of_joints.get(self.column, np.full(len(state.joints), np.nan)))
        if not self.dry and there(state):
            found = np.where(state.of_joints["saturation"] < WET, np.nan, found)
        return found

    def range(self, state: MeshState) -> tuple[float, float]:
        """Return the range from 0, or the least value where that is a little below the greatest, to the greatest."""
        values = self.values(state)
        values = values[np.isfinite(values)]
        if not len(values):
            return 0.0, 0.0
        low, high = float(values.min()), float(values.max())
        return (low if 0.8 * high < low < 0.99 * high else 0.0), high


PICTURES = {
    "pressure": Shown("fluid_pressure", "Pa", "fluid pressure", False, "YlGnBu"),
    "saturation": Shown("saturation", "", "saturation", True, "Blues"),
    "aperture": Shown("aperture", "m", "aperture", True, "YlOrRd"),
    "velocity": Shown("fluid_velocity", "m/s", "fluid velocity", False, "PuRd"),
    "concentration": Shown("proppant_concentration", "", "proppant concentration", False, "YlOrBr"),
}
"""Pictures of the fluid by the word for each."""


def there(state: MeshState) -> bool:
    """Return whether a frame has channels."""
    return bool(np.isfinite(state.of_joints.get("aperture", np.empty(0))).any())


def with_proppant(state: MeshState) -> bool:
    """Return whether the fluid of a frame carries proppant."""
    return "proppant_concentration" in state.of_joints


def ends(state: MeshState) -> np.ndarray:
    """Return the end points (n, 2) of all channels [m]."""
    rows = np.isfinite(state.of_joints.get("aperture", np.full(len(state.joints), np.nan)))
    return state.points[state.joints[rows]].reshape(-1, 2)


def draw(axes: Any, state: MeshState, shown: Shown, span: tuple[float, float], unit: float, width: float) -> Any:
    """Draw the channels with colours over a range `span` in this unit; width: of the widest line [points]. Return the
    artist of the colour bar, None without channels.
    """
    from matplotlib.collections import LineCollection
    from matplotlib.colors import LinearSegmentedColormap, Normalize

    if not there(state):
        return None
    from matplotlib import colormaps

    lines, values = state.points[state.joints], shown.values(state)
    aperture = state.of_joints["aperture"]
    wide = width * np.clip(aperture / max(float(np.nanmax(aperture)), 1e-300), LEAST, 1.0)
    dry = np.isfinite(aperture) & ~np.isfinite(values)
    axes.add_collection(LineCollection(lines[dry], colors=DRY, linewidths=LEAST * width, zorder=2), autolim=False)
    rows = np.flatnonzero(np.isfinite(values))
    rows = rows[np.argsort(values[rows], kind="stable")]  # the largest on top
    colours = LinearSegmentedColormap.from_list(shown.colours, colormaps[shown.colours](np.linspace(0.25, 1.0, 64)))
    high = max(span[1], span[0] + 1e-12) / unit
    drawn = LineCollection(
        lines[rows], array=values[rows] / unit, cmap=colours, norm=Normalize(span[0] / unit, high),
        linewidths=wide[rows], capstyle="round", zorder=3,
    )  # fmt: skip
    axes.add_collection(drawn, autolim=False)
    return drawn
