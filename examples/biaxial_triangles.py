# Biaxial test: does the shape of the grains matter?
# -----------------------------------------------------------------------------
# shows     stress and volume of two dense samples of the same grading and the
#           same friction: round grains, and triangles with rounded corners
#           (rigid clumps of seven discs). Triangles interlock: they are
#           stronger, and dilate more before they fail
# model     450 grains of 4 to 6 mm, friction 0.5, between four smooth walls;
#           a servo holds the side walls at 100 kPa (sim.every)
# run       hpcdem examples/biaxial_triangles.py   (two minutes on one core)
# results   examples/data: biaxial_triangles.jpg, round.clumps and
#           triangle.clumps (the grains), frames, walls.csv
# -----------------------------------------------------------------------------
import math

import numpy as np

import hpcdem
from hpcdem.io.clumps import Clumps, write_clumps

GRAINS, SIZES = 450, (4e-3, 5e-3, 6e-3)  # number, diameters of round grains [m]
STRESS, STRAIN, INERTIAL = 100e3, 0.16, 2e-3  # side stress [Pa], shortening, inertial number of the loading
DENSITY, STIFF, FRICTION = 2600.0, 1e8, 0.5
LEFT, RIGHT, BOTTOM, TOP = 1, 2, 3, 4
INWARD = {LEFT: (1, 0), RIGHT: (-1, 0), BOTTOM: (0, 1), TOP: (0, -1)}


# --- the grains --------------------------------------------------------------------
def circle(area):
    """Discs (dx, dy, r) and polar second moment of area of a round grain of this area [m2]."""
    r = math.sqrt(area / math.pi)
    return [(0.0, 0.0, r)], 0.5 * math.pi * r**4


def triangle(area, corner=0.22):
    """The same of an equilateral triangle whose corners are arcs; corner: their radius over the straight edge.

    Seven discs touch the outline from inside: at the corners, at the middle (of all edges), and halfway between.
    """
    edge = math.sqrt(area / (math.sqrt(3) / 4 + 3 * corner + math.pi * corner**2))
    r, inner = corner * edge, edge / (2 * math.sqrt(3))
    ways = [math.pi / 2 + k * 2 * math.pi / 3 for k in range(3)]
    discs = [(0.0, 0.0, r + inner)]
    for t in (1.0, 0.55):  # share of the way from the middle to a corner
        discs += [(2 * inner * t * math.cos(w), 2 * inner * t * math.sin(w), r + (1 - t) * inner) for w in ways]
    # Triangle, three bands of width r along its edges, three sectors of a third of a circle: moments about the middle.
    moment = math.sqrt(3) / 48 * edge**4
    moment += 3 * (edge * r * ((inner + r / 2) ** 2 + r * r / 12) + r * edge**3 / 12)
    beyond = math.sqrt(3) * r / math.pi  # from the corner of the triangle to the centroid of its sector
    moment += math.pi * r**2 * ((2 * inner) ** 2 + 4 * inner * beyond + r * r / 2)
    return discs, moment


