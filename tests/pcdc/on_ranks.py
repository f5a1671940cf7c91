"""A program for tests on several ranks: runs the script that is its argument on the fake simulation."""

from __future__ import annotations

import sys
from pathlib import Path


def main() -> None:
    """One rank of it."""
    from hpcdem.runtime import launch, shutdown

    launch.prepare_environment(1)
    comm = launch.start_mpi()
    from tests.pcdc.fake import Bench

    folder = Path(sys.argv[1])

    def work() -> None:
        bench = Bench(folder, comm)
        bench((folder / "script.sc").read_text())
        bench.interpreter.at_the_end()

    shutdown.leave(shutdown.run_together(comm, work))


if __name__ == "__main__":
    main()
