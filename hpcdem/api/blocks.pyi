"""Blocks in a Python program: the commands of the PCDC language as methods, what is there as arrays.

Made by ``scripts/pages``; do not edit it."""

from collections.abc import Callable, Iterable, Sequence
from typing import Literal, overload

import numpy as np

from hpcdem.api.objects import (
    Clocks,
    Conditioned,
    Fluxed,
    GroupedElsewhere,
    Moved,
    Named,
    Objects,
    Random,
    Recorded,
    Stressed,
    Tabled,
    Words,
)
from hpcdem.api.types import File, Number, Piece, Point, Value, Where
from hpcdem.commands.fdem import Project

class Geometry(Words):
    """Shapes in layers, of which meshes are made; lengths in metres, angles in degrees counter-clockwise."""
    def polyline(self, points: Sequence[Point], as_layer: str) -> None:
        """In the plane: straight lines from point to point.

        Parameters
        ----------
        points : the points; or a list of vectors [m].
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def polygon(self, points: Sequence[Point], as_layer: str) -> None:
        """A closed line; in three dimensions the plane surface inside it.

        Parameters
        ----------
        points : the corners [m].
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def rectangle(self, first: Point, second: Point, as_layer: str) -> None:
        """In the plane: a rectangle along the axes.

        Parameters
        ----------
        first : a corner [m].
        second : the opposite corner [m].
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def circle(
        self,
        centre: Point,
        radius: float,
        as_layer: str,
        *,
        segment_length: float | None = None,
        normal: Point | None = None,
    ) -> None:
        """A circle; with segment_length a polygon of equal sides. In three dimensions the surface of a disc.

        Parameters
        ----------
        centre : centre [m].
        radius : radius [m].
        as_layer : name of the layer; a layer may hold several shapes.
        segment_length : approximate length of the sides of a polygon [m] (in the plane; default: a true circle).
        normal : normal of the disc, of any length (in three dimensions; default: (0,0,1)).
        """
    def arc(self, centre: Point, radius: float, begin: float, end: float, as_layer: str) -> None:
        """In the plane: a part of a circle, counter-clockwise.

        Parameters
        ----------
        centre : centre [m].
        radius : radius [m].
        begin : first angle [degrees].
        end : last angle [degrees].
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def point(self, points: Sequence[Point], as_layer: str) -> None:
        """In the plane: single points, which become points of the mesh.

        Parameters
        ----------
        points : the points [m].
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def box(self, first: Point, second: Point, as_layer: str) -> None:
        """In three dimensions: a box along the axes.

        Parameters
        ----------
        first : a corner [m].
        second : the opposite corner [m].
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def sphere(self, centre: Point, radius: float, as_layer: str) -> None:
        """In three dimensions: a sphere.

        Parameters
        ----------
        centre : centre [m].
        radius : radius [m].
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def cylinder(self, first: Point, second: Point, radius: float, as_layer: str) -> None:
        """In three dimensions: a round cylinder.

        Parameters
        ----------
        first : middle of one end [m].
        second : middle of the other end [m].
        radius : radius [m].
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def cone(self, first: Point, second: Point, radius: float, other: float, as_layer: str) -> None:
        """In three dimensions: a round cone, or a part of one.

        Parameters
        ----------
        first : middle of one end [m].
        second : middle of the other end [m].
        radius : radius at the first end [m].
        other : radius at the other end [m].
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def disc(self, centre: Point, normal: Point, radius: float, as_layer: str) -> None:
        """In three dimensions: the surface of a round disc: meshes are cut along it.

        Parameters
        ----------
        centre : centre [m].
        normal : normal of any length.
        radius : radius [m].
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def plane(self, point: Point, normal: Point, as_layer: str) -> None:
        """In three dimensions: a plane without end.

        Parameters
        ----------
        point : a point of the plane [m].
        normal : normal of any length.
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def extrude(self, layer: str, along: Point, as_layer: str) -> None:
        """In three dimensions: bodies made by extruding the polygons of a layer along a vector.

        Parameters
        ----------
        layer : layer of the polygons.
        along : the vector of extrusion [m].
        as_layer : name of the layer; a layer may hold several shapes.
        """
    def revolve(
        self,
        layer: str,
        axis: Point,
        as_layer: str,
        about: Point | None = None,
        angle: float | None = None,
    ) -> None:
        """In three dimensions: bodies made by revolving the polygons of a layer about an axis in their plane.

        Parameters
        ----------
        layer : layer of the polygons.
        axis : direction of the axis.
        as_layer : name of the layer; a layer may hold several shapes.
        about : a point of the axis [m] (default: (0,0,0)).
        angle : angle of revolution, right-handed, up to 360 [degrees] (default: 360).
        """
    def fractures(
        self,
        as_layer: str,
        inside: str,
        *,
        orientation: tuple[Literal["fixed", "uniform", "normal", "fisher"], float],
        orientation_spread: float | None = None,
        orientation_towards: float | None = None,
        length: tuple[Literal["fixed", "exponential", "lognormal", "power"], float] | None = None,
        length_spread: float | None = None,
        length_least: float | None = None,
        length_greatest: float | None = None,
        radius: tuple[Literal["fixed", "exponential", "lognormal", "power"], float] | None = None,
        radius_spread: float | None = None,
        radius_least: float | None = None,
        radius_greatest: float | None = None,
        p10: float | None = None,
        p20: float | None = None,
        p21: float | None = None,
        p30: float | None = None,
        p32: float | None = None,
        scan_line: float | None = None,
        scan_direction: Point | None = None,
        reached: bool = False,
        ends_at: float | None = None,
        hole: Sequence[str] = (),
        shortest: float | None = None,
        seed: int,
    ) -> None:
        """A set of fractures with given statistics, as straight lines, in three dimensions discs; for `mesh.create`
        crack, or `mesh.intersect`.

        Parameters
        ----------
        as_layer : name of the layer; a layer may hold several shapes.
        inside : the layer that bounds them.
        orientation : distribution and mean of the angle to x, counter-clockwise; in three dimensions fixed or
            fisher, and the dip [degrees].
        orientation_spread : uniform: half width; normal: standard deviation [degrees]; fisher: kappa (default: 0).
        orientation_towards : dip direction, clockwise from y as seen from above [degrees] (in three dimensions;
            default: 0).
        length : distribution of the length, and its value: the length, the mean, the mean, the exponent [m] (in the
            plane).
        length_spread : lognormal: standard deviation [m].
        length_least : lower bound [m] (default: 0).
        length_greatest : upper bound [m] (default: none).
        radius : distribution of the radius of discs, and its value: the radius, the mean, the mean, the exponent [m]
            (in three dimensions).
        radius_spread : lognormal: standard deviation [m].
        radius_least : lower bound [m] (default: 0).
        radius_greatest : upper bound [m] (default: none).
        p10 : density: fractures per length of a scan line [1/m].
        p20 : density: fractures per area [1/m2] (in the plane).
        p21 : density: length of fractures per area [1/m] (in the plane).
        p30 : density: fractures per volume [1/m3] (in three dimensions).
        p32 : density: area of fractures per volume [1/m] (in three dimensions).
        scan_line : direction of the line of p10 [degrees] (in the plane; default: 0).
        scan_direction : direction of the line of p10 (in three dimensions; default: (0,0,1)).
        reached : meets p20, p21, p30 or p32 as closely as a whole number of fractures can, not on average.
        ends_at : share of the intersections with earlier fractures at which a fracture ends (in the plane; default:
            0).
        hole : no fractures inside this layer (in the plane).
        shortest : shorter pieces at the boundary are omitted [m] (in the plane; default: 0).
        seed : seed of the random numbers: each seed gives another network.
        """
    def import_file(
        self,
        file: File,
        as_layer: str,
        dxf_layer: str | None = None,
        scale: float | None = None,
        *,
        named: bool = False,
        origin: Point | None = None,
        to: Point | None = None,
        line: tuple[Point, Point] | None = None,
        legend: File | None = None,
        attribute: str | None = None,
        simplify: float | None = None,
    ) -> None:
        """Lines of a DXF file, or polygons and lines of a section: GeoJSON, shapefile, SVG, DXF, or an image with a
        legend (docs/sections.md); in three dimensions the solids of a STEP or BREP file, or what the triangles of an
        STL or DXF file (3DFACE) enclose.

        Parameters
        ----------
        file : name of the file.
        as_layer : name of the layer; a layer may hold several shapes.
        dxf_layer : only this layer of the file (default: all).
        scale : metres per unit of the file [m] (default: the unit given in STEP, DXF and .prj files, else 1).
        named : each name in the section becomes a layer, and as_layer the outline of all its polygons (in the
            plane).
        origin : point of the section, in its units, that is moved to `to` (in the plane; default: (0,0)).
        to : position of the origin in the model [m] (in the plane; default: (0,0)).
        line : two points of a map with heights, in its units: x is the distance along their line, y the height (in
            the plane).
        legend : legend of an image: a file with lines of colour and name (in the plane).
        attribute : attribute whose value is the name (GeoJSON, shapefiles) (in the plane; default: name, layer,
            unit, formation, label or id).
        simplify : omits points of boundaries where triangles of less than half the square of this length disappear
            [m] (in the plane).
        """
    def transform(
        self,
        layer: str,
        *,
        scale: float | None = None,
        rotate: float | None = None,
        axis: Point | None = None,
        about: Point | None = None,
        move: Point | None = None,
    ) -> None:
        """Moves, turns or scales a layer.

        Parameters
        ----------
        layer : name of the layer.
        scale : scale factor, applied first.
        rotate : angle of rotation, applied after the scale, counter-clockwise; in three dimensions right-handed
            about the axis [degrees].
        axis : axis of rotation (in three dimensions; default: (0,0,1)).
        about : centre of scaling and rotation [m] (default: the origin).
        move : translation, applied last [m].
        """
    def scale(self, factors: Point, layer: Sequence[str] | None = None) -> None:
        """Multiplies the coordinates of layers, of all without layer; a negative factor mirrors. Round shapes need
        factors of equal size.

        Parameters
        ----------
        factors : factors along the axes, not 0.
        layer : names of layers (default: all).
        """
    def translate(self, vector: Point, layer: Sequence[str] | None = None) -> None:
        """Moves layers; without layer all of them.

        Parameters
        ----------
        vector : translation of all points [m].
        layer : names of layers (default: all).
        """
    def export(
        self,
        layers: Sequence[str],
        file: File,
        *,
        scale: float | None = None,
        origin: Point | None = None,
        to: Point | None = None,
        line: tuple[Point, Point] | None = None,
    ) -> None:
        """In the plane: writes layers to a DXF, GeoJSON or CSV file under their names: in metres, or in the coordinates
        from which `geometry.import_file` with these options makes those of the model.

        Parameters
        ----------
        layers : names of the layers.
        file : name of the file, in the folder of the results.
        scale : metres per unit of the file [m] (default: 1).
        origin : point of the section, in its units, that is moved to `to` (default: (0,0)).
        to : position of the origin in the model [m] (default: (0,0)).
        line : two points of a map with heights, in its units: x is the distance along their line, y the height.
        """
    def delete(self, *layers: str) -> None:
        """Delete layers; meshes created from them keep their edges.

        Parameters
        ----------
        layers : names of the layers.
        """

class Mesh(Words):
    """Meshes: each call adds a body to the model. Its elements belong to a group of a set."""
    def create(
        self,
        from_layer: str,
        size: float,
        type: Literal["tri", "quad"] | None = None,
        *,
        refine_layer: Iterable[tuple[str, float] | tuple[str, float, float]] = (),
        hole: Sequence[str] = (),
        region: Iterable[str | tuple[str] | tuple[str, str]] = (),
        embed: Sequence[str] = (),
        crack: Sequence[str] = (),
        bodies: bool = False,
        irregular: bool = False,
        smooth: bool = False,
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """Meshes the inside of a layer with Gmsh. Several meshes make several bodies of one model, which may touch each
        other.

        Parameters
        ----------
        from_layer : layer with the outline of the mesh.
        size : length of edges [m].
        type : triangles or quads (in the plane; default: tri).
        refine_layer : smaller elements near this layer; each is (refine_layer, size, distance); size: length of
            edges there [m]; distance: distance over which the size grows to that of the rest [m] (default: ten times
            the size).
        hole : the inside of this layer stays empty.
        region : the elements inside this layer become a group; each is (region, group); group: name of the group
            (default: the name of the layer).
        embed : lines that become edges of the mesh; in three dimensions surfaces, which become faces.
        crack : lines that become edges with an initial crack; in three dimensions surfaces.
        bodies : each body of the layer becomes a group, named as in its file, else by the layer and its number (in
            three dimensions).
        irregular : triangles without a pattern, since cracks follow rows of equilateral triangles (in the plane).
        smooth : moves inner points to the centre of their neighbours, so that joints on all edges carry a uniform
            stress equally; for triangles (in the plane).
        group : the group that the new elements are in.
        set : the set of the group.
        """
    def structured(
        self,
        first: Point,
        second: Point,
        cells: tuple[int, ...],
        type: Literal["tri", "quad", "tet", "hex"] | None = None,
        diagonal: Literal["right", "left", "alternate", "both"] | None = None,
        *,
        split: int | None = None,
        ratio: tuple[float, ...] | None = None,
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """A regular mesh of a rectangle.

        Parameters
        ----------
        first : a corner [m].
        second : the opposite corner [m].
        cells : number of cells along x and y, in three dimensions also z.
        type : triangles or quads, in three dimensions tetrahedra or hexahedra (default: tri, tet).
        diagonal : direction of the diagonals; alternate: it changes from rectangle to rectangle; both: two in each
            rectangle (in the plane; default: alternate).
        split : tetrahedra of each box: 5, mirrored from box to box, 6 about a diagonal, or 12 about a point in the
            middle (in three dimensions; default: 6).
        ratio : ratio of the size of each rectangle or box to the previous one, along x and y (and z) (default: 1 1).
        group : the group that the new elements are in.
        set : the set of the group.
        """
    def brick(
        self,
        p0: Point,
        p1: Point,
        p2: Point,
        p3: Point | None = None,
        *,
        n: tuple[int, ...],
        ratio: tuple[float, ...] | None = None,
        triangle: bool | None = None,
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """A regular mesh of a parallelogram, in three dimensions of a parallelepiped, by a corner and the ends of its
        edges there.

        Parameters
        ----------
        p0 : corner at which the edges begin [m].
        p1 : end of the first edge [m].
        p2 : end of the second edge [m].
        p3 : end of the third edge [m] (in three dimensions).
        n : elements along each edge.
        ratio : ratio of the size of an element to the previous one, along each edge (default: 1 1).
        triangle : triangles, or tetrahedra; False: quads, or hexahedra (default: True).
        group : the group that the new elements are in.
        set : the set of the group.
        """
    def geometry(
        self,
        *,
        layer: Iterable[tuple[Sequence[str]] | tuple[Sequence[str], float] | tuple[Sequence[str], float, bool]] = (),
        circle: Iterable[tuple[Point, float] | tuple[Point, float, float] | tuple[Point, float, float, bool]] = (),
        arc: Iterable[tuple[Point, Point, Point] | tuple[Point, Point, Point, float] | tuple[Point, Point, Point, float, bool]] = (),
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """In the plane: triangles inside closed lines, by Gmsh, with a mesh size for each piece. Other pieces inside
        become edges and points of the mesh.

        Parameters
        ----------
        layer : layers of geometry; each is (layer, mesh_size, is_boundary); mesh_size: length of edges there [m]
            (default: the largest of the others); is_boundary: the piece bounds the mesh: elements outside it are
            removed (default: the first piece).
        circle : a circle; each is (center, radius, mesh_size, is_boundary); center: centre [m]; radius: radius [m];
            mesh_size: length of edges there [m] (default: the largest of the others); is_boundary: the piece bounds
            the mesh: elements outside it are removed (default: the first piece).
        arc : an arc, counter-clockwise; each is (center, start_point, end_point, mesh_size, is_boundary); center:
            centre [m]; start_point: start of the arc [m]; end_point: end of the arc [m]; mesh_size: length of edges
            there [m] (default: the largest of the others); is_boundary: the piece bounds the mesh: elements outside
            it are removed (default: the first piece).
        group : the group that the new elements are in.
        set : the set of the group.
        """
    def patch(
        self,
        boundary: Iterable[Piece],
        *,
        polyline: Iterable[Piece] = (),
        point: Iterable[Piece] = (),
        global_mesh_size: float | None = None,
        tolerance: float | None = None,
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """In the plane: triangles inside closed lines, by Gmsh, that follow other lines and points inside.

        Parameters
        ----------
        boundary : bounds the mesh; each is (array, layer, mesh_size); array: points; or a list of vectors [m];
            layer: layers of geometry; mesh_size: length of edges there [m] (default: the largest of the others).
        polyline : lines that become edges; each is (array, layer, mesh_size); array: points; or a list of vectors
            [m]; layer: layers of geometry; mesh_size: length of edges there [m] (default: the largest of the
            others).
        point : points of the mesh; each is (array, layer, mesh_size); array: points; or a list of vectors [m];
            layer: layers of geometry; mesh_size: length of edges there [m] (default: the largest of the others).
        global_mesh_size : mesh size away from the lines and points, and for those without a size [m] (default: the
            largest of the pieces).
        tolerance : points nearer than this are merged [m] (default: 1e-4).
        group : the group that the new elements are in.
        set : the set of the group.
        """
    def boundary(
        self,
        boundary: Sequence[Point],
        mesh_size: float | None = None,
        *,
        inner: Iterable[tuple[Sequence[Point]] | tuple[Sequence[Point], float] | tuple[Sequence[Point], float, bool]] = (),
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """In the plane: triangles inside a closed line, by Gmsh, with inner lines that are holes or filled.

        Parameters
        ----------
        boundary : corners of the outline; or a list of vectors [m].
        mesh_size : length of edges there [m] (default: the largest of the others).
        inner : corners of a line in it [m]; each is (inner_boundary, mesh_size, filled); mesh_size: length of edges
            there [m] (default: the largest of the others); filled: elements inside; False: a hole.
        group : the group that the new elements are in.
        set : the set of the group.
        """
    def hollow_circle(
        self,
        center: Point,
        radius: float,
        inner_radius: float,
        mesh_size: float | None = None,
        inner_mesh_size: float | None = None,
        *,
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """In the plane: triangles in a ring, by Gmsh.

        Parameters
        ----------
        center : centre of both circles [m].
        radius : outer radius [m].
        inner_radius : radius of the hole [m].
        mesh_size : length of edges there [m] (default: the largest of the others).
        inner_mesh_size : length of edges there [m] (default: the largest of the others).
        group : the group that the new elements are in.
        set : the set of the group.
        """
    def equilateral(
        self,
        first: Point,
        second: Point,
        size: float,
        *,
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """In the plane: nearly equilateral triangles in a rectangle.

        Parameters
        ----------
        first : a corner [m].
        second : the opposite corner [m].
        size : length of edges [m].
        group : the group that the new elements are in.
        set : the set of the group.
        """
    def import_file(
        self,
        file: File,
        *,
        group: str | None = None,
        set: str | None = None,
        merge: float | None = None,
        scale: float | None = None,
    ) -> None:
        """A mesh of another program, for example .msh or .inp; its physical groups and sets of elements, nodes and
        faces become groups.

        Parameters
        ----------
        file : name of the file.
        group : a group for all elements, in addition to those of the file.
        set : the set of the group.
        merge : points nearer than this are merged [m] (default: 0).
        scale : metres per unit of the file [m] (default: 1).
        """
    def intersect(self, layer: str, follow: bool = False) -> None:
        """Turns the joints on a layer into cracks: the edges of the mesh that lie on it.

        Parameters
        ----------
        layer : layer whose lines are edges of the mesh, or whose surfaces are faces.
        follow : for lines that are not edges: uses the edges that follow them best, or the faces between elements on
            either side.
        """
    def glue(
        self,
        tolerance: float | None = None,
        between: tuple[str, str] | None = None,
        *,
        set: str | None = None,
        where: Where | None = None,
    ) -> None:
        """Connects separately meshed bodies where their faces coincide; the faces become joints like those inside a
        body. Elements are cut at hanging nodes. With a range only faces of its elements are glued, to any others.

        Parameters
        ----------
        tolerance : points nearer than this are merged [m] (default: a thousandth of the shortest edge).
        between : only faces between the elements of these two groups.
        set : the set of the group.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def densify(
        self,
        maximum_length: float | tuple[float, float],
        pattern: tuple[int, int] | None = None,
        *,
        where: Where | None = None,
    ) -> None:
        """In the plane: halves quads until they are short enough, before the first model or condition is assigned.
        Neighbours are divided too, so that no side has more than one hanging node; quads with a hanging node become
        triangles.

        Parameters
        ----------
        maximum_length : greatest length of sides along x and y; one number applies to both [m].
        pattern : 1: halved along x, along y; 0: not (default: 1 1).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def delete(self, *, where: Where | None = None) -> None:
        """Deletes elements. Before the first model or condition is assigned, they leave the mesh and the others are
        renumbered; later they are excavated, as by `elements.null`.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def add_nodes(self, points: Sequence[Point]) -> None:
        """Adds nodes for elements that follow, before the first model or condition is assigned. Their numbers follow
        those of the mesh.

        Parameters
        ----------
        points : positions of the nodes [m].
        """
    def add_element(self, *corners: int) -> None:
        """Adds an element by the numbers of its nodes.

        Parameters
        ----------
        corners : numbers of three or four nodes, in three dimensions of four.
        """
    def scale(self, factors: Point) -> None:
        """Multiplies the coordinates of all points of the mesh, before the first model or condition is assigned.

        Parameters
        ----------
        factors : factors along the axes, above 0.
        """
    def translate(self, vector: Point) -> None:
        """Moves all points of the mesh, before the first model or condition is assigned.

        Parameters
        ----------
        vector : translation of all points [m].
        """
    def quadratic(self) -> None:
        """In the plane: turns each triangle of the mesh into an elastic six-node triangle with quadratic displacements:
        one over the height of a beam is enough for bending. It is stored as four connected elements; joints, contact
        and loads act on the halves of its sides. The mesh must have triangles only; must precede the first model or
        condition.
        """
    def quality(self) -> None:
        """Report the quality of the mesh in the log: angles, sizes."""

