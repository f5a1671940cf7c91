"""The Python interface: the commands of both languages as methods, the state as numpy arrays.

Everything ends in the functions of `hpcdem.commands`, as a script does, so both give the same results to the last
bit. Under mpiexec or srun every rank runs the same program, and every method is collective: call it on all ranks.
"""

from hpcdem.api.frames import Frame, Frames, frames
from hpcdem.api.simulation import Call, Coupling, Simulation, Wall, couple

__all__ = ["Call", "Coupling", "Frame", "Frames", "Simulation", "Wall", "couple", "frames"]
