"""hpcdem: discrete elements for rock and sand, on any number of ranks.

::

    import hpcdem

    sim = hpcdem.Simulation()
    sim.gen(2000, rad=[60.0, 80.0], x=(0.0, 20e3), y=(0.0, 10e3), group="sand")
    sim.cycle(5000)

See `hpcdem.Simulation` and docs/python.md. Names are loaded when they are first used: the environment has to be
settled before numpy, numba and MPI come in.

Made by ``scripts/pages``; do not edit it."""

from hpcdem.api import Simulation as Simulation
from hpcdem.api import couple as couple
from hpcdem.api import frames as frames
from hpcdem.core.errors import HpcdemError as HpcdemError
from hpcdem.physics.dem.user_laws import PairProperty as PairProperty
from hpcdem.physics.dem.user_laws import pair_law as pair_law
from hpcdem.physics.fdem.properties import Property as Property
from hpcdem.physics.fdem.user_laws import element_law as element_law
from hpcdem.physics.user_files import StateVariable as StateVariable
from hpcdem.runtime.launch import version as version
from hpcdem.sweep import Sweep as Sweep

_NAMES: dict[str, str]
