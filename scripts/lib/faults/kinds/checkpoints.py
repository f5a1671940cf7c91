"""Checkpoints that are no good when the run is to go on."""

from __future__ import annotations

import shutil
import signal
from collections.abc import Callable
from pathlib import Path

import h5py

from faults import judge
from faults.case import DONE, USAGE, Case
from faults.kind import kind


def _stopped(case: Case) -> list[Path]:
    """A run that was killed after its second checkpoint; the checkpoints, the last one last."""
    most = len(judge.in_order(case.world.reference.data)) - 1  # of those that nobody asked for, two are kept
    if not case.data.exists() or len(list(case.data.glob("*.sav"))) < min(3, most):
        job = case.start()
        number = case.rng.randint(min(3, most), min(20, most))
        case.until(lambda: len(list(case.data.glob("*.sav"))) >= number, job, 0.005)
        for pid in job.rank_pids():
            job.signal(pid, signal.SIGKILL)
        case.end(job, quiet=job.ranks > 1)
    return judge.in_order(case.data)


def _damaged(case: Case, damage: Callable[[bytearray], bytes | bytearray]) -> None:
    """One checkpoint, or the last few, are damaged; the run goes on from the last one that is whole."""
    found = _stopped(case)
    for path in found[-case.rng.choice((1, 1, 1, 2, 3)) :]:
        case.moments.append(case.reached())
        path.write_bytes(damage(bytearray(path.read_bytes())))
    _goes_on(case, found)


def _goes_on(case: Case, damaged: list[Path]) -> None:
    """What could not be taken is named; it stays as it is, and may be written again."""
    case.spoiled |= {path.name for path in damaged}
    expected = judge.newest(case.data)
    job = case.start()
    case._expected = expected
    case.end(job, {DONE})
    case.spoiled -= {path.name for path in damaged if judge.newest(case.data) is not None and _whole(path)}


def _whole(path: Path) -> bool:
    from hpcdem.core.errors import HpcdemError
    from hpcdem.io import checkpoint

    try:
        checkpoint.read(path)
    except (HpcdemError, OSError):
        return False
    return True


@kind(".sav cut", "the last checkpoints are cut at random lengths")
def cut(case: Case) -> None:
    _damaged(case, lambda data: data[: case.rng.randrange(len(data))])


@kind(".sav with a wrong bit", "one bit of the last checkpoints, anywhere in the file, is inverted")
def bit(case: Case) -> None:
    def flip(data: bytearray) -> bytearray:
        data[case.rng.randrange(len(data))] ^= 1 << case.rng.randrange(8)
        return data

    _damaged(case, flip)


@kind(".sav with a wrong byte", "one byte of the last checkpoints is changed")
def byte(case: Case) -> None:
    def change(data: bytearray) -> bytearray:
        data[case.rng.randrange(len(data))] ^= case.rng.randint(1, 255)
        return data

    _damaged(case, change)


@kind(".sav with an empty page", "4 KiB of the last checkpoints are zeros, as after the loss of a page of the disk")
def page(case: Case) -> None:
    def blank(data: bytearray) -> bytearray:
        first = case.rng.randrange(len(data) // 4096) * 4096
        data[first : first + 4096] = bytes(len(data[first : first + 4096]))
        return data

    _damaged(case, blank)


@kind(".sav emptied or foreign", "the last checkpoints are empty, random bytes, text, or another HDF5 file")
def foreign(case: Case) -> None:
    frame = next(case.world.reference.data.glob("*.vtkhdf")).read_bytes()
    texts = (b"", case.rng.randbytes(5000), b"no checkpoint at all\n" * 50, frame)
    _damaged(case, lambda data: case.rng.choice(texts))


@kind(".sav of the future", "the last checkpoint has a later format version: it is skipped")
def future(case: Case) -> None:
    found = _stopped(case)
    case.moments.append(case.reached())
    with h5py.File(found[-1], "r+") as file:
        file.attrs["version"] = 99
    _goes_on(case, found)


@kind(".sav missing", "the last checkpoints were removed: the run resumes from the one before, or from the "
      "beginning if there is none")  # fmt: skip
def missing(case: Case) -> None:
    found = _stopped(case)
    case.moments.append(case.reached())
    for path in found[-case.rng.choice((1, 2, len(found))) :]:
        path.unlink()


@kind(".sav of another script", "the folder contains a later checkpoint of another script: the program refuses it "
      "and names the line in which the scripts differ; the run resumes when that checkpoint is removed")  # fmt: skip
def another(case: Case) -> None:
    _stopped(case)
    if case.done():  # before it could be killed: nobody will look at checkpoints any more
        return
    last = judge.in_order(case.world.other.data)[-1]
    place = case.data / "9999999999.sav"
    shutil.copyfile(last, place)
    case.moments.append(case.reached())
    case.spoiled.add(place.name)
    job = case.start()
    case._expected = None
    case.end(job, {USAGE}, "must not be changed|the script was changed")
    case.refused = True
    place.unlink()
    case.spoiled.discard(place.name)
