"""What a model of any physics has: where it computes, where it writes, how far it is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from hpcdem.core.clock import Clock
from hpcdem.core.comm import Comm, SerialComm
from hpcdem.core.timers import Timers
from hpcdem.halo.ownership import Ownership


class Model:
    """comm: halo.comm; threads: per rank; outdir: where results go; log and stop: see runtime (None: silent, never
    stopped); balance_on: borders follow the load. A subclass has `clear`, which makes it empty and calls `restart`."""

    def __init__(
        self,
        comm: Comm | None = None,
        threads: int = 1,
        outdir: Path | str = "data",
        log: Any = None,
        stop: Any = None,
        balance_on: bool = True,
    ) -> None:
        self.comm = comm if comm is not None else SerialComm()
        self.threads, self.outdir = threads, Path(outdir)
        self.log, self.stop = log, stop
        self.balance_on = balance_on
        self.timers = Timers()
        self.halo: Any = None
        self.prepare_kernels: Callable[[str], object] = lambda kind: None
        """Collective: loads or compiles those of a kind, see `session.KINDS`."""

    def restart(self) -> None:
        """Back to step 0, with the first ownership."""
        self.release()
        self.clock = Clock()
        self.ownership = Ownership(self.comm, self.balance_on)
        self.rebuilds = 0

    def release(self) -> None:
        """Give back what MPI holds for this simulation. Not collective."""
        if self.halo is not None:
            self.halo.close()
        self.halo = None
