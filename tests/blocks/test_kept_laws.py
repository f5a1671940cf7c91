"""Laws of the user that were compiled before: taken from the cache folder by later runs, if they are the same."""

from __future__ import annotations

import math
import os
import sys
from pathlib import Path

import numpy as np
import pytest

from hpcdem.physics.fdem import changes, diagnostics, user_laws
from hpcdem.physics.fdem.properties import MODELS
from hpcdem.physics.fdem.simulation import Blocks
from hpcdem.physics.user_files import executed, made_of
from hpcdem.runtime import kept
from tests.blocks.support import ROCK, rectangle

TEXT = """
from hpcdem import StateVariable, element_law
from numba import njit
import math

@njit
def part(e):
    return e

@element_law(state=[StateVariable("most", "1", "largest strain so far")])
def stiff(e11, e22, e12, most, bulk, shear):
    p, two_mu = (bulk - 2.0 / 3.0 * shear) * (e11 + e22), 2.0 * shear
    return p + two_mu * part(e11), p + two_mu * e22, two_mu * e12, p, max(most, math.sqrt(e22 * e22))
"""


def stresses(law: user_laws.UserLaw) -> np.ndarray:
    """Of some triangles after a step, and what they remember."""
    sim = Blocks()
    sim.take_mesh(rectangle(3, 2, 1.0, 1.0, kind="cross"))
    changes.element_model(sim, None, law.name, ROCK)
    sim.option(collision=False)
    sim.close_model()
    sim.v[:, :6] = 1e-2 * np.sin(5.0 * sim.x[:, :6])
    changes.repeat(sim, sim.v)
    for _ in range(5):
        sim.step()
    return np.stack([diagnostics.values(sim, name) for name in ("stress_xx", "stress_yy", "stress_xy", "law_most")])


@pytest.mark.slow
def test_a_law_is_compiled_once(tmp_path, monkeypatch):
    """The next run takes it from the folder, to the same bits. A file that is damaged or of somebody else is not
    taken."""
    monkeypatch.setattr(kept, "store", lambda: (tmp_path / "cache", True))
    path, told = tmp_path / "law.py", []
    path.write_text(TEXT)

    def load() -> user_laws.UserLaw:
        for name in [name for name in MODELS if name.startswith("law.py:stiff#")]:
            del MODELS[name]
        sim = Blocks()
        return user_laws.load(sim, path, "law.py:stiff")

    def computed() -> np.ndarray:
        law = load()
        found, stats = stresses(law), law.loops.triangle.one.stats
        told.append((sum(stats.cache_hits.values()), sum(stats.cache_misses.values())))
        return found

    first = computed()
    assert np.abs(first).max() > 0.0
    assert np.array_equal(computed(), first)
    assert told == [(0, 1), (1, 0)]
    (folder,) = (tmp_path / "cache").iterdir()
    files = sorted(file.name.partition("-")[0] for file in folder.iterdir())
    assert files == ["evaluate", "find", "triangle"]
    law = load()
    stresses(law)
    (signature,) = law.loops.triangle.one.overloads
    loop = next(folder.glob("triangle-*"))
    whole = loop.read_bytes()
    files_ = law.loops.triangle.one._cache
    assert files_.load_overload(signature, law.loops.triangle.one.targetctx) is not None
    if loop.stat().st_uid:  # what is root's is as safe as the system
        with monkeypatch.context() as somebody:
            somebody.setattr(kept.os, "getuid", lambda: 987654)
            assert files_.load_overload(signature, law.loops.triangle.one.targetctx) is None
    else:
        os.chown(loop, 54321, -1)
        assert files_.load_overload(signature, law.loops.triangle.one.targetctx) is None
        os.chown(loop, 0, -1)
    for damage in (whole[:-100], whole[:50] + b"?" + whole[51:], b""):
        loop.write_bytes(damage)
        assert files_.load_overload(signature, law.loops.triangle.one.targetctx) is None
    loop.write_bytes(whole)
    assert files_.load_overload(signature, law.loops.triangle.one.targetctx) is not None

    for error in (ModuleNotFoundError("No module named 'hpcdem.moved'"), AttributeError("no attribute 'MovedClass'")):

        def of_another_version(data: bytes, error: Exception = error) -> None:
            raise error

        with monkeypatch.context() as moved:
            moved.setattr(kept.pickle, "loads", of_another_version)
            assert files_.load_overload(signature, law.loops.triangle.one.targetctx) is None


