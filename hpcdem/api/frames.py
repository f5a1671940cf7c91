"""Frames in a Python program or a notebook: tables for pandas and xarray, pictures, what they show by themselves."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack, overload

import numpy as np

from hpcdem.api.program import spelt
from hpcdem.core.errors import HpcdemError, UsageError
from hpcdem.core.nearest import hint

if TYPE_CHECKING:
    from hpcdem.io.frames import FrameFile
    from hpcdem.post.view.moment import Moment

NARROWEST = 100
"""Smallest width of a picture [pixels]."""
MAIN = ("particles", "elements")
"""Kinds of objects of a frame used by default."""


class Appearance(TypedDict, total=False):
    """Appearance of the objects of a picture: keywords of a layer of a view (docs/view.md)."""

    limits: tuple[float, float]
    log: bool
    colours: str
    opacity: float
    edges: bool
    size: float
    vectors: str
    arrows: float
    filter: str
    colour: str


class Frame:
    """The state of a model at one step, from a file or from a simulation (`sim.frame()`). In a notebook it shows a
    picture.

    step, time [s]; objects: number of objects by kind; fields(object): names of their quantities.
    """

    def __init__(self, moment: Moment, name: str = "") -> None:
        self._moment, self.name = moment, name
        self.step, self.time = moment.step, moment.time

    @property
    def objects(self) -> dict[str, int]:
        """Number of objects of each kind: particles, contacts, bonds, walls, elements, joints, ..."""
        return {kind: objects.count for kind, objects in self._moment.objects.items()}

    def fields(self, object: str | None = None) -> list[str]:
        """Return the names of fields and vectors of these objects."""
        return self._moment.of(object or self._main()).known()

    def table(self, object: str | None = None) -> dict[str, np.ndarray]:
        """Return the columns (n,) of all fields of a kind of object (default: particles, else elements); x and y of the
        centre first, vectors as velocity_x, velocity_y. Raises HpcdemError that names the available kinds.
        """
        objects = self._moment.of(object or self._main())
        columns = {axis: part for axis, part in zip("xyz", objects.centres().T)}
        for name in objects.known():
            if name not in objects.vectors:  # the lengths of vectors are not in tables, their components are
                columns[name] = np.asarray(objects.values(name, ""))
        return columns

    def pandas(self, object: str | None = None) -> Any:
        """Return `table` as a pandas.DataFrame, with the number of each object as index."""
        objects = self._moment.of(object or self._main())
        data = _needed("pandas").DataFrame(self.table(object))
        return data.set_index(objects.number) if objects.number in data else data.rename_axis("number")

    def xarray(self, object: str | None = None) -> Any:
        """Return `table` as an xarray.Dataset along the numbers of the objects; units are attributes of the
        variables.
        """
        return _with_units(self.pandas(object), self._moment, {"step": self.step, "time": self.time})

    def picture(
        self, field: str | None = None, object: str | None = None, width: int = 900, **appearance: Unpack[Appearance]
    ) -> bytes:
        """Draw the frame.

        Parameters
        ----------
        field, object : quantity that colours the objects that have it, or kind of object to colour.
        width : width of the picture [pixels].
        appearance : of the objects: limits=(low, high), colours="blue-red", log=True ... (docs/view.md).

        Returns
        -------
        bytes : contents of a PNG file.
        """
        if isinstance(width, bool) or not isinstance(width, int) or width < NARROWEST:
            raise UsageError(f"width: expected a whole number of pixels from {NARROWEST} on, got {width!r}")
        given = spelt(dict(appearance), Appearance.__annotations__)
        for name in given:
            if name not in Appearance.__annotations__:
                near = hint(name, Appearance.__annotations__)
                raise UsageError(f"unknown option '{name}'{near}; available: {', '.join(Appearance.__annotations__)}")
        import matplotlib

        from hpcdem.io.axes import CM
        from hpcdem.post import saved
        from hpcdem.post.view import paper, scene

        view = scene.default_view(self._moment)
        if field is not None:
            view = scene.with_field(view, self._moment, field, object, **given)
        page = paper.Paper(dpi=width / (paper.USUAL.page * CM))
        content = io.BytesIO()
        with matplotlib.rc_context(saved.SAVED):
            figure = paper.figure_of(scene.scene(self._moment, view), page)
            saved.save(figure, content, "png", page.dpi, f"a picture {width} pixels wide")
        return content.getvalue()

    def show(
        self, field: str | None = None, object: str | None = None, width: int = 900, **appearance: Unpack[Appearance]
    ) -> Any:
        """Return `picture` as an image of IPython, for a notebook."""
        return _needed("IPython.display").Image(self.picture(field, object, width, **appearance))

    def _main(self) -> str:
        for kind in (*MAIN, *self._moment.objects):
            if self._moment.objects.get(kind) is not None:
                return kind
        raise HpcdemError("this frame is empty")

    def __repr__(self) -> str:
        there = ", ".join(f"{count} {kind}" for kind, count in self.objects.items() if count)
        return f"<{self.name or 'frame'}: step {self.step}, {self.time:.6g} s, {there or 'nothing'}>"

    def _repr_png_(self) -> bytes:
        return self.picture()

    def _repr_html_(self) -> str:
        return shown(repr(self)[1:-1], self.picture() if any(self.objects.values()) else None)


class Frames(Sequence[Frame]):
    """The frames of a run in the order of their steps; each is read on first use."""

    def __init__(self, files: Sequence[FrameFile]) -> None:
        self.files = list(files)

    def __len__(self) -> int:
        return len(self.files)

    @overload
    def __getitem__(self, place: int) -> Frame: ...

    @overload
    def __getitem__(self, place: slice) -> Frames: ...

    def __getitem__(self, place: int | slice) -> Frame | Frames:
        from hpcdem.post.view.moment import read_moment

        if isinstance(place, slice):
            return Frames(self.files[place])
        path = self.files[place].path
        return Frame(read_moment(path), path.name)

    def __iter__(self) -> Iterator[Frame]:
        return (self[place] for place in range(len(self)))

    def pandas(self, object: str | None = None) -> Any:
        """Concatenate the tables of all frames; the index is step and number, `time` [s] a column."""
        pandas = _needed("pandas")
        parts = {frame.step: frame.pandas(object).assign(time=frame.time) for frame in self._each()}
        return pandas.concat(parts, names=["step"])

    def xarray(self, object: str | None = None) -> Any:
        """Combine all frames: dimensions step and number, coordinate `time` [s]; NaN where an object does not exist."""
        data = self.pandas(object)
        times = data.pop("time").groupby("step").first()
        found = _with_units(data, self[0]._moment, {})
        return found.assign_coords(time=("step", times.to_numpy()))

    def _each(self) -> Iterator[Frame]:
        """Iterate over the frames with each step once: of two frames of one step, before and after, the second."""
        return iter({frame.step: frame for frame in self}.values())

    def __repr__(self) -> str:
        steps = f", steps {self.files[0].step} to {self.files[-1].step}" if self.files else ""
        return f"<{len(self)} frames{steps}>"

    def _repr_html_(self) -> str:
        return shown(repr(self)[1:-1], self[-1].picture() if self.files else None)


def frames(path: str | Path = "data", name: str | None = None) -> Frames:
    """Return the frames of a folder, or the frame of a file. name: of blocks, frames NAME_<step>.vtkhdf; required if a
    folder contains several kinds. Raises HpcdemError if there are no such frames.
    """
    from hpcdem.io.frames import FrameFile, list_frames, mesh_frames_by_name
    from hpcdem.post.view.moment import read_moment

    path = Path(path)
    if path.is_file():
        return Frames([FrameFile(path, read_moment(path).step, False)])
    if not path.is_dir():
        raise HpcdemError(f"folder or file not found: {path}")
    kinds = dict(mesh_frames_by_name(path))
    if files := list_frames(path):
        kinds["all"] = files
    if name is None and len(kinds) == 1:
        (name,) = kinds
    if not kinds or name not in kinds:
        there = (
            f"it contains frames of {', '.join(sorted(kinds))}: select one with name=" if kinds else "no frames found"
        )
        raise HpcdemError(f"{path}: {there}")
    return Frames(kinds[name])


def shown(title: str, picture: bytes | None) -> str:
    """Return HTML of a line of text and a picture."""
    image = base64.b64encode(picture).decode() if picture else ""
    tag = f'<br><img src="data:image/png;base64,{image}" style="max-width:100%">' if image else ""
    return f"<div>{html.escape(title)}{tag}</div>"


def _with_units(data: Any, moment: Moment, about: dict[str, Any]) -> Any:
    _needed("xarray")
    found = data.to_xarray()
    for name in found.data_vars:
        stem = name.removesuffix("_x").removesuffix("_y").removesuffix("_z")
        unit = moment.unit_of("x" if name in ("x", "y", "z") else stem)
        if unit:
            found[name].attrs["units"] = unit
    return found.assign_attrs(about)


def _needed(package: str) -> Any:
    """A package of the extra [notebook]."""
    try:
        if package == "pandas":
            import pandas as module
        elif package == "xarray":
            import xarray as module
        else:
            import IPython.display as module
    except ImportError:
        name = package.partition(".")[0]
        raise UsageError(
            f"package {name} is not installed: pip install {name.lower()}, or the extra [notebook]"
        ) from None
    return module
