# A paper's figures from one command: thrusts, growth strata and a foreland basin on a flexed base
# -----------------------------------------------------------------------------
# shows     how one program runs a model and makes all figures of a paper from it: sections with numbered faults, slip
#           of each fault over shortening, deflection of the base, distortional strain
# model     32 km of bonded rock, 2 km thick, on an elastic plate that is broken below the mountain belt; a wall pushes
#           7 km while sediment fills the basin; 2400 to 2950 spheres of radius 80 and 105 m
# run       hpcdem examples/paper.py -j 2      (two to three minutes of one core)
# results   examples/data: paper_sections, paper_slip, paper_flexure, paper_strain (.png, .pdf); frames every 250 m;
#           measure/*.csv, flexure.csv, surface.csv, ss/data/*.npz
# -----------------------------------------------------------------------------
from pathlib import Path

import numpy as np
from matplotlib.collections import EllipseCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import hpcdem
from hpcdem.core.picture_words import NUMBERS
from hpcdem.io.frames import list_frames, read_frame
from hpcdem.post import strain_stress
from hpcdem.post.measure import report
from hpcdem.post.measure.figures import save
from hpcdem.post.measure.scene import Request
from hpcdem.post.section import read_section

PUSH, EVERY = 7000.0, 250.0  # shortening, and between frames [m]
RUN = f"""\
# spheres, as thick as they are on average: 4/3 of the mean radius
START
SET disk off thickness 123.0 seed 3 gentry 2.75
BOX left -200.0 right 32200.0 bottom -5000.0 height 12000.0
WALL id 0 nodes (-200.0, 0.0) (32200.0, 0.0)
WALL id 1 nodes (0.0, 6800.0) (0.0, -4800.0)
WALL id 2 nodes (32000.0, -4800.0) (32000.0, 6800.0)
GEN num 60000 rad discrete 80.0 105.0 x (0.0, 32000.0) y (0.0, 5200.0) group rock
PROP density 2500.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.0
SET gravity 0.0 -9.8 dt 0.05 print 0
CYC 4000
DEL range y 2000.0 99999.0
CYC 1500
PROP fric 0.1 group weak range y -100.0 330.0
PROP ebmod 2e8 gbmod 2e8 tstrength 1e7 sstrength 2e7 fric 0.3 range group rock
PROP color lg range group rock
PROP color mg range y 700.0 1050.0
PROP color mg range y 1400.0 1750.0
PROP color violet range group weak
# The belt behind the wall is a line load; sediment fills the basin up to a level that rises by 0.35 km.
FLEXURE wall id 0 young 7e10 poisson 0.25 te 4000.0 contrast 3200.0 x (-200.0, 120000.0) left broken load (1000.0 3e11) compensated interval 200
SURFACE id 1 interval 200 x (0.0, 32000.0) below 2000.0 rise 0.1 diffuse 1200.0 slope 32.0 rad discrete 80.0 105.0 density 2300.0 shear 2.9e9 poiss 0.2 hertz damp 0.4 fric 0.3 group growth episode 20000
WALL id 1 fric 0.1 xv 2.0
WALL id 2 fric 0.1
IMPLE wall id 1 xmove {PUSH} print {EVERY}
"""

sim = hpcdem.Simulation()
sim.command(RUN)
folder = Path(sim.engine.outdir)

# --- measurements, on all ranks ----------------------------------------------------
comm, log = sim.engine.comm, sim.engine.log
report.run(comm, log, Request(folder, ("faults", "surface"), walls=(1,), over_time=True))
size = 4.0 * 105.0
strain_stress.run(comm, log, strain_stress.Options(folder, size, left_wall=1, addball=True, delball=True))

