# Biaxial test: how strong is the rock?
# -----------------------------------------------------------------------------
# shows     stress-strain curves of one bonded specimen at three confining
#           stresses, its friction angle and cohesion (about 16 degrees and
#           11 MPa), and the bands along which its bonds broke
# model     1430 spheres of radius 60 and 80 m between four smooth walls; the
#           a servo holds the stress on the side walls (sim.every)
# run       hpcdem examples/biaxial.py         (under a minute on one core)
# results   examples/data: biaxial.jpg, frames at the start of each stage,
#           walls.csv (forces on all walls)
# -----------------------------------------------------------------------------
import math

import numpy as np

import hpcdem

GRAINS = 1500
CONFINING = 10e6, 20e6, 40e6  # side stress s3 [Pa]
STRAIN, RATE = 0.12, 3e-4  # shortening and its rate [1/s]: slow, the inertial number stays below 1e-3
LEFT, RIGHT, BOTTOM, TOP = 1, 2, 3, 4
INWARD = {LEFT: (1, 0), RIGHT: (-1, 0), BOTTOM: (0, 1), TOP: (0, -1)}

# --- a loose sample between four walls ---------------------------------------------
width = 160.0 * math.sqrt(GRAINS / 2)
height = 2.0 * width
sim = hpcdem.Simulation()
sim.set(disk="off", dt=0.04, seed=1, gentry=60, print=0)
sim.wall(LEFT, ((0.0, -height), (0.0, 2 * height)))
sim.wall(RIGHT, ((width, -height), (width, 2 * height)))
sim.wall(BOTTOM, ((-height, 0.0), (2 * height, 0.0)))
sim.wall(TOP, ((-height, height), (2 * height, height)))
sim.gen(GRAINS, rad=[60.0, 80.0], x=(0.0, width), y=(0.0, height))
sim.prop(density=2500.0, shear=2.9e9, poiss=0.2, hertz=True, damp=0.4, fric=0.0)
thickness = 2.0 * sim.gather("radius").mean()  # of the slice that forces act on


# --- the press ---------------------------------------------------------------------
def size():
    """Width and height of the sample [m]."""
    w = sim.walls
    return w[RIGHT].p1[0] - w[LEFT].p1[0], w[TOP].p1[1] - w[BOTTOM].p1[1]


def stresses():
    """Normal stress on each wall [Pa]."""
    across, along = size()
    force = sim.wall_forces()
    return {
        wall: -(force[wall][0] * nx + force[wall][1] * ny) / ((along if nx else across) * thickness)
        for wall, (nx, ny) in INWARD.items()
    }


class Servo:
    """Holds walls at a stress: inward speed = GAIN error + drift, the drift following the error slowly.

    GAIN: some 8e10 N/m are the stiffness of a grain at a wall; times 5 steps of 0.04 s, over diameter and thickness.
    """

    GAIN, SHARE, FASTEST, STEPS = 6e-7, 0.03, 6.0, 5

    def __init__(self, stress, walls, driven=0.0):
        self.stress, self.walls, self.driven = stress, walls, driven
        self.drift = dict.fromkeys(INWARD, 0.0)
        self.good = 0
        self.curve = []  # height, width, axial stress, side stress

    def __call__(self, sim):
        now = stresses()
        for wall, (nx, ny) in INWARD.items():
            speed = self.driven
            if wall in self.walls:
                push = self.GAIN * (self.stress - now[wall])
                speed = max(-self.FASTEST, min(self.FASTEST, push + self.drift[wall]))
                if abs(speed) < self.FASTEST:
                    self.drift[wall] += self.SHARE * push
            sim.wall(wall, xv=speed * nx, yv=speed * ny)
        self.curve.append((*size(), (now[BOTTOM] + now[TOP]) / 2, (now[LEFT] + now[RIGHT]) / 2))
        within = all(abs(now[wall] / self.stress - 1) < 0.01 for wall in self.walls)
        self.good = self.good + 1 if within else 0
        return not self.driven and self.good == 50  # True ends the cycle: at rest under this stress

    def run(self, steps):
        """Run the servo for a number of steps, or until the stress is reached if no wall is driven."""
        call = sim.every(self.STEPS, self)
        sim.cycle(steps)
        call.cancel()
        return np.array(self.curve)


