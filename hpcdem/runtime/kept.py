"""Compiled kernels that are made of a function of the user, kept beside those of hpcdem for later runs and other ranks.

numba keeps a kernel by the place of its source, and those that are made of other kernels not at all. Here who asks says
what a kernel is made of besides hpcdem: all of that is in the name of the folder, with all that `cache_key` knows. Each
kernel is a file of its own, which gets its name when it is whole, so that any number of processes may write it at the
same time. A file that is damaged, or belongs to somebody else, is as one that is not there.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import tempfile
from pathlib import Path
from typing import Any

from hpcdem.runtime.compilers import name_kernels_apart
from hpcdem.runtime.kernels import cache_folder, tidy

_DIGEST = 32
"""Bytes of SHA-256, before what a file holds."""


def folder(*made_of: str) -> Path:
    """Of the kernels that are made of these texts by this version on this type of machine."""
    base, _ = cache_folder()
    digest = hashlib.sha256(repr(made_of).encode()).hexdigest()
    return base.with_name(f"{base.name}-user-{digest[:32]}")


def knows(place: Path, name: str) -> bool:
    """Whether a kernel of this name is kept."""
    return any(place.glob(f"{name}-*"))


def keep(kernel: Any, place: Path, name: str) -> None:
    """From now on a kernel that has not been compiled yet is taken from this folder, or goes into it."""
    name_kernels_apart()
    kernel._cache = _Files(place, name)


class _Files:
    """What a dispatcher of numba asks for as its cache."""

    def __init__(self, place: Path, name: str) -> None:
        self.cache_path, self._place, self._name = str(place), place, name

    def _path(self, signature: Any) -> Path:
        return self._place / f"{self._name}-{hashlib.sha256(str(signature).encode()).hexdigest()[:16]}"

    def load_overload(self, signature: Any, target: Any) -> Any:
        """The compiled kernel, None if it is not there."""
        from numba.core.compiler import CompileResult

        target.refresh()
        try:
            with self._path(signature).open("rb") as file:
                if hasattr(os, "getuid") and os.fstat(file.fileno()).st_uid != os.getuid():
                    return None  # what is read here is executed
                data = file.read()
        except OSError:
            return None
        if hashlib.sha256(data[_DIGEST:]).digest() != data[:_DIGEST]:
            return None
        tidy(self._place)
        return CompileResult._rebuild(target, *pickle.loads(data[_DIGEST:]))

    def save_overload(self, signature: Any, found: Any) -> None:
        """Keep it, if that can be done: a disk that is full is no reason to stop."""
        from numba.core.serialize import dumps

        if found.lifted or found.library.has_dynamic_globals:
            return
        data = dumps(found._reduce())
        with contextlib.suppress(OSError):
            self._place.mkdir(mode=0o700, parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=self._place, prefix=".")
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(hashlib.sha256(data).digest() + data)
                os.replace(name, self._path(signature))
            except OSError:
                Path(name).unlink(missing_ok=True)
                raise

    def enable(self) -> None:
        """Nothing: it is."""

    def disable(self) -> None:
        """Nothing is read or written any more."""
        self.load_overload = lambda signature, target: None  # type: ignore[method-assign]
        self.save_overload = lambda signature, found: None  # type: ignore[method-assign]

    def flush(self) -> None:
        """Forget what is kept: numba's `recompile`."""
        for path in self._place.glob(f"{self._name}-*"):
            path.unlink(missing_ok=True)