class Elements(Stressed):
    """Elements: `sim.elements["stress-xx"]`, see `Objects`."""
    def __getitem__(
        self,
        name: Literal["stress-xx", "stress-yy", "stress-xy", "stress-zz", "stress-xz", "stress-yz", "plastic-state", "plastic-shear-strain", "plastic-volume-strain", "plastic-work", "creep-strain-xx", "creep-strain-yy", "creep-strain-xy", "kelvin-strain-xx", "kelvin-strain-yy", "kelvin-strain-xy", "creep-strain-zz", "creep-strain-xz", "creep-strain-yz", "kelvin-strain-zz", "kelvin-strain-xz", "kelvin-strain-yz", "creep-work", "mean-temperature", "mean-moisture", "suction", "law-state"] | str,
    ) -> np.ndarray: ...
    def group(self, group: str, set: str | None = None, *, where: Where | None = None) -> None:
        """Assign them to a group; each is in at most one group of a set.

        Parameters
        ----------
        group : name of the group.
        set : the set of the group.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["mechanical-iso-elastic", "mechanical-iso-e", "mech-iso-elastic", "mech-iso-e"],
        *,
        density: Value,
        young: Value | None = None,
        poisson_ratio: Value | None = None,
        shear: Value | None = None,
        bulk: Value | None = None,
        damp_factor: Value | None = None,
        friction: Value | None = None,
        penalty: Value | None = None,
        damp_b: Value | None = None,
        where: Where | None = None,
    ) -> None:
        """Isotropic, linear elastic, for large rotations.

        Parameters
        ----------
        density : density [kg/m3].
        young : Young's modulus E [Pa].
        poisson_ratio : Poisson's ratio.
        shear : shear modulus; with the bulk modulus it replaces E and Poisson's ratio [Pa].
        bulk : bulk modulus; with the shear modulus it replaces E and Poisson's ratio [Pa].
        damp_factor : viscous damping, part of the critical 2 L sqrt(rho E); without effect in static runs (default:
            0).
        friction : friction angle of its surfaces where they have no contact model [degrees] (default: 0).
        penalty : contact penalty of its surfaces where they have no contact model; 0: that of its joints, or 10 E
            [Pa] (default: 0).
        damp_b : exponent of the overlap of its surfaces while they separate, where they have no contact model; above
            1 contacts lose energy (default: 1).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(self, name: Literal["null"], *, relax: float | None = None, where: Where | None = None) -> None:
        """Removes (excavates) elements; adjacent faces become free. Assigning another model to them reinstates them as
        new, stress-free material at the present position of the void, connected to its neighbours without joints
        until face-joint c-model assigns some.

        Parameters
        ----------
        relax : the forces of the removed elements decrease to 0 over this time (static runs: number of steps) [s]
            (default: at once).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["mechanical-mohr-coulomb", "mechanical-mohr-c", "mechanical-m-coulomb", "mechanical-m-c", "mech-mohr-coulomb", "mech-mohr-c", "mech-m-coulomb", "mech-m-c"],
        *,
        density: Value,
        young: Value | None = None,
        poisson_ratio: Value | None = None,
        shear: Value | None = None,
        bulk: Value | None = None,
        friction: Value | None = None,
        cohesion: Value | None = None,
        tensile: Value | None = None,
        dilation: Value | None = None,
        damp_factor: Value | None = None,
        penalty: Value | None = None,
        damp_b: Value | None = None,
        where: Where | None = None,
    ) -> None:
        """Elastic up to the Mohr–Coulomb or tensile strength, then plastic, for large rotations.

        Parameters
        ----------
        density : density [kg/m3].
        young : Young's modulus E [Pa].
        poisson_ratio : Poisson's ratio.
        shear : shear modulus; with the bulk modulus it replaces E and Poisson's ratio [Pa].
        bulk : bulk modulus; with the shear modulus it replaces E and Poisson's ratio [Pa].
        friction : internal friction angle; also that of its surfaces where they have no contact model [degrees]
            (default: 0).
        cohesion : cohesion [Pa] (default: 0).
        tensile : tensile strength; limited to cohesion / tan(friction) [Pa] (default: 0).
        dilation : dilation angle, at most the friction angle [degrees] (default: 0).
        damp_factor : viscous damping, part of the critical 2 L sqrt(rho E); without effect in static runs (default:
            0).
        penalty : contact penalty of its surfaces where they have no contact model; 0: that of its joints, or 10 E
            [Pa] (default: 0).
        damp_b : exponent of the overlap of its surfaces while they separate, where they have no contact model; above
            1 contacts lose energy (default: 1).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["user"],
        *,
        law: File,
        density: Value,
        young: Value | None = None,
        poisson_ratio: Value | None = None,
        shear: Value | None = None,
        bulk: Value | None = None,
        damp_factor: Value | None = None,
        friction: Value | None = None,
        penalty: Value | None = None,
        parameter: Sequence[tuple[str, Value]] = (),
        where: Where | None = None,
    ) -> None:
        """A user law in a Python file, see docs/user_laws.md.

        Parameters
        ----------
        law : 'file.py:law': the file, in the folder of the script, and the name of the law in it; plain text.
        density : density [kg/m3].
        young : Young's modulus E [Pa].
        poisson_ratio : Poisson's ratio.
        shear : shear modulus; with the bulk modulus it replaces E and Poisson's ratio [Pa].
        bulk : bulk modulus; with the shear modulus it replaces E and Poisson's ratio [Pa].
        damp_factor : viscous damping, part of the critical 2 L sqrt(rho E); without effect in static runs (default:
            0).
        friction : friction angle of its surfaces where they have no contact model [degrees] (default: 0).
        penalty : contact penalty of its surfaces where they have no contact model; 0: that of its joints, or 10 E
            [Pa] (default: 0).
        parameter : a property that the law declares, by its name, and its value.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["mechanical-burgers", "mechanical-bur", "mech-burgers", "mech-bur"],
        *,
        density: Value,
        young: Value | None = None,
        poisson_ratio: Value | None = None,
        bulk: Value | None = None,
        kelvin_shear: Value | None = None,
        kelvin_viscosity: Value | None = None,
        maxwell_shear: Value | None = None,
        maxwell_viscosity: Value | None = None,
        kelvin_strain_xx: Value | None = None,
        kelvin_strain_yy: Value | None = None,
        kelvin_strain_xy: Value | None = None,
        kelvin_strain_zz: Value | None = None,
        kelvin_strain_xz: Value | None = None,
        kelvin_strain_yz: Value | None = None,
        damp_factor: Value | None = None,
        friction: Value | None = None,
        where: Where | None = None,
    ) -> None:
        """Burgers creep: elastic in volume, creeping in shear while model creep is on, for large rotations. An initial
        strain of the Kelvin unit belongs to an initial stress.

        Parameters
        ----------
        density : density [kg/m3].
        young : Young's modulus E [Pa].
        poisson_ratio : Poisson's ratio.
        bulk : bulk modulus, instead of the one that E and Poisson's ratio give [Pa].
        kelvin_shear : shear modulus of the Kelvin unit; 0: no Kelvin unit [Pa] (default: 0).
        kelvin_viscosity : viscosity of the Kelvin unit; 0: no Kelvin unit [Pa s] (default: 0).
        maxwell_shear : shear modulus of the Maxwell unit, instead of the one that E and Poisson's ratio give [Pa].
        maxwell_viscosity : viscosity of the Maxwell unit; 0: no dashpot [Pa s] (default: 0).
        kelvin_strain_xx : strain xx of the Kelvin unit at that moment; its zz is -xx - yy (default: 0).
        kelvin_strain_yy : strain yy of the Kelvin unit at that moment; its zz is -xx - yy (default: 0).
        kelvin_strain_xy : strain xy of the Kelvin unit at that moment; its zz is -xx - yy (default: 0).
        kelvin_strain_zz : strain zz of the Kelvin unit at that time; assign all three (in three dimensions; default:
            -xx - yy).
        kelvin_strain_xz : strain xz of the Kelvin unit at that moment (in three dimensions; default: 0).
        kelvin_strain_yz : strain yz of the Kelvin unit at that moment (in three dimensions; default: 0).
        damp_factor : viscous damping, part of the critical 2 L sqrt(rho E); without effect in static runs (default:
            0).
        friction : friction angle of its surfaces where they have no contact model [degrees] (default: 0).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["thermal-iso-heat", "thermal-iso-h", "therm-iso-heat", "therm-iso-h"],
        *,
        conductivity: Value,
        capacity: Value,
        transfer_coeficient: Value | None = None,
        transfer_coefficient: Value | None = None,
        transfer_coefficent: Value | None = None,
        expansion_coeficient: Value | None = None,
        expansion_coefficient: Value | None = None,
        conductivity_across: Value | None = None,
        conductivity_angle: Value | None = None,
        friction_heat: Value | None = None,
        conductivity_dip: Value | None = None,
        where: Where | None = None,
    ) -> None:
        """Heat conduction and thermal expansion, in addition to the mechanical model. If one element has this model,
        all elements need it. Heat is conducted across intact joints; broken joints transfer heat where their
        surfaces are in contact, with a transfer coefficient. Elements are free of thermal stress at the present
        temperatures. Temperatures may be in °C or K.

        Parameters
        ----------
        conductivity : thermal conductivity [W/(m K)].
        capacity : specific heat [J/(kg K)].
        transfer_coeficient : heat transfer at faces: to a prescribed environment without its own coefficient, and
            between surfaces in contact, with the harmonic mean of both [W/(m2 K)] (default: 0).
        transfer_coefficient : as transfer-coeficient.
        transfer_coefficent : as transfer-coeficient.
        expansion_coeficient : linear thermal expansion [1/K] (default: 0).
        expansion_coefficient : as expansion-coeficient.
        conductivity_across : conductivity across the direction of conductivity-angle [W/(m K)] (default:
            conductivity).
        conductivity_angle : direction of conductivity from x, counter-clockwise, in space the strike of its planes;
            it rotates with the element [degrees] (default: 0).
        friction_heat : part of the friction work that becomes heat when faces slide: each of the two elements
            absorbs this part of half of the work (default: 0).
        conductivity_dip : dip of the planes of conductivity [degrees] (in three dimensions; default: 90).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["hydraulic-porous-medium", "hydraulic-porous-m", "hydraulic-p-medium", "hydraulic-p-m", "hydr-porous-medium", "hydr-porous-m", "hydr-p-medium", "hydr-p-m"],
        *,
        fluid_density: Value,
        fluid_bulk: Value,
        viscosity: Value,
        aperature_initial: Value | None = None,
        aperture_initial: Value | None = None,
        aperature_minumum: Value | None = None,
        aperature_minimum: Value | None = None,
        aperture_minimum: Value | None = None,
        aperture_minumum: Value | None = None,
        aperature_maximum: Value | None = None,
        aperture_maximum: Value | None = None,
        leak_off: bool | None = None,
        matrix_pore_pressure: Value | None = None,
        matrix_permeability: Value | None = None,
        matrix_porosity_compressibility: Value | None = None,
        matrix_porosity_compressiblity: Value | None = None,
        matrix_porosity: Value | None = None,
        shear_dilation: Value | None = None,
        shear_dilation_limit: Value | None = None,
        matrix_saturation: Value | None = None,
        turbulence: bool | None = None,
        where: Where | None = None,
    ) -> None:
        """Fluid in joints: each is a channel between its two nodes, broken or not, of the aperture aperature-initial
        plus its mean opening, within the limits. It acts in addition to the mechanical model of the joint. If the
        model is assigned again, excess fluid is removed, and new volume is dry. In space channels are the triangles
        of the joints.

        Parameters
        ----------
        fluid_density : density of the fluid [kg/m3].
        fluid_bulk : bulk modulus of the fluid [Pa].
        viscosity : kinematic viscosity of the fluid: the dynamic one over the density [m2/s].
        aperature_initial : hydraulic aperture of a closed joint; in intact joints a virtual aperture, which
            represents the permeability of the rock [m].
        aperture_initial : as aperature-initial.
        aperature_minumum : smallest hydraulic aperture, of joints in compression [m].
        aperature_minimum : as aperature-minumum.
        aperture_minimum : as aperature-minumum.
        aperture_minumum : as aperature-minumum.
        aperature_maximum : largest hydraulic aperture [m] (default: no limit).
        aperture_maximum : as aperature-maximum.
        leak_off : broken joints lose fluid to the rock (Carter leak-off).
        matrix_pore_pressure : leak-off: pore pressure of the rock; negative: suction of unsaturated rock [Pa]
            (default: 0).
        matrix_permeability : leak-off: permeability of the rock [m2] (default: needed by leak-off).
        matrix_porosity_compressibility : leak-off: compressibility of the pores [1/Pa] (default: needed by
            leak-off).
        matrix_porosity_compressiblity : as matrix-porosity-compressibility.
        matrix_porosity : leak-off: porosity of the rock (default: needed by leak-off).
        shear_dilation : the aperture grows by the tangent of this angle times the mean slip of the joint [degrees]
            (default: 0).
        shear_dilation_limit : largest increase of the aperture by slip [m] (default: no limit).
        matrix_saturation : leak-off: initial saturation of the pores; below 1 a sharp front fills the rest (default:
            1).
        turbulence : on: fast flow is turbulent, with friction of smooth walls after Blasius; off: laminar at any
            Reynolds number.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["hydraulic-porous-proppant-medium", "hydraulic-porous-proppant-m", "hydraulic-porous-p-medium", "hydraulic-porous-p-m", "hydraulic-p-proppant-medium", "hydraulic-p-proppant-m", "hydraulic-p-p-medium", "hydraulic-p-p-m", "hydr-porous-proppant-medium", "hydr-porous-proppant-m", "hydr-porous-p-medium", "hydr-porous-p-m", "hydr-p-proppant-medium", "hydr-p-proppant-m", "hydr-p-p-medium", "hydr-p-p-m"],
        *,
        fluid_density: Value,
        fluid_bulk: Value,
        viscosity: Value,
        aperature_initial: Value | None = None,
        aperture_initial: Value | None = None,
        aperature_minumum: Value | None = None,
        aperature_minimum: Value | None = None,
        aperture_minimum: Value | None = None,
        aperture_minumum: Value | None = None,
        aperature_maximum: Value | None = None,
        aperture_maximum: Value | None = None,
        leak_off: bool | None = None,
        matrix_pore_pressure: Value | None = None,
        matrix_permeability: Value | None = None,
        matrix_porosity_compressibility: Value | None = None,
        matrix_porosity_compressiblity: Value | None = None,
        matrix_porosity: Value | None = None,
        shear_dilation: Value | None = None,
        shear_dilation_limit: Value | None = None,
        matrix_saturation: Value | None = None,
        turbulence: bool | None = None,
        proppant_density: float,
        proppant_size: float,
        proppant_size_factor: float | None = None,
        aperature_factor: float | None = None,
        aperture_factor: float | None = None,
        proppant_concentration_limit: float,
        proppant_modulus: float | None = None,
        viscosity_power: float | None = None,
        proppant_stokes: bool | None = None,
        where: Where | None = None,
    ) -> None:
        """Fluid in joints that carries proppant, one kind in all channels. Grains move with the slurry, increase its
        density and viscosity, settle, and bridge where the channel is narrow. A node that is filled to the limit is
        a pack: fluid passes it, grains do not, and it carries the load of the walls.

        Parameters
        ----------
        fluid_density : density of the fluid [kg/m3].
        fluid_bulk : bulk modulus of the fluid [Pa].
        viscosity : kinematic viscosity of the fluid: the dynamic one over the density [m2/s].
        aperature_initial : hydraulic aperture of a closed joint; in intact joints a virtual aperture, which
            represents the permeability of the rock [m].
        aperture_initial : as aperature-initial.
        aperature_minumum : smallest hydraulic aperture, of joints in compression [m].
        aperature_minimum : as aperature-minumum.
        aperture_minimum : as aperature-minumum.
        aperture_minumum : as aperature-minumum.
        aperature_maximum : largest hydraulic aperture [m] (default: no limit).
        aperture_maximum : as aperature-maximum.
        leak_off : broken joints lose fluid to the rock (Carter leak-off).
        matrix_pore_pressure : leak-off: pore pressure of the rock; negative: suction of unsaturated rock [Pa]
            (default: 0).
        matrix_permeability : leak-off: permeability of the rock [m2] (default: needed by leak-off).
        matrix_porosity_compressibility : leak-off: compressibility of the pores [1/Pa] (default: needed by
            leak-off).
        matrix_porosity_compressiblity : as matrix-porosity-compressibility.
        matrix_porosity : leak-off: porosity of the rock (default: needed by leak-off).
        shear_dilation : the aperture grows by the tangent of this angle times the mean slip of the joint [degrees]
            (default: 0).
        shear_dilation_limit : largest increase of the aperture by slip [m] (default: no limit).
        matrix_saturation : leak-off: initial saturation of the pores; below 1 a sharp front fills the rest (default:
            1).
        turbulence : on: fast flow is turbulent, with friction of smooth walls after Blasius; off: laminar at any
            Reynolds number.
        proppant_density : density of the grains [kg/m3].
        proppant_size : diameter of the grains [m].
        proppant_size_factor : smallest aperture, in diameters of grains: grains bridge in narrower channels
            (default: 3).
        aperature_factor : hydraulic aperture of a pack over that of the channel; 0: Kozeny–Carman permeability of
            the pack (default: 0).
        aperture_factor : as aperature-factor.
        proppant_concentration_limit : concentration of a pack.
        proppant_modulus : modulus of a pack in compression; 0: it carries no load [Pa] (default: 0).
        viscosity_power : beta of the slurry, whose viscosity is that of the fluid times (1 - C / limit)^beta
            (default: -2.5).
        proppant_stokes : on: settling after Stokes; off: after Schiller and Naumann, for any Reynolds number.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["thermal-fluid", "fluid-thermal", "thermal-f", "t-fluid", "t-f", "fluid-t", "f-thermal", "f-t"],
        *,
        conductivity: Value,
        capacity: Value | None = None,
        heat_capacity: Value | None = None,
        transfer_coeficient: Value | None = None,
        transfer_coefficient: Value | None = None,
        transfer_coefficent: Value | None = None,
        convective_heat_transfer_coefficient: Value | None = None,
        second_order: bool | None = None,
        where: Where | None = None,
    ) -> None:
        """Heat in the fluid of joints with a hydraulic model, in addition to heat in the elements. If one channel has
        this model, all channels need it. Fluid starts at the temperature of the adjacent rock; inflow has the
        temperature of its node.

        Parameters
        ----------
        conductivity : thermal conductivity of the fluid [W/(m K)].
        capacity : specific heat of the fluid [J/(kg K)].
        heat_capacity : as capacity.
        transfer_coeficient : heat transfer between fluid and each of the two sides [W/(m2 K)] (default: 0).
        transfer_coefficient : as transfer-coeficient.
        transfer_coefficent : as transfer-coeficient.
        convective_heat_transfer_coefficient : as transfer-coeficient.
        second_order : advection of second order with a flux limiter: fronts stay sharper.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["moisture-diffusion"],
        *,
        diffusivity: Value,
        shrinkage: Value | None = None,
        evaporation: Value | None = None,
        moisture_saturated: Value | None = None,
        moisture_residual: Value | None = None,
        air_entry: Value | None = None,
        pore_index: Value | None = None,
        where: Where | None = None,
    ) -> None:
        """Diffusion of moisture, mass of water over dry mass, in addition to the mechanical model. If one element has
        this model, all elements need it. It crosses joints until they break. Elements are free of the stress that it
        causes at the present values.

        Parameters
        ----------
        diffusivity : diffusivity of moisture [m2/s].
        shrinkage : linear shrinkage, strain over loss of moisture (default: 0).
        evaporation : mass flow through faces over the difference of moisture to a prescribed environment without its
            own coefficient [kg/(m2 s)] (default: 0).
        moisture_saturated : moisture at which all pores are full (default: 0.4).
        moisture_residual : residual moisture, which suction cannot remove (default: 0).
        air_entry : suction at which pores begin to drain, 1 / alpha of van Genuchten [Pa] (default: 10000).
        pore_index : exponent n of van Genuchten (default: 1.5).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def property(
        self,
        *,
        density: Value | None = None,
        young: Value | None = None,
        poisson_ratio: Value | None = None,
        shear: Value | None = None,
        bulk: Value | None = None,
        damp_factor: Value | None = None,
        friction: Value | None = None,
        penalty: Value | None = None,
        damp_b: Value | None = None,
        cohesion: Value | None = None,
        tensile: Value | None = None,
        dilation: Value | None = None,
        kelvin_shear: Value | None = None,
        kelvin_viscosity: Value | None = None,
        maxwell_shear: Value | None = None,
        maxwell_viscosity: Value | None = None,
        kelvin_strain_xx: Value | None = None,
        kelvin_strain_yy: Value | None = None,
        kelvin_strain_xy: Value | None = None,
        kelvin_strain_zz: Value | None = None,
        kelvin_strain_xz: Value | None = None,
        kelvin_strain_yz: Value | None = None,
        conductivity: Value | None = None,
        capacity: Value | None = None,
        transfer_coeficient: Value | None = None,
        transfer_coefficient: Value | None = None,
        transfer_coefficent: Value | None = None,
        expansion_coeficient: Value | None = None,
        expansion_coefficient: Value | None = None,
        conductivity_across: Value | None = None,
        conductivity_angle: Value | None = None,
        friction_heat: Value | None = None,
        conductivity_dip: Value | None = None,
        diffusivity: Value | None = None,
        shrinkage: Value | None = None,
        evaporation: Value | None = None,
        moisture_saturated: Value | None = None,
        moisture_residual: Value | None = None,
        air_entry: Value | None = None,
        pore_index: Value | None = None,
        parameter: Sequence[tuple[str, Value]] = (),
        where: Where | None = None,
    ) -> None:
        """Change properties of the model; the others stay.

        Parameters
        ----------
        density : density [kg/m3].
        young : Young's modulus E [Pa].
        poisson_ratio : Poisson's ratio.
        shear : shear modulus; with the bulk modulus it replaces E and Poisson's ratio [Pa].
        bulk : bulk modulus; with the shear modulus it replaces E and Poisson's ratio [Pa].
        damp_factor : viscous damping, part of the critical 2 L sqrt(rho E); without effect in static runs.
        friction : friction angle of its surfaces where they have no contact model; the internal one of
            mechanical-mohr-coulomb [degrees].
        penalty : contact penalty of its surfaces where they have no contact model; 0: that of its joints, or 10 E
            [Pa].
        damp_b : exponent of the overlap of its surfaces while they separate, where they have no contact model; above
            1 contacts lose energy.
        cohesion : cohesion [Pa].
        tensile : tensile strength; limited to cohesion / tan(friction) [Pa].
        dilation : dilation angle, at most the friction angle [degrees].
        kelvin_shear : shear modulus of the Kelvin unit; 0: no Kelvin unit [Pa].
        kelvin_viscosity : viscosity of the Kelvin unit; 0: no Kelvin unit [Pa s].
        maxwell_shear : shear modulus of the Maxwell unit, instead of the one that E and Poisson's ratio give [Pa].
        maxwell_viscosity : viscosity of the Maxwell unit; 0: no dashpot [Pa s].
        kelvin_strain_xx : strain xx of the Kelvin unit at that moment; its zz is -xx - yy.
        kelvin_strain_yy : strain yy of the Kelvin unit at that moment; its zz is -xx - yy.
        kelvin_strain_xy : strain xy of the Kelvin unit at that moment; its zz is -xx - yy.
        kelvin_strain_zz : strain zz of the Kelvin unit at that time; assign all three (in three dimensions).
        kelvin_strain_xz : strain xz of the Kelvin unit at that moment (in three dimensions).
        kelvin_strain_yz : strain yz of the Kelvin unit at that moment (in three dimensions).
        conductivity : thermal conductivity [W/(m K)].
        capacity : specific heat [J/(kg K)].
        transfer_coeficient : heat transfer at faces: to a prescribed environment without its own coefficient, and
            between surfaces in contact, with the harmonic mean of both [W/(m2 K)].
        transfer_coefficient : as transfer_coeficient.
        transfer_coefficent : as transfer_coeficient.
        expansion_coeficient : linear thermal expansion [1/K].
        expansion_coefficient : as expansion_coeficient.
        conductivity_across : conductivity across the direction of conductivity_angle [W/(m K)].
        conductivity_angle : direction of conductivity from x, counter-clockwise, in space the strike of its planes;
            it rotates with the element [degrees].
        friction_heat : part of the friction work that becomes heat when faces slide: each of the two elements
            absorbs this part of half of the work.
        conductivity_dip : dip of the planes of conductivity [degrees] (in three dimensions).
        diffusivity : diffusivity of moisture [m2/s].
        shrinkage : linear shrinkage, strain over loss of moisture.
        evaporation : mass flow through faces over the difference of moisture to a prescribed environment without its
            own coefficient [kg/(m2 s)].
        moisture_saturated : moisture at which all pores are full.
        moisture_residual : residual moisture, which suction cannot remove.
        air_entry : suction at which pores begin to drain, 1 / alpha of van Genuchten [Pa].
        pore_index : exponent n of van Genuchten.
        parameter : a property that the law declares, by its name, and its value.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def report(self, *, where: Where | None = None) -> None:
        """Report their number by model and group in the log.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def law(self, law: File) -> None:
        """Read, check and compile a law of a Python file before `sim.restore`.

        Parameters
        ----------
        law : 'file.py:law': the file, in the folder of the script, and the name of the law in it; plain text.
        """
    def null(self, *, relax: float | None = None, where: Where | None = None) -> None:
        """Removes (excavates) elements; adjacent faces become free. Assigning another model to them reinstates them as
        new, stress-free material at the present position of the void, connected to its neighbours without joints
        until `joints.model` assigns some.

        Parameters
        ----------
        relax : the forces of the removed elements decrease to 0 over this time (static runs: number of steps) [s]
            (default: at once).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def hide(self, hidden: bool = True, *, where: Where | None = None) -> None:
        """Hides elements from pictures and, without use-hidden, from ranges; False: shows them. They are still
        computed.

        Parameters
        ----------
        hidden : whether the elements are hidden.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def collision(self, on: bool, *, where: Where | None = None) -> None:
        """Contact detection for these elements; False: others pass through them.

        Parameters
        ----------
        on : whether contact is detected.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def water(self, surface: str, density: float, *, where: Where | None = None) -> None:
        """Water pressure on the surface of the model: depth below a water line times density and gravity, on all free
        faces of these elements below the line, also on parts of faces, as they move. The line runs from left to
        right; there is no water beyond its ends. The last command replaces earlier ones.

        Parameters
        ----------
        surface : layer of the water line, in three dimensions of planes and polygons.
        density : density of the water; 0: removes the water [kg/m3].
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def reset_state(self, *, where: Where | None = None) -> None:
        """Resets the plastic state of elements; plastic strain starts at 0 again. Stresses stay. Elastic elements have
        no such state, and the log reports that nothing changed.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def reset_kelvin_strain(self, *, where: Where | None = None) -> None:
        """Sets the strain of the Kelvin units of creeping elements to 0. Stresses and displacements stay.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def tell(self, *, where: Where | None = None) -> None:
        """Deprecated name of `report`.

        Report their number by model and group in the log.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """

class Faces(Fluxed):
    """Faces of elements: contact, and stress on surfaces; see `Objects`."""
    def group(self, group: str, set: str | None = None, *, where: Where | None = None) -> None:
        """Assign them to a group; each is in at most one group of a set.

        Parameters
        ----------
        group : name of the group.
        set : the set of the group.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def model(
        self,
        name: Literal["contact-mohr-coulomb", "contact-mohr-c", "contact-m-coulomb", "contact-m-c", "c-mohr-coulomb", "c-mohr-c", "c-m-coulomb", "c-m-c"],
        *,
        friction: Value | None = None,
        penalty_normal: Value | None = None,
        normal_stiffness: Value | None = None,
        penalty_shear: Value | None = None,
        shear_stiffness: Value | None = None,
        damping_t: Value | None = None,
        damping_b: Value | None = None,
        damping_ratio: Value | None = None,
        where: Where | None = None,
    ) -> None:
        """Contact of surfaces: potential of the overlap, Coulomb friction. The smaller value of two surfaces applies.

        Parameters
        ----------
        friction : friction angle [degrees] (default: 0).
        penalty_normal : normal penalty; 10 to 100 E is usual [Pa] (default: 10 E).
        normal_stiffness : as penalty-normal.
        penalty_shear : shear penalty [Pa] (default: the normal penalty).
        shear_stiffness : as penalty-shear.
        damping_t : largest normal stress while surfaces approach; contacts that reach it lose energy [Pa] (default:
            never).
        damping_b : exponent of the overlap while surfaces separate; above 1 contacts lose energy (default: 1).
        damping_ratio : normal dashpot, part of the critical damping of two elements; the larger value of two
            surfaces applies; without effect in static runs (default: 0).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def property(
        self,
        *,
        friction: Value | None = None,
        penalty_normal: Value | None = None,
        normal_stiffness: Value | None = None,
        penalty_shear: Value | None = None,
        shear_stiffness: Value | None = None,
        damping_t: Value | None = None,
        damping_b: Value | None = None,
        damping_ratio: Value | None = None,
        where: Where | None = None,
    ) -> None:
        """Change properties of the model; the others stay.

        Parameters
        ----------
        friction : friction angle [degrees].
        penalty_normal : normal penalty; 10 to 100 E is usual [Pa].
        normal_stiffness : as penalty_normal.
        penalty_shear : shear penalty [Pa].
        shear_stiffness : as penalty_shear.
        damping_t : largest normal stress while surfaces approach; contacts that reach it lose energy [Pa].
        damping_b : exponent of the overlap while surfaces separate; above 1 contacts lose energy.
        damping_ratio : normal dashpot, part of the critical damping of two elements; the larger value of two
            surfaces applies; without effect in static runs.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def report(self, *, where: Where | None = None) -> None:
        """Report their number by model and group in the log.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def stress(
        self,
        *,
        xx: Number | None = None,
        yy: Number | None = None,
        zz: Number | None = None,
        xy: Number | None = None,
        xz: Number | None = None,
        yz: Number | None = None,
        normal: Number | None = None,
        dip: Number | None = None,
        quiet: bool | None = None,
        incoming_x: Number | None = None,
        incoming_y: Number | None = None,
        incoming_z: Number | None = None,
        where: Where | None = None,
    ) -> None:
        """Traction on surfaces: stress times the present normal. Tension is positive. Where it is not 0, it is the
        total traction: water pressure on the face is not added.

        Parameters
        ----------
        xx : stress xx [Pa].
        yy : stress yy [Pa].
        zz : stress zz [Pa] (in three dimensions).
        xy : stress xy [Pa].
        xz : stress xz [Pa] (in three dimensions).
        yz : stress yz [Pa] (in three dimensions).
        normal : stress along the normal, which turns with the surface; negative is pressure [Pa].
        dip : shear stress along the surface, counter-clockwise about the body [Pa] (in the plane).
        quiet : dashpots rho c_p and rho c_s, through which waves leave in dynamic runs; a stress given with it
            enters as a wave of half its size.
        incoming_x : velocity along x of a plane wave that enters through quiet faces [m/s].
        incoming_y : velocity along y of the plane wave [m/s].
        incoming_z : velocity along z of the plane wave [m/s] (in three dimensions).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def heat(
        self,
        *,
        heat_flux: Number | None = None,
        transfer_coeficient: float | None = None,
        environment_temperature: Number | None = None,
        where: Where | None = None,
    ) -> None:
        """Heat through surfaces, which are adiabatic without it; inner faces follow it once they are free. Times of
        tables are those of heat.

        Parameters
        ----------
        heat_flux : heat inflow per area [W/m2].
        transfer_coeficient : heat transfer to the environment [W/(m2 K)] (default: the coefficient of the elements).
        environment_temperature : temperature of the environment [K].
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def free_field(self, *, where: Where | None = None) -> None:
        """Free-field boundary on vertical sides: a column with the elements of the side and the base motion of the
        model (velocity or quiet faces) moves next to each side, which gets its stress and dashpots on the difference
        of both motions. The present forces keep the nodes of the side in equilibrium, so remove the conditions of
        the static stage.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def tell(self, *, where: Where | None = None) -> None:
        """Deprecated name of `report`.

        Report their number by model and group in the log.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """

