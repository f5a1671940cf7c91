"""A beam of elastic elements bends under its own weight: deflection against beam theory, for finer and finer meshes.

hpcdem.Simulation has blocks as it has particles, with the words of PCDC scripts. A few seconds on one core.

  hpcdem cantilever.py          results in cells4/, cells8/, cells16/
"""

import hpcdem

length, height = 1.0, 0.1  # m
density, young, poisson, g = 2700.0, 30e9, 0.25, 9.81

# Euler-Bernoulli and Timoshenko (shear coefficient 5/6), in plane strain, per metre of thickness.
weight, modulus, shear = density * g * height, young / (1.0 - poisson**2), young / (2.0 * (1.0 + poisson))
theory = weight * length**4 / (8.0 * modulus * height**3 / 12.0) + weight * length**2 / (
    2.0 * 5.0 / 6.0 * shear * height
)

for n in (4, 8, 16):
    with hpcdem.Simulation(outdir=f"cells{n}", log=False) as sim:
        sim.gravity((0, -g))
        sim.mesh.structured((0, 0), (length, height), cells=(10 * n, n), type="quad")
        sim.elements.model("mech-iso-elastic", density=density, young=young, poisson_ratio=poisson)
        sim.nodes.move(1, where="geometry 'left'")
        sim.solve(elastic=True)
        end = sim.nodes.values("displacement-y", where="geometry 'right'").mean()
    if sim.rank == 0:
        print(
            f"{n:3d} elements over the height: the end goes down by {-1e6 * end:.4g} um, theory {1e6 * theory:.4g} um"
        )
