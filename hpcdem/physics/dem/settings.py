"""Settings of the SET command."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class Settings:
    """SI units. Intervals are in steps, 0 is off. `dt` and `frac`: the one given last counts, the other is 0. gentry:
    attempts of GEN per particle requested, 0 while not set. thickness: of the model, for pressures and stresses.
    units: that the user says to work in (core.units.SYSTEMS), "" none. restitution: 1 without dashpots. rolling: type
    of rolling resistance (rolling.py). side: x of the left periodic side, period: length of a periodic model, 0 of
    others (periodic.py); widening: velocity of its right side relative to the left one [m/s], since the time `since`
    [s], when the length was `length`."""

    dt: float = 0.0
    frac: float = 0.0
    gx: float = 0.0
    gy: float = 0.0
    disk: str = "on"
    lsm: float = 0.0
    stepbar: int = 0
    save: int = 0
    print: int = 0
    ps: int = 0
    vtk: int = 0
    energy: int = 0
    seed: int = 5
    wallside: str = "both"
    gentry: float = 0.0
    thickness: float = 1.0
    units: str = ""
    restitution: float = 1.0
    rolling: str = "c"
    side: float = 0.0
    period: float = 0.0
    widening: float = 0.0
    since: float = 0.0
    length: float = 0.0