class Joints(Objects):
    """Joints between elements; see `Objects`."""
    def __getitem__(
        self,
        name: Literal["opening", "slip", "damage", "normal-stress", "shear-stress", "state", "normal-stress-largest", "normal-stress-first", "normal-stress-middle", "normal-stress-last", "shear-stress-largest", "shear-stress-first", "shear-stress-middle", "shear-stress-last"] | str,
    ) -> np.ndarray: ...
    def group(self, group: str, set: str | None = None, *, where: Where | None = None) -> None:
        """Assign them to a group; each is in at most one group of a set.

        Parameters
        ----------
        group : name of the group.
        set : the set of the group.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["classic-intrinsic-cohesive-interface", "classic-intrinsic-cohesive-i", "classic-intrinsic-c-interface", "classic-intrinsic-c-i", "classic-i-cohesive-interface", "classic-i-cohesive-i", "classic-i-c-interface", "classic-i-c-i", "c-intrinsic-cohesive-interface", "c-intrinsic-cohesive-i", "c-intrinsic-c-interface", "c-intrinsic-c-i", "c-i-cohesive-interface", "c-i-cohesive-i", "c-i-c-interface", "c-i-c-i"],
        *,
        friction: Value | None = None,
        cohesion: Value,
        tensile_strength: Value,
        gf1: Value,
        gf2: Value,
        penalty_overlay: Value | None = None,
        penalty_overlap: Value | None = None,
        penalty_normal: Value | None = None,
        penalty_shear: Value | None = None,
        np: int | None = None,
        where: Where | None = None,
    ) -> None:
        """Cohesive joints between elements: intact up to their strength, then they soften and break, and are contacts
        afterwards.

        Parameters
        ----------
        friction : friction angle [degrees] (default: 0).
        cohesion : cohesion; 0: friction alone [Pa].
        tensile_strength : tensile strength; 0: none [Pa].
        gf1 : fracture energy, mode I [N/m].
        gf2 : fracture energy, mode II [N/m].
        penalty_overlay : penalty of a closed joint [Pa] (default: the penalty of opening).
        penalty_overlap : as penalty-overlay.
        penalty_normal : penalty of opening [Pa] (default: 10 E).
        penalty_shear : penalty of shear [Pa] (default: the penalty of opening).
        np : integration points (default: 3).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["joint-mohr-coulomb", "joint-mohr-c", "joint-m-coulomb", "joint-m-c", "j-mohr-coulomb", "j-mohr-c", "j-m-coulomb", "j-m-c"],
        *,
        normal_stiffness: Value,
        shear_stiffness: Value,
        friction: Value | None = None,
        cohesion: Value | None = None,
        tensile_strength: Value | None = None,
        dilation: Value | None = None,
        dilation_limit: Value | None = None,
        where: Where | None = None,
    ) -> None:
        """Pre-existing joints, as springs: sigma = normal-stiffness opening, tau = shear-stiffness slip, at most
        cohesion - sigma tan friction. They slide, open and close and never break. A point that opens beyond its
        tensile strength loses that strength and its cohesion.

        Parameters
        ----------
        normal_stiffness : normal stiffness; for Barton–Bandis joints at zero stress [Pa/m].
        shear_stiffness : shear stiffness [Pa/m].
        friction : friction angle [degrees] (default: 0).
        cohesion : cohesion; 0 at a point that has failed in tension [Pa] (default: 0).
        tensile_strength : tensile strength; 0 at a point that has failed in tension [Pa] (default: 0).
        dilation : dilation angle, at most the friction angle [degrees] (default: 0).
        dilation_limit : sliding distance up to which it dilates [m] (default: no end).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["joint-barton-bandis", "joint-barton-b", "joint-b-bandis", "joint-b-b", "j-barton-bandis", "j-barton-b", "j-b-bandis", "j-b-b"],
        *,
        normal_stiffness: Value,
        shear_stiffness: Value,
        closure_maximum: Value,
        residual_friction: Value,
        jrc: Value,
        jcs: Value,
        joint_size: Value | None = None,
        dilation_part: Value | None = None,
        where: Where | None = None,
    ) -> None:
        """Pre-existing rough joints: closure v under the pressure normal-stiffness v / (1 - v / closure-maximum), from
        the pressure jcs on along the tangent; shear strength by the angle residual-friction + m jrc log10(jcs /
        pressure), at most 70 degrees, m: roughness that is mobilised or worn, by the path over joint-size / 500 (jrc
        / joint-size)^0.33; dilation by dilation-part of the part with m. They slide, open and close and never break.

        Parameters
        ----------
        normal_stiffness : normal stiffness; for Barton–Bandis joints at zero stress [Pa/m].
        shear_stiffness : shear stiffness [Pa/m].
        closure_maximum : largest closure V_m [m].
        residual_friction : residual friction angle [degrees].
        jrc : joint roughness coefficient JRC.
        jcs : strength of the walls JCS [Pa].
        joint_size : length of joint for which JRC and JCS are given [m] (default: 0.1).
        dilation_part : part of the mobilised roughness angle by which the joint dilates; 0: no dilation (default:
            0.5).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["hydraulic-porous-medium", "hydraulic-porous-m", "hydraulic-p-medium", "hydraulic-p-m", "hydr-porous-medium", "hydr-porous-m", "hydr-p-medium", "hydr-p-m"],
        *,
        fluid_density: Value,
        fluid_bulk: Value,
        viscosity: Value,
        aperature_initial: Value | None = None,
        aperture_initial: Value | None = None,
        aperature_minumum: Value | None = None,
        aperature_minimum: Value | None = None,
        aperture_minimum: Value | None = None,
        aperture_minumum: Value | None = None,
        aperature_maximum: Value | None = None,
        aperture_maximum: Value | None = None,
        leak_off: bool | None = None,
        matrix_pore_pressure: Value | None = None,
        matrix_permeability: Value | None = None,
        matrix_porosity_compressibility: Value | None = None,
        matrix_porosity_compressiblity: Value | None = None,
        matrix_porosity: Value | None = None,
        shear_dilation: Value | None = None,
        shear_dilation_limit: Value | None = None,
        matrix_saturation: Value | None = None,
        turbulence: bool | None = None,
        where: Where | None = None,
    ) -> None:
        """Fluid in joints: each is a channel between its two nodes, broken or not, of the aperture aperature-initial
        plus its mean opening, within the limits. It acts in addition to the mechanical model of the joint. If the
        model is assigned again, excess fluid is removed, and new volume is dry. In space channels are the triangles
        of the joints.

        Parameters
        ----------
        fluid_density : density of the fluid [kg/m3].
        fluid_bulk : bulk modulus of the fluid [Pa].
        viscosity : kinematic viscosity of the fluid: the dynamic one over the density [m2/s].
        aperature_initial : hydraulic aperture of a closed joint; in intact joints a virtual aperture, which
            represents the permeability of the rock [m].
        aperture_initial : as aperature-initial.
        aperature_minumum : smallest hydraulic aperture, of joints in compression [m].
        aperature_minimum : as aperature-minumum.
        aperture_minimum : as aperature-minumum.
        aperture_minumum : as aperature-minumum.
        aperature_maximum : largest hydraulic aperture [m] (default: no limit).
        aperture_maximum : as aperature-maximum.
        leak_off : broken joints lose fluid to the rock (Carter leak-off).
        matrix_pore_pressure : leak-off: pore pressure of the rock; negative: suction of unsaturated rock [Pa]
            (default: 0).
        matrix_permeability : leak-off: permeability of the rock [m2] (default: needed by leak-off).
        matrix_porosity_compressibility : leak-off: compressibility of the pores [1/Pa] (default: needed by
            leak-off).
        matrix_porosity_compressiblity : as matrix-porosity-compressibility.
        matrix_porosity : leak-off: porosity of the rock (default: needed by leak-off).
        shear_dilation : the aperture grows by the tangent of this angle times the mean slip of the joint [degrees]
            (default: 0).
        shear_dilation_limit : largest increase of the aperture by slip [m] (default: no limit).
        matrix_saturation : leak-off: initial saturation of the pores; below 1 a sharp front fills the rest (default:
            1).
        turbulence : on: fast flow is turbulent, with friction of smooth walls after Blasius; off: laminar at any
            Reynolds number.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["hydraulic-porous-proppant-medium", "hydraulic-porous-proppant-m", "hydraulic-porous-p-medium", "hydraulic-porous-p-m", "hydraulic-p-proppant-medium", "hydraulic-p-proppant-m", "hydraulic-p-p-medium", "hydraulic-p-p-m", "hydr-porous-proppant-medium", "hydr-porous-proppant-m", "hydr-porous-p-medium", "hydr-porous-p-m", "hydr-p-proppant-medium", "hydr-p-proppant-m", "hydr-p-p-medium", "hydr-p-p-m"],
        *,
        fluid_density: Value,
        fluid_bulk: Value,
        viscosity: Value,
        aperature_initial: Value | None = None,
        aperture_initial: Value | None = None,
        aperature_minumum: Value | None = None,
        aperature_minimum: Value | None = None,
        aperture_minimum: Value | None = None,
        aperture_minumum: Value | None = None,
        aperature_maximum: Value | None = None,
        aperture_maximum: Value | None = None,
        leak_off: bool | None = None,
        matrix_pore_pressure: Value | None = None,
        matrix_permeability: Value | None = None,
        matrix_porosity_compressibility: Value | None = None,
        matrix_porosity_compressiblity: Value | None = None,
        matrix_porosity: Value | None = None,
        shear_dilation: Value | None = None,
        shear_dilation_limit: Value | None = None,
        matrix_saturation: Value | None = None,
        turbulence: bool | None = None,
        proppant_density: float,
        proppant_size: float,
        proppant_size_factor: float | None = None,
        aperature_factor: float | None = None,
        aperture_factor: float | None = None,
        proppant_concentration_limit: float,
        proppant_modulus: float | None = None,
        viscosity_power: float | None = None,
        proppant_stokes: bool | None = None,
        where: Where | None = None,
    ) -> None:
        """Fluid in joints that carries proppant, one kind in all channels. Grains move with the slurry, increase its
        density and viscosity, settle, and bridge where the channel is narrow. A node that is filled to the limit is
        a pack: fluid passes it, grains do not, and it carries the load of the walls.

        Parameters
        ----------
        fluid_density : density of the fluid [kg/m3].
        fluid_bulk : bulk modulus of the fluid [Pa].
        viscosity : kinematic viscosity of the fluid: the dynamic one over the density [m2/s].
        aperature_initial : hydraulic aperture of a closed joint; in intact joints a virtual aperture, which
            represents the permeability of the rock [m].
        aperture_initial : as aperature-initial.
        aperature_minumum : smallest hydraulic aperture, of joints in compression [m].
        aperature_minimum : as aperature-minumum.
        aperture_minimum : as aperature-minumum.
        aperture_minumum : as aperature-minumum.
        aperature_maximum : largest hydraulic aperture [m] (default: no limit).
        aperture_maximum : as aperature-maximum.
        leak_off : broken joints lose fluid to the rock (Carter leak-off).
        matrix_pore_pressure : leak-off: pore pressure of the rock; negative: suction of unsaturated rock [Pa]
            (default: 0).
        matrix_permeability : leak-off: permeability of the rock [m2] (default: needed by leak-off).
        matrix_porosity_compressibility : leak-off: compressibility of the pores [1/Pa] (default: needed by
            leak-off).
        matrix_porosity_compressiblity : as matrix-porosity-compressibility.
        matrix_porosity : leak-off: porosity of the rock (default: needed by leak-off).
        shear_dilation : the aperture grows by the tangent of this angle times the mean slip of the joint [degrees]
            (default: 0).
        shear_dilation_limit : largest increase of the aperture by slip [m] (default: no limit).
        matrix_saturation : leak-off: initial saturation of the pores; below 1 a sharp front fills the rest (default:
            1).
        turbulence : on: fast flow is turbulent, with friction of smooth walls after Blasius; off: laminar at any
            Reynolds number.
        proppant_density : density of the grains [kg/m3].
        proppant_size : diameter of the grains [m].
        proppant_size_factor : smallest aperture, in diameters of grains: grains bridge in narrower channels
            (default: 3).
        aperature_factor : hydraulic aperture of a pack over that of the channel; 0: Kozeny–Carman permeability of
            the pack (default: 0).
        aperture_factor : as aperature-factor.
        proppant_concentration_limit : concentration of a pack.
        proppant_modulus : modulus of a pack in compression; 0: it carries no load [Pa] (default: 0).
        viscosity_power : beta of the slurry, whose viscosity is that of the fluid times (1 - C / limit)^beta
            (default: -2.5).
        proppant_stokes : on: settling after Stokes; off: after Schiller and Naumann, for any Reynolds number.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    @overload
    def model(
        self,
        name: Literal["thermal-fluid", "fluid-thermal", "thermal-f", "t-fluid", "t-f", "fluid-t", "f-thermal", "f-t"],
        *,
        conductivity: Value,
        capacity: Value | None = None,
        heat_capacity: Value | None = None,
        transfer_coeficient: Value | None = None,
        transfer_coefficient: Value | None = None,
        transfer_coefficent: Value | None = None,
        convective_heat_transfer_coefficient: Value | None = None,
        second_order: bool | None = None,
        where: Where | None = None,
    ) -> None:
        """Heat in the fluid of joints with a hydraulic model, in addition to heat in the elements. If one channel has
        this model, all channels need it. Fluid starts at the temperature of the adjacent rock; inflow has the
        temperature of its node.

        Parameters
        ----------
        conductivity : thermal conductivity of the fluid [W/(m K)].
        capacity : specific heat of the fluid [J/(kg K)].
        heat_capacity : as capacity.
        transfer_coeficient : heat transfer between fluid and each of the two sides [W/(m2 K)] (default: 0).
        transfer_coefficient : as transfer-coeficient.
        transfer_coefficent : as transfer-coeficient.
        convective_heat_transfer_coefficient : as transfer-coeficient.
        second_order : advection of second order with a flux limiter: fronts stay sharper.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def property(
        self,
        *,
        normal_stiffness: Value | None = None,
        shear_stiffness: Value | None = None,
        closure_maximum: Value | None = None,
        residual_friction: Value | None = None,
        jrc: Value | None = None,
        jcs: Value | None = None,
        joint_size: Value | None = None,
        dilation_part: Value | None = None,
        friction: Value | None = None,
        cohesion: Value | None = None,
        tensile_strength: Value | None = None,
        dilation: Value | None = None,
        dilation_limit: Value | None = None,
        gf1: Value | None = None,
        gf2: Value | None = None,
        penalty_overlay: Value | None = None,
        penalty_overlap: Value | None = None,
        penalty_normal: Value | None = None,
        penalty_shear: Value | None = None,
        fluid_density: Value | None = None,
        fluid_bulk: Value | None = None,
        viscosity: Value | None = None,
        aperature_initial: Value | None = None,
        aperture_initial: Value | None = None,
        aperature_minumum: Value | None = None,
        aperature_minimum: Value | None = None,
        aperture_minimum: Value | None = None,
        aperture_minumum: Value | None = None,
        aperature_maximum: Value | None = None,
        aperture_maximum: Value | None = None,
        leak_off: bool | None = None,
        matrix_pore_pressure: Value | None = None,
        matrix_permeability: Value | None = None,
        matrix_porosity_compressibility: Value | None = None,
        matrix_porosity_compressiblity: Value | None = None,
        matrix_porosity: Value | None = None,
        shear_dilation: Value | None = None,
        shear_dilation_limit: Value | None = None,
        matrix_saturation: Value | None = None,
        turbulence: bool | None = None,
        conductivity: Value | None = None,
        capacity: Value | None = None,
        heat_capacity: Value | None = None,
        transfer_coeficient: Value | None = None,
        transfer_coefficient: Value | None = None,
        transfer_coefficent: Value | None = None,
        convective_heat_transfer_coefficient: Value | None = None,
        second_order: bool | None = None,
        proppant_density: float | None = None,
        proppant_size: float | None = None,
        proppant_size_factor: float | None = None,
        aperature_factor: float | None = None,
        aperture_factor: float | None = None,
        proppant_concentration_limit: float | None = None,
        proppant_modulus: float | None = None,
        viscosity_power: float | None = None,
        proppant_stokes: bool | None = None,
        where: Where | None = None,
    ) -> None:
        """Change properties of the model; the others stay.

        Parameters
        ----------
        normal_stiffness : normal stiffness; for Barton–Bandis joints at zero stress [Pa/m].
        shear_stiffness : shear stiffness [Pa/m].
        closure_maximum : largest closure V_m [m].
        residual_friction : residual friction angle [degrees].
        jrc : joint roughness coefficient JRC.
        jcs : strength of the walls JCS [Pa].
        joint_size : length of joint for which JRC and JCS are given [m].
        dilation_part : part of the mobilised roughness angle by which the joint dilates; 0: no dilation.
        friction : friction angle [degrees].
        cohesion : cohesion; 0: friction alone [Pa].
        tensile_strength : tensile strength; 0: none [Pa].
        dilation : dilation angle, at most the friction angle [degrees].
        dilation_limit : sliding distance up to which it dilates [m].
        gf1 : fracture energy, mode I [N/m].
        gf2 : fracture energy, mode II [N/m].
        penalty_overlay : penalty of a closed joint [Pa].
        penalty_overlap : as penalty_overlay.
        penalty_normal : penalty of opening [Pa].
        penalty_shear : penalty of shear [Pa].
        fluid_density : density of the fluid [kg/m3].
        fluid_bulk : bulk modulus of the fluid [Pa].
        viscosity : kinematic viscosity of the fluid: the dynamic one over the density [m2/s].
        aperature_initial : hydraulic aperture of a closed joint; in intact joints a virtual aperture, which
            represents the permeability of the rock [m].
        aperture_initial : as aperature_initial.
        aperature_minumum : smallest hydraulic aperture, of joints in compression [m].
        aperature_minimum : as aperature_minumum.
        aperture_minimum : as aperature_minumum.
        aperture_minumum : as aperature_minumum.
        aperature_maximum : largest hydraulic aperture [m].
        aperture_maximum : as aperature_maximum.
        leak_off : broken joints lose fluid to the rock (Carter leak_off).
        matrix_pore_pressure : leak-False: pore pressure of the rock; negative: suction of unsaturated rock [Pa].
        matrix_permeability : leak-False: permeability of the rock [m2].
        matrix_porosity_compressibility : leak-False: compressibility of the pores [1/Pa].
        matrix_porosity_compressiblity : as matrix_porosity_compressibility.
        matrix_porosity : leak-False: porosity of the rock.
        shear_dilation : the aperture grows by the tangent of this angle times the mean slip of the joint [degrees].
        shear_dilation_limit : largest increase of the aperture by slip [m].
        matrix_saturation : leak-False: initial saturation of the pores; below 1 a sharp front fills the rest.
        turbulence : True: fast flow is turbulent, with friction of smooth walls after Blasius; False: laminar at any
            Reynolds number.
        conductivity : thermal conductivity of the fluid [W/(m K)].
        capacity : specific heat of the fluid [J/(kg K)].
        heat_capacity : as capacity.
        transfer_coeficient : heat transfer between fluid and each of the two sides [W/(m2 K)].
        transfer_coefficient : as transfer_coeficient.
        transfer_coefficent : as transfer_coeficient.
        convective_heat_transfer_coefficient : as transfer_coeficient.
        second_order : advection of second order with a flux limiter: fronts stay sharper.
        proppant_density : density of the grains [kg/m3].
        proppant_size : diameter of the grains [m].
        proppant_size_factor : smallest aperture, in diameters of grains: grains bridge in narrower channels.
        aperature_factor : hydraulic aperture of a pack over that of the channel; 0: Kozeny–Carman permeability of
            the pack.
        aperture_factor : as aperature_factor.
        proppant_concentration_limit : concentration of a pack.
        proppant_modulus : modulus of a pack in compression; 0: it carries no load [Pa].
        viscosity_power : beta of the slurry, whose viscosity is that of the fluid times (1 - C / limit)^beta.
        proppant_stokes : True: settling after Stokes; False: after Schiller and Naumann, for any Reynolds number.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def report(self, *, where: Where | None = None) -> None:
        """Report their number by model and group in the log.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def reset_state(self, *, where: Where | None = None) -> None:
        """Resets the damage of joints that are not broken. Sliding joints regain their tensile strength and cohesion
        but keep their slip.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def tell(self, *, where: Where | None = None) -> None:
        """Deprecated name of `report`.

        Report their number by model and group in the log.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """

