"""Scripts that use a specimen: gravity deposition, and a biaxial test.

The numbers in them follow from the specimen: a stiffness at which grains overlap little under the load there is, a time
step a fraction of sqrt(m / k), times from falling and from the strain rate at which the test is quasi-static.
"""

from __future__ import annotations

import math
from string import Template

from hpcdem.pre.specimen import Specimen
from hpcdem.pre.specimen.files import group_of

GRAVITY, DENSITY, FRICTION = 9.81, 2650.0, 0.5
OVERLAP = 1e-3
"""Approximate overlap at rest over the diameter of a grain."""
IMPACT = 0.1
"""Largest overlap, over its radius, of a disc that falls down through the whole space above the specimen."""
FRACTION = 0.15
"""Time step over sqrt(m / k) of the smallest grain."""
CONFINING, STIFFNESS = 100e3, 500.0
"""Confining stress [Pa], and the stiffness of a contact over it."""
INERTIAL = 1e-3
"""Inertial number, rate x d x sqrt(density / stress), of the test: quasi-static (GDR MiDi 2004)."""
_COLOURS = "yellow", "red", "blue", "green", "mg", "violet", "gb", "lg", "black"

_DEPOSIT = Template("""\
# Gravity deposition of the grains in $file
# -----------------------------------------------------------------------------
# model     $grains between three walls, $width_mm mm apart
# run       hpcdem deposit.py      ($steps steps)
# results   data: frames at the start and the end$results
# -----------------------------------------------------------------------------
$begin
SET disk on                             # discs of 1 m thickness
SET dt $dt
SET gravity 0.0 -$gravity
SET print 0

WALL id 1 nodes (0.0, $top) (0.0, 0.0) kn $kn ks $kn fric $friction color black
WALL id 2 nodes (0.0, 0.0) ($width, 0.0) kn $kn ks $kn fric $friction color black
WALL id 3 nodes ($width, $top) ($width, 0.0) kn $kn ks $kn fric $friction color black

# At this stiffness grains overlap by about a thousandth of their size under the
# weight of those above.
PROP density $density kn $kn ks $kn damp 0.3 fric $friction
$colours
CYC $steps
${end}STOP
""")

