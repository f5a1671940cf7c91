"""The entries of the energy account of blocks and their fluid, see energy.py, and whether they add up."""

from __future__ import annotations

from hpcdem.core.account import closed as with_closing

ENTRIES = ("pumped", "leaked", "viscous", "fluid", "pushed", "strain", "joints", "fracture", "outside")
"""pumped: by conditions and wells at the pressure and height of their nodes; leaked: left with what leaks; viscous:
lost by the flow; fluid: stored by its compression and height; pushed: done on the blocks; strain: in elements; joints:
what they give back; fracture: lost by joints; outside: gravity and loads on the blocks but the fluid."""


def closed(entries: dict[str, float]) -> dict[str, float]:
    """Add closing: pumped + outside - all others except pushed, and relative: closing over the largest entry."""
    taken = ("leaked", "viscous", "fluid", "strain", "joints", "fracture")
    closing = entries["pumped"] + entries["outside"] - sum(entries[name] for name in taken)
    return with_closing(entries, closing)