def parts(tmp_path: Path, text: str) -> str | None:
    """What the function `law` of a text is made of."""
    path = str(tmp_path / "one.py")
    return made_of(executed(text, path, f"one.py:law#{abs(hash(text))}")["law"], path)


@pytest.mark.parametrize(
    "text",
    [
        "import math\ndef law(x):\n    return math.sqrt(abs(x))",
        "from math import sqrt\nA = (1, 2.5, (True, 3))\ndef law(x):\n    return sqrt(x) + A[1]",
        "import numpy as np\ndef law(x):\n    return np.pi * x",
        "def other(x, a=2.0):\n    return law(a) if x > 3.0 else 0.0\ndef law(x):\n    return other(x)",
        "def law(x):\n    def inner(y):\n        return y\n    return inner(x)",
        "def make(a):\n    def inner(x):\n        return a * x\n    return inner\nlaw = make(3.0)",
    ],
)
def test_what_can_be_kept(tmp_path, text):
    assert parts(tmp_path, text) is not None


@pytest.mark.parametrize(
    "text",
    [
        "import json\ndef law(x):\n    return json.loads(x)",
        "from tests.blocks.support import rectangle\ndef law(x):\n    return rectangle(x)",
        "import numpy as np\nA = np.array([1.0])\ndef law(x):\n    return A[0] * x",
        "A = [1.0]\ndef law(x):\n    return A[0] * x",
        "A = [1.0]\ndef other(x):\n    return A[0] * x\ndef law(x):\n    def inner(y):\n        return other(y)\n"
        "    return inner(x)",
        "def make(a):\n    def inner(x):\n        return a[0] * x\n    return inner\nlaw = make([3.0])",
        "from os.path import join\ndef law(x, f=join):\n    return x",
    ],
)  # fmt: skip
def test_what_is_of_another_file_is_not_kept(tmp_path, text):
    """Nor what can change, whose value does not tell."""
    assert parts(tmp_path, text) is None


@pytest.mark.parametrize(
    "one, other",
    [
        ("A = 1.0\ndef law(x):\n    return A * x", "A = math.nextafter(1.0, 2.0)\ndef law(x):\n    return A * x"),
        ("A = 1\ndef law(x):\n    return A * x", "A = 1.0\ndef law(x):\n    return A * x"),
        ("def make(a):\n    return lambda x: a * x\nlaw = make(3.0)",
         "def make(a):\n    return lambda x: a * x\nlaw = make(4.0)"),
        ("def other(x, a=2.0):\n    return a\ndef law(x):\n    return other(x)",
         "def other(x, a=3.0):\n    return a\ndef law(x):\n    return other(x)"),
        ("A = 1.0\ndef other(x):\n    return A\ndef law(x):\n    return other(x)",
         "A = 2.0\ndef other(x):\n    return A\ndef law(x):\n    return other(x)"),
        ("from numba import njit\n@njit\ndef law(x):\n    return x",
         "from numba import njit\n@njit(fastmath=True)\ndef law(x):\n    return x"),
    ],
)  # fmt: skip
def test_values_distinguish_functions(tmp_path, one, other):
    assert parts(tmp_path, "import math\n" + one) != parts(tmp_path, "import math\n" + other)


def test_the_module_of_a_text_is_known_by_its_name(tmp_path):
    names = executed("A = 3.0", str(tmp_path / "one.py"), "one.py:a#1")
    assert vars(sys.modules["law of one.py:a#1"]) is names and math.isclose(names["A"], 3.0)
