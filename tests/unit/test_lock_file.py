"""requirements.lock: exact, hashed, in step with pyproject.toml; and what happens where it does not fit."""

from __future__ import annotations

import importlib.metadata
import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

from tests.conftest import ROOT

LOCK = ROOT / "requirements.lock"
ENTRY = re.compile(r"^(?P<pin>[^#\s\\][^\\\n]*?)(?P<hashes>( \\\n    --hash=sha256:[0-9a-f]{64})+)$", re.MULTILINE)
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def pins() -> dict[str, list[Requirement]]:
    """The entries of each package: several where versions differ with Python or processor."""
    found: dict[str, list[Requirement]] = {}
    for entry in ENTRY.finditer(LOCK.read_text(encoding="utf-8")):
        pin = Requirement(entry["pin"])
        found.setdefault(canonicalize_name(pin.name), []).append(pin)
    return found


def version_of(pin: Requirement) -> Version:
    (specifier,) = pin.specifier
    assert specifier.operator == "==" and "*" not in specifier.version, pin
    return Version(specifier.version)


def here(pins_of_one: list[Requirement]) -> list[Requirement]:
    return [pin for pin in pins_of_one if pin.marker is None or pin.marker.evaluate()]


def wanted() -> Iterator[Requirement]:
    extras = PROJECT["optional-dependencies"]
    for line in PROJECT["dependencies"] + extras["mpi"] + extras["setup"]:
        yield Requirement(line)


def test_every_line_is_an_exact_version_with_hashes():
    text = LOCK.read_text(encoding="utf-8")
    rest = [line for line in ENTRY.sub("", text).splitlines() if line.strip() and not line.startswith("#")]
    assert rest == [] and len(pins()) > 15
    for entries in pins().values():
        for pin in entries:
            version_of(pin)
            assert pin.url is None and not pin.extras


def test_it_names_no_host():
    text = LOCK.read_text(encoding="utf-8")
    assert "://" not in text and "--index" not in text and "--find-links" not in text and "@" not in text
    assert "scripts/lock" in text.splitlines()[1], "says how it was made"


def test_it_agrees_with_pyproject():
    """Whatever hpcdem asks for is there, in versions it allows, for every Python and processor."""
    locked = pins()
    for requirement in wanted():
        name = canonicalize_name(requirement.name)
        assert name in locked, f"{requirement} is not in the lock: run scripts/lock"
        for pin in locked[name]:
            assert requirement.specifier.contains(version_of(pin)), (
                f"{pin} does not suit {requirement}: run scripts/lock"
            )


def test_each_package_has_one_version_here():
    for name, entries in pins().items():
        assert len(here(entries)) <= 1, name
    for requirement in wanted():
        assert len(here(pins()[canonicalize_name(requirement.name)])) == 1


def test_it_is_complete():
    """What the locked packages need of each other is in it too, as far as they are installed here in those versions."""
    locked, looked = pins(), 0
    for name, entries in locked.items():
        for pin in here(entries):
            try:
                installed = importlib.metadata.distribution(name)
            except importlib.metadata.PackageNotFoundError:
                continue
            if Version(installed.version) != version_of(pin):
                continue
            looked += 1
            for line in installed.requires or []:
                need = Requirement(line)
                if need.marker is None or need.marker.evaluate({"extra": ""}):
                    (found,) = here(locked[canonicalize_name(need.name)])
                    assert need.specifier.contains(version_of(found), prereleases=True), f"{name} needs {need}"
    if not looked:
        pytest.skip("none of the locked versions is installed here")


# -- scripts/lib/setup.sh --------------------------------------------------------------------------------------------


def install_locked(tmp_path: Path, pip: str) -> tuple[subprocess.CompletedProcess[str], str]:
    """The function of that name with a pip of our own, which notes what it is asked."""
    (tmp_path / "venv" / "bin").mkdir(parents=True)
    for name, text in (
        ("pip", f'#!/bin/bash\necho "$*" >>{tmp_path}/asked\n{pip}'),
        ("python", "#!/bin/bash\necho Python 3.99"),
    ):
        (tmp_path / "venv" / "bin" / name).write_text(text)
        (tmp_path / "venv" / "bin" / name).chmod(0o755)
    command = f"set -euo pipefail; source scripts/lib/setup.sh; install_locked {tmp_path}/venv && echo done || echo not"
    done = subprocess.run(["bash", "-c", command], cwd=ROOT, capture_output=True, text=True, check=False)
    return done, (tmp_path / "asked").read_text()


def test_hashes_are_asked_for(tmp_path):
    done, asked = install_locked(tmp_path, "exit 0")
    assert done.returncode == 0 and done.stderr == "" and done.stdout.endswith("done\n")
    assert asked.count("--require-hashes") == asked.count("--requirement ") == 2 and asked.count("--editable .") == 1


def test_each_package_of_the_lock_is_asked_for_once(tmp_path):
    done, asked = install_locked(tmp_path, f'for last; do :; done; cat "$last" >>{tmp_path}/parts || true')
    assert done.stdout.endswith("done\n") and asked.count("install") == 3
    both = (tmp_path / "parts").read_text()
    entries = ENTRY.findall(LOCK.read_text(encoding="utf-8"))
    assert sorted(ENTRY.findall(both)) == sorted(entry for entry in entries if not entry[0].startswith("uv==")) != []


