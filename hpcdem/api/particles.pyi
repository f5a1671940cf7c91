"""Discs in a Python program: the commands of ZDEM as methods.

Made by ``scripts/pages``; do not edit it."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Unpack

import numpy as np

from hpcdem.api.types import File, Selected
from hpcdem.core.material import Material

class ParticleCommands:
    """Methods of a `Simulation` for particles."""
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
        """BOX: make four walls around the model; particles that leave the box are deleted.

        Parameters
        ----------
        left, right, bottom, height : left, right and bottom coordinate and height above the bottom [m].
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
        """WALL: make a wall from node to node, or change or delete the wall with this id; omitted properties keep their
        values.

        Parameters
        ----------
        id : id of the wall.
        nodes : end points, ((x, y), (x, y)) [m]; both sides act, unless set(wallside="left").
        kn, ks, fric : normal and shear stiffness [N/m], for particles of the linear law, and friction coefficient.
        color : colour by name or number.
        xv, yv : velocity [m/s]; it holds until it is changed.
        delete : bool: remove the wall with its contacts; accepts only id.
        """
    def periodic(self, x: tuple[float, float] | None = None, xv: float | None = None) -> None:
        """PERIODIC: make x = left and x = right periodic sides: particles that leave through one enter through the
        other,
        and are in contact across them. Horizontal walls that span both continue without an end; BOX loses its left
        and
        right walls. The right side can move.

        Parameters
        ----------
        x : coordinates of the sides, (left, right) [m]; those of BOX, if there is one (default: sides that are
            periodic
            already).
        xv : velocity of the right side relative to the left one [m/s], negative to shorten; 0 ends it. The strain
            rate is
            xv / (right - left): particles that are not fixed along x get the velocities of a homogeneous strain, and
        those
            that pass the sides change their velocity by xv (default: unchanged).
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
        """BALL: create one particle.

        Parameters
        ----------
        x, y : coordinates of the centre [m].
        rad : radius [m].
        id : id of the particle (default: the next free one).
        color, group : colour by name or number; name of the group.
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
        """GEN num: insert particles at random positions without overlap; across periodic boundaries too, if these bound
        x.

        Scripts request far more particles than fit. The command stops after FAILURES consecutive attempts without
        success
        or, with SET gentry, after that many attempts per requested particle.

        Parameters
        ----------
        num : number of particles requested.
        rad : radii, of which each particle gets one at random; a repeated one is more likely [m].
        x, y : bounds of the rectangle, (least, greatest) [m].
        color, group : colour by name or number; name of the group.

        Returns
        -------
        int : number of particles created.
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
        """GEN grid: create a particle at each node of a square lattice of spacing 2 max(rad).

        Parameters
        ----------
        rad : radii, of which each particle gets one at random; a repeated one is more likely [m].
        x, y : bounds of the rectangle, (least, greatest) [m].
        idmin : id of the first particle (default: the next free one).
        color, group : colour by name or number; name of the group.

        Returns
        -------
        int : number of particles created.
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
        """GLINE: create a row of particles from p1 towards p2 with spacing 2 rad cratio; overlaps are not checked.

        Parameters
        ----------
        p1, p2 : end points, (x, y) [m].
        rad : radius [m].
        cratio : distance of neighbouring centres over the sum of their radii.
        kn, ks, fric : normal and shear stiffness [N/m] and friction coefficient.
        color, group : colour by name or number; name of the group.

        Returns
        -------
        int : number of particles created.
        """
    def load(
        self,
        file: File,
        scale: float = 1.0,
        x: tuple[float, float] | None = None,
        y: tuple[float, float] | None = None,
    ) -> int:
        """LOAD: make a new model from rows "x y r [group]" [m], or from a frame all_<step>.dat of ZDEM or hpcdem with
        its
        complete state (commands/dem/frame_state.py).

        Parameters
        ----------
        file : path of the file.
        scale : factor on all lengths, if the file has rows.
        x, y : load only centres in these ranges, (least, greatest), in the units of the file.

        Returns
        -------
        int : number of particles.
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
        """SECTION: apply the polygons or lines of a file .geojson, .json, .shp, .svg, .dxf or of an image to the
        particles.

        By default, particles whose centres lie in a polygon get its name as group, and those of its attributes that
        are
        properties (density, fric, kn, ...) or color; later polygons of the file cover earlier ones. With rad, the
        polygons
        are filled with new particles. With cut, bonds that cross a line are removed; with bond properties, these are
        assigned to them.

        Parameters
        ----------
        file : path of the section.
        scale : metres per unit of the file (default: as given in the file, else 1).
        origin, to : point of the file, in its units, and the corresponding point of the model [m].
        line : two points of a map, in its units: x is the distance along the line through them, y the height (z).
        legend : for an image: path of a file with rows colour, name.
        attribute : attribute whose value is the name, for GeoJSON and shapefiles (default: name, layer, unit, ... or
            id).
        only : names of the polygons and lines to use (default: all).
        rad : radii of new particles, drawn at random; a repeated one is more likely [m].
        porosity : porosity of the filled polygons (default: 0.2).
        cut : bool: remove the bonds that cross a line.
        ebmod, gbmod, tstrength, sstrength : properties of elastic bonds that cross a line [Pa].
        n_bond, s_bond : strengths of contact bonds that cross a line [N].
        where : particles to change (default: all); of a bond both must be selected; not for new particles.

        Returns
        -------
        int : number of particles that got a group or were created, or number of bonds changed.
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
        id : id of the process; a second command with this id replaces its settings, its balance continues, and so do
            its
            episodes if group and episode are unchanged.
        interval : steps between two applications.
        x : range in which it acts, (least, greatest) [m] (default: the extent of the particles).
        spacing : width of the columns [m] (default: four times the largest radius).
        diffuse : coefficient of diffusion of the heights [m2/s].
        slope : largest stable angle of the surface [deg]; steeper parts slide down.
        erode, above : rate of erosion [m/s], and the level down to which it acts [m]; a level alone acts at once.
        deposit, below : rate of deposition [m/s], and the level up to which it acts [m]; a level alone: each
            application
            deposits a layer as thick as a column is wide, until the level is reached.
        rise : upward velocity of the levels, from the command on [m/s].
        years : years represented by a second of model time; diffuse, erode, deposit and rise are then per year.
        only : groups whose discs may be eroded; other groups protect what lies below them (default: all).
        rad : radii of deposited discs, drawn at random; a repeated one is more likely [m].
        porosity : porosity of eroded and deposited material: bulk area = area of discs / (1 - porosity) (default:
            0.15).
        compact : compaction of the deposit: porosity at the surface, and depth at which it has decreased by a factor
            e [m];
            discs shrink during burial and keep their mass.
        group : group of the deposited discs (default: growth).
        episode : number of steps after which a new group begins: growth1, growth2, ...
        colors : names of the colours of these groups, in turn.
        off : bool: end the process.
        hertz : bool: contacts of Hertz and Mindlin, defined by shear [Pa] and poiss.
        properties : properties of the deposit, as in PROP.
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
        """CLUMP file: create rigid bodies of discs from a clump file, scaled, rotated about the origin of the file,
        then
        translated.

        Mass and inertia are density times the area and polar second moment of area in the file.

        Parameters
        ----------
        file : path of the clump file.
        x, y : translation [m].
        angle : rotation angle, anticlockwise [rad].
        scale : factor on all lengths.
        color, group : colour by name or number; name of the group.

        Returns
        -------
        int : number of rigid bodies created.
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
        wall : id of the wall, which becomes a polyline; or instead where: the particles of the row.
        rigidity : flexural rigidity [N m]; or instead young [Pa], poisson and te: Young's modulus, Poisson's ratio
            and
            elastic thickness [m].
        contrast : density of the fluid below minus density of the infill of the deflection, particles excluded
            [kg/m3].
        x : left and right end of the plate, if it is longer than the base [m].
        left, right : "infinite" (continues without load), "free" or "broken", "clamped" or "fixed".
        load : constant line load: x [m] and size, positive downwards [N/m].
        compensated : bool: the mean load of the first interval is in equilibrium with the undeformed base.
        interval : steps between two solutions of the plate: the base moves in the first half and rests in the second
            half.
        relax : fraction of the distance to equilibrium by which the base moves in an interval, 0 to 1.
        speed : largest speed of the base [m/s] (default: 1e-3 of the largest radius per step).
        segments : number of segments of the base (default: 20 per flexural parameter, at least 50).
        off : bool: end the flexure; the base keeps its present shape.
        """
    def join(self, where: Selected, group: str | None = None, color: str | int | None = None) -> int:
        """CLUMP RANGE: join the selected particles into one clump and return their number.

        Area and polar second moment of area are the sums of those of the discs, overlaps counted twice; the clump
        keeps the
        momentum and angular momentum of the particles. Raises CommandError if the particles are bonded to each other
        or
        differ in density, damping or fixed directions.
        """
    def delete(self, where: Selected = None) -> int:
        """DEL: remove particles with their contacts and bonds, and return their number. Their ids are not reused."""
    def twin(self, number: int, *, where: Selected = None) -> int:
        """TWIN: displace one free particle by 1e-5 of its radius, to compare runs that differ only by this
        displacement.

        Parameters
        ----------
        number : number of the twin; it determines the particle and the direction. 0 is the undisturbed model.
        where : particles from which one is drawn; members of clumps and particles fixed in x or y are excluded.

        Returns
        -------
        int : id of the particle; -1 for twin 0.

        Raises
        ------
        CommandError : if the selection contains no free particle.
        """
    def export(self, file: File, group: bool = False, where: Selected = None) -> None:
        """EXP: write rows "x y r [group]" in the order of ids, with 13 significant digits.

        Parameters
        ----------
        file : path of the file.
        group : bool: write the names of groups as a fourth column.
        where : particles to write (default: all).
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
        """PROP: assign properties, velocities, colour and group to particles; omitted ones keep their values.

        A density is per volume, or per area when SET disk makes disks. With `hertz`, contacts follow Hertz and
        Mindlin; kn
        or ks without it select the linear law. Contacts use the new values from the next step. Velocities of a clump
        are
        those of its centre; its members follow.

        Parameters
        ----------
        where : particles to change (default: all).
        hertz : bool: contacts of Hertz and Mindlin, defined by shear [Pa] and poiss.
        xv, yv, spin : velocity [m/s] and angular velocity, anticlockwise [rad/s].
        color, group : colour by name or number; name of the group.
        law : 'file.py:function' beside the program (docs/user_laws.md), or "linear".
        between : bool: assign the law to pairs of discs with these two laws; nothing else is changed.
        parameter : values of the properties that the law declares.
        properties : density [kg/m3], of discs of unit thickness [kg/m2]; fric; shear [Pa]; poiss; damp; kn, ks
            [N/m];
            rfric, rdamp: coefficient of rolling resistance, damping over the critical one; xp, yp: pressures along x
        and y,
            each acting on the area 2 R thickness of a particle [Pa].
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
        """PROP with bond keys: bond touching pairs and update existing bonds.

        Pairs are those with d - (Ra + Rb) rext <= tolerate. Either ebmod, gbmod, tstrength, sstrength (elastic
        bonds) or
        n_bond, s_bond (contact bonds). Omitted properties keep their values; in new bonds they are 0.

        Parameters
        ----------
        where : particles whose pairs are bonded; both particles of a pair must be selected.
        ebmod, gbmod : Young's and shear modulus of elastic bonds [Pa].
        tstrength, sstrength : their tensile strength and cohesion [Pa].
        n_bond, s_bond : tensile and shear strength of contact bonds [N].
        tolerate : largest gap across which a pair is bonded [m] (default: 1e-6).
        rext : factor on the radii in the search for pairs (default: 1).
        fric : friction coefficient of the particles.
        rubber : bool: label the bonds as a membrane; the label has no mechanical effect.
        conserving : bool: use one shear stiffness for open and touching bonds, so that opening and closing conserve
            energy;
            for contact bonds of Hertz particles, the stiffness at the moment of bonding.
        moment : bool: elastic bonds resist relative rotation and break in tension by the stress at their outer
            fibre.

        Returns
        -------
        int : number of new bonds.
        """
    def break_bonds(self, where: Selected = None, across: Sequence[np.ndarray] | None = None) -> int:
        """BOND break: remove the bonds between particles of a selection; friction limits their shear forces from then
        on.

        Parameters
        ----------
        where : particles; a bond is removed if both of its particles are selected (default: all).
        across : polylines, arrays of points (n, 2) [m]: remove only bonds that cross one of them (default: no
            restriction).
        """
    def fix(self, *dofs: str, where: Selected = None) -> None:
        """FIX: keep the present velocity of particles in these directions: "x", "y", "spin"."""
    def free(self, *dofs: str, where: Selected = None) -> None:
        """FREE: undo `fix` for these directions."""
    def add_physics(self, name: str, **parameters: float) -> None:
        """Add physics to the particles, effective from the next step. "diffusion": heat conduction through contacts,
        with
        conductance of each contact [W/K] and capacity [J/(kg K)]; fields temperature [K], heat_source [W],
        heat_given [J];
        HIST can record heat and heat_given [J], which are also columns of energy.csv.
        """
    def hist(self, id: int, interval: int, what: str) -> None:
        """HIST: record a quantity every `interval` steps in hist_id_<id>.dat and hist_<id>.csv: kinetic, step, time,
        unbalanced, contacts, bonds, energy, deflection, period, sxx, syy or sxy, or "gstress group a", "gstrain
        group a|b",
        "xstress wall 3", "ystrain wall 0|3". Strains are zero at this command.
        """
    def plot(self, y: int, x: int) -> None:
        """PLOT: at `finish`, write history y against history x."""
    def extents(self) -> dict[str, float]:
        """Return {left, right, bottom, top} of the particles that are not fixed in both x and y [m]."""
    def wall_force(self, id: int) -> tuple[float, float]:
        """Return the force on a wall (x, y) [N], summed exactly."""
    def wall_forces(self) -> dict[int, tuple[float, float]]:
        """Return the force on every wall (x, y) [N] by id, with one pass over the contacts."""
    def stress(self, y: tuple[float, float] | None = None) -> dict[str, float]:
        """Return the mean stress between periodic boundaries, {sxx, syy, sxy} [Pa], positive in compression; sxy is the
        force in x across horizontal lines.

        Parameters
        ----------
        y : heights, (lower, upper) [m] (default: those of BOX).
        """
    def kinetic_energy(self) -> float:
        """Return the kinetic energy, the sum of (m v^2 + I w^2) / 2 [J], summed exactly."""
    def unbalanced(self) -> float:
        """Return the largest unbalanced force of a free particle over the mean contact force; small at equilibrium."""
    def surface_balance(self, id: int) -> dict[str, float]:
        """Return the mass and area balance of a process of SURFACE.

        Returns
        -------
        dict : bulk areas [m2]: eroded; deposited (discs at rest); settling (discs not yet at rest); lost (deleted
            before
            they came to rest); carried (demand smaller than a disc, not yet met; negative: erosion); demanded (sum
            requested by the processes: deposited + settling + lost - eroded + carried); compacted (lost as discs of
        the
            deposit shrink, part of the deposited area). Numbers: discs_eroded, discs_deposited, discs_settling.
        Masses
            [kg]: mass_eroded, mass_deposited.
        """
    def clumps(self) -> dict[str, np.ndarray]:
        """Return the clumps of the whole model on every rank, in the order of ids: id (that of the first member), x y
        [m],
        vx vy [m/s], spin [rad/s], angle [rad], area, mass, inertia, members (their number).
        """
