"""`.sav` files: HDF5, in the order of ids, free of ranks and threads.

Layout: attributes `format`, `version`, `state` (JSON: everything that is not a table) on the root; one group per table,
one dataset per column. The root attribute `sums` (JSON) holds the 64-bit words of each dataset added up modulo 2^64,
and `crc` the CRC-32 of `state` and `sums`; they are compared after writing, before the file gets its name, and again on
reading.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from hpcdem.errors import HpcdemError
from hpcdem.io.frame import Table
from hpcdem.io.h5 import reading, writing_to

FORMAT = "hpcdem checkpoint"
VERSION = 2


def word_sum(values: np.ndarray) -> int:
    """Sum of the 64-bit words of an array modulo 2^64: does not depend on the order of rows."""
    wide = np.ascontiguousarray(values)
    wide = wide.view(np.uint64) if wide.dtype.itemsize == 8 else wide.astype(np.int64).view(np.uint64)
    return int(np.add.reduce(wide.ravel(), dtype=np.uint64)) if wide.size else 0


def _crc(state: str, sums: str) -> int:
    return zlib.crc32(sums.encode("utf-8", "surrogateescape"), zlib.crc32(state.encode("utf-8", "surrogateescape")))


def write(path: str | os.PathLike, state: Mapping[str, Any], tables: Mapping[str, Table], comm: Any) -> None:
    """Collective. Writes to a temporary name, reads it back, then renames. HpcdemError on all ranks if anything
    fails."""

    def read_back(temporary: str) -> None:
        try:
            read(temporary)
        except HpcdemError as failure:
            raise HpcdemError(f"checkpoint {os.fspath(path)} could not be read back after writing: {failure}") from None

    columns = {f"{name}/{c}": values for name, table in tables.items() for c, values in table.columns.items()}
    parts = np.array([word_sum(values) for values in columns.values()], dtype=np.uint64)
    sums = dict(zip(columns, comm.sum_into(parts).tolist()))  # integers without sign go round, as they should
    with writing_to(path, comm, read_back) as writer:
        for table_name, table in tables.items():
            writer.group(table_name)
            for name, values in table.columns.items():
                writer.slabs(f"{table_name}/{name}", values, table.offset, table.total)
        texts = {"state": json.dumps(state), "sums": json.dumps(sums)}
        writer.group("/", {"format": FORMAT, "version": VERSION, **texts, "crc": _crc(**texts)})


def read(path: str | os.PathLike) -> tuple[dict[str, Any], dict[str, dict[str, np.ndarray]]]:
    """State and tables of a checkpoint, on this process alone. HpcdemError says what is wrong with the file."""
    with reading(path) as file:
        try:
            if file.attrs.get("format") != FORMAT:
                raise HpcdemError(f"{os.fspath(path)} is not an hpcdem checkpoint")
            version = int(file.attrs["version"])
            if version > VERSION:
                raise HpcdemError(
                    f"{os.fspath(path)} has checkpoint version {version}, this program reads up to {VERSION}"
                )
            texts = {name: str(file.attrs[name]) for name in ("state", "sums")}
            if version > 1 and int(file.attrs["crc"]) != _crc(**texts):
                raise HpcdemError(f"{os.fspath(path)} is damaged: checksum of its state is wrong")
            state, sums = json.loads(texts["state"]), json.loads(texts["sums"])
            tables: dict[str, dict[str, np.ndarray]] = {}
            for full, expected in sums.items():
                table, name = full.split("/")
                values = file[full][...]
                if word_sum(values) != expected:
                    raise HpcdemError(f"{os.fspath(path)} is damaged: checksum of {full} is wrong")
                tables.setdefault(table, {})[name] = values
        except (AttributeError, KeyError, OSError, TypeError, ValueError, RuntimeError) as problem:
            raise HpcdemError(f"{os.fspath(path)} is damaged: {problem}") from None
    return state, tables
