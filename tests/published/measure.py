"""The measurements that hold our models beside published ones: those of the package under one name."""

from functools import partial

from hpcdem.post.measure import faults
from hpcdem.post.measure.breaks import Break, advance, breaks, heaves
from hpcdem.post.measure.faults import Band
from hpcdem.post.measure.grains import Grains, common, grains, series
from hpcdem.post.measure.surface import front, on, peaks, surface, thickness, uplift
from hpcdem.post.measure.triangles import Strain, shear, strain
from hpcdem.post.measure.wedge import Wedge, wedge

bands = partial(faults.bands, straight=False)
"""Connected bands as they are, also where faults meet."""

__all__ = [
    "Band", "Break", "Grains", "Strain", "Wedge", "advance", "bands", "breaks", "common", "front", "grains", "heaves",
    "on", "peaks", "series", "shear", "strain", "surface", "thickness", "uplift", "wedge",
]  # fmt: skip