# --- figures -----------------------------------------------------------------------
KM = 1e3
WIDTH, LETTERS = 18.0 / 2.54, 8.0  # of a printed page [inches], of letters [points]
GROWTH = ["#f3e3b3", "#e9c46a", "#dd9c4a", "#b9683c", "#8c4a2f", "#5e3023"]
BEDS = {"weak": "#8f7aa8", "light": "#d9d6cf", "dark": "#9b968c"}
NAMED = 400.0  # slip from which faults that no longer move are drawn [m]
LINES = ["#1b6ca8", "#b2182b", "#2f7d4f", "#6a4c93", "#a66a00", "#c2378a", "#3d3d3d", "#148f8f", "#7f5539", "#5b8c00"]
table = {
    name: np.genfromtxt(folder / file, delimiter=",", names=True, dtype=None, encoding="utf-8", ndmin=1)
    for name, file in (("faults", "measure/faults.csv"), ("along", "measure/faults_along.csv"),
                       ("all", "measure/faults_total.csv"), ("plate", "flexure.csv"), ("sediment", "surface.csv"))
}  # fmt: skip
shortening = dict(zip(table["all"]["step"].tolist(), table["all"]["shorteningm"].tolist()))


def panels(*heights, across=WIDTH, **more):
    """A figure with panels of these heights [inches]."""
    figure = Figure(figsize=(across, sum(heights) + 0.45), layout="constrained")
    axes = figure.subplots(len(heights), 1, height_ratios=heights, squeeze=False, **more)[:, 0]
    for ax, letter in zip(axes, "abcdefgh"):
        ax.tick_params(labelsize=LETTERS, direction="out", width=0.6)
        ax.set_title(f"({letter})", loc="left", fontsize=LETTERS + 1.0, fontweight="bold", pad=3.0)
        for spine in ax.spines.values():
            spine.set_linewidth(0.6)
    return figure, axes


def words(ax, x=None, y=None, title=None):
    """Labels of axes, and what a panel shows."""
    if x:
        ax.set_xlabel(x, fontsize=LETTERS)
    if y:
        ax.set_ylabel(y, fontsize=LETTERS)
    if title:
        ax.set_title(title, loc="right", fontsize=LETTERS, pad=3.0)


def plate(step):
    """x and height of the base [km], and the load [MPa]: the rows at or before a step."""
    rows = table["plate"]
    steps = np.unique(rows["step"])
    rows = rows[rows["step"] == steps[max(np.searchsorted(steps, step, side="right") - 1, 0)]]
    return rows["x"] / KM, -rows["deflection"] / KM, rows["load"] / 1e6


def colours(p, names):
    """Colours (n, 3): beds before, growth strata from old to young."""
    group = np.array([*names, ""], dtype=object)[p["group"]]
    out = np.array([to_rgb(BEDS["dark" if c == NUMBERS["mg"] else "light"]) for c in p["color"].tolist()])
    out[group == "weak"] = to_rgb(BEDS["weak"])
    for k, colour in enumerate(GROWTH, 1):
        out[group == f"growth{k}"] = to_rgb(colour)
    return out


def section(ax, file):
    """Particles, base, wall and faults of a frame."""
    frame = read_frame(file.path, ["particles"])
    p = frame.tables["particles"].columns
    d = 2.0 * p["radius"] / KM
    ax.add_collection(EllipseCollection(
        d, d, np.zeros(len(d)), units="xy", offsets=np.column_stack([p["x"], p["y"]]) / KM, linewidths=0.0,
        facecolors=colours(p, frame.group_names), offset_transform=ax.transData,
    ))  # fmt: skip
    x, base, _ = plate(file.step)
    ax.fill_between(x, base, -9.0, color="#efebe4", lw=0.0, zorder=0)
    ax.plot(x, base, color="black", lw=0.9)
    wall = float(frame.walls["p1"][frame.walls["id"] == 1][0, 0]) / KM
    ax.axvspan(-1.0, wall, color="#c9c9c9", zorder=0, lw=0.0)
    ax.axvline(wall, color="black", lw=1.2)
    rows = table["along"][table["along"]["step"] == file.step]
    now = table["faults"][table["faults"]["step"] == file.step]
    for number in np.unique(rows["fault"]):
        one = rows[rows["fault"] == number]
        state, colour = now[now["fault"] == number], LINES[(number - 1) % len(LINES)]
        if state["state"][0] != "active":
            if abs(state["slipm"][0]) > NAMED:
                ax.plot(one["xm"] / KM, one["ym"] / KM, color="black", lw=0.6, ls=(0, (4, 2)), zorder=4)
            continue
        top = np.argmax(one["ym"])
        ax.plot(one["xm"] / KM, one["ym"] / KM, color="white", lw=2.8, zorder=4)
        ax.plot(one["xm"] / KM, one["ym"] / KM, color=colour, lw=1.6, zorder=5)
        ax.annotate(f"{number}", (one["xm"][top] / KM, one["ym"][top] / KM), xytext=(0, 2), textcoords="offset points",
                    ha="center", fontsize=LETTERS - 0.5, color=colour, zorder=6)  # fmt: skip
    ax.set(xlim=(0.0, 32.0), ylim=(-2.0, 4.0), aspect="equal")


