# Hello, drop: balls fall into a box, compared with theory
# -----------------------------------------------------------------------------
# shows     the height of fall of the first ball before any impact, and its
#           closed form, equal to the last digit printed; a picture of
#           the nine balls at five moments of the fall and at rest
# model     a box 8 m wide, nine spheres of radius 0.3 to 0.5 m
# run       python examples/hello_drop.py    or    hpcdem examples/hello_drop.py
#           (a few seconds)
# results   examples/data: hello_drop.jpg, frames, walls.csv
# -----------------------------------------------------------------------------
import numpy as np

import hpcdem

G, DT = 9.8, 2e-4

sim = hpcdem.Simulation(log=False)
sim.set(disk="off", dt=DT, gravity=(0.0, -G), print=0)
sim.wall(1, ((-4.0, 0.0), (4.0, 0.0)))
sim.wall(2, ((-4.0, 6.0), (-4.0, 0.0)))
sim.wall(3, ((4.0, 0.0), (4.0, 6.0)))
for k in range(9):
    size = k % 3
    sim.ball(x=-3.2 + 0.8 * k, y=4.5 + 0.5 * size, rad=0.3 + 0.1 * size, color=("red", "blue", "mg")[size])
sim.prop(density=2500.0, shear=1e7, poiss=0.2, hertz=True, fric=0.3)

moments = [sim.gather("x", "y", "radius", "color")]
for _ in range(4):
    sim.cycle(1000)
    moments.append(sim.gather("x", "y", "radius", "color"))

fallen = moments[0][1][0] - moments[-1][1][0]
theory = 0.5 * G * sim.time * (sim.time + DT)  # g dt^2 (1 + 2 + ... + n): the leap-frog sum of g t^2 / 2
if sim.rank == 0:
    print(f"after {sim.time:.2f} s ball 0 has fallen {fallen:.6f} m, theory {theory:.6f} m")

sim.prop(damp=0.4)  # now they may come to rest
sim.cycle(30000)
moments.append(sim.gather("x", "y", "radius", "color"))

# --- the picture ---------------------------------------------------------------
if sim.rank == 0:
    from matplotlib.collections import EllipseCollection
    from matplotlib.figure import Figure

    from hpcdem.io.colours import RGB

    figure = Figure(figsize=(6.7, 5.3), layout="constrained")
    ax = figure.add_subplot(xlim=(-4.1, 4.1), ylim=(-0.1, 6.1), aspect="equal", xlabel="x (m)", ylabel="y (m)")
    for n, (x, y, r, color) in enumerate(moments):
        at_rest = n == len(moments) - 1
        balls = EllipseCollection(
            2 * r, 2 * r, 0 * r, units="xy", offsets=np.c_[x, y], offset_transform=ax.transData, linewidths=0.8,
            edgecolors="black" if at_rest else RGB[color], facecolors=RGB[color] if at_rest else "none",
        )  # fmt: skip
        ax.add_collection(balls)
    ax.plot([-4, -4, 4, 4], [6, 0, 0, 6], color="black", linewidth=1.5)
    figure.savefig(sim.outdir / "hello_drop.jpg", dpi=200)
