"""Water in fixed jointed rock: parameters and lines that several cases share."""

from __future__ import annotations

from hpcdem.cases.base import Case, quantity


class Water(Case):
    """Parameters of the fluid; its bulk modulus does not affect steady flow."""

    fluid_density: float = quantity(1000.0, "kg/m3", "density of the water", gt=0)
    viscosity: float = quantity(1e-3, "Pa s", "dynamic viscosity of the water", gt=0)
    aperture: float = quantity(1e-5, "m", "hydraulic aperture of the joints", gt=0)


class Warm(Case):
    """Parameters of water and rock with heat; flow is steady, so the bulk modulus of the water has no effect."""

    fluid_density: float = quantity(1000.0, "kg/m3", "density of the water", gt=0)
    viscosity: float = quantity(1e-3, "Pa s", "dynamic viscosity of the water", gt=0)
    fluid_conductivity: float = quantity(0.6, "W/(m K)", "thermal conductivity of the water", ge=0)
    fluid_capacity: float = quantity(4200.0, "J/(kg K)", "specific heat of the water", gt=0)
    exchange: float = quantity(1e3, "W/(m2 K)", "heat transfer between the water and each side of its channel", gt=0)
    density: float = quantity(2700.0, "kg/m3", "density of the rock", gt=0)
    conductivity: float = quantity(2.7, "W/(m K)", "thermal conductivity of the rock", gt=0)
    capacity: float = quantity(1000.0, "J/(kg K)", "specific heat of the rock", gt=0)


WARM = """\
pcdc face-joint c-model hydr-p-m property fluid-density [fluid_density] fluid-bulk 1e6 \\
    viscosity [viscosity/fluid_density] aperature-initial [aperture] \\
    aperature-minumum [0.5*aperture] RANGE
pcdc face-joint c-model t-f property conductivity [fluid_conductivity] capacity [fluid_capacity] \\
    transfer-coeficient [exchange] RANGE
pcdc model option mechanical off                 # the rock is fixed
pcdc flow-node initial saturation 1
"""
"""Water-filled channels of a RANGE with a thermal model; elements have their own."""

ROCK = """
pcdc element c-model mech-iso-e property density 2500 young 50e9 poisson-r 0.25
pcdc model option mechanical off                 # the rock is fixed
"""
CHANNELS = """\
pcdc face-joint c-model hydr-p-m property fluid-density [fluid_density] fluid-bulk 2.2e9 \\
    viscosity [viscosity/fluid_density] aperature-initial [aperture] aperature-minumum [0.01*aperture] RANGE
"""
"""Channels: all joints, or those of a RANGE."""

STEADY = """
import numpy as np
pcdc model solve hydraulic steady
inflow = float(pcdc.values('flow-node', 'inflow', group='in', set='wet').sum())
outflow = -float(pcdc.values('flow-node', 'inflow', group='out', set='wet').sum())
imbalance = abs(inflow - outflow) / max(abs(inflow), 1e-300)
account = pcdc.fluid['relative']                 # what of the volume of fluid does not add up
nodes = pcdc.numbers('flow-node')
x, y, pressure = (np.asarray(v) for v in (pcdc.values('node', 'position-x'), pcdc.values('node', 'position-y'),
                                          pcdc.values('flow-node', 'pressure')))
at = np.searchsorted(pcdc.numbers('node'), nodes)
x, y = x[at], y[at]
"""
"""inflow, outflow [m2/s] of the groups 'in' and 'out' set 'wet'; imbalance, account; x, y, pressure of nodes."""