def sections(frames):
    """Four stages, one below the other, with a key of the beds."""
    tall = (WIDTH - 0.5) / 32.0 * 6.0 + 0.25
    figure, axes = panels(*[tall] * len(frames), sharex=True)
    for ax, file in zip(axes, frames):
        section(ax, file)
        words(ax, y="y (km)", title=f"shortening {shortening[file.step] / KM:.1f} km")
    words(axes[-1], x="x (km)")
    ages = [
        (c, f"growth {k}")
        for k, c in enumerate(GROWTH, 1)
        if f"growth{k}" in read_frame(frames[-1].path, []).group_names
    ]
    key = [(BEDS["weak"], "detachment"), (BEDS["light"], "pre-growth"), (BEDS["dark"], "marker"), *ages]
    marks = [axes[0].plot([], [], "o", color=colour, ms=5.0, mec="#666666", mew=0.3)[0] for colour, _ in key]
    axes[0].legend(marks, [name for _, name in key], ncols=len(key), fontsize=LETTERS - 1.0, frameon=False,
                   loc="upper right", handletextpad=0.1, columnspacing=0.8, borderaxespad=0.2)  # fmt: skip
    return figure


def slips():
    """Slip of each fault, when each was active, and the area of sediment."""
    rows = table["faults"]
    numbers = np.unique(rows["fault"])
    figure, (upper, middle, lower) = panels(2.3, 0.16 * len(numbers) + 0.25, 1.1, sharex=True)
    for k, number in enumerate(numbers):
        one, colour = rows[rows["fault"] == number], LINES[(number - 1) % len(LINES)]
        x, slip, active = one["shorteningm"] / KM, np.abs(one["slipm"]) / KM, one["state"] == "active"
        upper.plot(x, slip, color=colour, lw=1.3)
        middle.plot(x, np.full(len(x), k), color="#cccccc", lw=0.8)
        middle.plot(x[active], np.full(active.sum(), k), "s", color=colour, ms=3.2)
    middle.set(yticks=range(len(numbers)), ylim=(len(numbers) - 0.4, -0.6))
    middle.set_yticklabels(numbers)
    last = {number: abs(rows["slipm"][rows["fault"] == number][-1]) / KM for number in numbers}
    at, gap = -1.0, 0.06 * max(last.values(), default=1.0)
    for number, slip in sorted(last.items(), key=lambda one: one[1]):
        at = max(slip, at + gap)
        colour = LINES[(number - 1) % len(LINES)]
        upper.text(1.006 * PUSH / KM, at, f"{number}", va="center", fontsize=LETTERS, color=colour)
    upper.set(ylim=(0.0, None), xlim=(0.0, 1.03 * PUSH / KM))
    words(upper, y="slip (km)", title="largest slip of each fault")
    words(middle, y="fault", title="frames in which a fault was active")
    sediment = table["sediment"]
    at = np.interp(sediment["step"], list(shortening), list(shortening.values())) / KM
    lower.plot(at, sediment["deposited"] / KM**2, color="#b9683c", lw=1.3, label="deposited")
    lower.plot(at, sediment["eroded"] / KM**2, color="#1b6ca8", lw=1.3, label="eroded")
    lower.legend(frameon=False, fontsize=LETTERS)
    words(lower, "shortening (km)", "area (km²)", "sediment, pores included")
    return figure


