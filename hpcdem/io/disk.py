"""Requests to the disk, and messages when they fail."""

from __future__ import annotations

import errno
import os
import re
from contextlib import suppress

_CAUSES = {
    errno.ENOSPC: "no space left on the disk",
    errno.EDQUOT: "the disk quota is used up",
    errno.EROFS: "the file system is read-only",
    errno.EACCES: "permission denied",
    errno.EPERM: "permission denied",
    errno.ENOENT: "the folder does not exist",
    errno.ENOTDIR: "a part of the path is not a folder",
    errno.EISDIR: "a folder with this name exists",
    errno.EFBIG: "the file would exceed the allowed size",
    errno.EIO: "the disk reports an input/output error",
}


def explain(path: str | os.PathLike, error: BaseException, doing: str = "write") -> str:
    """Describe in one sentence which operation on which file failed, and why. Finds the errno in HDF5's long messages
    too."""
    number = error.errno if isinstance(error, OSError) else None
    if number is None and (found := re.search(r"errno = (\d+)", str(error))):
        number = int(found[1])
    if number in _CAUSES:
        cause = _CAUSES[number]
    elif number is not None and 0 < number < 200:
        cause = os.strerror(number)
    else:
        cause = str(error).strip() or type(error).__name__
    return f"cannot {doing} {os.fspath(path)}: {cause}"


def publish(temporary: str, path: str) -> None:
    """Give a finished file its name, once it is safe on the disk."""
    to_disk(temporary)
    os.replace(temporary, path)
    _folder_to_disk(path)


def to_disk(path: str) -> None:
    """Flush a file, so that its content survives a loss of power."""
    handle = os.open(path, os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def _folder_to_disk(path: str) -> None:
    """Make a new name durable. Not every file system supports this; the file is valid without it."""
    with suppress(OSError):
        handle = os.open(os.path.dirname(path) or ".", os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def remove(path: str) -> None:
    """Delete a file, if it is there."""
    with suppress(OSError):
        os.remove(path)