class Nodes(Moved):
    """Nodes; see `Objects`. Conditions are numbers or names of tables of time."""
    def __getitem__(
        self,
        name: Literal["displacement", "velocity", "position-x", "position-y", "position-z", "displacement-x", "displacement-y", "displacement-z", "velocity-x", "velocity-y", "velocity-z", "reaction-x", "reaction-y", "reaction-z", "temperature", "moisture"] | str,
    ) -> np.ndarray: ...
    def group(self, group: str, set: str | None = None, *, where: Where | None = None) -> None:
        """Assign them to a group; each is in at most one group of a set.

        Parameters
        ----------
        group : name of the group.
        set : the set of the group.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def velocity(
        self,
        *,
        vx: Number | None = None,
        vy: Number | None = None,
        vz: Number | None = None,
        ax: Number | None = None,
        ay: Number | None = None,
        az: Number | None = None,
        where: Where | None = None,
    ) -> None:
        """Velocity or acceleration of nodes. Components that are not given stay free; an acceleration begins at the
        present velocity.

        Parameters
        ----------
        vx : velocity along x [m/s].
        vy : velocity along y [m/s].
        vz : velocity along z [m/s] (in three dimensions).
        ax : acceleration along x [m/s2].
        ay : acceleration along y [m/s2].
        az : acceleration along z [m/s2] (in three dimensions).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def force(
        self,
        *,
        fx: Number | None = None,
        fy: Number | None = None,
        fz: Number | None = None,
        where: Where | None = None,
    ) -> None:
        """Force on each node.

        Parameters
        ----------
        fx : force along x [N].
        fy : force along y [N].
        fz : force along z [N] (in three dimensions).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def damp(self, local: float, *, where: Where | None = None) -> None:
        """Local damping of nodes: a force against the motion, of this part of the size of the unbalanced force.
        Default: 0 in dynamic runs, 0.8 in static runs. It divides the stable time step by the root of 1 + damping.

        Parameters
        ----------
        local : fraction of the unbalanced force, from 0 to 1.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def fluid(
        self,
        *,
        pressure: Number | None = None,
        flow_surface: Number | Point | None = None,
        flow_rate: Number | None = None,
        where: Where | None = None,
    ) -> None:
        """Fluid at nodes, one of the three at each; times of tables are those of flow. With a range, pressure and
        flow_surface load the free faces whose nodes all lie in it with water pressure, with or without channels
        there. Without a range they apply to the fluid in joints only.

        Parameters
        ----------
        pressure : pressure, not negative [Pa].
        flow_surface : water level at the nodes, measured against gravity, or a point of the water surface:
            hydrostatic pressure below it; above it water can leave (seepage) [m].
        flow_rate : inflow volume at each node; negative: outflow, limited to the available fluid; in space m3/s
            [m2/s].
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def proppant(
        self,
        *,
        proppant_volumetric_concentration: Number | None = None,
        proppant_volumetric_flow_rate: Number | None = None,
        where: Where | None = None,
    ) -> None:
        """Proppant inflow at flow nodes, also of wells; give one of the two. Times of tables are those of flow; a
        packed node accepts none.

        Parameters
        ----------
        proppant_volumetric_concentration : concentration of the slurry that conditions and wells supply: volume of
            grains over volume of slurry.
        proppant_volumetric_flow_rate : volume of grains that enters each node, added to its slurry; in space m3/s
            [m2/s].
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def temperature(self, temperature: Number, *, where: Where | None = None) -> None:
        """Temperature of nodes; times of tables are those of heat.

        Parameters
        ----------
        temperature : temperature [K].
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def fluid_temperature(self, temperature: Number, *, where: Where | None = None) -> None:
        """Temperature of the fluid at flow nodes, for example of injected fluid; times of tables are those of heat.

        Parameters
        ----------
        temperature : temperature [K].
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def initial_velocity(
        self,
        velocity: Point | None = None,
        *,
        vx: float | None = None,
        vy: float | None = None,
        vz: float | None = None,
        where: Where | None = None,
    ) -> None:
        """Set the present velocity of nodes, or some components of it.

        Parameters
        ----------
        velocity : velocity [m/s].
        vx : velocity along x; the other components stay [m/s].
        vy : velocity along y; the other components stay [m/s].
        vz : velocity along z; the other components stay [m/s] (in three dimensions).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def initial_temperature(self, temperature: float, *, where: Where | None = None) -> None:
        """Set the present temperature of nodes.

        Parameters
        ----------
        temperature : temperature, also of the fluid at the nodes; initially 0. Elements around the nodes are free of
            thermal stress at this temperature [K].
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def reset_velocity(self) -> None:
        """Sets all velocities to 0."""
    def reset_displacement(self) -> None:
        """Sets all displacements to 0."""

