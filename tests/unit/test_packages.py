"""What hpcdem is installed from: sdist and wheel hold the whole package, recipes need what pyproject.toml says."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
NEEDS = dict(re.fullmatch(r"([\w-]+)>=([\d.]+)", need).groups() for need in PROJECT["dependencies"])
RECIPES = {
    "conda-forge/recipe.yaml": r"^    - ([\w-]+) >=([\d.]+)$",
    "pixi/pixi.toml": r'^([\w-]+) = ">=([\d.]+)"$',
    "spack/package.py": r'"py-([\w-]+)@([\d.]+):"',
}
BESIDE = {"python", "setuptools"}
LMOD = Path("/etc/profile.d/lmod.sh")


@pytest.mark.parametrize("name", RECIPES)
def test_recipes_need_what_the_project_needs(name):
    found = {
        package.removesuffix("-base"): version
        for package, version in re.findall(RECIPES[name], (ROOT / "packaging" / name).read_text(), re.MULTILINE)
    }
    assert {package: version for package, version in found.items() if package not in BESIDE} == NEEDS


VERSIONED = [
    "conda-forge/recipe.yaml", "spack/package.py", "modules/0.2.0.lua", "easybuild/hpcdem-0.2.0-foss-2023b.eb",
    "../CITATION.cff",
]  # fmt: skip


@pytest.mark.parametrize("name", VERSIONED)
def test_recipes_are_of_this_version(name):
    assert PROJECT["version"] in (ROOT / "packaging" / name).read_text()


def test_every_recipe_is_on_the_page():
    page = (ROOT / "docs" / "packages.md").read_text()
    for path in filter(Path.is_file, (ROOT / "packaging").rglob("*")):
        assert str(path.relative_to(ROOT)) in page


def test_the_module_is_loaded_and_taken_away(tmp_path):
    """Its program is in the path then, and only then."""
    if subprocess.run(["bash", "-c", f"source {LMOD}; module --version"], capture_output=True, check=False).returncode:
        pytest.skip("no Lmod here: apt-get install lmod")
    (tmp_path / "modules" / "hpcdem").mkdir(parents=True)
    shutil.copy(ROOT / "packaging" / "modules" / f"{PROJECT['version']}.lua", tmp_path / "modules" / "hpcdem")
    program = tmp_path / "made" / "bin" / "hpcdem"
    program.parent.mkdir(parents=True)
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    lines = f"""source {LMOD}; module use {tmp_path}/modules
module load hpcdem; command -v hpcdem; echo $HPCDEM_BIN $HDF5_USE_FILE_LOCKING
module unload hpcdem; echo "[$HPCDEM_BIN]"
"""
    env = {"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), "HPCDEM_PREFIX": str(tmp_path / "made")}
    done = subprocess.run(["bash", "-c", lines], env=env, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == [str(program), f"{program.parent} FALSE", "[]"], done.stderr


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """An sdist of the sources, and the wheel that is made of it."""
    folder = tmp_path_factory.mktemp("packages")
    source = folder / "source"
    skip = shutil.ignore_patterns("__pycache__", "*.egg-info")
    shutil.copytree(ROOT / "hpcdem", source / "hpcdem", ignore=skip)
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, source)
    make = "import setuptools.build_meta as b, sys; getattr(b, sys.argv[1])(sys.argv[2])"
    env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}

    def build(what, where):
        subprocess.run([sys.executable, "-c", make, what, str(folder)], cwd=where, env=env, check=True,
                       capture_output=True, timeout=300)  # fmt: skip

    build("build_sdist", source)
    (sdist,) = folder.glob("*.tar.gz")
    shutil.unpack_archive(sdist, folder)
    build("build_wheel", folder / sdist.name.removesuffix(".tar.gz"))
    (wheel,) = folder.glob("*.whl")
    return sdist, wheel


@pytest.mark.slow
@pytest.mark.nightly
def test_the_wheel_holds_the_package(packages):
    there = {str(path.relative_to(ROOT)) for path in (ROOT / "hpcdem").rglob("*")
             if path.is_file() and "__pycache__" not in path.parts}  # fmt: skip
    with zipfile.ZipFile(packages[1]) as wheel:
        names = {name for name in wheel.namelist() if name.startswith("hpcdem/")}
    assert names == there


@pytest.mark.slow
@pytest.mark.nightly
def test_the_wheel_is_installed_into_a_fresh_environment(packages, tmp_path):
    """Its programs start there, with the numpy and MPI of this environment."""
    venv.create(tmp_path / "env", with_pip=True)
    python = tmp_path / "env" / "bin" / "python"
    env = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    subprocess.run([python, "-m", "pip", "install", "-q", "--no-deps", "--no-index", packages[1]], env=env, check=True,
                   timeout=300)  # fmt: skip
    where = next((tmp_path / "env" / "lib").glob("python*")) / "site-packages"
    others = [path for path in sys.path if path.endswith("-packages")]
    (where / "beside.pth").write_text("\n".join(others))
    for program in ("hpcdem", "zdem", "zdemss", "zdem2jpg"):
        done = subprocess.run([tmp_path / "env" / "bin" / program, "--help"], env=env, cwd=tmp_path,
                              capture_output=True, text=True, timeout=120)  # fmt: skip
        assert done.returncode == 0, done.stderr
    said = subprocess.run([python, "-c", "import hpcdem; print(hpcdem.__file__)"], env=env, cwd=tmp_path,
                          capture_output=True, text=True, check=True).stdout  # fmt: skip
    assert Path(said.strip()).is_relative_to(where)
