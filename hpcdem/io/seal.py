"""A seal behind an HDF5 file: a checksum of all that describes its data.

HDF5 believes what it reads of groups, names, types and sizes: a wrong byte there can send it into an endless loop or
end the process. So the seal is checked before HDF5 reads the file. HDF5 ignores bytes after its own end.

Layout of the seal: JSON with the `length` of the HDF5 part and the places of its `rows`, [first byte, bytes] of each
dataset; then the number of bytes of that JSON (u8), the CRC-32 of the HDF5 part without rows and of the JSON (u4), and
MARK. Rows are not covered; they have checksums of their own.
"""

from __future__ import annotations

import json
import os
import struct
import zlib
from collections.abc import Iterable, Sequence
from typing import BinaryIO

MARK = b"\r\nsealed"
_END = struct.Struct("<QI8s")
_PART = 1 << 20


class Broken(Exception):
    """The file is not what was sealed."""


def put(path: str | os.PathLike, rows: Iterable[tuple[int, int]]) -> None:
    """Seal a finished file. rows: (first byte, bytes) of each dataset. OSError as for any file."""
    places = sorted([first, size] for first, size in rows if size > 0)
    with open(path, "r+b") as file:
        length = file.seek(0, os.SEEK_END)
        text = json.dumps({"length": length, "rows": places}).encode()
        crc = zlib.crc32(text, _described(file, length, places))
        file.seek(length)
        file.write(text + _END.pack(len(text), crc, MARK))


def check(path: str | os.PathLike) -> bool:
    """Return whether the file has a seal. Raises Broken if the contents do not match it, OSError as for any file."""
    with open(path, "rb") as file:
        size = file.seek(0, os.SEEK_END)
        if size < _END.size:
            return False
        file.seek(size - _END.size)
        count, crc, mark = _END.unpack(file.read(_END.size))
        if mark != MARK:
            return False
        start = size - _END.size - count
        if start < 0:
            raise Broken("its seal is broken")
        file.seek(start)
        text = file.read(count)
        try:
            about = json.loads(text)
            places = [(int(first), int(last)) for first, last in about["rows"]]
            whole = about["length"] == start and zlib.crc32(text, _described(file, start, places)) == crc
        except (ValueError, TypeError, KeyError, OverflowError):
            whole = False
        if not whole:
            raise Broken("checksum of its description is wrong")
        return True


def _described(file: BinaryIO, length: int, rows: Sequence[Sequence[int]]) -> int:
    """CRC-32 of the first `length` bytes without these rows, which are in order."""
    crc, at = 0, 0
    for first, size in [*rows, (length, 0)]:
        if not at <= first <= length:
            raise ValueError("positions that are not in order")
        file.seek(at)
        while at < first:
            part = file.read(min(_PART, first - at))
            if not part:
                raise ValueError("shorter than declared")
            crc, at = zlib.crc32(part, crc), at + len(part)
        at = first + size
    return crc