class Bolts(Objects):
    """Rock bolts: `sim.bolts["axial-force"]` returns that of their elements, see `Objects`."""
    def __getitem__(
        self,
        name: Literal["axial-force", "axial-strain", "plastic-strain", "bolt-state"] | str,
    ) -> np.ndarray: ...
    def group(self, group: str, set: str | None = None, *, where: Where | None = None) -> None:
        """Assign them to a group; each is in at most one group of a set.

        Parameters
        ----------
        group : name of the group.
        set : the set of the group.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def create(
        self,
        points: Sequence[Point],
        *,
        segments: int | None = None,
        length: float | None = None,
        grout: tuple[float, float] | None = None,
        plate: bool = False,
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """Installs a rock bolt along these points at their present positions, at any stage of a run. It is divided at
        the edges of elements, or as given. Nodes follow the rock across the bar and are coupled along it by grout;
        under the plate in all directions. Where the rock is removed they are free. Bolts have no weight and no
        stiffness in bending.

        Parameters
        ----------
        points : the points, from the head on; or a list of vectors [m].
        segments : elements of each straight part.
        length : greatest length of an element [m] (default: to the edges of the elements of the mesh).
        grout : start and end of the grout along the bolt; the rest is free [m] (default: all of it).
        plate : fixes the first node to the rock by a face plate.
        group : the group of its elements and nodes (default: none).
        set : the set of the group.
        """
    def between(
        self,
        first: Point,
        second: Point,
        mesh_size: float | None = None,
        *,
        group: str | None = None,
        set: str | None = None,
        where: Where | None = None,
    ) -> None:
        """Installs rock bolts between two points, as `bolts.create`: each part of the line inside the rock becomes a
        bolt. With a range only in these elements.

        Parameters
        ----------
        first : head of the bolt [m].
        second : end of the bolt [m].
        mesh_size : greatest length of its elements [m] (default: 0.2).
        group : the group of its elements and nodes (default: none).
        set : the set of the group.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def model(
        self,
        name: Literal["mechanical-elastic-plastic", "mechanical-elastic-p", "mechanical-e-plastic", "mechanical-e-p", "mech-elastic-plastic", "mech-elastic-p", "mech-e-plastic", "mech-e-p"],
        *,
        density: float,
        young: float,
        diameter: float,
        tensile_yield_force: float | None = None,
        compressive_yield_force: float | None = None,
        tension_failure_strain: float | None = None,
        shear_stiffness_rock_bolt: float,
        grout_thickness: float,
        cohesion_rock_grout: float,
        cohesion_grout_bolt: float,
        friction_rock_grout: float | None = None,
        friction_grout_bolt: float | None = None,
        spacing: float | None = None,
        pretension_force: float | None = None,
        damp_factor: float | None = None,
        where: Where | None = None,
    ) -> None:
        """Bars with an axial force only, elastic and perfectly plastic, in grout that slips at its strength. Forces and
        stiffness are those of one bolt; the model divides them by the spacing. The strength of the grout per length
        is the smaller of pi (diameter + 2 grout-thickness) (cohesion-rock-grout - sigma tan friction-rock-grout) and
        pi diameter (cohesion-grout-bolt - sigma tan friction-grout-bolt), sigma: stress across the bar in the rock
        if it is pressure, in space the mean in all directions across. If the model is assigned again, the force in
        the bar changes only by the difference of the pretension. In space each bolt is a single bolt: spacing is 1.

        Parameters
        ----------
        density : density [kg/m3].
        young : Young's modulus E [Pa].
        diameter : diameter of the bar [m].
        tensile_yield_force : axial yield force in tension [N] (default: never).
        compressive_yield_force : axial yield force in compression, without sign [N] (default: the yield force in
            tension).
        tension_failure_strain : elongation of an element since its installation, over its length, at which it breaks
            (default: never).
        shear_stiffness_rock_bolt : force of the grout per length of bolt and displacement [N/m/m].
        grout_thickness : thickness of the grout around the bar [m].
        cohesion_rock_grout : cohesion between rock and grout [Pa].
        cohesion_grout_bolt : cohesion between grout and bolt [Pa].
        friction_rock_grout : friction angle between rock and grout [degrees] (default: 0).
        friction_grout_bolt : friction angle between grout and bolt [degrees] (default: 0).
        spacing : spacing of bolts across the plane [m] (default: 1).
        pretension_force : tension at installation [N] (default: 0).
        damp_factor : viscous damping of the motion along the bar, part of 2 A sqrt(rho E); without effect in static
            runs (default: 0).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def delete(self, *, where: Where | None = None) -> None:
        """Removes elements of bolts with their part of the grout at once; without RANGE all of them. The numbers of the
        others stay.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """

class BoltNodes(Conditioned):
    """Nodes of rock bolts: `sim.bolt_nodes["slip"]`, see `Objects`."""
    def __getitem__(
        self,
        name: Literal["position-x", "position-y", "position-z", "displacement-x", "displacement-y", "displacement-z", "velocity-x", "velocity-y", "velocity-z", "bond-force", "slip", "bond-state", "reaction-x", "reaction-y", "reaction-z", "host", "distance"] | str,
    ) -> np.ndarray: ...
    def group(self, group: str, set: str | None = None, *, where: Where | None = None) -> None:
        """Assign them to a group; each is in at most one group of a set.

        Parameters
        ----------
        group : name of the group.
        set : the set of the group.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def velocity(
        self,
        *,
        vx: Number | None = None,
        vy: Number | None = None,
        vz: Number | None = None,
        ax: Number | None = None,
        ay: Number | None = None,
        az: Number | None = None,
        where: Where | None = None,
    ) -> None:
        """Velocity or acceleration of nodes of bolts. Other components stay free: along the bar nodes follow its
        forces, across it the rock.

        Parameters
        ----------
        vx : velocity along x [m/s].
        vy : velocity along y [m/s].
        vz : velocity along z [m/s] (in three dimensions).
        ax : acceleration along x [m/s2].
        ay : acceleration along y [m/s2].
        az : acceleration along z [m/s2] (in three dimensions).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def force(
        self,
        *,
        fx: Number | None = None,
        fy: Number | None = None,
        fz: Number | None = None,
        where: Where | None = None,
    ) -> None:
        """Force on each node of one bolt; the rock carries the component across the bar.

        Parameters
        ----------
        fx : force along x [N].
        fy : force along y [N].
        fz : force along z [N] (in three dimensions).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """

class FlowNodes(GroupedElsewhere):
    """Nodes at the ends of channels, with numbers and groups of nodes: `sim.flow_nodes["pressure"]`, see `Objects`."""
    def __getitem__(
        self,
        name: Literal["pressure", "saturation", "fluid", "volume", "inflow", "temperature", "concentration", "proppant", "pack-pressure"] | str,
    ) -> np.ndarray: ...
    def initial(
        self,
        *,
        pressure: float | None = None,
        saturation: float | None = None,
        concentration: float | None = None,
        where: Where | None = None,
    ) -> None:
        """Sets the present fluid of the flow nodes (nodes at which a channel ends) among these nodes; channels are
        initially dry.

        Parameters
        ----------
        pressure : filled, at this pressure [Pa].
        saturation : filled part of the volume.
        concentration : concentration of proppant in the present fluid.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def initial_temperature(self, temperature: float, *, where: Where | None = None) -> None:
        """Set the present temperature of the fluid at them.

        Parameters
        ----------
        temperature : temperature of the fluid alone [K].
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """

