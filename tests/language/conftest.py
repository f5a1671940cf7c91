"""Scripts run as the program runs them, for a look at the model they leave."""

from __future__ import annotations

import io

import pytest

from hpcdem.core.comm import SerialComm
from hpcdem.lang.zdem.execute import Interpreter
from hpcdem.lang.zdem.parser import parse_text
from hpcdem.physics.dem.simulation import Simulation
from hpcdem.runtime.progress import Log


@pytest.fixture
def play(tmp_path):
    """`play("BALL ...", "CYC 1")`: the model after these lines (behind START and SET dt) and their log."""

    def run(*lines: str, begin: str = "START\nSET dt 1e-3") -> tuple[Simulation, str]:
        out = io.StringIO()
        sim = Simulation(SerialComm(), 1, tmp_path / "data", Log(0, out))
        text = "\n".join([begin, *lines]) + "\n"
        Interpreter(parse_text(text, str(tmp_path / "script.py"))).run(sim)
        return sim, out.getvalue()

    return run
