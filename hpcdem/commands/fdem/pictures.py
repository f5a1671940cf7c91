"""output image: pictures of the model as it is, of any field that its frames have."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from hpcdem.commands.fdem import frames
from hpcdem.commands.fdem.choices import everything
from hpcdem.commands.fdem.project import Project
from hpcdem.commands.fdem.values import FIGURES, frames_name
from hpcdem.core.errors import CommandError
from hpcdem.io.agreed import on_first
from hpcdem.physics.fdem.groups import SHOWN, Range, UseHidden


def image(
    project: Project,
    file: str,
    view: str = "",
    field: str = "",
    object: str = "",
    camera: tuple[tuple[float, float], tuple[float, float]] | None = None,
    eye: str | None = None,
    section: str | None = None,
    deformed: float | None = None,
    title: str | None = None,
    full: bool = False,
    where: Range | None = None,
    **appearance: Any,
) -> None:
    """Draw the present state into `<file>_<step>.png` in the output folder (.pdf or .svg with that extension). view: a
    file *.mv; field: quantity that colours these objects (default: the first objects that have it); appearance: values
    of `hpcdem.post.view.model.Layer`; full: the colour scale covers all values; camera: corners of the visible part of
    the plane [m]; eye, section: in space, as in `hpcdem.post.view.model.ModelView`; where: objects to draw. Collective.
    """
    from hpcdem.post.view.model import ModelView, read_view
    from hpcdem.post.view.moment import of_blocks
    from hpcdem.post.view.paper import draw
    from hpcdem.post.view.scene import adjusted, default_view

    frames_name(file)
    suffix = Path(file).suffix.lower()
    stem = file[: -len(suffix)] if suffix in FIGURES else file
    if where is not None and object not in SHOWN:
        raise CommandError(f"range needs object, one of {', '.join(SHOWN)}")
    project.ready(use=False)
    only = {} if where is None else {object: np.asarray(everything(project, SHOWN[object], where))}
    if project.hidden.any():
        for of in ("elements", "joints"):
            only.setdefault(of, everything(project, SHOWN[of], (UseHidden(False),)))
    settings = project.to_read(view) if view else None
    appearance |= {"limits": "full"} if full else {}
    step = project.step
    path = project.to_write(project.folder() / f"{stem}_{step:010d}{suffix if suffix in FIGURES else FIGURES[0]}")
    state = frames.whole(project)
    if project.blocks.dim == 3:
        project.blocks.prepare_kernels("pictures")

    def picture() -> None:
        assert state is not None
        moment = of_blocks(state)
        shown: ModelView = default_view(moment) if settings is None else read_view(settings)
        more: dict[str, Any] = {"deformed": deformed, "title": title, "eye": eye, "section": section}
        if camera is not None:
            (left, bottom), (right, top) = camera
            more["camera"] = left, right, bottom, top
        more = {word: value for word, value in more.items() if value is not None}
        draw(
            moment,
            path,
            adjusted(shown, moment, field.replace("-", "_") or None, object or None, appearance, **more),
            only=only or None,
        )

    with project.blocks.timers.around("output"):
        on_first(project.comm, picture)
