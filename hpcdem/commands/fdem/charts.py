"""Charts: curves of histories or of points, written as CSV and drawn."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hpcdem.commands.fdem import frames, histories
from hpcdem.commands.fdem.histories import find
from hpcdem.commands.fdem.project import Project
from hpcdem.commands.fdem.records import Chart, Curve
from hpcdem.core.errors import CommandError
from hpcdem.io.agreed import atomic_path, on_first
from hpcdem.io.files import write_sections

FIGURES = (".png", ".pdf", ".svg")


def create(project: Project, name: str, title: str = "", x_label: str = "", y_label: str = "") -> None:
    """An empty diagram; one of this name is replaced."""
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
) -> None:
    """One more curve: history y against history x (or time), or points."""
    chart = _chart(project, name)
    for history in filter(None, (x, y)):
        find(project, history)
    chart.curves.append(Curve(label or y or "points", x, y, scale_x, scale_y, list(values), style))


def figure_name(path: str) -> None:
    """CommandError if figures are not written to files of this kind."""
    if Path(path).suffix.lower() not in FIGURES:
        raise CommandError(f"'{path}': a figure is a file *.png, *.pdf or *.svg")


def export(project: Project, name: str, path: str, cracks: bool = False, plastic: bool = False) -> None:
    """Write the diagram as a figure into the folder of the results, and its curves as CSV beside it: curve, x, y, one
    row per point. cracks, plastic: the figure also shows the model at this moment, with the one or the other.
    Collective."""
    from hpcdem.post.charts import draw

    chart, figure = _chart(project, name), project.result(path)
    figure_name(path)
    if cracks and plastic:
        raise CommandError("cracks and plastic: beside a diagram there is room for one of them")
    curves = [(curve.label, curve.style, _points(project, curve)) for curve in chart.curves]
    if not any(points for _, _, points in curves):
        raise CommandError(f"chart '{name}' has no points yet")
    rows = [f"{histories._quoted(label)},{x!r},{y!r}" for label, _, points in curves for x, y in points]
    titles = [histories._quoted(text) for text in (chart.x_label or "x", chart.y_label or "y")]
    text = "\n".join([",".join(["curve", *titles]), *rows]) + "\n"
    for file in (figure, figure.with_suffix(".csv")):
        project.to_write(file)
    project.folder()
    write_sections(figure.with_suffix(".csv"), project.comm, lambda: [text.encode()])
    if cracks or plastic:
        project.ready(use=False)
    model = frames.whole(project) if cracks or plastic else None

    def picture() -> None:
        with atomic_path(figure) as temporary:
            draw(Path(temporary), figure.suffix[1:].lower(), chart.title, _x_label(project, chart),
                 _y_label(project, chart), curves, model, plastic)  # fmt: skip

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
    return f"{name}: {history.value.replace('_', ' ')} [{history.unit}]"


def _chart(project: Project, name: str) -> Chart:
    if name not in project.charts:
        known = ", ".join(f"'{other}'" for other in project.charts) or "none so far"
        raise CommandError(f"there is no chart '{name}'; there is {known}")
    return project.charts[name]