@pytest.mark.parametrize("said", ["ERROR: No matching distribution found for numba==0.68.1", ""])
def test_where_the_lock_does_not_fit_the_ranges_are_taken(tmp_path, said):
    done, _ = install_locked(tmp_path, f'echo "{said}" >&2; exit 1')
    assert done.returncode == 0 and done.stdout == "not\n"
    assert said in done.stderr and "Python 3.99" in done.stderr and "pyproject.toml" in done.stderr


UV = """
mkdir -p {0}/bin
printf '#!/bin/bash\necho "$*" >>{0}/asked; for last; do :; done; cat "$last" >>{0}/parts 2>/dev/null || true\n{1}' \
    >{0}/bin/python
chmod +x {0}/bin/python
source scripts/lib/setup.sh
get_uv() {{ mkdir -p "$1/uv/bin" && cp {0}/bin/python "$1/uv/bin/uv"; }}
make_venv() {{ echo "venv ${{*:3}}"; }}
install_locked() {{ echo "pip"; }}
compile_modules() {{ echo "compiled"; }}
cd {0}; cp $OLDPWD/requirements.lock .
fill_from_wheels venv {0}/bin/python mpi
"""
"""What fills an environment, with an installer of our own that notes what it is asked."""


@pytest.mark.parametrize(("code", "steps"), [("exit 0", ["venv --without-pip", "compiled"]), ("exit 1", ["pip"])])
def test_the_quick_installer_takes_the_lock_or_leaves_it_to_pip(tmp_path, code, steps):
    done = subprocess.run(
        ["bash", "-c", UV.format(tmp_path, code)], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert [line for line in steps if line not in done.stdout.splitlines()] == [], done.stdout + done.stderr
    assert ("pip" in done.stdout.splitlines()) == (code == "exit 1")
    asked = (tmp_path / "asked").read_text()
    assert asked.count("--require-hashes --only-binary :all:") == 1
    locked = ENTRY.findall(LOCK.read_text(encoding="utf-8"))
    got = ENTRY.findall((tmp_path / "parts").read_text())
    assert sorted(got) == sorted(entry for entry in locked if not entry[0].startswith("uv==")) != []


def test_the_quick_installer_is_of_the_lock(tmp_path):
    command = f"source scripts/lib/setup.sh; lock_of_uv {tmp_path}/lock"
    subprocess.run(["bash", "-c", command], cwd=ROOT, check=True)
    ((pin, hashes, _),) = ENTRY.findall((tmp_path / "lock").read_text())
    assert pin.startswith("uv==") and hashes.count("sha256") > 5


def test_another_lock_is_another_environment():
    """scripts/run fills its environment again when the lock has changed."""
    text = (ROOT / "scripts" / "lib" / "setup.sh").read_text()
    assert re.search(r'once "\$1" "wheels-\$2" "\$\(fingerprint [^\n]*<requirements\.lock', text)


# -- scripts/audit -----------------------------------------------------------------------------------------------------


def audit(tmp_path: Path, *answers: dict | str) -> subprocess.CompletedProcess[str]:
    """scripts/lib/audit.py with a pip-audit that gives one answer after the other: JSON, or words of despair."""
    program = tmp_path / "pip-audit"
    lines = [f'case "$*" in *{name}*) service={k};; esac' for k, name in enumerate(("pypi", "osv"))]
    for k, answer in enumerate(answers):
        (tmp_path / f"answer{k}").write_text(answer if isinstance(answer, str) else json.dumps(answer))
    program.write_text(
        "#!/bin/bash\n" + "\n".join(lines) + f"\nfile={tmp_path}/answer$service\n"
        'if [[ $(head -c 1 "$file") == "{" ]]; then cat "$file"; exit; fi\ncat "$file" >&2; exit 1\n'
    )
    program.chmod(0o755)
    command = [sys.executable, ROOT / "scripts" / "lib" / "audit.py", program, LOCK]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)


GOOD = {"name": "numpy", "version": "2.4.6", "vulns": []}
WEAK = {"name": "pillow", "version": "9.0", "vulns": [{"id": "PYSEC-2022-10", "fix_versions": ["9.0.1"]}]}
UNKNOWN = {"name": "mpich", "skip_reason": "not known there"}
DOWN = "ERROR:pip_audit._cli:Could not connect: Connection refused"


@pytest.mark.parametrize(
    ("answers", "code", "said"),
    [
        (({"dependencies": [GOOD, UNKNOWN]},), 0, "nothing is known against the 1 packages"),
        (({"dependencies": [GOOD, WEAK]},), 1, "pillow 9.0: PYSEC-2022-10, mended in 9.0.1"),
        ((DOWN, {"dependencies": [WEAK]}), 1, "PYSEC-2022-10"),
        ((DOWN, {"dependencies": [GOOD]}), 0, "nothing is known"),
        ((DOWN, DOWN), 0, "no advisory service could be asked"),
        (({"dependencies": [UNKNOWN]}, DOWN), 0, "no advisory service could be asked"),
        (("", ""), 0, "no advisory service could be asked"),
    ],
)
def test_silence_is_not_taken_for_an_answer(tmp_path, answers, code, said):
    done = audit(tmp_path, *answers)
    assert (done.returncode, said in done.stdout) == (code, True), done.stdout + done.stderr


@pytest.mark.parametrize("name", ["audit", "lock"])
def test_help_asks_nobody(name):
    script = ROOT / "scripts" / name
    assert os.access(script, os.X_OK)
    done = subprocess.run([script, "--help"], capture_output=True, text=True, timeout=20, check=False)
    assert done.returncode == 0 and done.stdout.startswith("usage: scripts/") and done.stderr == ""
