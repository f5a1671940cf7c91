"""Kernels that `hpcdem warmup -j 2` has compiled, for runs with one thread and for tests too.

A warm-up for several threads compiles what runs with one thread need as well, into folders of its own (see
hpcdem/runtime/kernels.py). Before many tests that is half of the compiling: the folders of runs with one thread, if
there are none yet, become copies. Tests that compute in their own process, and their helpers, look where numba looks if
nobody says anything: beside the sources.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

from numba.core.caching import _CacheLocator

import hpcdem
from hpcdem.session import KINDS

FOLDER = """
from hpcdem.runtime import kernels, launch
launch.prepare_environment({threads})
print(kernels.cache_folder()[0])
"""


def folder(threads: int) -> Path:
    """The folder of kernels of particles, for runs with this many threads: asked in their environment."""
    done = subprocess.run([sys.executable, "-c", FOLDER.format(threads=threads)], check=True, stdout=subprocess.PIPE)
    return Path(done.stdout.decode().strip())


def main() -> None:
    """Copy what is there."""
    compiled, single = folder(2), folder(1)
    for kind in KINDS:
        source, target = (f.with_name(f"{f.name}-{kind}" if kind else f.name) for f in (compiled, single))
        for package in {path.parent for path in Path(hpcdem.__file__).parent.rglob("*.py")}:
            of_package = source / _CacheLocator.get_suitable_cache_subpath(str(package / "any.py"))
            if of_package.is_dir():
                shutil.copytree(of_package, package / "__pycache__", dirs_exist_ok=True)
        if not target.is_dir():
            building = target.with_name(f"{target.name}.building-{os.getpid()}")
            shutil.copytree(source, building)
            building.rename(target)


if __name__ == "__main__":
    main()
