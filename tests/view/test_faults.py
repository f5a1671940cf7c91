"""Faults in a view: their lines and colours, beside a frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from hpcdem.commands.dem import cycles, output, particles, properties
from hpcdem.post.view.moment import read_moment
from hpcdem.post.view.scene import CATEGORIES, PALE, default_view, rgb, scene
from hpcdem.post.view.tracks import ENDS, FIELDS, TABLE
from tests.support import model


def test_faults_are_darker_than_the_groups_below(tmp_path: Path) -> None:
    """Each has the colour of its entry in the legend, darker than the groups of discs and elements."""
    sim = model(tmp_path, 1e-4)
    for gid in range(2):
        particles.ball(sim, gid, float(gid), 0.0, 0.1)
    properties.prop(sim, density=2000.0, kn=1e6, ks=1e6)
    cycles.prepare(sim)
    output.Snapshot(sim).write_print()
    (tmp_path / "measure").mkdir()
    numbers = range(1, 13)
    rows = [f"0,0,{k},active,{','.join(str(float(k + n)) for n in range(len(ENDS) + len(FIELDS)))}" for k in numbers]
    head = ",".join(["step", "ini", "fault", "state", *ENDS, *FIELDS])
    (tmp_path / TABLE).write_text("\n".join([head, *rows]) + "\n")
    moment = read_moment(tmp_path / "all_0000000000.vtkhdf")
    view = default_view(moment)
    shown = view.model_copy(update={"layers": tuple(one.model_copy(update={"visible": True}) for one in view.layers)})
    painted = next(one for one in scene(moment, shown).layers if one.layer.object == "faults")
    assert [word for word, _ in painted.legend] == [f"fault {k}" for k in numbers]
    shades = painted.shades[painted.kind]
    assert np.allclose(shades, rgb([colour for _, colour in painted.legend]))
    assert len(np.unique(shades[:10], axis=0)) == 10
    brightness = lambda colours: colours @ (0.299, 0.587, 0.114)  # noqa: E731
    light = [colour for colour in (*CATEGORIES, *PALE) if colour != "#222255"]
    assert brightness(shades).max() < brightness(rgb(light)).min()