def write_grains(path, shape, pitch, columns):
    """A loose lattice of grains turned at random; the same sizes in the same places for every shape."""
    rng = np.random.default_rng(2)
    sizes, angle = rng.choice(SIZES, GRAINS), rng.uniform(0, 2 * math.pi, GRAINS)
    area = math.pi / 4 * sizes**2
    grains = [shape(a) for a in area]
    at = np.arange(GRAINS)
    start = np.concatenate([[0], np.cumsum([len(discs) for discs, _ in grains])])
    dx, dy, r = np.array([disc for discs, _ in grains for disc in discs]).T
    moment = np.array([m for _, m in grains])
    x, y = (at % columns + 0.5) * pitch, (at // columns + 0.5) * pitch
    write_clumps(path, Clumps(x, y, angle, area, moment, start, dx, dy, r))


# --- the press ---------------------------------------------------------------------
class Press:
    """Four walls around a sample; a servo holds walls at a stress every STEPS steps:
    inward speed = gain error + drift, the drift following the error slowly."""

    STEPS, SHARE = 5, 0.03

    def __init__(self, sim):
        self.sim, self.fastest = sim, 0.2 * math.sqrt(STRESS / DENSITY)
        d = np.mean(SIZES)
        self.gain = 0.4 * d / (STIFF * self.STEPS)  # over dt: a grain at every diameter of the wall
        self.wanted = dict.fromkeys(INWARD, STRESS)
        self.driven, self.drift, self.good, self.curve = {}, {}, 0, []

    def size(self):
        """Width and height of the sample [m]."""
        w = self.sim.walls
        return w[RIGHT].p1[0] - w[LEFT].p1[0], w[TOP].p1[1] - w[BOTTOM].p1[1]

    def __call__(self, sim):
        width, height = self.size()
        force = sim.wall_forces()
        now = {
            wall: -(force[wall][0] * nx + force[wall][1] * ny) / (height if nx else width)
            for wall, (nx, ny) in INWARD.items()
        }
        for wall, (nx, ny) in INWARD.items():
            speed = self.driven.get(wall)
            if speed is None:
                push = self.gain / sim.dt * (self.wanted[wall] - now[wall])
                speed = max(-self.fastest, min(self.fastest, push + self.drift.get(wall, 0.0)))
                if abs(speed) < self.fastest:
                    self.drift[wall] = self.drift.get(wall, 0.0) + self.SHARE * push
            sim.wall(wall, xv=speed * nx, yv=speed * ny)
        self.curve.append((width, height, (now[BOTTOM] + now[TOP]) / 2, (now[LEFT] + now[RIGHT]) / 2))
        self.good = self.good + 1 if all(abs(s / STRESS - 1) < 0.01 for s in now.values()) else 0
        return not self.driven and self.good == 100  # True ends the cycle: at rest under this stress

    def run(self, steps):
        call = self.sim.every(self.STEPS, self)
        self.sim.cycle(steps)
        call.cancel()
        return np.array(self.curve)


sim = hpcdem.Simulation()


def test(name, shape):
    """Shortening, deviator stress [Pa], volume strain; places of discs; of a sample of one shape."""
    sim.start()
    pitch, columns = 1.75 * max(SIZES), round(math.sqrt(GRAINS / 2))
    width, height = columns * pitch, -(-GRAINS // columns) * pitch
    path = sim.outdir / f"{name}.clumps"
    if sim.rank == 0:
        sim.outdir.mkdir(parents=True, exist_ok=True)
        write_grains(path, shape, pitch, columns)
    sim.set(frac=0.25, gentry=60, print=0)
    springs = {"kn": STIFF, "ks": STIFF}
    sim.wall(LEFT, ((0.0, -height), (0.0, 2 * height)), **springs)
    sim.wall(RIGHT, ((width, -height), (width, 2 * height)), **springs)
    sim.wall(BOTTOM, ((-height, 0.0), (2 * height, 0.0)), **springs)
    sim.wall(TOP, ((-height, height), (2 * height, height)), **springs)
    sim.clump(path)
    sim.prop(density=DENSITY, damp=0.3, fric=0.0, **springs)  # without friction it packs densely
    Press(sim).run(200_000)
    sim.prop(fric=FRICTION)
    press = Press(sim)
    press.run(20_000)

    press = Press(sim)
    width, height = press.size()
    rate = INERTIAL / (np.mean(SIZES) * math.sqrt(DENSITY / STRESS))
    press.driven = {BOTTOM: rate * height / 2, TOP: rate * height / 2}
    curve = press.run(round(STRAIN / rate / sim.dt))
    void = width * height / sim.clumps()["area"].sum() - 1
    strain, volume = np.log(height / curve[:, 1]), np.log(curve[:, 0] * curve[:, 1] / (width * height))
    found = {"strain": strain, "q": curve[:, 2] - curve[:, 3], "volume": volume, "void": void, "walls": sim.walls}
    return found | dict(zip(("x", "y", "r", "clump"), sim.gather("x", "y", "radius", "clump")))


def smooth(values):
    """Running mean over two hundredths of the way."""
    n = max(len(values) // 50, 1)
    return np.convolve(values, np.ones(n) / n, "valid")


tests = {name: test(name, shape) for name, shape in (("round", circle), ("triangle", triangle))}

# --- numbers and the picture ----------------------------------------------------------
if sim.rank == 0:
    for name, t in tests.items():
        q = smooth(t["q"])
        angle = math.degrees(math.asin(q.max() / (q.max() + 2 * STRESS)))
        late = q[len(q) * 3 // 4 :].mean()
        print(
            f"{name}: void ratio {t['void']:.3f}, peak of s1 - s3 {q.max() / 1e3:.0f} kPa (friction angle "
            f"{angle:.1f} degrees), at the end {late / 1e3:.0f} kPa, volume strain {100 * t['volume'][-1]:.1f} %"
        )

    from matplotlib.collections import EllipseCollection
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.7, 4.6), layout="constrained")
    grid = figure.add_gridspec(2, 3, width_ratios=(1.7, 1.0, 1.0), height_ratios=(1.4, 1.0))
    above = figure.add_subplot(grid[0, 0])
    below = figure.add_subplot(grid[1, 0], sharex=above)
    for (name, t), color in zip(tests.items(), ("tab:blue", "tab:red")):
        strain = 100 * smooth(t["strain"])
        above.plot(strain, smooth(t["q"]) / 1e3, color=color, label=f"{name}, e = {t['void']:.2f}")
        below.plot(strain, 100 * smooth(t["volume"]), color=color)
    above.set(xlim=(0, 100 * STRAIN), ylim=(0, None), ylabel=r"$\sigma_1-\sigma_3$ (kPa)")
    above.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, columnspacing=1.0)
    above.tick_params(labelbottom=False)
    below.axhline(0.0, color="0.6", linewidth=0.6)
    below.set(xlabel="shortening (%)", ylabel="swelling (%)")
    shades = np.array(["#f2d7a0", "#d9a441", "#a9743a", "#7f8c8d", "#c9c2b4"])
    highest = 1e3 * max(t["walls"][TOP].p1[1] - t["walls"][BOTTOM].p1[1] for t in tests.values())
    widest = 1e3 * max(t["walls"][RIGHT].p1[0] - t["walls"][LEFT].p1[0] for t in tests.values())
    for k, (name, t) in enumerate(tests.items()):
        ax = figure.add_subplot(grid[:, 1 + k])
        size = 2e3 * t["r"]
        ax.add_collection(
            EllipseCollection(
                size, size, 0 * size, units="xy", offsets=1e3 * np.c_[t["x"], t["y"]], offset_transform=ax.transData,
                facecolors=shades[np.unique(t["clump"], return_inverse=True)[1] * 7 % 5], linewidths=0,
            )
        )  # fmt: skip
        w = t["walls"]
        x1, x2 = 1e3 * w[LEFT].p1[0], 1e3 * w[RIGHT].p1[0]
        y1, y2 = 1e3 * w[BOTTOM].p1[1], 1e3 * w[TOP].p1[1]
        ax.plot([x1, x2, x2, x1, x1], [y1, y1, y2, y2, y1], color="0.2", linewidth=1.0)
        middle = (x1 + x2) / 2  # one scale for both
        ax.set(xlim=(middle - widest / 2 - 2, middle + widest / 2 + 2), ylim=(y1 - 2, y1 + highest + 2), aspect="equal")
        ax.text(middle, y1 - 3, name, ha="center", va="top")
        ax.set_axis_off()
    figure.savefig(sim.outdir / "biaxial_triangles.jpg", dpi=200)
