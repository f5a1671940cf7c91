"""Blocks in a Python program: the commands of the PCDC language as methods, what is there as arrays.

A method has the words of the command. Its values are checked against the table of the language and handed to the
binding of the command, as those of a line of a script are, so both do the same.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from hpcdem.api.arguments import Where, arguments, chosen_by, model_arguments
from hpcdem.api.program import HELP, carried_out, place, spelt
from hpcdem.commands import fdem
from hpcdem.core.errors import CommandError
from hpcdem.lang.pcdc.bindings import Call, carry_out
from hpcdem.lang.pcdc.keywords import matching
from hpcdem.lang.pcdc.kinds import FunctionName
from hpcdem.lang.pcdc.table import PCDC
from hpcdem.physics.fdem import groups as g
from hpcdem.physics.fdem.tables import AXES, Drawn, Over

if TYPE_CHECKING:
    from hpcdem.commands.fdem import Project

Point = tuple[float, ...]
"""Two numbers, three in a model of three dimensions."""
File = str | Path
Number = float | str | FunctionName
"""Of a condition: a number, the name of a table of time, or what `nodes.function` gives."""
Value = float | Over | Drawn | np.ndarray
"""Of a property: a number; what `tables.over` or `fields.drawn` gives; one for each of the objects chosen (n,)."""
OBJECTS = {"node": g.NODE, "element": g.ELEMENT, "joint": g.JOINT, **{k: k for k in (*g.SUPPORTS, *g.FLOW)}}
"""What histories call them."""


Kind = TypeVar("Kind", bound=type)


def commands(cls: Kind) -> Kind:
    """Errors in public methods of the class leave with file and line of the program, and the name of the method."""
    for name, found in list(vars(cls).items()):
        if inspect.isfunction(found) and (name == "__getitem__" or not name.startswith("_")):
            setattr(cls, name, _told(found))
        elif isinstance(found, property) and not name.startswith("_") and found.fget is not None:
            setattr(cls, name, property(_told(found.fget)))
    return cls


def _told(method: Callable[..., Any]) -> Callable[..., Any]:
    name = method.__name__
    names = [parameter for parameter in inspect.signature(method).parameters if parameter != "self"]

    @functools.wraps(method)
    def call(self: Any, *values: Any, **options: Any) -> Any:
        word, options = self._word, spelt(options, names)
        full = (f"{word}[...]" if name == "__getitem__" else f"{word}.{name}") if word else name
        advice = f"see help(sim.{word})" if word else HELP
        return carried_out(place(), full, lambda: method(self, *values, **options), advice, names)

    return call


class Orders:
    """The way from a method to the function of its command. project: gives the blocks, made on the first call."""

    def __init__(self, project: Callable[[], Project]) -> None:
        self.project = project

    def __call__(
        self, command: str, given: Mapping[str, Any], where: Where = None, kind: str = "", model: str | None = None
    ) -> None:
        """Carry out a command. kind: of the objects that `where` chooses; model: the constitutive model, or the
        condition, whose properties are given."""
        project = self.project()  # first: kernels are settled before modules that have some are imported
        row = PCDC.command(command)
        chosen = chosen_by(where, kind)
        if model is None:
            found = arguments(row, given, chosen is not None, project.dim)
        else:
            found = model_arguments(row, model, given, project.dim)
        project.line = place()[1]
        call = Call(project, found, None, lambda names, file: None)
        call.where = chosen
        carry_out(row, call)


class Words:
    """Methods of one kind. _word: what they are called in a program, ``sim.<word>``."""

    _word = ""

    def __init__(self, do: Orders) -> None:
        self._do = do


@commands
class Geometry(Words):
    """Shapes in layers, of which meshes are made; lengths in metres, angles in degrees counter-clockwise."""

    _word = "geometry"

    def polyline(self, points: Sequence[Point], as_layer: str) -> None:
        """Straight lines from point to point."""
        self._shape("polyline", as_layer, points=points)

    def polygon(self, points: Sequence[Point], as_layer: str) -> None:
        """A closed line; in three dimensions the flat surface within."""
        self._shape("polygon", as_layer, points=points)

    def rectangle(self, first: Point, second: Point, as_layer: str) -> None:
        """A rectangle along the axes, from corner to corner."""
        self._shape("rectangle", as_layer, first=first, second=second)

    def circle(
        self,
        centre: Point,
        radius: float,
        as_layer: str,
        *,
        segment_length: float | None = None,
        normal: Point | None = None,
    ) -> None:
        """A circle, with the length of its sides a polygon; in three dimensions the surface of a disc."""
        given = {"centre": centre, "radius": radius, "segment_length": segment_length, "normal": normal}
        self._do("geometry create circle", {**given, "as_layer": as_layer})

    def arc(self, centre: Point, radius: float, begin: float, end: float, as_layer: str) -> None:
        """A part of a circle from angle to angle."""
        self._shape("arc", as_layer, centre=centre, radius=radius, begin=begin, end=end)

    def point(self, points: Sequence[Point], as_layer: str) -> None:
        """Single points, which become points of the mesh."""
        self._shape("point", as_layer, points=points)

    def box(self, first: Point, second: Point, as_layer: str) -> None:
        """In three dimensions: a box along the axes, from corner to corner."""
        self._shape("box", as_layer, first=first, second=second)

    def sphere(self, centre: Point, radius: float, as_layer: str) -> None:
        """In three dimensions: a sphere."""
        self._shape("sphere", as_layer, centre=centre, radius=radius)

    def cylinder(self, first: Point, second: Point, radius: float, as_layer: str) -> None:
        """In three dimensions: a round cylinder between the middles of its ends."""
        self._shape("cylinder", as_layer, first=first, second=second, radius=radius)

    def cone(self, first: Point, second: Point, radius: float, other: float, as_layer: str) -> None:
        """In three dimensions: a round cone, or a part of one, by the middles and radii of its ends."""
        self._shape("cone", as_layer, first=first, second=second, radius=radius, other=other)

    def disc(self, centre: Point, normal: Point, radius: float, as_layer: str) -> None:
        """In three dimensions: the surface of a round disc."""
        self._shape("disc", as_layer, centre=centre, normal=normal, radius=radius)

    def plane(self, point: Point, normal: Point, as_layer: str) -> None:
        """In three dimensions: a plane without end."""
        self._shape("plane", as_layer, point=point, normal=normal)

    def extrude(self, layer: str, along: Point, as_layer: str) -> None:
        """In three dimensions: the polygons of a layer, drawn along a way, as bodies."""
        self._shape("extrude", as_layer, layer=layer, along=along)

    def revolve(
        self, layer: str, axis: Point, as_layer: str, about: Point | None = None, angle: float | None = None
    ) -> None:
        """In three dimensions: the polygons of a layer, turned about an axis in their plane [degrees], as bodies."""
        self._shape("revolve", as_layer, layer=layer, axis=axis, about=about, angle=angle)

    def fractures(
        self,
        as_layer: str,
        inside: str,
        *,
        orientation: tuple[str, float],
        length: tuple[str, float] | None = None,
        radius: tuple[str, float] | None = None,
        seed: int,
        orientation_spread: float | None = None,
        orientation_towards: float | None = None,
        length_spread: float | None = None,
        length_least: float | None = None,
        length_greatest: float | None = None,
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
    ) -> None:
        """A set of fractures with given statistics, as straight lines inside of a layer, in three dimensions as discs.
        orientation: ("fixed", "uniform", "normal" or "fisher", mean); length, of discs radius: ("fixed", "exponential",
        "lognormal" or "power", value); one of the densities p10, p20 and p21 [1/m, 1/m2, 1/m], of discs p10, p30 and
        p32 [1/m, 1/m3, 1/m]; docs/pcdc_reference.md has the rest."""
        laws = {
            "length": (length, {"spread": length_spread, "least": length_least, "greatest": length_greatest}),
            "radius": (radius, {"spread": radius_spread, "least": radius_least, "greatest": radius_greatest}),
        }
        given = {
            "orientation": {"value": orientation, "spread": orientation_spread, "towards": orientation_towards},
            **{name: None if law is None else {"value": law, **more} for name, (law, more) in laws.items()},
            "p10": p10, "p20": p20, "p21": p21, "p30": p30, "p32": p32, "scan_line": scan_line,
            "scan_direction": scan_direction, "reached": reached, "ends_at": ends_at,
            "inside": inside, "hole": hole or None, "shortest": shortest, "seed": seed, "as_layer": as_layer,
        }  # fmt: skip
        self._do("geometry create fractures", given)

    def import_file(self, file: File, as_layer: str, dxf_layer: str | None = None, scale: float | None = None) -> None:
        """Lines of a DXF file, or of one of its layers; in three dimensions the solids of a STEP or BREP file, or what
        the triangles of an STL or DXF file enclose; scale: metres in a unit of the file."""
        given = {"file": file, "as_layer": as_layer, "dxf_layer": dxf_layer, "scale": scale}
        self._do("geometry import", given)

    def transform(
        self,
        layer: str,
        *,
        scale: float | None = None,
        rotate: float | None = None,
        about: Point | None = None,
        move: Point | None = None,
        axis: Point | None = None,
    ) -> None:
        """Scale, then turn about a point, in space about an axis through it, then move a layer."""
        given = {"layer": layer, "scale": scale, "rotate": rotate, "about": about, "move": move, "axis": axis}
        self._do("geometry transform", given)

    def scale(self, factors: Point, layer: Sequence[str] | None = None) -> None:
        """Multiply the coordinates of layers, of all if none is named."""
        self._do("geometry scale", {"factors": factors, "layer": layer})

    def translate(self, way: Point, layer: Sequence[str] | None = None) -> None:
        """Move layers, all if none is named [m]."""
        self._do("geometry translate", {"way": way, "layer": layer})

    def export(self, layers: Sequence[str], file: File) -> None:
        """Write layers to a DXF file in the folder of the results."""
        self._do("geometry export", {"layers": layers, "file": file})

    def delete(self, *layers: str) -> None:
        """Forget layers; meshes that were made from them keep their edges."""
        self._do("geometry delete", {"layers": layers})

    def _shape(self, kind: str, as_layer: str, **given: Any) -> None:
        self._do(f"geometry create {kind}", {**given, "as_layer": as_layer})


@commands
class Mesh(Words):
    """Meshes: each call makes one more body of the model. Its elements go into a group of a set."""

    _word = "mesh"

    def create(
        self,
        from_layer: str,
        size: float,
        type: str | None = None,
        *,
        refine_layer: Iterable[tuple[Any, ...]] = (),
        hole: Sequence[str] = (),
        region: Iterable[str | tuple[str, str]] = (),
        embed: Sequence[str] = (),
        crack: Sequence[str] = (),
        irregular: bool = False,
        smooth: bool = False,
        bodies: bool = False,
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """The inside of a layer, by Gmsh; size: of edges [m]; type: "tri" or "quad". refine_layer: (layer, size) or
        (layer, size, distance); hole, embed, crack: layers; region: layers, or (layer, name of the group); bodies: in
        three dimensions each body of the layer is a group of its own."""
        given = {
            "from_layer": from_layer, "size": size, "type": type, "irregular": irregular, "smooth": smooth,
            "bodies": bodies,
            "refine_layer": [_named(one, "value", "size", "distance") for one in refine_layer] or None,
            "hole": hole or None, "embed": embed or None, "crack": crack or None,
            "region": [_named(one, "value", "group") for one in region] or None, "group": _group(group, set),
        }  # fmt: skip
        self._do("mesh create", given)

    def structured(
        self,
        first: Point,
        second: Point,
        cells: tuple[int, ...],
        type: str | None = None,
        diagonal: str | None = None,
        *,
        split: int | None = None,
        ratio: tuple[float, ...] | None = None,
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """A regular mesh of the rectangle between two corners [m], cells along x and y. diagonal: "right", "left",
        "alternate" or "both"; ratio: along x and y each cell is so many times as large as the one before. In
        three dimensions the box between them, cells and ratio along x, y and z; type: "tet" (split: 5, 6 or 12 of each
        cell) or "hex"."""
        given = {
            "first": first, "second": second, "cells": cells, "type": type, "diagonal": diagonal,
            "split": split, "ratio": ratio, "group": _group(group, set),
        }  # fmt: skip
        self._do("mesh structured", given)

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
        """A regular mesh of the parallelogram, in three dimensions the parallelepiped, by a corner p0 and the ends of
        its edges there [m], with n elements along each; ratio: each is so many times as large as the one before;
        triangle=False: quads, or hexahedra."""
        given = {"p0": p0, "p1": p1, "p2": p2, "p3": p3, "n": n, "ratio": ratio, "triangle": triangle}
        self._do("element create brick", {**given, "group": _group(group, set)})

    def geometry(
        self,
        *,
        layer: Iterable[tuple[Any, ...]] = (),
        circle: Iterable[tuple[Any, ...]] = (),
        arc: Iterable[tuple[Any, ...]] = (),
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """Triangles in the inside of closed lines, with a mesh size for each piece. layer: (names, size); circle:
        (centre, radius, size); arc: (centre, start, end, size), counter-clockwise; True as a last item: it bounds the
        mesh, as the first piece does if none is marked as boundary. Others become edges of the mesh."""
        size = ("mesh_size", "is_boundary")
        given = {
            "layer": [_named(one, "value", *size) for one in layer] or None,
            "circle": [{"value": True, **_named(one, "center", "radius", *size)} for one in circle] or None,
            "arc": [{"value": True, **_named(one, "center", "start_point", "end_point", *size)} for one in arc] or None,
        }
        self._do("element create geometry", {**given, "group": _group(group, set)})

    def patch(
        self,
        boundary: Iterable[Mapping[str, Any]],
        *,
        polyline: Iterable[Mapping[str, Any]] = (),
        point: Iterable[Mapping[str, Any]] = (),
        global_mesh_size: float | None = None,
        tolerance: float | None = None,
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """Triangles in the inside of closed lines that follow other lines and points. Each piece is a dict of array
        (points [m]) or layer (names of layers), and mesh_size [m]; tolerance [m]: points nearer than this are one."""
        pieces = {"boundary_close_polyline": boundary, "constrain_polyline": polyline, "constrain_point": point}
        given = {name: [{"value": True, **one} for one in of] or None for name, of in pieces.items()}
        more = {"global_mesh_size": global_mesh_size, "tolerance": tolerance, "group": _group(group, set)}
        self._do("element create geometry-patch", {**given, **more})

    def boundary(
        self,
        boundary: Sequence[Point],
        mesh_size: float | None = None,
        *,
        inner: Iterable[tuple[Any, ...]] = (),
        group: str | None = None,
        set: str | None = None,
    ) -> None:
        """Triangles in the inside of a closed line [m]. inner: (points, size) of closed lines in it, which are holes;
        True as a third item: filled."""
        given = {
            "boundary": {"value": boundary, "mesh_size": mesh_size},
            "inner_boundary": [_named(one, "value", "mesh_size", "filled") for one in inner] or None,
        }
        self._do("element create geometry-boundary", {**given, "group": _group(group, set)})

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
        """Triangles in a ring, with mesh sizes on its outer and inner circle [m]."""
        given = {
            "center": center, "radius": {"value": radius, "mesh_size": mesh_size},
            "inner_radius": {"value": inner_radius, "mesh_size": inner_mesh_size}, "group": _group(group, set),
        }  # fmt: skip
        self._do("element create hollow-circle", given)

    def equilateral(
        self, first: Point, second: Point, size: float, *, group: str | None = None, set: str | None = None
    ) -> None:
        """Nearly equilateral triangles in a rectangle, with edges of about `size` [m]."""
        given = {"first": first, "second": second, "size": size, "group": _group(group, set)}
        self._do("mesh equilateral", given)

    def import_file(
        self,
        file: File,
        *,
        group: str | None = None,
        set: str | None = None,
        merge: float | None = None,
        scale: float | None = None,
    ) -> None:
        """A mesh of another program; merge: points nearer than this are one [m]; scale: metres in a unit of the
        file."""
        given = {"file": file, "group": _group(group, set), "merge": merge, "scale": scale}
        self._do("mesh import", given)

    def intersect(self, layer: str, follow: bool = False) -> None:
        """Joints on a layer become cracks; follow: its lines are no edges of the mesh, the nearest edges are taken."""
        self._do("mesh intersect", {"layer": layer, "follow": follow})

    def glue(
        self,
        tolerance: float | None = None,
        between: tuple[str, str] | None = None,
        *,
        set: str | None = None,
        where: Where = None,
    ) -> None:
        """Bodies hang together where their faces lie on each other; tolerance [m]; between: only elements of these
        two groups; where: only faces of these elements, with any."""
        if between is None and set is not None:
            raise TypeError("set goes with between")
        pair = None if between is None else {"value": between, "set": set}
        self._do("mesh glue", {"tolerance": tolerance, "between": pair}, where, g.ELEMENT)

    def densify(
        self,
        maximum_length: float | tuple[float, float],
        pattern: tuple[int, int] | None = None,
        *,
        where: Where = None,
    ) -> None:
        """Quads are halved, along x and y or as the pattern says (1 or 0), until their sides are no longer than this
        [m]; neighbours follow, and quads with a point on a side become triangles."""
        most = maximum_length if isinstance(maximum_length, tuple) else (maximum_length,)
        self._do("element densify", {"maximum_length": most, "pattern": pattern}, where, g.ELEMENT)

    def delete(self, *, where: Where = None) -> None:
        """Elements are gone; after the first model or condition they are taken out, as by `elements.null`."""
        self._do("element delete", {}, where, g.ELEMENT)

    def add_nodes(self, points: Sequence[Point]) -> None:
        """More nodes [m], for elements that are added next; their numbers follow those of the mesh."""
        self._do("model add node", {"points": points})

    def add_element(self, *corners: int) -> None:
        """One more element, by the numbers of its nodes."""
        self._do("model add element", {"corners": corners})

    def scale(self, factors: Point) -> None:
        """Multiply the coordinates of all points."""
        self._do("model scale", {"factors": factors})

    def translate(self, way: Point) -> None:
        """Move all points [m]."""
        self._do("model translate", {"way": way})

    def quality(self) -> None:
        """Angles and sizes, in the log."""
        self._do("mesh quality", {})


@commands
class Objects(Words):
    """Elements, faces, joints or nodes: `sim.elements["stress-xx"]` is a quantity of all of them.

    where: text of a RANGE (``"group 'platen' set 'bc'"``, ``"x 0 1 present"``) or terms of
    `hpcdem.physics.fdem.groups`; left out, all.
    """

    kind: str
    pcdc: str

    def __getitem__(self, name: str) -> np.ndarray:
        """A quantity of all of them (n,), in the order of numbers, on every rank; names as in histories. Collective."""
        return self.values(name)

    def numbers(self, where: Where = None) -> np.ndarray:
        """Numbers of those that are there, ascending. Collective."""
        return fdem.queries.numbers(self._do.project(), self.kind, chosen_by(where, self.kind))

    def values(self, name: str, where: Where = None) -> np.ndarray:
        """A quantity by name, in the order of `numbers`; NaN where there is none. Collective."""
        chosen = chosen_by(where, self.kind)
        return fdem.queries.values(self._do.project(), self.kind, _quantity(name), chosen)

    def total(self, name: str, where: Where = None) -> float:
        """Exact sum of a quantity. Collective."""
        chosen = chosen_by(where, self.kind)
        return fdem.queries.total(self._do.project(), self.kind, _quantity(name), chosen)

    def group(self, group: str, set: str | None = None, *, where: Where = None) -> None:
        """Put them into a group; each is in one group of a set at most."""
        self._carry_out("group", {"group": group, "set": set}, where)

    def _carry_out(self, command: str, given: Mapping[str, Any], where: Where, model: str | None = None) -> None:
        self._do(f"{self.pcdc} {command}", given, where, self.kind, model)

    def _take_back(self, conditions: Sequence[str], where: Where) -> None:
        """Conditions by their names, short or in full; all, if none is named."""
        rows = PCDC.command(f"{self.pcdc} boundary remove").options
        names = [next((row.name for row in matching(one.replace("_", "-"), rows)), one) for one in conditions]
        self._carry_out("boundary remove", dict.fromkeys(names, True), where)


@commands
class _Modelled(Objects):
    """With a constitutive model."""

    def model(self, name: str, *, where: Where = None, **properties: Value) -> None:
        """The constitutive model, with its properties: docs/pcdc_reference.md lists them; `young`, `poisson_ratio`.
        Of a law of the user: "user", law="file.py:law", parameter=[("limit", 2e5)], see docs/user_laws.md."""
        self._carry_out("c-model", properties, where, name)

    def property(self, *, where: Where = None, **properties: Value) -> None:
        """Change properties of the model; the others stay."""
        self._carry_out("property", properties, where)

    def tell(self, *, where: Where = None) -> None:
        """Say in the log how many there are, by model and group."""
        self._carry_out("list summary", {}, where)


@commands
class Elements(_Modelled):
    """Elements: `sim.elements["stress-xx"]`, see `Objects`."""

    _word, kind, pcdc = "elements", g.ELEMENT, "element"

    def law(self, law: str) -> None:
        """Read, check and compile a law of a Python file, "file.py:law", before `sim.restore`."""
        self._do("element law", {"law": law})

    def null(self, *, relax: float | None = None, where: Where = None) -> None:
        """Take elements out; relax: time [s] (static runs: steps) over which their forces on the others die down."""
        self._carry_out("c-model", {"relax": relax}, where, "null")

    def hide(self, hidden: bool = True, *, where: Where = None) -> None:
        """They are hidden from pictures and, without use-hidden, from ranges, or seen again."""
        self._carry_out("hide", {"hidden": hidden}, where)

    def collision(self, on: bool, *, where: Where = None) -> None:
        """Contact of these elements with others is looked for, or not."""
        self._carry_out("collision", {"on": on}, where)

    def water(self, surface: str, density: float, *, where: Where = None) -> None:
        """Water of a density [kg/m3] stands before their free faces below the line of a layer; 0: no more."""
        self._carry_out("water", {"surface": surface, "density": density}, where)

    def initial_stress(
        self,
        *,
        xx: float | None = None,
        yy: float | None = None,
        xy: float | None = None,
        zz: float | None = None,
        xz: float | None = None,
        yz: float | None = None,
        gradient: Mapping[str, Point] | None = None,
        where: Where = None,
    ) -> None:
        """Stress [Pa] from the beginning, tension positive, 0 where it is left out; in the plane zz is then that of
        plane strain, Poisson's ratio times xx + yy, in plane stress 0. gradient: by component, per metre in x and y
        (and z) [Pa/m], ``{"yy": (0.0, 25e3)}``."""
        stress = {"xx": xx, "yy": yy, "xy": xy, "zz": zz, "xz": xz, "yz": yz}
        slopes = dict(gradient or {})
        for name in slopes:
            if stress.get(name) is None:
                raise ValueError(f"gradient: there is no stress {name!r} that it could be added to")
        given = {
            f"stress_{name}": None if value is None else {"value": value, "gradient": slopes.get(name)}
            for name, value in stress.items()
        }
        self._carry_out("initial", given, where)

    def reset_state(self, *, where: Where = None) -> None:
        """Plastic states are forgotten."""
        self._carry_out("reset state", {}, where)

    def reset_kelvin_strain(self, *, where: Where = None) -> None:
        """Kelvin units of elements that creep are without strain from here on."""
        self._carry_out("reset kelvin-strain", {}, where)


@commands
class Faces(_Modelled):
    """Faces of elements: contact, and stress on surfaces; see `Objects`."""

    _word, kind, pcdc = "faces", g.FACE, "element-face"

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
        where: Where = None,
    ) -> None:
        """Traction on surfaces [Pa], tension positive; normal turns with the surface, dip is shear along it in
        the plane, counter-clockwise about the body, xy, xz and yz are components of the stress. Numbers or
        names of tables of time. quiet: waves leave through them in dynamic runs; incoming_x, _y, _z: velocity [m/s] of
        a plane wave that comes in through them. Without a range: the whole surface of the model."""
        given = {
            "stress_xx": xx, "stress_yy": yy, "stress_zz": zz, "stress_xy": xy, "stress_xz": xz, "stress_yz": yz,
            "stress_normal": normal, "dip": dip,
            "quiet": quiet,
            "incoming_x": incoming_x, "incoming_y": incoming_y, "incoming_z": incoming_z,
        }  # fmt: skip
        self._carry_out("boundary", given, where, "mechanical-stress-boundary-condition")

    def heat(
        self,
        *,
        heat_flux: Number | None = None,
        transfer_coeficient: float | None = None,
        environment_temperature: Number | None = None,
        where: Where = None,
    ) -> None:
        """Heat that comes in [W/m2], or its transfer [W/(m2 K)] from an environment of this temperature, without a
        coefficient with that of the elements. Numbers or names of tables over the time of heat. Without a range: the
        whole surface of the model."""
        given = {
            "heat_flux": heat_flux, "transfer_coeficient": transfer_coeficient,
            "environment_temperature": environment_temperature,
        }  # fmt: skip
        self._carry_out("boundary", given, where, "thermal-const-heat")

    def field(
        self,
        name: str,
        *,
        flux: Number | None = None,
        transfer: float | None = None,
        environment: Number | None = None,
        where: Where = None,
    ) -> None:
        """A field of elements, as "moisture": what comes in, or goes to an environment of this value, over the
        difference to it; without a coefficient with that of the elements. Numbers or names of tables over the time of
        the field. Without a range: the whole surface of the model."""
        given = {"flux": flux, "transfer": transfer, "environment": environment}
        self._carry_out("boundary", given, where, f"{name}-flux-boundary-condition")

    def free_field(self, *, where: Where = None) -> None:
        """Vertical sides beyond which the ground goes on, in dynamic runs: columns beside them move with the base."""
        self._carry_out("boundary", {}, where, "free-field")

    def remove_boundary(self, *conditions: str, where: Where = None) -> None:
        """Take boundary conditions back. conditions: only
        these, as pcdc element-face boundary calls them."""
        self._take_back(conditions, where)


@commands
class Joints(_Modelled):
    """Joints between elements; see `Objects`."""

    _word, kind, pcdc = "joints", g.JOINT, "face-joint"

    def reset_state(self, *, where: Where = None) -> None:
        """Damage of joints that are not broken is forgotten; of those that slide, that they are torn, not what slid."""
        self._carry_out("reset state", {}, where)


@commands
class Nodes(Objects):
    """Nodes; see `Objects`. Conditions are numbers or names of tables of time."""

    _word, kind, pcdc = "nodes", g.NODE, "node"

    def velocity(
        self,
        *,
        vx: Number | None = None,
        vy: Number | None = None,
        vz: Number | None = None,
        ax: Number | None = None,
        ay: Number | None = None,
        az: Number | None = None,
        where: Where = None,
    ) -> None:
        """Velocity [m/s] or acceleration [m/s2] that nodes have from now on; components left out stay free."""
        given = {
            "velocity_x": vx, "velocity_y": vy, "velocity_z": vz, "acceleration_x": ax, "acceleration_y": ay,
            "acceleration_z": az,
        }  # fmt: skip
        self._carry_out("boundary", given, where, "mechanical-velocity-boundary-condition")

    def damp(self, local: float, *, where: Where = None) -> None:
        """Local damping, from 0 to 1, in the place of that of the model (0, in static runs 0.8)."""
        self._carry_out("mechanical-damp", {"local": local}, where)

    def function(self, function: str) -> FunctionName:
        """Read, check and compile a function of place and time in a Python file, "file.py:function"
        (docs/user_laws.md): a value for conditions of nodes and faces. Before `sim.restore` it names the function."""
        self._do("node function", {"function": function})
        return FunctionName(function)

    def force(
        self,
        *,
        fx: Number | None = None,
        fy: Number | None = None,
        fz: Number | None = None,
        where: Where = None,
    ) -> None:
        """Force on each node [N per m of thickness, in three dimensions N]."""
        given = {"force_x": fx, "force_y": fy, "force_z": fz}
        self._carry_out("boundary", given, where, "mechanical-force-boundary-condition")

    def move(self, type: int, along: Point | None = None, *, where: Where = None) -> None:
        """Freedom of nodes: 0 free, 1 held, 2 along a vector only, 3 (in three dimensions) across it only."""
        given = {"type": (type,) if along is None else (type, along)}
        self._carry_out("boundary", given, where, "mechanical-move-boundary-constraint")

    def fluid(
        self,
        *,
        pressure: Number | None = None,
        flow_surface: Number | Point | None = None,
        flow_rate: Number | None = None,
        where: Where = None,
    ) -> None:
        """One of them at flow nodes: pressure [Pa], level [m] or point of a free surface, rate that comes in at each
        [m2/s]. With `where`, pressure and level wet the free faces whose nodes all are in it."""
        given = {"pressure": pressure, "flow_surface": flow_surface, "flow_rate": flow_rate}
        self._carry_out("boundary", given, where, "hydraulic-constant-flow-boundary")

    def proppant(
        self,
        *,
        proppant_volumetric_concentration: Number | None = None,
        proppant_volumetric_flow_rate: Number | None = None,
        where: Where = None,
    ) -> None:
        """One of them at flow nodes, of wells too: concentration of the slurry that comes in [1], or volume of grains
        that does at each [m2/s]."""
        given = {
            "proppant_volumetric_concentration": proppant_volumetric_concentration,
            "proppant_volumetric_flow_rate": proppant_volumetric_flow_rate,
        }
        self._carry_out("boundary", given, where, "hydraulic-proppant-boundary")

    def temperature(self, temperature: Number, *, where: Where = None) -> None:
        """Temperature of nodes from now on: a number or the name of a table over the time of heat."""
        self._carry_out("boundary", {"temperature": temperature}, where, "thermal-solid-boundary-condition")

    def field(self, name: str, value: Number, *, where: Where = None) -> None:
        """The value of a field of elements, as "moisture", from now on: a number or the name of a table over its
        time."""
        self._carry_out("boundary", {name: value}, where, f"{name}-boundary-condition")

    def initial_field(self, name: str, value: float, *, where: Where = None) -> None:
        """The value of a field of elements, as "moisture", now; elements around the nodes are free of the stress that
        it brings then."""
        self._carry_out("initial", {name: value}, where)

    def fluid_temperature(self, temperature: Number, *, where: Where = None) -> None:
        """The same of the fluid at flow nodes, and of what is injected there."""
        self._carry_out("boundary", {"temperature": temperature}, where, "thermal-flow-boundary-condition")

    def remove_boundary(self, *conditions: str, where: Where = None) -> None:
        """Take boundary conditions back, those of fluid and heat too. conditions: only
        these, as pcdc node boundary calls them."""
        self._take_back(conditions, where)

    def initial_velocity(
        self,
        velocity: Point | None = None,
        *,
        vx: float | None = None,
        vy: float | None = None,
        vz: float | None = None,
        where: Where = None,
    ) -> None:
        """The velocity of nodes now [m/s], or some components of it."""
        given = {"velocity": velocity, "velocity_x": vx, "velocity_y": vy, "velocity_z": vz}
        self._carry_out("initial", given, where)

    def initial_temperature(self, temperature: float, *, where: Where = None) -> None:
        """The temperature of nodes now, and of the fluid at them; elements around them are free of thermal stress
        then."""
        self._carry_out("initial", {"temperature": temperature}, where)

    def reset_velocity(self) -> None:
        """All velocities become zero."""
        self._carry_out("reset velocity", {}, None)

    def reset_displacement(self) -> None:
        """Displacements are counted from here."""
        self._carry_out("reset displacement", {}, None)


@commands
class Bolts(Objects):
    """Rock bolts: `sim.bolts["axial-force"]` is that of their elements, see `Objects`."""

    _word, kind, pcdc = "bolts", g.BOLT_ELEMENT, "bolt-element"

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
        """Install a bolt along these points [m], from its head on, as things are now: divided at the edges of elements,
        into so many segments or ones of this length [m]; in grout from where to where along it [m]; plate: the head is
        tied to the rock. group: that its elements and nodes are put into."""
        if group is None and set is not None:
            raise TypeError("set goes with group")
        given = {
            "points": points, "segments": segments, "length": length, "grout": grout, "plate": plate,
            "group": _group(group, set),
        }  # fmt: skip
        self._do("bolt create polyline", given)

    def between(
        self,
        first: Point,
        second: Point,
        mesh_size: float | None = None,
        *,
        group: str | None = None,
        set: str | None = None,
        where: Where = None,
    ) -> None:
        """Install a bolt from a point to another [m] in the parts of the way that lie in the rock; where: only in these
        elements."""
        given = {"first": first, "second": second, "mesh_size": mesh_size, "group": _group(group, set)}
        self._do("bolt-element create", given, where, g.ELEMENT)

    def model(self, name: str, *, where: Where = None, **properties: float) -> None:
        """The properties of elements of bolts: docs/pcdc_reference.md lists them; those of one bolt."""
        self._do("bolt c-model", properties, where, self.kind, name)

    def delete(self, *, where: Where = None) -> None:
        """Take elements out at once, with their part of the grout."""
        self._do("bolt delete", {}, where, self.kind)


@commands
class BoltNodes(Objects):
    """Nodes of rock bolts: `sim.bolt_nodes["slip"]`, see `Objects`."""

    _word, kind, pcdc = "bolt_nodes", g.BOLT_NODE, "bolt-node"

    def velocity(
        self,
        *,
        vx: Number | None = None,
        vy: Number | None = None,
        ax: Number | None = None,
        ay: Number | None = None,
        vz: Number | None = None,
        az: Number | None = None,
        where: Where = None,
    ) -> None:
        """Velocity [m/s] or acceleration [m/s2] from now on; components left out stay free."""
        given = {"velocity_x": vx, "velocity_y": vy, "acceleration_x": ax, "acceleration_y": ay}
        given |= {"velocity_z": vz, "acceleration_z": az}
        self._carry_out("boundary", given, where, "bolt-node-constrain")

    def force(
        self,
        *,
        fx: Number | None = None,
        fy: Number | None = None,
        fz: Number | None = None,
        where: Where = None,
    ) -> None:
        """Force on each node of one bolt [N]."""
        given = {"force_x": fx, "force_y": fy, "force_z": fz}
        self._carry_out("boundary", given, where, "bolt-node-force-boundary-condition")

    def remove_boundary(self, *conditions: str, where: Where = None) -> None:
        """Take back what was prescribed. conditions: only these, as pcdc bolt-node boundary calls them."""
        self._take_back(conditions, where)


@commands
class FlowNodes(Objects):
    """Nodes at which a channel ends, with numbers and groups of nodes: `sim.flow_nodes["pressure"]`, see `Objects`."""

    _word, kind, pcdc = "flow_nodes", g.FLOW_NODE, "flow-node"

    def group(self, group: str, set: str | None = None, *, where: Where = None) -> None:
        """They have the groups of nodes: `sim.nodes.group`."""
        raise CommandError("flow nodes have the groups of nodes: sim.nodes.group")

    def initial(
        self,
        *,
        pressure: float | None = None,
        saturation: float | None = None,
        concentration: float | None = None,
        where: Where = None,
    ) -> None:
        """Fluid that they hold now: its pressure [Pa], or the part of their room that is filled; concentration of
        proppant in it [1]. where: of nodes."""
        given = {"pressure": pressure, "saturation": saturation, "concentration": concentration}
        self._do("flow-node initial", given, chosen_by(where, g.NODE), g.NODE)

    def initial_temperature(self, temperature: float, *, where: Where = None) -> None:
        """The temperature of the fluid at them now. where: of nodes."""
        self._do("node hydraulic-initialize", {"flow_node_temperature": temperature}, chosen_by(where, g.NODE), g.NODE)


@commands
class Channels(Objects):
    """Joints with a hydraulic model, with numbers and groups of joints: `sim.channels["aperture"]`, see `Objects`."""

    _word, kind, pcdc = "channels", g.CHANNEL, "flow-channel"

    def group(self, group: str, set: str | None = None, *, where: Where = None) -> None:
        """They have the groups of joints: `sim.joints.group`."""
        raise CommandError("channels have the groups of joints: sim.joints.group")


@commands
class Wells(Words):
    """Wells: `sim.wells["injection"]` is what one has now: pressure [Pa], rate [m2/s], injected [m2], stage."""

    _word = "wells"

    def __getitem__(self, name: str) -> dict[str, float]:
        found = fdem.queries.wells(self._do.project())
        if name not in found:
            known = ", ".join(f"'{other}'" for other in found) or "none so far"
            raise CommandError(f"there is no well '{name}'; there is {known}")
        return found[name]

    def create(self, name: str, *, where: Where = None) -> None:
        """Flow nodes of a range of nodes are a well, which is shut in; its water pushes on free faces whose nodes all
        are in the range."""
        self._do("well create", {"name": name}, where, g.NODE)

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
        """One more stage: rate [m2/s] up to a pressure (limit [Pa]), pressure [Pa], or shut in; numbers or names of
        tables over the time of flow; time [s] that it takes, None: no end."""
        given = {"name": name, "rate": rate, "pressure": pressure, "shut_in": shut_in, "time": time, "limit": limit}
        self._do("well stage", given)


@commands
class Liners(Objects):
    """Liners: `sim.liners["axial-force"]` is that of their elements, see `Objects`."""

    _word, kind, pcdc = "liners", g.LINER_ELEMENT, "liner-element"

    def create(self, *, group: str | None = None, set: str | None = None, where: Where = None) -> None:
        """Put a liner on the free faces of a range, as things are now. group: that its elements and nodes are put
        into."""
        if group is None and set is not None:
            raise TypeError("set goes with group")
        self._do("liner create", {"group": _group(group, set)}, where, g.FACE)

    def model(self, name: str, *, where: Where = None, **properties: float) -> None:
        """The properties of elements of liners: docs/pcdc_reference.md lists them."""
        self._do("liner c-model", properties, where, self.kind, name)

    def delete(self, *, where: Where = None) -> None:
        """Take elements out at once."""
        self._do("liner delete", {}, where, self.kind)


@commands
class LinerNodes(Objects):
    """Nodes of liners: `sim.liner_nodes["rotation"]`, see `Objects`."""

    _word, kind, pcdc = "liner_nodes", g.LINER_NODE, "liner-node"

    def velocity(
        self,
        *,
        vx: Number | None = None,
        vy: Number | None = None,
        spin: Number | None = None,
        where: Where = None,
    ) -> None:
        """Velocity [m/s] and rate of rotation [rad/s] from now on; components left out stay free."""
        given = {"velocity_x": vx, "velocity_y": vy, "spin": spin}
        self._carry_out("boundary", given, where, "liner-node-constrain")

    def force(
        self,
        *,
        fx: Number | None = None,
        fy: Number | None = None,
        moment: Number | None = None,
        where: Where = None,
    ) -> None:
        """Force [N/m] and moment [N m/m] on each node."""
        given = {"force_x": fx, "force_y": fy, "moment": moment}
        self._carry_out("boundary", given, where, "liner-node-force-boundary-condition")

    def remove_boundary(self, *, where: Where = None) -> None:
        """Take back what was prescribed."""
        self._carry_out("boundary remove", {}, where)


@commands
class Tables(Words):
    """Functions of time for conditions, or of a coordinate for properties; linear from point to point."""

    _word = "tables"

    def create(self, name: str, values: Sequence[Point], *, relative: bool | None = None) -> None:
        """(time [s], coordinate [m] or plastic strain, value), the first ascending. relative: times count from the
        moment at which a condition takes the table."""
        if relative is None:
            self._do("table create", {"name": name, "values": values})
            return
        word = "relative-time" if relative else "absolute-time"
        numbers = [number for pair in values for number in pair]
        self._do("table", {"name": name, "data": numbers, "type": {"value": True, word: True}})

    def delete(self, name: str) -> None:
        """Forget a table."""
        self._do("table delete", {"name": name})

    def over(self, name: str, axis: str) -> Over:
        """For a property: the table over "x", "y" or in space "z" in the mesh, over "plastic-strain" (what softens or
        hardens), or over "temperature" (moduli and strengths)."""
        if axis not in AXES:
            raise ValueError(f"axis: expected {', '.join(map(repr, AXES))}, got {axis!r}")
        return Over(name, AXES.index(axis))


@commands
class Fields(Words):
    """Random fields: properties that differ from object to object."""

    _word = "fields"

    def create(
        self,
        name: str,
        *,
        seed: int,
        weibull: tuple[float, float] | None = None,
        normal: tuple[float, float] | None = None,
        lognormal: tuple[float, float] | None = None,
        correlation: float | None = None,
        covariance: str | None = None,
        least: float | None = None,
        greatest: float | None = None,
    ) -> None:
        """One of weibull (scale, shape), normal and lognormal (mean, standard deviation); correlation: length [m] over
        which neighbours are alike, covariance "exponential" or "gaussian"; cut below least and above greatest."""
        if covariance is not None and correlation is None:
            raise TypeError("covariance goes with correlation")
        given = {
            "name": name, "weibull": weibull, "normal": normal, "lognormal": lognormal, "seed": seed, "least": least,
            "correlation": None if correlation is None else {"value": correlation, "covariance": covariance},
            "greatest": greatest,
        }  # fmt: skip
        self._do("field create", given)

    def delete(self, name: str) -> None:
        """Forget a random field; what was drawn from it stays."""
        self._do("field delete", {"name": name})

    def drawn(self, name: str) -> Drawn:
        """For a property: drawn from this field."""
        return Drawn(name)


@commands
class Histories(Words):
    """Numbers recorded during the run: `sim.histories["load"]` is (n, 3) step, time [s] and value so far."""

    _word = "histories"

    def __getitem__(self, name: str) -> np.ndarray:
        rows = fdem.histories.find(self._do.project(), name).rows
        return np.array(rows, np.float64).reshape(-1, 3)

    def create(
        self,
        name: str,
        object: str,
        value: str,
        *,
        id: int | None = None,
        nearest: Point | None = None,
        how: str | None = None,
        every: int | None = None,
        variable: str | None = None,
        well: str | None = None,
        where: Where = None,
    ) -> None:
        """Follow a value of a "node", "element", "joint", a part of bolts or liners ("bolt-node", "liner-element"), a
        "flow-node", a "flow-channel", a "well" (well: its name) or of the "model": of one (id, or nearest to a point),
        or of those of a range or of all by how: "sum", "mean", "minimum", "maximum"; every so many steps. variable:
        with the value "law-state", which state variable of laws of the user."""
        ways = ("sum", "mean", "minimum", "maximum")
        words = None if value is None else _script_word(value)
        given = {"name": name, "object": object, "value": words, "id": id, "nearest": nearest, "every": every,
                 "variable": variable, "well": well}  # fmt: skip
        if how is not None and how not in ways:
            raise ValueError(f"how: expected one of {', '.join(ways)}, got {how!r}")
        if how is not None:
            given[how] = True
        self._do("history create", given, where, OBJECTS.get(object, g.NODE))

    def delete(self, name: str) -> None:
        """Stop a history; its file stays."""
        self._do("history delete", {"name": name})

    def export(self, file: File, names: Sequence[str] | None = None) -> None:
        """Write all histories, or some, side by side as CSV."""
        self._do("history export", {"file": file, "names": names})


@commands
class Charts(Words):
    """Diagrams of histories or points."""

    _word = "charts"

    def create(
        self, name: str, *, title: str | None = None, x_label: str | None = None, y_label: str | None = None
    ) -> None:
        """An empty diagram."""
        self._do("chart create", {"name": name, "title": title, "x_label": x_label, "y_label": y_label})

    def add(
        self,
        name: str,
        *,
        x: str | None = None,
        y: str | None = None,
        scale_x: float | None = None,
        scale_y: float | None = None,
        values: Sequence[Point] | None = None,
        profile: str | None = None,
        label: str | None = None,
        style: str | None = None,
        where: Where = None,
    ) -> None:
        """A curve of history y against history x (or time), of points, or of what fluid has now along the line of
        channels of a range (profile: "pressure", "saturation", "aperture", "flow-rate", "velocity",
        "temperature", "concentration"); style: "line" or "points"."""
        given = {
            "name": name, "x": x, "y": y, "scale_x": scale_x, "scale_y": scale_y, "values": values,
            "profile": None if profile is None else _script_word(profile), "label": label, "style": style,
        }  # fmt: skip
        self._do("chart add", given, where, g.JOINT)

    def export(
        self,
        name: str,
        file: File,
        cracks: bool = False,
        plastic: bool = False,
        fluid: str | None = None,
        temperature: bool = False,
    ) -> None:
        """Write a diagram as figure and CSV; cracks, plastic, temperature, fluid ("pressure", "saturation", "aperture",
        "velocity" or "concentration"): beside it the model as it is now, with one of them."""
        given = {
            "name": name, "file": file, "cracks": cracks, "plastic": plastic, "fluid": fluid,
            "temperature": temperature,
        }  # fmt: skip
        self._do("chart export", given)


@commands
class Output(Words):
    """Frames for ParaView."""

    _word = "output"

    def vtk(self, file: str, every: int | None = None, *, off: bool = False) -> None:
        """Frames ``<file>_<step>.vtkhdf`` in the folder of the results: now, or every so many steps; off: no more."""
        self._do("output vtk", {"file": file, "every": every, "off": off})

    def image(
        self,
        file: str,
        *,
        view: str | None = None,
        field: str | None = None,
        object: str | None = None,
        limits: tuple[float, float] | None = None,
        full: bool = False,
        log: bool = False,
        colours: str | None = None,
        opacity: float | None = None,
        edges: bool = False,
        size: float | None = None,
        vectors: str | None = None,
        arrows: float | None = None,
        filter: str | None = None,
        deformed: float | None = None,
        camera: tuple[tuple[float, float], tuple[float, float]] | None = None,
        eye: str | None = None,
        section: str | None = None,
        title: str | None = None,
        where: Where = None,
    ) -> None:
        """Draw the model as it is now, ``<file>_<step>.png``, with objects coloured by a field that frames have.

        view: a file *.mv, else everything is shown; object: "elements", "joints", ..., of which the field and the other
        looks are; limits: values of the first and the last colour, full: the least and the greatest, else those that
        1 % is below or above; camera: lower left and upper right corner [m]; eye: in space from where it is seen ("-y",
        "iso", "1,-2,0.5"); section: a plane that cuts it ("x=1.5"); where: the objects that are shown. See
        docs/view.md."""
        given = {
            "file": file, "view": view, "field": field, "object": object, "limits": limits, "full": full,
            "log": log, "colours": colours, "opacity": opacity, "edges": edges, "size": size, "vectors": vectors,
            "arrows": arrows, "filter": filter, "deformed": deformed, "camera": camera, "eye": eye, "section": section,
            "title": title,
        }  # fmt: skip
        self._do("output image", given, where, g.SHOWN.get(object or "", g.ELEMENT))


@commands
class BlockCommands:
    """What a `Simulation` has of blocks. The model of blocks is made when it is first used."""

    _word = ""

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

    def _begin_blocks(self, project: Callable[[], Project]) -> None:
        self._blocks = do = Orders(project)
        self.geometry, self.mesh = Geometry(do), Mesh(do)
        self.elements, self.faces, self.joints, self.nodes = Elements(do), Faces(do), Joints(do), Nodes(do)
        self.bolts, self.bolt_nodes = Bolts(do), BoltNodes(do)
        self.flow_nodes, self.channels, self.wells = FlowNodes(do), Channels(do), Wells(do)
        self.liners, self.liner_nodes = Liners(do), LinerNodes(do)
        self.tables, self.fields = Tables(do), Fields(do)
        self.histories, self.charts, self.output = Histories(do), Charts(do), Output(do)

    def _before_steps(self) -> None:
        """CommandError if the blocks cannot be stepped as things are."""

    def gravity(self, gravity: Point) -> None:
        """Gravity of the blocks from now on [m/s2]; that of particles is ``set(gravity=...)``."""
        self._blocks("model gravity", {"gravity": gravity})

    def units(self, system: str) -> None:
        """Units of what is given of blocks from now on, "SI", "mm-MPa-s" or "km-MPa-s": unlikely values are warned of,
        histories and charts labelled; no value changes. Those of particles are ``set(units=...)``."""
        self._blocks("model units", {"system": system})

    def option(
        self,
        *,
        dynamic: bool | None = None,
        collision: bool | None = None,
        overlap: str | None = None,
        deep_overlap: str | None = None,
        potential: str | None = None,
        large_strain: bool | None = None,
        energy: bool | None = None,
        mechanical: bool | None = None,
        hydraulic: bool | None = None,
        one_way: bool | None = None,
        thermal: bool | None = None,
        proppant: bool | None = None,
    ) -> None:
        """Of blocks: motion in time or towards equilibrium; contact of surfaces; of bodies that overlap at first
        "refuse", "relax" or "keep"; of those that come to overlap too deep "warn" or "stop"; the potential of contact
        in space, "distance" or "munjiza"; rotations of elements; keep the energy budget; motion at all; flow of fluid,
        and whether it does not push; flow of heat; proppant that moves in the fluid."""
        given = {
            "dynamic": dynamic, "collision": collision, "overlap": overlap,
            "deep_overlap": deep_overlap, "potential": potential,
            "large_strain": large_strain, "energy": energy, "mechanical": mechanical, "hydraulic": hydraulic,
            "one_way": one_way, "thermal": thermal, "proppant": proppant,
        }  # fmt: skip
        self._blocks("model option", given)

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
        """The time step of dynamic runs of blocks: given [s] or by a table of time, estimated again and again (every
        so many steps), or reached by mass; hydraulic, thermal [s]: those of flow and of heat."""
        given = {
            "value": value, "auto": auto, "update_frequency": update_frequency, "safety": safety,
            "mass_scaling": mass_scaling, "hydraulic": hydraulic, "thermal": thermal,
        }  # fmt: skip
        self._blocks("model time-step", given)

    def sub_step(
        self, *, mechanical: int | None = None, hydraulic: int | None = None, thermal: int | None = None
    ) -> None:
        """Steps of the blocks between two cycles of flow and heat, and sub-steps of such cycles (0: as many as are
        stable)."""
        given = {"mechanical": mechanical, "hydraulic": hydraulic, "thermal": thermal}
        self._blocks("model sub-step", given)

    def field_clock(
        self, field: str, *, flows: bool | None = None, time_step: float | None = None, sub_steps: int | None = None,
        current_time: float | None = None,
    ) -> None:  # fmt: skip
        """The clock of a field of elements, as "moisture": whether it flows; its sub-steps [s] (0: those of a cycle
        take the time of the steps of the blocks), and how many in a cycle (0: as many as are stable); what it shows
        now."""
        given = {
            "field": field, "flows": flows, "time_step": time_step, "sub_steps": sub_steps,
            "current_time": current_time,
        }  # fmt: skip
        self._blocks("model field", given)

    def field_account(self, name: str) -> dict[str, float]:
        """The account of a field of elements, as "moisture": given, commands, stored, removed; what does not add up.
        Collective."""
        return fdem.fields.account(self._blocks.project(), name)

    def run_time(self, time: float) -> None:
        """The time [s] that `solve` takes at most from now on; 0: no end."""
        self._blocks("model run-time", {"time": time})

    def solve_check(self, steps: int) -> None:
        """Steps between two looks at the ratio in `solve`."""
        self._blocks("model solve-check", {"steps": steps})

    def cycle_option(
        self,
        part: str,
        *,
        time_step: float | None = None,
        cycle_number: int | None = None,
    ) -> None:
        """Time step [s] and number of steps of a part ("mechanical", "thermal", "hydraulic", "proppant-transport") in a
        cycle of a coupled calculation."""
        given = {"value": True, "time-step": time_step, "cycle-number": cycle_number}
        self._blocks("model cycle-option", {part: {name: v for name, v in given.items() if v is not None}})

    def reset_clock(
        self,
        part: str,
        *,
        current_time: float | None = None,
        start_time: float | None = None,
        time_step: float | None = None,
    ) -> None:
        """What the clock of a part shows now, from when `run_time` counts, and its time step [s]; parts: see
        `cycle_option`."""
        given = {"value": True, "current-time": current_time, "start-time": start_time, "time-step": time_step}
        self._blocks("model reset", {part: {name: v for name, v in given.items() if v is not None}})

    def tell_time(self, part: str) -> None:
        """Say in the log what time a part has come to; parts: see `cycle_option`."""
        self._blocks("model query", {part: {"value": True, "time": True}})

    def tell_devices(self) -> None:
        """Say in the log what the run computes with: ranks, threads, processors."""
        self._blocks("device list", {})

    @property
    def wet_faces(self) -> dict[str, np.ndarray]:
        """Free faces before which water stands: number (element * 4 + face), size [m], in space [m2], and the mean
        pressure that pushes on each [Pa]. Collective."""
        return fdem.queries.wet_faces(self._blocks.project())

    @property
    def fluid(self) -> dict[str, float]:
        """The account of the fluid [m2]: given, stored, leaked, removed; what does not add up. Collective."""
        return fdem.queries.fluid(self._blocks.project())

    @property
    def fluid_energies(self) -> dict[str, float]:
        """The energy of blocks and fluid in implicit steps [J/m], in space [J]: pumped, leaked, viscous, fluid, strain,
        joints, fracture, outside; what does not add up. Collective."""
        return fdem.queries.fluid_energies(self._blocks.project())

    @property
    def proppant(self) -> dict[str, float]:
        """The account of proppant [m2]: came, stored, packed, left, removed; what does not add up. Collective."""
        return fdem.queries.proppant(self._blocks.project())

    @property
    def heat(self) -> dict[str, float]:
        """The account of heat [J/m]: given, commands, stored, fluid, removed; what does not add up. Collective."""
        return fdem.queries.heat(self._blocks.project())

    def plane_stress(self) -> None:
        """The model of the plane is a plate of a metre of thickness whose two faces bear nothing: no stress across the
        plane. Said before initial stress and before the first step."""
        self._blocks("model plane-stress", {})

    def plane_strain(self) -> None:
        """Nothing moves across the plane, as is so from the beginning; takes `plane_stress` back."""
        self._blocks("model plane-strain", {})

    def rayleigh(self, ratio: float, *, frequency: float | None = None, part: str | None = None) -> None:
        """Rayleigh damping of elements in dynamic runs: ratio of the critical one at a frequency [Hz]; part: both
        (default), mass or stiffness. ratio 0: no more."""
        self._blocks("model rayleigh", {"ratio": ratio, "frequency": frequency, "part": part})

    def creep(
        self,
        on: bool = True,
        *,
        dt: float | None = None,
        change: float | None = None,
        least: float | None = None,
        greatest: float | None = None,
    ) -> None:
        """Elements creep from now on, or no more. dt: creep step of static runs [s]; with change it follows the change
        of stress, between least and greatest [s]."""
        given = {"on": on, "dt": dt, "change": change, "least": least, "greatest": greatest}
        self._blocks("model creep", given)

    @property
    def creep_time(self) -> float:
        """Time that the elements have crept [s]."""
        return float(self._blocks.project().blocks.creep.time)

    def step(self, n: int) -> None:
        """So many steps of the blocks, and of the particles that are coupled to them."""
        self._before_steps()
        self._blocks("model step", {"steps": n})

    def solve(
        self,
        *,
        ratio: float | None = None,
        cycles: int | None = None,
        time: float | None = None,
        run_time: float | None = None,
        window: int | None = None,
        limit: int | None = None,
        on_failure: str | None = None,
        elastic: bool = False,
        solver: str | None = None,
        steps: int | None = None,
        hydraulic: bool = False,
        thermal: bool = False,
        dt: float | None = None,
        steady: bool = False,
        auto: bool = False,
    ) -> None:
        """Steps until the first of ratio, cycles, time and run_time [s] is reached, without any ratio 1e-5 or 10 000
        cycles; with elastic straight to static equilibrium,
        in so many steps of what is new in the loads; with hydraulic fluid flows by implicit steps of at most dt [s],
        for this time or until it is steady, through blocks in equilibrium; with thermal so does heat. With auto
        fluid flows by explicit steps, if these cost less.
        In static runs with creep time is creep time.
        A run towards a ratio that gets nowhere (window, limit) ends the program with exit code 3, unless on_failure
        is "continue"; `solved` says how it ended."""
        given = {
            "ratio": ratio, "cycles": cycles, "time": time, "run_time": run_time, "window": window, "limit": limit,
            "on_failure": on_failure,
            "elastic": elastic, "solver": solver, "steps": steps, "hydraulic": hydraulic, "thermal": thermal, "dt": dt,
            "steady": steady, "auto": auto,
        }  # fmt: skip
        self._before_steps()
        self._blocks("model solve", given)

    @property
    def solved(self) -> dict[str, Any]:
        """How the last `solve` ended: reason, ratio (NaN if nobody looked), steps. Empty before the first."""
        return dict(self._blocks.project().solved)

    @property
    def ratio(self) -> float:
        """Unbalanced over all forces of the nodes. Collective."""
        return fdem.queries.ratio(self._blocks.project())

    @property
    def energies(self) -> dict[str, float]:
        """The energy budget of the blocks [J/m], in space [J], after ``option(energy=True)``. Collective."""
        return fdem.queries.energies(self._blocks.project())

    @property
    def block_time(self) -> float:
        """Model time of the blocks [s]."""
        return float(self._blocks.project().blocks.clock.time)

    @property
    def block_steps(self) -> int:
        """Steps of the blocks."""
        return self._blocks.project().step


def _named(given: Any, *names: str) -> dict[str, Any]:
    """("hole", 0.05) as {"value": "hole", "size": 0.05}."""
    parts = (given,) if isinstance(given, str) else tuple(given)
    if not 1 <= len(parts) <= len(names):
        raise TypeError(f"expected {', '.join(names[1:])} beside the name of the layer, got {given!r}")
    return dict(zip(names, parts))


def _group(group: str | None, set_name: str | None) -> dict[str, Any] | None:
    if group is None and set_name is None:
        return None
    return {"value": g.DEFAULT if group is None else group, "set": set_name}


def _script_word(name: str) -> Any:
    return name.replace("_", "-") if isinstance(name, str) else name


def _quantity(name: str) -> str:
    if not isinstance(name, str):
        raise TypeError(f"expected the name of a quantity, got {name!r}")
    return name.replace("-", "_")