class Channels(GroupedElsewhere):
    """Joints with a hydraulic model, with numbers and groups of joints: `sim.channels["aperture"]`, see `Objects`."""
    def __getitem__(
        self,
        name: Literal["pressure", "saturation", "aperture", "flow-rate", "velocity", "temperature", "concentration", "pack-pressure"] | str,
    ) -> np.ndarray: ...

class Wells(Named):
    """Wells: `sim.wells["injection"]` returns the present pressure [Pa], rate [m2/s], injected [m2] and stage
    of one.
    """
    def create(self, name: str, *, where: Where | None = None) -> None:
        """Makes a well of the flow nodes of a range: one connected volume, whose pressure is that at its highest node.
        Stages control it; without a stage it is shut in. Its water loads the free faces whose nodes all lie in the
        range.

        Parameters
        ----------
        name : name.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def stage(
        self,
        name: str,
        *,
        rate: Number | None = None,
        pressure: Number | None = None,
        shut_in: bool = False,
        time: float | None = None,
        limit: float | None = None,
    ) -> None:
        """Appends a stage to a well; a stage without time that has begun ends now. After the last stage the well is
        shut in. Times of tables are those of flow.

        Parameters
        ----------
        name : name.
        rate : injected volume; negative: produced, limited to the available fluid; in space m3/s [m2/s].
        pressure : prescribed pressure [Pa].
        shut_in : no flow in or out.
        time : duration, in time of flow [s] (default: no end).
        limit : with rate: pressure above which the rate is reduced [Pa] (default: none).
        """

class Liners(Objects):
    """Liners: `sim.liners["axial-force"]` returns that of their elements, see `Objects`."""
    def __getitem__(
        self,
        name: Literal["axial-force", "shear-force", "moment-first", "moment-last", "membrane-largest", "membrane-smallest", "membrane-xx", "membrane-yy", "membrane-xy", "membrane-zz", "membrane-xz", "membrane-yz", "bending-largest", "bending-smallest", "bending-xx", "bending-yy", "bending-xy", "bending-zz", "bending-xz", "bending-yz", "transverse-shear", "axial-strain", "plastic-strain", "plastic-rotation", "plastic-curvature", "liner-state", "bond-pressure", "bond-shear", "gap", "slip", "bond-state", "host"] | str,
    ) -> np.ndarray: ...
    def group(self, group: str, set: str | None = None, *, where: Where | None = None) -> None:
        """Assign them to a group; each is in at most one group of a set.

        Parameters
        ----------
        group : name of the group.
        set : the set of the group.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def create(self, *, group: str | None = None, set: str | None = None, where: Where | None = None) -> None:
        """Installs a stress-free liner on the selected free faces at their present positions, at any stage of a run. A
        face gets one beam, in space one triangle; liners that share a point, in space an edge, of the mesh are
        connected, also around a closed opening. Liners have weight but no contact: the rock of their faces loads
        them.

        Parameters
        ----------
        group : the group of its elements and nodes (default: none).
        set : the set of the group.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def model(
        self,
        name: Literal["beam", "shell", "sh"],
        *,
        density: float,
        young: float,
        poisson_ratio: float | None = None,
        thickness: float | None = None,
        area: float | None = None,
        inertia: float | None = None,
        tensile_strength: float | None = None,
        compressive_strength: float | None = None,
        plastic_moment: float | None = None,
        normal_stiffness: float,
        shear_stiffness: float,
        bond_tensile_strength: float | None = None,
        bond_cohesion: float | None = None,
        bond_friction: float | None = None,
        where: Where | None = None,
    ) -> None:
        """In the plane beams in plane strain, per metre of thickness, elastic and perfectly plastic. Either a shell
        with a thickness, or steel sets by area and inertia over their spacing, with poisson-ratio 0. The axial force
        stays between the strengths times the area, the moment below 4 plastic-moment (Nt - N) (N + Nc) / (Nt +
        Nc)^2: the limit of a fully plastic rectangular section. In space flat shells with a thickness, whose forces
        and moments have these limits in their principal directions. The bond to the rock is elastic, slips at
        bond-cohesion + pressure tan(bond-friction), and parts for good above bond-tensile-strength. If the model is
        assigned again, the forces in elements stay.

        Parameters
        ----------
        density : density [kg/m3].
        young : Young's modulus E [Pa].
        poisson_ratio : Poisson's ratio: plane strain uses E / (1 - nu^2); 0 for steel sets (default: 0).
        thickness : thickness of the shell; defines area and inertia if they are omitted [m] (default: thickness of a
            rectangle of this area and inertia).
        area : area of the section over the spacing of steel sets [m2/m] (in the plane; default: the thickness).
        inertia : second moment of the section over the spacing of steel sets [m4/m] (in the plane; default:
            thickness^3 / 12).
        tensile_strength : strength in tension; requires compressive_strength [Pa] (default: never).
        compressive_strength : strength in compression; requires tensile_strength [Pa] (default: never).
        plastic_moment : largest moment at the axial force that allows most [N m/m] (default: plastic moment of a
            rectangle).
        normal_stiffness : stiffness of the bond across the face [Pa/m].
        shear_stiffness : stiffness of the bond along the face; 0: it slips freely [Pa/m].
        bond_tensile_strength : tension at which the bond breaks [Pa] (default: never).
        bond_cohesion : cohesion of the bond, until it breaks [Pa] (default: never slips).
        bond_friction : friction angle of the bond, intact or broken [degrees] (default: 0).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def delete(self, *, where: Where | None = None) -> None:
        """Removes elements of liners at once; without RANGE all of them. The numbers of the others stay.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """

