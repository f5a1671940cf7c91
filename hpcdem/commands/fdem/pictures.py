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
    name: str,
    view: str = "",
    field: str = "",
    kind: str = "",
    corners: tuple[tuple[float, float], tuple[float, float]] | None = None,
    eye: str | None = None,
    section: str | None = None,
    deformed: float | None = None,
    title: str | None = None,
    where: Range | None = None,
    **looks: Any,
) -> None:
    """Draw the model as it is now into `<name>_<step>.png` in the folder of the results (.pdf or .svg if the name ends
    so). view: a file *.mv; field: what colours objects of this kind (else the first that have it); looks: values of
    `hpcdem.post.view.model.Layer`; corners: of the part of the plane [m]; eye, section: in space, as in
    `hpcdem.post.view.model.ModelView`; where: the objects of the kind that are shown. Collective."""
    from hpcdem.post.view.model import ModelView, read_view
    from hpcdem.post.view.moment import of_blocks
    from hpcdem.post.view.paper import draw
    from hpcdem.post.view.scene import adjusted, default_view

    frames_name(name)
    suffix = Path(name).suffix.lower()
    stem = name[: -len(suffix)] if suffix in FIGURES else name
    if where is not None and kind not in SHOWN:
        raise CommandError(f"range goes with object, one of {', '.join(SHOWN)}")
    project.ready(use=False)
    only = {} if where is None else {kind: np.asarray(everything(project, SHOWN[kind], where))}
    if project.hidden.any():
        for of in ("elements", "joints"):
            only.setdefault(of, everything(project, SHOWN[of], (UseHidden(False),)))
    file = project.to_read(view) if view else None
    step = project.step
    path = project.to_write(project.folder() / f"{stem}_{step:010d}{suffix if suffix in FIGURES else FIGURES[0]}")
    state = frames.whole(project)
    if project.blocks.dim == 3:
        project.blocks.prepare_kernels("pictures")

    def picture() -> None:
        assert state is not None
        moment = of_blocks(state)
        shown: ModelView = default_view(moment) if file is None else read_view(file)
        more: dict[str, Any] = {"deformed": deformed, "title": title, "eye": eye, "section": section}
        if corners is not None:
            (left, bottom), (right, top) = corners
            more["camera"] = left, right, bottom, top
        more = {word: value for word, value in more.items() if value is not None}
        draw(moment, path, adjusted(shown, moment, field or None, kind or None, looks, **more), only=only or None)

    with project.blocks.timers.around("output"):
        on_first(project.comm, picture)
