"""`hpcdem case hydraulic-fracture` against the closed forms of kgd_solutions.py: a coarse one, and slow ones with the
parameters of docs/validation.md."""

from __future__ import annotations

import numpy as np
import pytest

from hpcdem.cases import HydraulicFracture
from hpcdem.core.errors import ScriptError
from tests.cases.ready import results

RING = {"energy": 31.25, "tensile_strength": 2e6, "viscosity": 1e-6, "time": 10.0, "reach": 5.3, "size": 0.05}
"""K_Ic = 1 MPa m^1/2, a case that other codes have run."""
THICK = {
    "regime": "viscosity", "energy": 10.0, "rate": 1e-3, "viscosity": 0.1, "confinement": 50e6, "time": 1.0,
    "reach": 1.4, "steps_at_most": 500.0,
}  # fmt: skip


@pytest.mark.mpi
def test_a_short_fracture_on_a_coarse_mesh(launch, tmp_path):
    """Three process zones long: 10 % of length, 3 % of opening, 6 % of pressure. On two ranks the same to 1e-9."""
    small = HydraulicFracture(reach=1.0, time=0.6, far=6, size=0.04)
    one, two = (results(launch, tmp_path / str(ranks), small, ranks) for ranks in (1, 2))
    print(vars(one))
    assert abs(one.length_error) < 0.1 and abs(one.opening_error) < 0.03 and abs(one.pressure_error) < 0.06
    assert one.balance < 1e-12 and one.steps > 50
    assert np.allclose(one.curve, two.curve, rtol=1e-9) and one.steps == two.steps
    for name in ("hydraulic-fracture", "injection"):
        assert (tmp_path / "1" / "data" / f"{name}.png").stat().st_size > 5000


@pytest.mark.slow
@pytest.mark.parametrize("given", [{}, RING, THICK], ids=["toughness", "K_Ic", "viscosity"])
def test_the_closed_forms(launch, tmp_path, given):
    """Length 3 %, opening 2 %, net pressure 5 %, means over the last fifth."""
    done = results(launch, tmp_path, HydraulicFracture(**given), timeout=7200.0)
    print(vars(done))
    assert abs(done.length_error) < 0.03 and abs(done.opening_error) < 0.02 and abs(done.pressure_error) < 0.05
    assert done.balance < 1e-9


def test_joints_that_would_snap_are_refused():
    with pytest.raises(ScriptError, match="snap"):
        HydraulicFracture(size=0.1)
    HydraulicFracture(size=0.1, regime="viscosity")
