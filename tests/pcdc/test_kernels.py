"""A cache folder of kernels is complete when it gets its name: after the rehearsal no script compiles any more."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.pcdc.test_whole import SCRIPTS

SCRIPT = """
pcdc mesh structured (0,0) (9,1) cells 18 2 type quad
pcdc mesh structured (0,1) (9,2) cells 12 2
pcdc element c-model mech-iso-e property den 2000 y 1e9 p-r 0.2
pcdc model gravity (0,-10)
pcdc history create 'load' node value reaction-y sum range y 0 0
pcdc node boundary mech-m-b-c type 1 range y 0 0
pcdc element-face boundary m-s-b-c s-n -1e3 range y 2 2
pcdc model step 20
pcdc element c-model null range id 9
pcdc model option dynamic off
pcdc model solve cycles 60
pcdc output vtk 'a'
pcdc model save 'a.sav'
pcdc model restore 'a.sav'
pcdc model step 5
print(pcdc.ratio, pcdc.values('element', 'stress-yy').min())
"""


def kernels(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*.nbc")}


@pytest.mark.slow
@pytest.mark.parametrize("ranks", [1, pytest.param(2, marks=pytest.mark.mpi)])
def test_nothing_is_compiled_after_the_rehearsal(launch, tmp_path, ranks):
    env = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    done = launch(1, "warmup", "--of", "blocks", cwd=tmp_path, env=env, timeout=1200)
    assert done.returncode == 0, done.stderr
    (folder,) = (tmp_path / "cache").iterdir()
    assert folder.name.endswith("-blocks")
    before = kernels(folder)
    assert len(before) > 50
    (tmp_path / "script.sc").write_text(SCRIPT)
    for name in ("bar.sc", "loop.sc"):
        shutil.copy(SCRIPTS / name, tmp_path)
    for name in ("script.sc", "bar.sc", "loop.sc"):
        done = launch(ranks, name, "--no-figure", cwd=tmp_path, env=env, timeout=1200)
        assert done.returncode == 0, done.stderr
        assert list((tmp_path / "cache").iterdir()) == [folder]
        assert kernels(folder) - before == set(), name