_BIAXIAL = Template('''\
# Biaxial test of the grains in $file
# -----------------------------------------------------------------------------
# shows     deviator stress and volumetric strain over axial strain
# model     $grains between four smooth walls; the side walls
#           are held at their stress by a servo
# run       hpcdem biaxial.py
# results   data: biaxial.csv, biaxial.png, frames
# -----------------------------------------------------------------------------
import csv
from pathlib import Path

import numpy as np

import hpcdem

CONFINING = $stress  # side stress [Pa]
STRAIN, RATE = 0.2, $rate  # shortening and its rate [1/s]: an inertial number of about 1e-3
FRICTION = $friction  # during the test; the grains are packed with PACKED
PACKED = 0.1
WIDTH, HEIGHT, SIZE = $width, $height, $size  # the box, the mean size of the grains [m]
KN = $kn  # stiffness of contacts [N/m]: $stiffness times the stress
DT = $dt
LEFT, RIGHT, BOTTOM, TOP = 1, 2, 3, 4
INWARD = {LEFT: (1, 0), RIGHT: (-1, 0), BOTTOM: (0, 1), TOP: (0, -1)}

sim = hpcdem.Simulation()
$begin
sim.set(disk="on", dt=DT, print=0)
far = 2.0 * max(WIDTH, HEIGHT)
sim.wall(LEFT, ((0.0, -far), (0.0, far)), kn=KN, ks=0.0)
sim.wall(RIGHT, ((WIDTH, -far), (WIDTH, far)), kn=KN, ks=0.0)
sim.wall(BOTTOM, ((-far, 0.0), (far, 0.0)), kn=KN, ks=0.0)
sim.wall(TOP, ((-far, HEIGHT), (far, HEIGHT)), kn=KN, ks=0.0)
sim.prop(density=$density, kn=KN, ks=KN, damp=0.3, fric=PACKED)


def size():
    """Width and height of the sample [m]."""
    w = sim.walls
    return w[RIGHT].p1[0] - w[LEFT].p1[0], w[TOP].p1[1] - w[BOTTOM].p1[1]


class Servo:
    """Holds walls at a stress: inward speed = GAIN error + drift, the drift following the error slowly.

    GAIN: the share of a layer of grains, of stiffness KN / SIZE, that would be compressed in the STEPS
    between two calls.
    """

    STEPS, SHARE, FASTEST = 5, 0.03, 3.0 * RATE * HEIGHT
    GAIN = 0.2 * SIZE / (KN * STEPS * DT)

    def __init__(self, stress, walls, driven=0.0):
        self.stress, self.walls, self.driven = stress, walls, driven
        self.drift = dict.fromkeys(INWARD, 0.0)
        self.good = 0
        self.curve = []  # height, width, axial stress, side stress

    def __call__(self, sim):
        across, along = size()
        force = sim.wall_forces()
        now = {
            wall: -(force[wall][0] * nx + force[wall][1] * ny) / (across if ny else along)
            for wall, (nx, ny) in INWARD.items()
        }
        for wall, (nx, ny) in INWARD.items():
            speed = self.driven
            if wall in self.walls:
                push = self.GAIN * (self.stress - now[wall])
                speed = max(-self.FASTEST, min(self.FASTEST, push + self.drift[wall]))
                if abs(speed) < self.FASTEST:
                    self.drift[wall] += self.SHARE * push
            sim.wall(wall, xv=speed * nx, yv=speed * ny)
        self.curve.append((along, across, (now[BOTTOM] + now[TOP]) / 2, (now[LEFT] + now[RIGHT]) / 2))
        within = all(abs(now[wall] / self.stress - 1) < 0.02 for wall in self.walls)
        self.good = self.good + 1 if within else 0
        return not self.driven and self.good == 50  # True ends the cycle: at rest under this stress

    def run(self, steps):
        """Run the servo for a number of steps, or until the stress is reached if no wall is driven."""
        call = sim.every(self.STEPS, self)
        sim.cycle(steps)
        call.cancel()
        return np.array(self.curve)


Servo(CONFINING, INWARD).run(round(1.0 / RATE / DT))
sim.prop(fric=FRICTION)
width, height = size()
curve = Servo(CONFINING, (LEFT, RIGHT), driven=RATE * height / 2).run(round(STRAIN / RATE / DT))
axial, lateral = np.log(height / curve[:, 0]), np.log(width / curve[:, 1])
deviator, side = curve[:, 2] - curve[:, 3], curve[:, 3]

if sim.rank == 0:
    from matplotlib.figure import Figure

    n = max(1, len(axial) // 200)
    rows = [np.convolve(v, np.ones(n) / n, "valid")[::n] for v in (axial, axial + lateral, deviator, side)]
    with open(Path(sim.outdir) / "biaxial.csv", "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["axial_strain", "volumetric_strain", "deviator_stress[Pa]", "side_stress[Pa]"])
        table.writerows(zip(*(v.tolist() for v in rows)))
    figure = Figure(figsize=(6.7, 5.0), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(100 * rows[0], rows[2] / 1e3, color="tab:red")
    above.set_ylabel(r"$$\\sigma_1-\\sigma_3$$ (kPa)")
    below.plot(100 * rows[0], 100 * rows[1], color="tab:blue")
    below.axhline(0.0, color="0.6", lw=0.6)
    below.set(xlabel="axial strain (%)", ylabel="volumetric strain (%)\\n(compression +)")
    figure.savefig(Path(sim.outdir) / "biaxial.png", dpi=200)
    print(f"side stress {CONFINING / 1e3:g} kPa: peak of s1 - s3 is {rows[2].max() / 1e3:.1f} kPa")
''')


