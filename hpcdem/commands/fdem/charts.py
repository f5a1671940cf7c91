"""Charts: curves of histories or of points, written as CSV and drawn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hpcdem.commands.fdem import frames, histories
from hpcdem.commands.fdem.choices import everything
from hpcdem.commands.fdem.histories import find
from hpcdem.commands.fdem.needed import needed
from hpcdem.commands.fdem.project import Project
from hpcdem.commands.fdem.records import Chart, Curve
from hpcdem.commands.fdem.values import figure_name
from hpcdem.core.errors import CommandError
from hpcdem.core.nearest import quoted
from hpcdem.core.units import label as unit_label
from hpcdem.io.agreed import atomic_path, make_folder, on_first
from hpcdem.io.files import write_sections
from hpcdem.physics.fdem.groups import CHANNEL, FLOW_NODE, Range
from hpcdem.physics.flow.model import Flow
from hpcdem.physics.flow.network import path as path_of
from hpcdem.physics.heat.model import Heat
from hpcdem.physics.proppant.model import Proppant


def create(project: Project, name: str, title: str = "", x_label: str = "", y_label: str = "") -> None:
    """Create an empty chart; it replaces one with this name."""
    project.charts[name] = Chart(title, x_label, y_label)


def add(
    project: Project,
    name: str,
    x: str = "",
    y: str = "",
    scale_x: float = 1.0,
    scale_y: float = 1.0,
    values: Sequence[tuple[float, float]] = (),
    label: str = "",
    style: str = "line",
    profile: str = "",
    where: Range | None = None,
) -> None:
    """Add a curve: history y against history x (or time), given points, or a profile, which is a present quantity of
    the fluid against distance along a line of channels from its left end. Collective.
    """
    chart = _chart(project, name)
    if profile:
        found, label = _profile(project, profile.replace("-", "_"), where), label or profile.replace("-", " ")
        values = [(scale_x * s, scale_y * value) for s, value in found]
    for history in filter(None, (x, y)):
        find(project, history)
    chart.curves.append(Curve(label or y or "points", x, y, scale_x, scale_y, list(values), style))


def _profile(project: Project, name: str, where: Range | None) -> list[tuple[float, float]]:
    """(distance [m], value) along channels: pressure, saturation, temperature and concentration of their nodes, else of
    their middles."""
    channels = everything(project, CHANNEL, where)
    flow, at = Flow.of(project.blocks), project.positions()
    network = flow.network
    found = path_of(network.ends[np.searchsorted(network.channels, channels)])
    if found is None:
        raise CommandError(
            f"a profile needs one line with two ends; the {len(channels)} channels of the range do not form one"
        )
    order, points = found
    if tuple(at[points[-1]]) < tuple(at[points[0]]):
        order, points = order[::-1], points[::-1]
    s = np.append(0.0, np.cumsum(np.hypot(*np.diff(at[points], axis=0).T)))
    if name == "temperature" and name not in flow.more:
        raise CommandError("the fluid has no thermal model: assign face-joint c-model thermal-fluid first")
    if name == "concentration":
        needed(project, Proppant)
    if name in ("pressure", "saturation", "temperature", "concentration"):
        values = _by_number(flow.values(FLOW_NODE, name, np.sort(points)), points)
    else:
        s = 0.5 * (s[1:] + s[:-1])
        values = np.abs(flow.values(CHANNEL, name, channels)[order])
    return list(zip(s.tolist(), values.tolist(), strict=True))


def _by_number(values: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Values in ascending order of these numbers, in their order."""
    return values[np.argsort(np.argsort(numbers))]


def export(
    project: Project, name: str, file: str, cracks: bool = False, plastic: bool = False, fluid: str = "",
    temperature: bool = False,
) -> None:  # fmt: skip
    """Write the chart as a figure into the output folder, and its curves as CSV: curve, x, y, one row per point. With
    cracks, plastic, temperature or fluid (pressure, saturation, aperture, velocity or concentration), the figure also
    shows the present state of the model. Collective.
    """
    from hpcdem.post.charts import draw

    chart, figure = _chart(project, name), project.result(file)
    figure_name(file)
    beside = [panel for panel in ("cracks" * cracks, "plastic" * plastic, "temperature" * temperature, fluid) if panel]
    if len(beside) > 1:
        raise CommandError("give only one of cracks, plastic, temperature and fluid")
    for asked, physics in ((temperature, Heat), (fluid, Flow), (fluid == "concentration", Proppant)):
        if asked:
            needed(project, physics, use=False)
    curves = [(curve.label, curve.style, _points(project, curve)) for curve in chart.curves]
    if not any(points for _, _, points in curves):
        raise CommandError(f"chart '{name}' has no points yet")
    rows = [f"{histories._quoted(label)},{x!r},{y!r}" for label, _, points in curves for x, y in points]
    titles = [histories._quoted(text) for text in (chart.x_label or "x", chart.y_label or "y")]
    text = "\n".join([",".join(["curve", *titles]), *rows]) + "\n"
    for written in (figure, figure.with_suffix(".csv")):
        project.to_write(written)
    project.folder()
    make_folder(figure.parent, project.comm)
    write_sections(figure.with_suffix(".csv"), project.comm, lambda: [text.encode()])
    if beside:
        project.ready(use=False)
        if project.dim == 3:
            project.blocks.prepare_kernels("pictures")
    model = frames.whole(project) if beside else None

    def picture() -> None:
        with atomic_path(figure) as temporary:
            draw(Path(temporary), figure.suffix[1:].lower(), chart.title, _x_label(project, chart),
                 _y_label(project, chart), curves, model, *beside)  # fmt: skip

    on_first(project.comm, picture)


def _points(project: Project, curve: Curve) -> list[tuple[float, float]]:
    """The points of a curve; of two histories those steps that both have."""
    if not curve.y:
        return curve.points
    y = find(project, curve.y).rows
    if not curve.x:
        return [(curve.scale_x * time, curve.scale_y * value) for _, time, value in y]
    x = {step: value for step, _, value in find(project, curve.x).rows}
    return [(curve.scale_x * x[step], curve.scale_y * value) for step, _, value in y if step in x]


def _x_label(project: Project, chart: Chart) -> str:
    if chart.x_label or not chart.curves or not chart.curves[0].y:
        return chart.x_label
    first = chart.curves[0]
    return _named(project, first.x) if first.x else "time [s]"


def _y_label(project: Project, chart: Chart) -> str:
    if chart.y_label or not chart.curves or not chart.curves[0].y:
        return chart.y_label
    return _named(project, chart.curves[0].y)


def _named(project: Project, name: str) -> str:
    history = find(project, name)
    return f"{name}: {history.value.replace('_', ' ')} [{unit_label(project.units, history.unit)}]"


def _chart(project: Project, name: str) -> Chart:
    if name not in project.charts:
        raise CommandError(f"there is no chart '{name}'; available: {quoted(project.charts)}")
    return project.charts[name]
