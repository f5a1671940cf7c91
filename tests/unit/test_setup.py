"""What stands around the program, scripts/run, scripts/test and .ci/run: environments that are kept or made again, and
what the README tells to type."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT


def bash(text: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Lines of bash after those of scripts/lib/setup.sh, as the scripts have them."""
    lines = f"set -euo pipefail\nsource '{ROOT}/scripts/lib/setup.sh'\n{text}"
    return subprocess.run(["bash", "-c", lines], cwd=folder, capture_output=True, text=True, check=False)


def program(path: Path, text: str) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)  # it may be a link
    path.write_text(f"#!/bin/bash\n{text}\n")
    path.chmod(0o755)


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A folder with a name that shells take apart."""
    folder = tmp_path / "a tree (copy) of $HOME's"
    folder.mkdir()
    return folder


# -- is it ready? ------------------------------------------------------------------------------------------------------

FILL = 'once env wheels "$key" bash -c \'mkdir -p env/bin; ln -sfn "$(command -v bash)" env/bin/python; echo filled\''


def filled(tree: Path, key: str) -> bool:
    done = bash(f"key={key}\n{FILL}", tree)
    assert done.returncode == 0, done.stderr
    return done.stdout == "filled\n"


def test_an_environment_is_filled_once_and_again_when_what_it_depends_on_has_changed(tree):
    assert [filled(tree, key) for key in ("one", "one", "two", "two", "one")] == [True, False, True, False, True]


def test_one_whose_python_has_gone_is_filled_again(tree):
    """As when a Python was moved or taken off the machine: the stamp is there, and programs would not start."""
    assert filled(tree, "one")
    (tree / "env" / "bin" / "python").unlink()
    (tree / "env" / "bin" / "python").symlink_to("/nowhere/bin/python3")
    assert [filled(tree, "one"), filled(tree, "one")] == [True, False]


def test_what_fails_is_not_taken_for_ready(tree):
    for _ in range(2):
        done = bash("once env wheels key bash -c 'mkdir -p env/bin; echo tried; exit 3' || exit $?", tree)
        assert (done.returncode, done.stdout) == (3, "tried\n")


def test_it_depends_on_the_folder_and_on_the_version_of_python(tree, tmp_path):
    """A folder that was moved, a second clone beside it, another Python: each has an environment of its own."""
    trees = [tree, tmp_path / "beside"]
    for one in trees:
        (one / "scripts" / "lib").mkdir(parents=True)
        for name in ("pyproject.toml", "scripts/lib/setup.sh"):
            shutil.copy(ROOT / name, one / name)
    for name, version in (("old", "3.11.1"), ("new", "3.12.1")):
        program(tmp_path / name, f"echo Python {version}")
    keys = [bash(f"fingerprint '{tmp_path}/{name}' mpi", one).stdout for one in trees for name in ("old", "new")]
    assert len(set(keys)) == 4 and all(len(key) == 65 for key in keys)


# -- is it usable? -----------------------------------------------------------------------------------------------------


@pytest.fixture
def made(tree: Path) -> Path:
    """An environment of this Python, with a pip that says where it is, and a mark that goes when it is made again."""
    done = bash(f"make_venv env '{sys.executable}' --without-pip", tree)
    assert done.returncode == 0, done.stderr
    program(tree / "env" / "bin" / "pip", f"cat <<'END'\npip 24.0 from {tree}/env/lib/site-packages/pip\nEND")
    (tree / "env" / "mark").touch()
    return tree


def kept(tree: Path, python: str = sys.executable) -> bool:
    done = bash(f"make_venv env '{python}' --without-pip", tree)
    assert done.returncode == 0, done.stderr
    assert subprocess.run([tree / "env" / "bin" / "python", "-V"], check=False).returncode == 0
    return (tree / "env" / "mark").exists()


def test_a_usable_environment_is_kept(made):
    assert kept(made)


def test_one_of_a_folder_that_was_moved_is_made_again(made, tmp_path):
    assert not kept(made.rename(tmp_path / "moved"))


def test_one_of_another_python_is_made_again(made):
    program(made / "env" / "bin" / "python", "echo Python 3.10.2")
    assert not kept(made)


def test_one_without_its_python_is_made_again(made):
    (made / "env" / "bin" / "python").unlink()
    (made / "env" / "bin" / "python").symlink_to("/nowhere/bin/python3")
    assert not kept(made)


def test_one_without_pip_is_made_again(made):
    (made / "env" / "bin" / "pip").unlink()
    assert not kept(made)


# -- what the README tells to type -------------------------------------------------------------------------------------


def readme_commands(name: str) -> list[str]:
    """The two of the block that begins the README."""
    block = re.search(r"^```\n(\./scripts/.*?)```", (ROOT / name).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert block
    return [line.partition("#")[0].strip() for line in block[1].splitlines()]


@pytest.mark.parametrize("name", ["README.md", "README.zh.md"])
def test_the_readme_has_two_commands(name):
    assert readme_commands(name) == ["./scripts/run examples/push.py", "./scripts/test"]


@pytest.mark.parametrize(("first", "second", "code", "ran"), [(0, 0, 0, 3), (3, 0, 3, 1), (0, 4, 4, 3)])
def test_ci_types_them_one_after_the_other_and_fails_if_either_does(tree, first, second, code, ran):
    (tree / ".ci").mkdir()
    shutil.copy(ROOT / ".ci" / "run", tree / ".ci")
    for name, answer in (("run", first), ("test", second)):
        program(tree / "scripts" / name, f'echo "./scripts/{name}${{*:+ $*}} in $PWD"\nexit {answer}')
    done = subprocess.run([tree / ".ci" / "run"], cwd="/", capture_output=True, text=True, check=False)
    asked = [f"{line} in {tree}" for line in [*readme_commands("README.md"), "./scripts/test --nightly"]]
    told = done.stdout.splitlines()
    assert (done.returncode, told[:ran]) == (code, asked[:ran])
    if second:
        assert told[ran:] == [f"the nightly list failed (exit code {second}, see above); the two commands decide"]
    else:
        assert not told[ran:]


def test_programs_that_tests_start_are_of_this_tree(tmp_path):
    """Also where the environment was made for a second clone beside it."""
    for words in (["-m", "hpcdem"], [str(Path(sys.executable).parent / "hpcdem")]):
        said = subprocess.run(
            [sys.executable, *words, "--version"], cwd=tmp_path, capture_output=True, text=True, check=False
        )
        assert said.returncode == 0, said.stderr
    text = "import hpcdem; print(hpcdem.__file__)"
    said = subprocess.run([sys.executable, "-c", text], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert Path(said.stdout.strip()) == ROOT / "hpcdem" / "__init__.py"
    assert os.environ["PYTHONPATH"].split(os.pathsep)[0] == str(ROOT)
