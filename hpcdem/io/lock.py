"""A lock on a folder that ends with the process that holds it, however that ends.

The lock is the system's (flock on a file `.lock` in the folder), so a killed run, a crashed node or a full disk leaves
none behind; the file itself may stay and means nothing. Its content names the holder of the lock.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
from pathlib import Path
from typing import Any

NAME = ".lock"

_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL, errno.EROFS, errno.EACCES, errno.EPERM}
"""Errors of file systems without locks, or without write permission; nothing is protected then."""


class Taken(Exception):
    """Another process holds the lock. holder: what it wrote about itself."""

    def __init__(self, holder: dict[str, Any]) -> None:
        super().__init__("the folder is locked")
        self.holder = holder


class FolderLock:
    """A held lock. works: False where the file system has none; nothing is held then."""

    def __init__(self, folder: Path, about: dict[str, Any]) -> None:
        """Raises Taken. about: JSON values for those who come later."""
        self._path = folder / NAME
        self._handle = -1
        self.works = True
        try:
            self._handle = _locked(self._path)
            os.ftruncate(self._handle, 0)
            os.pwrite(self._handle, json.dumps(about).encode(), 0)
        except BlockingIOError:
            raise Taken(_holder(self._path)) from None
        except OSError as failure:
            if failure.errno not in _NO_LOCKS | {errno.ENOSPC, errno.EDQUOT}:
                raise
            self.works = self._handle >= 0

    @property
    def descriptors(self) -> tuple[int, ...]:
        """Return the descriptors that a child process must inherit to hold the lock until it ends; none on systems
        without locks."""
        return (self._handle,) if self._handle >= 0 else ()

    def release(self) -> None:
        """Give it back and remove the file."""
        if self._handle >= 0:
            try:
                if _same(self._handle, self._path):
                    os.unlink(self._path)
            except OSError:
                pass
            os.close(self._handle)
            self._handle = -1


def holder_of(folder: Path) -> dict[str, Any] | None:
    """Return the record of the process that holds the lock; None if the lock is free. Changes nothing."""
    try:
        handle = os.open(folder / NAME, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return _holder(folder / NAME)
    except OSError:
        pass
    finally:
        os.close(handle)
    return None


def _locked(path: Path) -> int:
    """Descriptor of the locked file. Whoever held it before may have removed the file in between: then once more."""
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o644)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _same(handle, path):
                return handle
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)


def _same(handle: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), os.stat(path))
    except FileNotFoundError:
        return False


def _holder(path: Path) -> dict[str, Any]:
    try:
        about = json.loads(path.read_text())
        return about if isinstance(about, dict) else {}
    except (OSError, ValueError):
        return {}
