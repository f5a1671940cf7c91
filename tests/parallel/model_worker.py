"""Runs models one after the other, on any number of ranks and threads, and writes what became of them.

[mpiexec -n R] python model_worker.py THREADS WAY FROM SAVES KIND...

Files are KIND/WAY.npz; KIND/WAY.sav, a checkpoint from the middle, if SAVES is `saves`; KIND/FROM.sav is what a run
goes on from, unless FROM is `begin`.
"""

from __future__ import annotations

import sys
import traceback
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.parallel.kinds import KINDS
from tests.parallel.model import communicator, run


def main(threads: str, way: str, source: str, saves: str, *kinds: str) -> None:
    comm = communicator()
    for kind in kinds:
        folder = Path(kind)
        try:
            found = run(
                KINDS[kind], int(threads), folder / f"{way}.sav" if saves == "saves" else None,
                None if source == "begin" else folder / f"{source}.sav",
            )  # fmt: skip
        except BaseException:
            print(f"{kind}, rank {comm.rank}:", traceback.format_exc(), sep="\n", file=sys.stderr, flush=True)
            comm.abort(1)
            raise
        if comm.rank == 0:
            np.savez(folder / f"{way}.tmp.npz", **found)
            (folder / f"{way}.tmp.npz").rename(folder / f"{way}.npz")  # whole, whatever happens to the next one


if __name__ == "__main__":
    main(*sys.argv[1:])
