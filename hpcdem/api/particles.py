"""Discs in a Python program: the commands of ZDEM as methods.

`Function` says which function of `hpcdem.commands.dem` a method is; arguments, types and texts are those of the
function. Editors see them in particles.pyi, which is made from this file: ``scripts/pages``.
"""

from __future__ import annotations

from hpcdem.api.functions import WRITTEN, Function, commands


@commands
class ParticleCommands:
    """Methods of a `Simulation` for particles."""

    box = Function("walls.box")
    wall = Function("walls.wall", "id nodes")
    periodic = Function("walls.periodic", "x xv")
    ball = Function("particles.ball", "x y rad id? color group")
    gen = Function("particles.gen")
    gen_grid = Function("particles.gen_grid")
    gline = Function("particles.gline", "p1 p2 rad cratio")
    load = Function("particles.load", alone=True)
    section = Function("sections.section", "file")
    surface = Function("surface.surface", "id")
    clump = Function("clumps.clump")
    flexure = Function("flexure.flexure", "wall where")
    join = Function("clumps.join", "where! group color")
    delete = Function("particles.delete")
    twin = Function("particles.twin", "number")
    export = Function("particles.export", file=WRITTEN, reads_only=True)
    prop = Function("properties.prop")
    bond = Function("bonds.bond")
    break_bonds = Function("bonds.break_bonds")
    fix = Function("properties.fix", "*dofs")
    free = Function("properties.free", "*dofs")
    add_physics = Function("physics.add")
    hist = Function("history.hist", reads_only=True)
    plot = Function("history.plot_hist", reads_only=True)
    extents = Function("queries.extents", reads_only=True)
    wall_force = Function("queries.wall_force", reads_only=True)
    wall_forces = Function("queries.wall_forces", reads_only=True)
    stress = Function("queries.stress", reads_only=True)
    kinetic_energy = Function("queries.kinetic_energy", reads_only=True)
    unbalanced = Function("queries.unbalanced", reads_only=True)
    surface_balance = Function("surface.balance", reads_only=True)
    clumps = Function("queries.clumps", reads_only=True)
