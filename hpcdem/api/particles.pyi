"""Discs in a Python program: the commands of ZDEM as methods.

Made by ``scripts/pages``; do not edit it."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Unpack

import numpy as np

from hpcdem.api.types import File, Selected
from hpcdem.core.material import Material

class ParticleCommands:
    """The methods of a `Simulation` for particles."""
    def box(
        self,
        left: float,
        right: float,
        bottom: float,
        height: float,
        kn: float = 0.0,
        ks: float = 0.0,
        fric: float = 0.0,
    ) -> None:
        """BOX: four walls around the space of the model; particles that leave it are deleted.

        Parameters
        ----------
        left, right, bottom, height : its sides [m]; the height is measured from the bottom.
        kn, ks, fric : normal and shear stiffness [N/m] and friction coefficient of the walls.
        """
    def wall(
        self,
        id: int,
        nodes: tuple[tuple[float, float], tuple[float, float]] | None = None,
        *,
        kn: float | None = None,
        ks: float | None = None,
        fric: float | None = None,
        color: str | int | None = None,
        xv: float | None = None,
        yv: float | None = None,
        delete: bool = False,
    ) -> None:
        """WALL: make a wall from node to node, or change or delete the one with this id; what is left out stays.

        Parameters
        ----------
        id : number of the wall.
        nodes : its ends, ((x, y), (x, y)) [m]; both sides act, unless set(wallside="left").
        kn, ks, fric : normal and shear stiffness [N/m], for particles of the linear law, and friction coefficient.
        color : name or number.
        xv, yv : velocity, until it is changed [m/s].
        delete : remove the wall with its contacts; accepts only id.
        """
    def periodic(self, x: tuple[float, float]) -> None:
        """PERIODIC: the sides x = left and x = right become one: particles that leave through one enter through the
        other,
        and touch across them. Horizontal walls that span both continue without an end; BOX loses its left and right
        wall.

        Parameters
        ----------
        x : the sides, (left, right) [m]; those of BOX, if there is one.
        """
    def ball(
        self,
        x: float,
        y: float,
        rad: float,
        id: int | None = None,
        color: str | int = 0,
        group: str = '***',
    ) -> None:
        """BALL: one particle.

        Parameters
        ----------
        x, y : place of its centre [m].
        rad : radius [m].
        id : number; left out, the next free one.
        color, group : name or number; name.
        """
    def gen(
        self,
        num: int,
        rad: Iterable[float],
        x: tuple[float, float],
        y: tuple[float, float],
        color: str | int = 0,
        group: str = '***',
    ) -> int:
        """GEN num: random insertion without overlap; also across periodic sides, if x are these.

        Scripts ask for far more than fit: it gives up after FAILURES attempts in a row that found no room, or after
        SET
        gentry attempts per particle requested, if that is set.

        Parameters
        ----------
        num : number of particles to place.
        rad : radii that are drawn from [m].
        x, y : sides of the rectangle, (least, greatest) [m].
        color, group : name or number; name.

        Returns
        -------
        int : how many found room.
        """
    def gen_grid(
        self,
        rad: Iterable[float],
        x: tuple[float, float],
        y: tuple[float, float],
        idmin: int | None = None,
        color: str | int = 0,
        group: str = '***',
    ) -> int:
        """GEN grid: a particle at each node of a square lattice of spacing 2 max(rad).

        Parameters
        ----------
        rad : radii that are drawn from [m].
        x, y : sides of the rectangle, (least, greatest) [m].
        idmin : first number; left out, the next free one.
        color, group : name or number; name.

        Returns
        -------
        int : how many were made.
        """
    def gline(
        self,
        p1: tuple[float, float],
        p2: tuple[float, float],
        rad: float,
        cratio: float = 1.0,
        *,
        kn: float | None = None,
        ks: float | None = None,
        fric: float | None = None,
        color: str | int = 0,
        group: str = '***',
    ) -> int:
        """GLINE: a row of particles from p1 towards p2, of spacing 2 rad cratio; overlaps are not checked.

        Parameters
        ----------
        p1, p2 : ends, (x, y) [m].
        rad : radius [m].
        cratio : distance of neighbours over the sum of their radii.
        kn, ks, fric : normal and shear stiffness [N/m] and friction coefficient.
        color, group : name or number; name.

        Returns
        -------
        int : how many were made.
        """
    def load(
        self,
        file: File,
        scale: float = 1.0,
        x: tuple[float, float] | None = None,
        y: tuple[float, float] | None = None,
    ) -> int:
        """LOAD: a new model from rows "x y r [group]" [m], or from a frame all_<step>.dat of ZDEM or hpcdem with all
        that
        it holds (commands/dem/frame_state.py).

        Parameters
        ----------
        file : the file.
        scale : factor on all lengths, of rows.
        x, y : only centres in these ranges, (least, greatest), in the numbers of the file.

        Returns
        -------
        int : how many there are.
        """
    def section(
        self,
        file: File,
        *,
        scale: float | None = None,
        origin: tuple[float, float] = (0.0, 0.0),
        to: tuple[float, float] = (0.0, 0.0),
        line: tuple[tuple[float, float], tuple[float, float]] | None = None,
        legend: File | None = None,
        attribute: str | None = None,
        only: Sequence[str] | str = (),
        rad: Sequence[float] | float | None = None,
        porosity: float | None = None,
        cut: bool = False,
        ebmod: float | None = None,
        gbmod: float | None = None,
        tstrength: float | None = None,
        sstrength: float | None = None,
        n_bond: float | None = None,
        s_bond: float | None = None,
        where: Selected = None,
    ) -> int:
        """SECTION: use the polygons or the lines of a file .geojson, .json, .shp, .svg, .dxf or of an image.

        Without further words, particles with their centres in a polygon get its name as group, and its attributes
        that are
        properties (density, fric, kn, ...) or color; later polygons of the file cover earlier ones. With rad, the
        polygons
        are filled with new particles. With cut, bonds that cross a line are removed; with bond properties they get
        these.

        Parameters
        ----------
        file : the section.
        scale : metres per unit of the file; left out, as the file says, else 1.
        origin, to : point of the file, in its units, and where it is in the model [m].
        line : two points of a map, in its units: x is the distance along the line through them, y the height (z).
        legend : of an image: a file with lines colour, name.
        attribute : whose value is the name, of GeoJSON and shapefiles; left out, name, layer, unit, ... or id.
        only : names of the polygons and lines that are used; left out, all.
        rad : radii of new particles that are drawn from [m].
        porosity : of the filled polygons; 0.2.
        cut : remove the bonds that cross a line.
        ebmod, gbmod, tstrength, sstrength : of elastic bonds that cross a line [Pa].
        n_bond, s_bond : of contact bonds that cross a line [N].
        where : the particles, of new ones none; of a bond both.

        Returns
        -------
        int : how many particles got a group or are new, or how many bonds changed.
        """
    def surface(
        self,
        id: int,
        *,
        interval: int | None = None,
        x: tuple[float, float] | None = None,
        spacing: float | None = None,
        diffuse: float | None = None,
        slope: float | None = None,
        erode: float | None = None,
        above: float | None = None,
        deposit: float | None = None,
        below: float | None = None,
        rise: float | None = None,
        years: float | None = None,
        only: Sequence[str] | str = (),
        rad: Sequence[float] | float | None = None,
        porosity: float | None = None,
        compact: tuple[float, float] | None = None,
        group: str | None = None,
        episode: int | None = None,
        colors: Sequence[str] | str = (),
        off: bool = False,
        hertz: bool = False,
        **properties: Unpack[Material],
    ) -> None:
        """SURFACE: switch a surface process on or off; it acts at steps that are multiples of the interval.

        Parameters
        ----------
        id : number of the process; a second command with it replaces the first.
        interval : steps between two applications.
        x : range in which it acts, (least, greatest) [m]; left out, as far as the particles reach.
        spacing : width of the columns [m]; left out, four times the largest radius.
        diffuse : coefficient of diffusion of the heights [m2/s].
        slope : largest angle of the surface [deg]; what is steeper slides down.
        erode, above : rate of erosion [m/s], and the level down to which it acts [m]; a level alone acts at once.
        deposit, below : rate of deposition [m/s], and the level up to which it acts [m]; a level alone: a layer as
            thick as
            a column is wide at each application, until the level is met.
        rise : velocity of the levels, upwards, from the command on [m/s].
        years : years that a second of the model stands for; diffuse, erode, deposit and rise are then per year.
        only : groups of which discs may be eroded; others protect what is under them. Left out, all.
        rad : radii of deposited discs that are drawn from [m].
        porosity : of what is eroded and deposited: bulk area is area of discs / (1 - porosity); 0.15.
        compact : of the deposit: porosity of the sediment at the surface, and depth at which it is smaller by e [m];
            discs
            shrink as they are buried and keep their mass.
        group : of the deposit; growth.
        episode : steps after which a new group begins, growth1, growth2, ...
        colors : of these groups in turn, names.
        off : end the process.
        hertz : contacts of Hertz and Mindlin, by shear [Pa] and poiss.
        properties : of the deposit, as in PROP.
        """
    def clump(
        self,
        file: File,
        x: float = 0.0,
        y: float = 0.0,
        angle: float = 0.0,
        scale: float = 1.0,
        color: str | int = 0,
        group: str = '***',
    ) -> int:
        """CLUMP file: rigid bodies of discs from a clump file, scaled, turned about its origin, then moved.

        Mass and inertia are density times the area and polar second moment of area in the file.

        Parameters
        ----------
        file : the file.
        x, y : way [m].
        angle : of the turn [rad].
        scale : factor on all lengths.
        color, group : name or number; name.

        Returns
        -------
        int : how many bodies.
        """
    def flexure(
        self,
        wall: int | None = None,
        where: Selected = None,
        *,
        rigidity: float | None = None,
        young: float | None = None,
        poisson: float = 0.25,
        te: float | None = None,
        contrast: float | None = None,
        x: tuple[float, float] | None = None,
        left: str = 'infinite',
        right: str = 'infinite',
        load: tuple[float, float] | None = None,
        compensated: bool = False,
        interval: int = 1000,
        relax: float = 0.5,
        speed: float | None = None,
        segments: int | None = None,
        off: bool = False,
    ) -> None:
        """FLEXURE: a horizontal wall, or a row of particles fixed in x and y, bends under the contact forces on it like
        an
        elastic plate on a fluid: rigidity w'''' + contrast g w = load.

        Parameters
        ----------
        wall : id of the wall, which becomes a polyline; or where: the particles of the row.
        rigidity : flexural rigidity [N m]; or young, poisson, te: Young's modulus [Pa], Poisson's ratio, elastic
            thickness
            [m].
        contrast : density of the fluid below minus that of what fills the deflection, without the particles [kg/m3].
        x : left and right end of the plate, if it is longer than the base [m].
        left, right : "infinite" (continues without load), "free" or "broken", "clamped" or "fixed".
        load : a constant line load: x [m] and size, downwards [N/m].
        compensated : the mean load of the first interval is in equilibrium with the undeformed base.
        interval : steps between two solutions of the plate: the base moves in the first half and rests in the
            second.
        relax : share of the distance to equilibrium that the base moves in an interval.
        speed : largest speed of the base [m/s]; otherwise 1e-3 of the largest radius in a step.
        segments : of the base; otherwise 20 per flexural parameter, at least 50.
        off : the base stays where it is.
        """
    def join(self, where: Selected, group: str | None = None, color: str | int | None = None) -> int:
        """CLUMP RANGE: make one clump of the chosen particles; returns how many they are.

        Area and polar second moment of area are the sums of those of the discs, overlaps counted twice; it moves on
        with
        their momentum and angular momentum. CommandError if the particles are bonded to each other, or differ in
        density,
        damping or fixed directions.
        """
    def delete(self, where: Selected = None) -> int:
        """DEL: remove particles with their contacts and bonds; how many went. Their ids are not used again."""
    def twin(self, number: int, *, where: Selected = None) -> int:
        """TWIN: move one free particle by 1e-5 of its radius, for runs that differ by no more than that.

        Parameters
        ----------
        number : of the twin; it draws the particle and the direction. 0 is the model itself: nothing moves.
        where : the particles of which one is drawn; members of clumps and particles fixed in x or y are not.

        Returns
        -------
        int : id of the particle, -1 for twin 0.

        Raises
        ------
        CommandError : if no such particle is free.
        """
    def export(self, file: File, group: bool = False, where: Selected = None) -> None:
        """EXP: rows "x y r [group]" in the order of ids, 13 significant digits.

        Parameters
        ----------
        file : the file.
        group : with the names of groups.
        where : the particles.
        """
    def prop(
        self,
        where: Selected = None,
        *,
        hertz: bool = False,
        xv: float | None = None,
        yv: float | None = None,
        spin: float | None = None,
        color: str | int | None = None,
        group: str | None = None,
        law: str | None = None,
        between: Sequence[str] = (),
        parameter: Mapping[str, float] | None = None,
        **properties: Unpack[Material],
    ) -> None:
        """PROP: properties, velocities, colour and group of particles; what is left out stays.

        A density is per volume, or per area when SET disk makes disks. Properties of Hertz and Mindlin are taken
        with
        `hertz`; kn or ks without it give the linear law. Contacts use the new values from the next step. Velocities
        of
        a clump are those of its centre; its members follow.

        Parameters
        ----------
        where : the particles.
        hertz : contacts of Hertz and Mindlin, by shear [Pa] and poiss.
        xv, yv, spin : velocity [m/s] and angular velocity, anticlockwise [rad/s].
        color, group : name or number; name.
        law : 'file.py:function' beside the program (docs/user_laws.md), or "linear".
        between : the law is that of pairs of discs with these two laws; nothing else is set.
        parameter : properties that the law declares.
        properties : density [kg/m3], of discs of unit thickness [kg/m2]; fric; shear [Pa]; poiss; damp; kn, ks
            [N/m];
            rfric, rdamp: coefficient of rolling resistance, damping over the critical one;
            xp, yp: pressures that push along x and y, on 2 R thickness of each particle [Pa].
        """
    def bond(
        self,
        where: Selected = None,
        *,
        ebmod: float | None = None,
        gbmod: float | None = None,
        tstrength: float | None = None,
        sstrength: float | None = None,
        n_bond: float | None = None,
        s_bond: float | None = None,
        tolerate: float | None = None,
        rext: float | None = None,
        fric: float | None = None,
        rubber: bool = False,
        conserving: bool = False,
        moment: bool = False,
    ) -> int:
        """PROP with bond keys: bond the pairs that touch, renew the bonds that are there.

        Pairs are those with d - (Ra + Rb) rext <= tolerate. Either ebmod, gbmod, tstrength, sstrength (elastic
        bonds)
        or n_bond, s_bond (contact bonds). What is left out stays, or is 0 in a new bond.

        Parameters
        ----------
        where : particles; both of a pair are among them.
        ebmod, gbmod : Young's and shear modulus of elastic bonds [Pa].
        tstrength, sstrength : their tensile strength and cohesion [Pa].
        n_bond, s_bond : tensile and shear strength of contact bonds [N].
        tolerate : largest gap that is bonded [m]; 1e-6.
        rext : factor on the radii in the search for pairs; 1.
        fric : friction coefficient of the particles.
        rubber : mark the bonds as those of a membrane, without any effect on the motion.
        conserving : one shear stiffness, touching or open, so that opening and closing make no energy (of a contact
            bond of
            Hertz particles that at the moment of bonding).
        moment : elastic bonds resist relative rotation, and break in tension by the stress at their outer fibre.

        Returns
        -------
        int : how many are new.
        """
    def break_bonds(self, where: Selected = None, across: Sequence[np.ndarray] | None = None) -> int:
        """BOND break: remove the bonds with both ends in `where`; how many. Shear forces stay, limited by friction from
        then on.

        Parameters
        ----------
        where : particles; both of a pair are among them.
        across : lines, of points (n, 2) [m]: only bonds that cross one of them; left out, all.
        """
    def fix(self, *dofs: str, where: Selected = None) -> None:
        """FIX: these of "x", "y", "spin" keep the velocity they have."""
    def free(self, *dofs: str, where: Selected = None) -> None:
        """FREE: undo `fix`."""
    def add_physics(self, name: str, **parameters: float) -> None:
        """Physics on the particles beside their motion, from the next step on. There is "diffusion": heat through
        contacts; conductance of each [W/K], capacity [J/(kg K)]; fields temperature [K], heat_source [W], heat_given
        [J]; HIST follows heat and heat_given [J], which are columns of energy.csv.
        """
    def hist(self, id: int, interval: int, what: str) -> None:
        """HIST: record kinetic, step, time, unbalanced, contacts, bonds, energy, deflection, sxx, syy or sxy, or
        "gstress group a", "gstrain group a|b", "xstress wall 3", "ystrain wall 0|3", every `interval` steps in
        hist_id_<id>.dat and hist_<id>.csv; strains begin at 0 here.
        """
    def plot(self, y: int, x: int) -> None:
        """PLOT: at `finish`, write history y against history x."""
    def extents(self) -> dict[str, float]:
        """{left, right, bottom, top} of the particles that are not fixed in both x and y [m]."""
    def wall_force(self, id: int) -> tuple[float, float]:
        """Force on a wall (x, y) [N], exactly summed."""
    def wall_forces(self) -> dict[int, tuple[float, float]]:
        """Force on every wall by id (x, y) [N]: one pass over the contacts for all of them."""
    def stress(self, y: tuple[float, float] | None = None) -> dict[str, float]:
        """Mean stress between periodic sides: {sxx, syy, sxy} [Pa], positive in compression; sxy is the force in x
        across
        horizontal lines.

        Parameters
        ----------
        y : heights, (lower, upper) [m]; left out, those of BOX.
        """
    def kinetic_energy(self) -> float:
        """Sum of (m v^2 + I w^2) / 2 [J], exactly summed."""
    def unbalanced(self) -> float:
        """Largest unbalanced force of a free particle over the mean contact force: small at rest."""
    def surface_balance(self, id: int) -> dict[str, float]:
        """The balance of a process of SURFACE.

        Returns
        -------
        dict : bulk areas [m2] eroded, deposited (discs at rest), settling (not yet at rest), lost (deleted before
            they were
            at rest), carried (demanded, less than a disc, not yet met; negative: erosion), demanded (the sum that
        the
            processes wanted: deposited + settling + lost - eroded + carried), compacted (lost by discs of the
        deposit as
            they shrink, part of the deposited area); discs_eroded, discs_deposited,
            discs_settling; mass_eroded, mass_deposited [kg].
        """
    def clumps(self) -> dict[str, np.ndarray]:
        """The clumps of the whole model, on every rank, in the order of ids: id (that of the first member), x y, vx vy,
        spin, angle, area, mass, inertia, members (how many).
        """