def deposit(specimen: Specimen) -> str:
    """Return a script of commands in which the grains fall and settle between walls."""
    width, opening = specimen.density.room
    radius, mass = _smallest(specimen)
    solid = float(specimen.area.sum())
    weight = DENSITY * GRAVITY * solid / width  # stress at the floor [Pa]
    fall = math.sqrt(2.0 * GRAVITY * max(opening - solid / width, 0.0))
    # A disc that hits at v is stopped after v sqrt(m / k).
    kn = max(weight / OVERLAP, mass * (fall / (IMPACT * radius)) ** 2)
    dt = _rounded(FRACTION * math.sqrt(mass / kn))
    time = 3.0 * math.sqrt(2.0 * opening / GRAVITY)
    is_circle = specimen.request.shape == "circle"
    file = file_of(specimen)
    sizes, counts = specimen.grading.sizes.tolist(), specimen.counts.tolist()
    some = [size for size, count in zip(sizes, counts) if count]
    colours = "".join(
        f"PROP color {_COLOURS[k % len(_COLOURS)]} range group {group_of(size)}\n" for k, size in enumerate(some)
    )
    return _DEPOSIT.substitute(
        file=file, grains=_kinds(specimen), width_mm=f"{1e3 * width:.4g}", width=f"{width:.12g}",
        top=f"{1.05 * opening + 2.0 * float(specimen.reach.max()):.6g}", begin=f"LOAD {file}" if is_circle else
        f"START\nCLUMP file {file}", dt=f"{dt:g}", kn=f"{_rounded(kn):g}", gravity=f"{GRAVITY:g}",
        density=f"{DENSITY:g}", friction=f"{FRICTION:g}", steps=math.ceil(time / dt / 1000.0) * 1000,
        colours=colours if is_circle else "", end="EXP deposited.xyr group\n" if is_circle else "",
        results=", deposited.xyr (beside this script)" if is_circle else "",
    )  # fmt: skip


def biaxial(specimen: Specimen) -> str:
    """Return a Python program in which the grains are compressed between four walls to a stress, then shortened at
    constant side stress.
    """
    width, opening = specimen.density.room
    _, mass = _smallest(specimen)
    kn = STIFFNESS * CONFINING
    size = math.sqrt(float((specimen.area * specimen.size).sum() / specimen.area.sum() * specimen.size.mean()))
    is_circle = specimen.request.shape == "circle"
    file = file_of(specimen)
    return _BIAXIAL.substitute(
        file=file, grains=_kinds(specimen), stress=f"{CONFINING:g}", friction=f"{FRICTION:g}", width=f"{width:.12g}",
        height=f"{opening:.12g}", size=f"{size:.4g}", kn=f"{kn:g}", stiffness=f"{STIFFNESS:g}", density=f"{DENSITY:g}",
        rate=f"{_rounded(INERTIAL / (size * math.sqrt(DENSITY / CONFINING))):g}",
        dt=f"{_rounded(FRACTION * math.sqrt(mass / kn)):g}",
        begin=f'sim.load("{file}")' if is_circle else f'sim.clump("{file}")',
    )  # fmt: skip


def file_of(specimen: Specimen) -> str:
    """The file that the scripts read."""
    return "specimen.xyr" if specimen.request.shape == "circle" else "specimen.clumps"


def _kinds(specimen: Specimen) -> str:
    many = len(specimen) != 1
    return f"{len(specimen)} {specimen.request.shape}{'s' if many else ''}"


def _smallest(specimen: Specimen) -> tuple[float, float]:
    """Smallest radius [m] and mass [kg] of a grain 1 m thick."""
    return 0.5 * float(specimen.size.min()), DENSITY * float(specimen.area.min())


def _rounded(value: float) -> float:
    """Round to two digits, downwards for time steps and rates, which is all the same for the others."""
    unit = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.floor(value / unit + 1e-9) * unit
