"""Vectors of nodes by their lengths: histories and numbers of the script."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.pcdc.test_plastic import run


@pytest.mark.parametrize("dim", [2, 3])
def test_histories_follow_the_length_of_a_vector(tmp_path: Path, dim: int) -> None:
    mesh, gravity, place = [
        ("(0,0) (2,1) cells 4 2", "(3,-9.81)", "(2,1)"), ("(0,0,0) (2,1,1) cells 2 2 2", "(3,4,-9.81)", "(2,1,1)")
    ][dim - 2]  # fmt: skip
    axes = "xyz"[:dim]
    text = (
        f"pcdc model new dim {dim}\npcdc mesh structured {mesh}\n"
        "pcdc element c-model mech-iso-elastic property density 2500 young 20e9 p-r 0.2\n"
        f"pcdc model gravity {gravity}\n"
    )
    names = [f"{vector}{end}" for vector in ("displacement", "velocity") for end in ("", *(f"-{a}" for a in axes))]
    text += "".join(f"pcdc history create '{n}' node value {n} nearest {place} every 5\n" for n in names)
    found = run(tmp_path, text + "pcdc model step 20\n")
    for vector, unit in (("displacement", "m"), ("velocity", "m/s")):
        table = {end: np.loadtxt(tmp_path / "data" / f"history_{vector}{end}.csv", delimiter=",", skiprows=1)[:, -1]
                 for end in ("", *(f"-{a}" for a in axes))}  # fmt: skip
        size = np.sqrt(sum(table[f"-{a}"] ** 2 for a in axes))
        np.testing.assert_allclose(table[""], size, rtol=1e-15)
        assert table[""][-1] > 0.0
        first = (tmp_path / "data" / f"history_{vector}.csv").read_text().splitlines()[0]
        assert f"{vector} [{unit}]" in first
        values = found.namespace["pcdc"].values("node", vector)
        every = [found.namespace["pcdc"].values("node", f"{vector}_{a}") for a in axes]
        np.testing.assert_array_equal(values, np.sqrt(sum(v**2 for v in every)))