# --- one specimen: packed without friction, bonded, and kept ---------------------------
Servo(CONFINING[0], INWARD).run(60000)
bonds = sim.bond(ebmod=2e8, gbmod=2e8, tstrength=1e7, sstrength=2e7)
sim.prop(fric=0.3)
specimen = sim.outdir / "specimen.sav"
sim.save(specimen)

# --- tested at each confining stress ----------------------------------------------------
curves = {}
for s3 in CONFINING:
    sim.restore(specimen)
    Servo(s3, INWARD).run(60000)
    before = sim.bonds()
    width, height = size()
    curve = Servo(s3, (LEFT, RIGHT), driven=RATE * height / 2).run(round(STRAIN / RATE / sim.dt))
    strain, q = np.log(height / curve[:, 1]), curve[:, 2] - curve[:, 3]
    n = len(q) // 50
    curves[s3] = np.convolve(strain, np.ones(n) / n, "valid"), np.convolve(q, np.ones(n) / n, "valid")
    if s3 == CONFINING[0]:  # where did bonds break?
        ids, x, y, r = sim.gather("gid", "x", "y", "radius")
        after, walls = sim.bonds(), sim.walls
        held = set(zip(after["id1"], after["id2"]))
        broken = np.array([pair for pair in zip(before["id1"], before["id2"]) if pair not in held])

peaks = [max(q) for _, q in curves.values()]
slope, level = np.polyfit(CONFINING, peaks, 1)  # q = (K - 1) s3 + 2 c sqrt(K)
friction = math.degrees(math.asin(slope / (slope + 2)))
cohesion = level / (2 * math.sqrt(slope + 1))
if sim.rank == 0:
    for s3, peak in zip(CONFINING, peaks):
        print(f"s3 {s3 / 1e6:g} MPa: peak of s1 - s3 is {peak / 1e6:.1f} MPa")
    print(f"friction angle {friction:.1f} degrees, cohesion {cohesion / 1e6:.1f} MPa")

# --- the picture ------------------------------------------------------------------------
if sim.rank == 0:
    from matplotlib.collections import EllipseCollection
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.7, 4.2), layout="constrained")
    left, right = figure.subplots(1, 2, width_ratios=(1.5, 1.0))
    for (s3, (strain, q)), color in zip(curves.items(), ("tab:green", "tab:blue", "tab:red")):
        left.plot(100 * strain, q / 1e6, color=color, label=f"$\\sigma_3$ = {s3 / 1e6:g} MPa")
    left.set(xlim=(0, 100 * STRAIN), ylim=(0, None), xlabel="shortening (%)")
    left.set_ylabel(r"$\sigma_1-\sigma_3$ (MPa)")
    left.legend(frameon=False, loc="upper right")
    left.set_ylim(0, 1.25 * max(peaks) / 1e6)

    lost = np.zeros(len(ids))  # bonds broken of each grain
    np.add.at(lost, np.searchsorted(ids, broken.ravel()), 1.0)
    grains = EllipseCollection(
        r / 500.0, r / 500.0, 0 * r, units="xy", offsets=np.c_[x, y] / 1e3, offset_transform=right.transData,
        cmap="YlOrRd",
    )  # fmt: skip
    grains.set_array(lost)
    grains.set_clim(0, 6)
    right.add_collection(grains)
    x1, x2 = walls[LEFT].p1[0] / 1e3, walls[RIGHT].p1[0] / 1e3
    y1, y2 = walls[BOTTOM].p1[1] / 1e3, walls[TOP].p1[1] / 1e3
    right.plot([x1, x1], [y1, y2], [x2, x2], [y1, y2], color="0.5", linewidth=1.0)
    right.plot([x1 - 0.3, x2 + 0.3], [y1, y1], [x1 - 0.3, x2 + 0.3], [y2, y2], color="black", linewidth=2.0)
    right.set(xlim=(x1 - 0.4, x2 + 0.4), ylim=(y1 - 0.2, y2 + 0.2), aspect="equal", xlabel="x (km)", ylabel="y (km)")
    figure.colorbar(grains, ax=right, label="bonds broken per grain", shrink=0.7)
    figure.savefig(sim.outdir / "biaxial.jpg", dpi=200)