class LinerNodes(Objects):
    """Nodes of liners: `sim.liner_nodes["rotation"]`, see `Objects`."""
    def __getitem__(
        self,
        name: Literal["position-x", "position-y", "position-z", "displacement-x", "displacement-y", "displacement-z", "velocity-x", "velocity-y", "velocity-z", "rotation", "rotation-x", "rotation-y", "rotation-z", "spin", "spin-x", "spin-y", "spin-z", "reaction-x", "reaction-y", "reaction-z", "reaction-moment", "reaction-moment-x", "reaction-moment-y", "reaction-moment-z", "distance"] | str,
    ) -> np.ndarray: ...
    def group(self, group: str, set: str | None = None, *, where: Where | None = None) -> None:
        """Assign them to a group; each is in at most one group of a set.

        Parameters
        ----------
        group : name of the group.
        set : the set of the group.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def velocity(
        self,
        *,
        vx: Number | None = None,
        vy: Number | None = None,
        vz: Number | None = None,
        spin: Number | None = None,
        spin_x: Number | None = None,
        spin_y: Number | None = None,
        spin_z: Number | None = None,
        where: Where | None = None,
    ) -> None:
        """Velocity of nodes of liners. Components that are not given stay free.

        Parameters
        ----------
        vx : velocity along x [m/s].
        vy : velocity along y [m/s].
        vz : velocity along z [m/s] (in three dimensions).
        spin : rate of rotation, counter-clockwise [rad/s] (in the plane).
        spin_x : rate of rotation about x [rad/s] (in three dimensions).
        spin_y : rate of rotation about y [rad/s] (in three dimensions).
        spin_z : rate of rotation about z [rad/s] (in three dimensions).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def force(
        self,
        *,
        fx: Number | None = None,
        fy: Number | None = None,
        fz: Number | None = None,
        moment: Number | None = None,
        moment_x: Number | None = None,
        moment_y: Number | None = None,
        moment_z: Number | None = None,
        where: Where | None = None,
    ) -> None:
        """Force and moment on each node of a liner, in the plane per metre of thickness.

        Parameters
        ----------
        fx : force along x [N/m].
        fy : force along y [N/m].
        fz : force along z [N] (in three dimensions).
        moment : moment, counter-clockwise [N m/m] (in the plane).
        moment_x : moment about x [N m] (in three dimensions).
        moment_y : moment about y [N m] (in three dimensions).
        moment_z : moment about z [N m] (in three dimensions).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def remove_boundary(self, *, where: Where | None = None) -> None:
        """Remove prescribed conditions.

        Parameters
        ----------
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """

class Tables(Tabled):
    """Functions of time for conditions, or of a coordinate for properties; piecewise linear."""
    def delete(self, name: str) -> None:
        """Deletes a table.

        Parameters
        ----------
        name : name.
        """

class Fields(Random):
    """Random fields: properties that differ from object to object."""
    def create(
        self,
        name: str,
        *,
        weibull: tuple[float, float] | None = None,
        normal: tuple[float, float] | None = None,
        lognormal: tuple[float, float] | None = None,
        seed: int,
        correlation: float | None = None,
        covariance: Literal["exponential", "gaussian"] | None = None,
        least: float | None = None,
        greatest: float | None = None,
    ) -> None:
        """Creates a random field: properties that differ between elements, faces or joints. Properties that use one
        field are fully correlated; another seed gives an independent field. Assigned values stay when the field is
        changed or deleted.

        Parameters
        ----------
        name : name.
        weibull : scale (63 % of the values are below it) and shape.
        normal : mean and standard deviation.
        lognormal : mean and standard deviation of the values themselves.
        seed : seed of the random numbers: each seed gives another field.
        correlation : correlation length; the field depends on positions, not on the mesh [m] (default: objects are
            independent).
        covariance : exp(-r/L), or exp(-(r/L)2), which is smooth (default: exponential).
        least : lower bound of the distribution (default: none).
        greatest : upper bound of the distribution (default: none).
        """
    def delete(self, name: str) -> None:
        """Deletes a random field; assigned values stay.

        Parameters
        ----------
        name : name.
        """

class Histories(Recorded):
    """Quantities recorded during the run: `sim.histories["load"]` is (n, 3): step, time [s] and value so far."""
    def delete(self, name: str) -> None:
        """Stops a history; its file stays.

        Parameters
        ----------
        name : name.
        """
    def export(self, file: File, names: Sequence[str] | None = None) -> None:
        """Writes all histories, or some, side by side as CSV.

        Parameters
        ----------
        file : name of the file.
        names : names of the histories to export (default: all).
        """

class Charts(Words):
    """Diagrams of histories or points."""
    def create(
        self,
        name: str,
        *,
        title: str | None = None,
        x_label: str | None = None,
        y_label: str | None = None,
    ) -> None:
        """A diagram.

        Parameters
        ----------
        name : name.
        title : title of the diagram.
        x_label : label of the x axis.
        y_label : label of the y axis.
        """
    def add(
        self,
        name: str,
        *,
        x: str | None = None,
        y: str | None = None,
        scale_x: float | None = None,
        scale_y: float | None = None,
        values: Sequence[Point] | None = None,
        profile: Literal["pressure", "saturation", "aperture", "flow-rate", "velocity", "temperature", "concentration"] | None = None,
        label: str | None = None,
        style: Literal["line", "points"] | None = None,
        where: Where | None = None,
    ) -> None:
        """A curve of two histories, or of points.

        Parameters
        ----------
        name : name.
        x : history along x; without it the time (default: time).
        y : history along y.
        scale_x : factor on the values (default: 1).
        scale_y : factor on the values (default: 1).
        values : points (x,y).
        profile : present values of the fluid along the line of the joints of the range, over the distance [m] from
            its left end (in the plane).
        label : name of the curve in the legend.
        style : how it is drawn (default: line).
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """
    def export(
        self,
        name: str,
        file: File,
        cracks: bool = False,
        plastic: bool = False,
        fluid: Literal["pressure", "saturation", "aperture", "velocity", "concentration"] | None = None,
        temperature: bool = False,
    ) -> None:
        """Writes a diagram as CSV and as a figure of the same name.

        Parameters
        ----------
        name : name.
        file : name of the figure: .png, .pdf or .svg.
        cracks : adds the present model, with its cracks by mode.
        plastic : adds the present model with contours of plastic shear strain.
        fluid : adds the present model with channels coloured by this value.
        temperature : adds the present model with contours of temperature, and cracks.
        """

class Output(Words):
    """Frames for ParaView."""
    def vtk(self, file: File, every: int | None = None, *, off: bool = False) -> None:
        """Writes frames for ParaView: now, and with every at an interval of steps.

        Parameters
        ----------
        file : first part of the names of the files, in the folder of the results.
        every : steps between two frames (default: once, now).
        off : stops the frames of this name.
        """
    def image(
        self,
        file: File,
        *,
        view: File | None = None,
        field: str | None = None,
        object: Literal["elements", "particles", "clumps", "walls", "contacts", "bonds", "channels", "joints", "bolts", "liners", "face-conditions", "flow-nodes", "node-conditions"] | None = None,
        limits: tuple[float, float] | None = None,
        full: bool = False,
        log: bool = False,
        colours: Literal["viridis", "cividis", "plasma", "yellow-brown", "yellow-blue", "yellow-green", "greys", "blue-red", "blue-yellow-red", "orange-violet", "spectral", "rainbow"] | None = None,
        opacity: float | None = None,
        edges: bool = False,
        size: float | None = None,
        vectors: str | None = None,
        arrows: float | None = None,
        filter: str | None = None,
        deformed: float | None = None,
        camera: tuple[Point, Point] | None = None,
        eye: str | None = None,
        section: str | None = None,
        title: str | None = None,
        where: Where | None = None,
    ) -> None:
        """Draws the present model, `<name>_<step>.png`, with any field of frames.

        Parameters
        ----------
        file : first part of the name, in the folder of the results; the ending .pdf, .svg or .png selects the
            format.
        view : view file *.mv of hpcdem view or hpcdem draw (default: everything).
        field : field of the colours; hpcdem draw --list lists the fields of a frame.
        object : objects to which the field and the options below apply (default: the first that have the field).
        limits : values of the first and the last colour (default: the 1 % and 99 % quantiles of the shown values).
        full : instead of limits: minimum and maximum of the shown values.
        log : logarithmic colours.
        colours : colour map of the field (default: viridis).
        opacity : from 0 to 1 (default: 1).
        edges : outlines of elements.
        size : factor on widths of lines (default: 1).
        vectors : arrows: displacement or velocity.
        arrows : factor on the length of the arrows (default: 1).
        filter : only objects that satisfy this condition, for example 'stress_yy < -1e6 and x > 2'.
        deformed : factor on displacements (default: 1).
        camera : lower left and upper right corner of the picture, in space along it and up it [m] (default: the
            model).
        eye : position of the viewer: along an axis, from the right, the front and above (iso), or in a direction (in
            three dimensions; default: 'iso').
        section : a cutting plane: 'x=1.5' removes the part towards the eye, 'x<1.5' and 'x>1.5' keep one side,
            'px,py,pz,nx,ny,nz' gives a point and the normal into the removed part (in three dimensions; default:
            whole).
        title : title of the picture; {step} and {time} are filled in.
        where : text of a RANGE, or terms of hpcdem.physics.fdem.groups; left out: all.
        """

class BlockCommands(Clocks):
    """The methods of a `Simulation` for blocks. The model of blocks is made on first use."""
    geometry: Geometry
    mesh: Mesh
    elements: Elements
    faces: Faces
    joints: Joints
    nodes: Nodes
    bolts: Bolts
    bolt_nodes: BoltNodes
    flow_nodes: FlowNodes
    channels: Channels
    wells: Wells
    liners: Liners
    liner_nodes: LinerNodes
    tables: Tables
    fields: Fields
    histories: Histories
    charts: Charts
    output: Output
    def _begin_blocks(self, project: Callable[[], Project], before: Callable[[], None] = ...) -> None: ...
    def gravity(self, gravity: Point) -> None:
        """Set gravity of the blocks from now on; for particles use ``set(gravity=...)``.

        Parameters
        ----------
        gravity : acceleration [m/s2].
        """
    def units(self, system: Literal["si", "mm-mpa-s", "km-mpa-s"]) -> None:
        """Declare the units of following values of blocks: unlikely values give a warning, histories and charts show
        the units; no value changes. For particles use ``set(units=...)``.

        Parameters
        ----------
        system : SI, mm-MPa-s, km-MPa-s.
        """
    def option(
        self,
        *,
        dynamic: bool | None = None,
        collision: bool | None = None,
        overlap: Literal["refuse", "relax", "keep"] | None = None,
        deep_overlap: Literal["warn", "stop"] | None = None,
        potential: Literal["distance", "munjiza"] | None = None,
        mechanical: bool | None = None,
        large_strain: bool | None = None,
        energy: bool | None = None,
        hydraulic: bool | None = None,
        one_way: bool | None = None,
        thermal: bool | None = None,
        proppant: bool | None = None,
    ) -> None:
        """Set switches of the calculation of blocks.

        Parameters
        ----------
        dynamic : true motion in time; False: static, towards equilibrium (default: True).
        collision : contact of surfaces (default: True).
        overlap : bodies that overlap before the first step: reject them, with their positions; separate them in a
            static stage; or start with the overlap (default: refuse).
        deep_overlap : bodies that overlap by more than a tenth of an altitude of an element during the run: report
            where, or end the run (default: warn).
        potential : potential of contact: distance to the nearest face of an element over the typical altitude in its
            body, or four times the smallest barycentric coordinate (in three dimensions; default: distance).
        mechanical : motion of blocks; False: blocks are fixed while fluid or heat flows (default: True).
        large_strain : rotations of elements are included (default: True).
        energy : keep the energy budget from here on, in dynamic runs: `energies`, histories of the model, a table at
            the end.
        hydraulic : flow in joints with a hydraulic model; False: pressures are frozen and keep loading the blocks
            (default: True).
        one_way : fluid follows the blocks but does not load them.
        thermal : heat flow in elements with a thermal model; False: temperatures and thermal stress are frozen
            (default: True).
        proppant : motion of grains in channels that carry proppant; False: grains are fixed (default: True).
        """
    def time_step(
        self,
        *,
        value: float | str | None = None,
        auto: bool | None = None,
        update_frequency: int | None = None,
        safety: float | None = None,
        mass_scaling: float | None = None,
        hydraulic: float | None = None,
        thermal: float | None = None,
    ) -> None:
        """The time step of dynamic runs. In static runs a step is one unit of time. Without this command it is
        estimated at the first step and after each change of the model. The last of value, mass_scaling and auto on
        applies and replaces the others.

        Parameters
        ----------
        value : the time step; 0: estimated automatically; a table over time is evaluated every 100 steps [s].
        auto : True: estimated again every 100 steps; False: at the first step and after changes of the model only; a
            value stays.
        update_frequency : with auto: steps after which it is estimated again (default: 100).
        safety : part of the stability limit that estimates and mass_scaling use (default: 0.8).
        mass_scaling : mass is added to nodes as this time step requires; 0: none, and the step is estimated again
            [s].
        hydraulic : sub-step of flow, which then has its own clock; 0: the sub-steps of a cycle cover the time of the
            steps of the blocks or, without motion, are half of the stable sub-step [s] (default: 0).
        thermal : sub-step of heat, which then has its own clock; 0: the sub-steps of a cycle cover the time of the
            steps of the blocks or, without motion, are 0.9 of the stable sub-step [s] (default: 0).
        """
    def sub_step(
        self,
        *,
        mechanical: int | None = None,
        thermal: int | None = None,
        hydraulic: int | None = None,
    ) -> None:
        """Steps of the parts of a coupled calculation.

        Parameters
        ----------
        mechanical : steps of the blocks between two cycles of flow, and of heat (default: 1).
        thermal : sub-steps of a cycle of heat; 0: as many as stability requires; if heat is slow, without fluid and
            frictional heat, moving blocks have a cycle of heat every ten steps (default: 0).
        hydraulic : sub-steps of a cycle of flow; 0: as many as stability requires (default: 0).
        """
    def field_clock(
        self,
        field: Literal["moisture"],
        *,
        flows: bool | None = None,
        time_step: float | None = None,
        sub_steps: int | None = None,
        current_time: float | None = None,
    ) -> None:
        """The clock of a field that diffuses in elements, as of moisture.

        Parameters
        ----------
        field : name of the field.
        flows : False: values and the stress that they cause are frozen (default: True).
        time_step : sub-step of the field, which then has its own clock; 0: the sub_steps of a cycle cover the time
            of the steps of the blocks or, without motion, are 0.9 of the stable sub-step [s] (default: 0).
        sub_steps : sub_steps in a cycle; 0: as many as stability requires (default: 0).
        current_time : present time of its clock [s].
        """
    def run_time(self, time: float) -> None:
        """Maximum simulated time of each following `solve`, counted from its start or from the start-time of model
        reset; without another criterion `solve` runs for this time. No time passes in static runs without creep.

        Parameters
        ----------
        time : 0: no limit [s].
        """
    def solve_check(self, steps: int) -> None:
        """Steps between two checks of the ratio in `solve`.

        Parameters
        ----------
        steps : default: 50 in static runs, 100 in dynamic runs.
        """
    def rayleigh(
        self,
        ratio: float,
        *,
        frequency: float | None = None,
        part: Literal["both", "mass", "stiffness"] | None = None,
    ) -> None:
        """Rayleigh damping of elements in dynamic runs, in addition to their damp-factor: alpha times the mass, beta
        times the stiffness. The damping ratio of a vibration is alpha / (4 pi f) + pi beta f.

        Parameters
        ----------
        ratio : part of the critical damping at the frequency; 0: no Rayleigh damping.
        frequency : frequency at which this ratio applies; with both parts the ratio is least there [Hz].
        part : both parts, or one of them (default: both).
        """
    def creep(
        self,
        on: bool = True,
        *,
        dt: float | None = None,
        change: float | None = None,
        least: float | None = None,
        greatest: float | None = None,
    ) -> None:
        """Switches creep of elements of mech-burgers on or off. In dynamic runs creep time passes with the time of the
        model. In static runs `solve` time advances it in creep steps, each of which ends in equilibrium; `every` of
        histories and frames then counts creep steps.

        Parameters
        ----------
        on : whether elements creep.
        dt : creep step of static runs; with change the first one [s].
        change : the creep step is adapted to this change of stress: the largest change of the deviators of elements
            and of their Kelvin dashpots in a creep step, over the largest deviator; the step at most halves or
            doubles each time (default: dt stays).
        least : with change: shortest creep step [s] (default: dt / 100).
        greatest : with change: longest creep step [s] (default: 100 dt).
        """
    def plane_stress(self) -> None:
        """In the plane: plane stress: a plate of unit thickness with stress-free faces; the stress across the plane is
        0 in elastic, yielding and creeping elements, also with heat. Must precede element initial and the first
        step. A user law must return 0 for the out-of-plane stress.
        """
    def plane_strain(self) -> None:
        """In the plane: plane strain: no strain across the plane. This is the default of models in two dimensions; the
        command revokes `plane_stress`.
        """
    def report_devices(self) -> None:
        """Reports the ranks, threads and cores of the run in the log."""
    def step(self, n: int) -> None:
        """Execute a number of steps of the blocks and of the particles coupled to them.

        Parameters
        ----------
        n : number of steps.
        """
    def solve(
        self,
        *,
        ratio: float | None = None,
        cycles: int | None = None,
        time: float | None = None,
        run_time: float | None = None,
        window: int | None = None,
        limit: int | None = None,
        on_failure: Literal["stop", "continue"] | None = None,
        elastic: bool = False,
        hydraulic: bool = False,
        thermal: bool = False,
        dt: float | None = None,
        auto: bool = False,
        steady: bool = False,
        solver: Literal["auto", "direct", "petsc"] | None = None,
        steps: int | None = None,
    ) -> None:
        """Steps until the first of ratio, cycles, time and run_time is reached. Without any of them: ratio 1e-5 or 10
        000 cycles, with a warning if the cycles end it. With elastic: static equilibrium by Newton's method, for
        elastic or yielding blocks whose joints are not past their peak and whose surfaces are not in contact. A run
        that does not converge to its ratio (window, limit) ends the script with exit code 3 and names the body that
        slides away; `solved['reason']` is the reason why a run ended.

        Parameters
        ----------
        ratio : unbalanced forces over all forces of the nodes; with elastic: 1e-8, or less as far as rounding
            allows.
        cycles : steps; with elastic: units of time (1) for which prescribed velocities act.
        time : simulated time; in static runs creep time, with each creep step solved to its ratio (1e-5), or
            directly with elastic [s].
        run_time : as `run_time`, for this command alone [s].
        window : with a ratio: the run fails if the least ratio has not decreased by a tenth in this number of steps,
            nor in as many steps as the progress so far took; 0: never (default: static runs: ten times the steps in
            which a wave crosses the model and returns, at least 20 000; dynamic runs, and with cycles or time: 0).
        limit : with a ratio: the run fails after this number of steps; 0: never (default: static runs 1 000 000,
            dynamic runs 10 000 000; with time: 0).
        on_failure : stop: with exit code 3; continue: with a warning, the script can check solved (default: stop).
        elastic : directly, without steps.
        hydraulic : flow by implicit steps, backward Euler, for a time or until it is steady; in static runs blocks
            are in equilibrium at the end of each step, and joints may pass their peak and break; with mechanical
            off, flow alone.
        thermal : heat by implicit steps, backward Euler, for a time or directly to its steady state; in static runs
            blocks are in equilibrium at the end of each step, and joints may pass their peak and break; with
            mechanical off, heat alone.
        dt : with hydraulic or thermal: longest time step; steps of flow are shorter when joints break or a step does
            not converge [s] (default: a hundredth of the time).
        auto : with hydraulic and time: uses explicit steps, as without the word hydraulic, if their estimated cost
            is lower or implicit steps are not possible; the log reports both estimates.
        steady : with hydraulic or thermal: until outflow equals inflow; no time passes.
        solver : with elastic, hydraulic or thermal: SciPy on one rank, identical results on any number of ranks;
            PETSc on all ranks; auto: PETSc, if available, from 400 000 unknowns, in space from 20 000 (default:
            auto).
        steps : with elastic: number of equal load increments, in each of which elements yield once; an increment
            that does not converge is halved (default: 1).
        """
    def tell_devices(self) -> None:
        """Deprecated name of `report_devices`.

        Reports the ranks, threads and cores of the run in the log.
        """
    def tell_time(self, part: str) -> None:
        """Deprecated name of `report_time`.

        Log the present time of a part; parts: see `cycle_option`.
        """
