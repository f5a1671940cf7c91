"""Scripts with laws of the user on several ranks: they are compiled once, named again after a restart, and wrong ones
stop all. The same bits on any ranks: test_models.py."""

from __future__ import annotations

import shutil
import uuid
from pathlib import Path

import pytest

LAWS = Path(__file__).resolve().parent.parent / "blocks" / "laws"

SCRIPT = """
pcdc mesh structured (0,0) (2,1) cells 8 4 diagonal alternate
pcdc element c-model user 'rock.py:tresca' property den 2000 bulk 4e9 shear 3e9 parameter 'limit' 1e6
pcdc model option dynamic off
pcdc node boundary mech-vel-b-c velocity-y 0 range y -0.01 0.01
pcdc node boundary mech-vel-b-c velocity-y -2e-5 range y 0.99 1.01
pcdc history create 'flow' element value law-state variable 'slip' maximum every 50
pcdc model step 200
pcdc model save 'a.sav'
pcdc model step 100
pcdc history export 'flow.csv'
"""
GO_ON = """
pcdc element law 'rock.py:tresca'
pcdc model restore 'a.sav'
pcdc model step 100
pcdc history export 'flow.csv'
"""


def run(launch, folder: Path, ranks: int, name: str, text: str):
    (folder / f"{name}.sc").write_text(text)
    return launch(ranks, f"{name}.sc", "--outdir", name, "--no-figure", cwd=folder)


@pytest.mark.slow
@pytest.mark.mpi
def test_a_script_continues_with_the_law_that_it_names_and_with_no_other(launch, tmp_path):
    (tmp_path / "rock.py").write_text((LAWS / "rock.py").read_text() + f"\n# {uuid.uuid4()}\n")
    whole = run(launch, tmp_path, 2, "whole", SCRIPT)
    assert whole.returncode == 0, whole.stderr
    assert "law rock.py:tresca is compiled: " in whole.stdout + whole.stderr
    again = run(launch, tmp_path, 2, "again", GO_ON)
    assert again.returncode == 0, again.stderr
    assert "is compiled: " not in again.stdout + again.stderr  # but taken from where the first run has left it
    curves = [(tmp_path / name / "flow.csv").read_text() for name in ("whole", "again")]
    assert curves[0] == curves[1] and "law_slip [1]" in curves[0] and len(curves[0].splitlines()) > 5
    silent = run(launch, tmp_path, 2, "silent", GO_ON.replace("pcdc element law 'rock.py:tresca'", ""))
    assert silent.returncode not in (0, None)
    assert "silent.sc:3" in silent.stderr and "has elements with the law rock.py:tresca" in silent.stderr
    (tmp_path / "rock.py").write_text((LAWS / "rock.py").read_text() + "\n# changed\n")
    changed = run(launch, tmp_path, 2, "changed", GO_ON)
    assert changed.returncode != 0 and "but rock.py has changed" in changed.stderr


@pytest.mark.mpi
def test_an_error_stops_all_ranks_before_the_run(launch, tmp_path):
    text = (LAWS / "rock.py").read_text().replace("two_mu * e12, p\n", "two_nu * e12, p\n")
    (tmp_path / "rock.py").write_text(text)
    line = 1 + text[: text.index("two_nu")].count("\n")
    script = SCRIPT.replace("tresca", "elastic").replace("parameter 'limit' 1e6", "")
    found = run(launch, tmp_path, 2, "wrong", "print('it runs')\n" + script)
    assert found.returncode != 0 and "it runs" not in found.stdout
    assert (
        "wrong.sc:4: pcdc element c-model user" in found.stderr and f"rock.py:{line}: numba: NameError" in found.stderr
    )


@pytest.mark.slow
@pytest.mark.mpi
def test_resume_takes_the_law_of_the_script(launch, tmp_path):
    """The law is compiled before the checkpoint is read; with another text the run stops."""
    shutil.copy(LAWS / "rock.py", tmp_path)
    (tmp_path / "job.sc").write_text(SCRIPT.replace("pcdc model save 'a.sav'", ""))
    job = ("job.sc", "--no-figure", "--outdir")
    whole = launch(1, *job, "whole", cwd=tmp_path)
    assert whole.returncode == 0, whole.stderr
    stopped = launch(1, *job, "out", "--time-limit", "0:00:00.001", cwd=tmp_path)
    assert stopped.returncode == 85, stopped.stderr
    text = (tmp_path / "rock.py").read_text()
    (tmp_path / "rock.py").write_text(text + "\n# changed\n")
    changed = launch(1, *job, "out", "--resume", cwd=tmp_path)
    assert changed.returncode == 2 and "but rock.py has changed" in changed.stderr
    (tmp_path / "rock.py").write_text(text)
    again = launch(2, *job, "out", "--resume", cwd=tmp_path)
    assert again.returncode == 0 and "resuming from" in again.stdout, again.stderr
    curves = [(tmp_path / name / "flow.csv").read_text() for name in ("whole", "out")]
    assert curves[0] == curves[1] and len(curves[0].splitlines()) > 5