def flexed(frames):
    """The base and its load at these stages, and the depth of the basin over shortening."""
    figure, (upper, middle, lower) = panels(1.9, 1.3, 1.2)
    for k, file in enumerate(frames):
        x, base, load = plate(file.step)
        shade = str(0.75 - 0.75 * k / max(len(frames) - 1, 1))
        upper.plot(x, base, color=shade, lw=1.2, label=f"{shortening[file.step] / KM:.1f} km")
        middle.plot(x, np.convolve(load, np.ones(5) / 5.0, "same"), color=shade, lw=1.0)
    upper.axhline(0.0, color="#888888", lw=0.5, ls=":")
    upper.legend(title="shortening", frameon=False, fontsize=LETTERS - 1.0, title_fontsize=LETTERS - 1.0, ncols=2)
    for ax in (upper, middle):
        ax.set_xlim(0.0, 32.0)
    words(upper, "x (km)", "height (km)", "base of the model")
    words(middle, "x (km)", "load (MPa)", "contact forces of the particles, mean over 2.4 km")
    rows = table["plate"]
    steps = np.unique(rows["step"])
    x = np.interp(steps, list(shortening), list(shortening.values())) / KM
    for at, colour in ((10.0, LINES[1]), (16.0, LINES[0]), (24.0, LINES[2])):
        depth = [np.interp(at, *plate(step)[:2]) for step in steps]
        lower.plot(x, depth, color=colour, lw=1.2, label=f"x = {at:g} km")
    lower.legend(frameon=False, fontsize=LETTERS - 1.0, ncols=3)
    lower.set_xlim(0.0, PUSH / KM)
    words(lower, "shortening (km)", "height (km)", "subsidence of the base")
    return figure


def strains(frames):
    """Distortional strain of each particle since the start of the push."""
    tall = (WIDTH - 0.9) / 32.0 * 6.0 + 0.25
    figure, axes = panels(*[tall] * len(frames), sharex=True)
    for ax, file in zip(axes, frames):
        p = read_section(folder / "ss" / "data" / f"{file.path.stem}.npz").particles
        d = 2.0 * p["radius"] / KM
        picture = ax.add_collection(EllipseCollection(
            d, d, np.zeros(len(d)), units="xy", offsets=np.column_stack([p["x"], p["y"]]) / KM, linewidths=0.0,
            array=p["distortional"], cmap="RdBu_r", clim=(-1.0, 1.0), offset_transform=ax.transData,
        ))  # fmt: skip
        across, base, _ = plate(file.step)
        ax.fill_between(across, base, -9.0, color="#efebe4", lw=0.0, zorder=0)
        ax.plot(across, base, color="black", lw=0.9)
        ax.set(xlim=(0.0, 32.0), ylim=(-2.0, 4.0), aspect="equal")
        words(ax, y="y (km)", title=f"shortening {shortening[file.step] / KM:.1f} km")
    words(axes[-1], x="x (km)")
    bar = figure.colorbar(picture, ax=list(axes), shrink=0.5, pad=0.01)
    bar.set_label("distortional strain, red: top to the right", fontsize=LETTERS)
    bar.ax.tick_params(labelsize=LETTERS)
    return figure


if comm.rank == 0:
    moving = [file for file in list_frames(folder) if file.step in shortening and not file.ini]
    stages = [moving[k] for k in np.linspace(len(moving) / 4.0 - 1.0, len(moving) - 1.0, 4).round().astype(int)]
    pages = {"sections": sections(stages), "slip": slips(), "flexure": flexed(stages), "strain": strains(stages[1::2])}
    for name, figure in pages.items():
        for kind in ("png", "pdf"):
            print(f"figure: {save(figure, folder / f'paper_{name}.{kind}')}")
