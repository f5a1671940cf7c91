"""One Slurm for all tests of this folder."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.conftest import absent, is_open_mpi, why_no_mpi
from tests.slurm.cluster import CannotStart, Cluster


@pytest.fixture(scope="session")
def slurm_or_reason() -> Iterator[Cluster | str]:
    """A running cluster, or why there is none."""
    if why_no_mpi():
        yield why_no_mpi()
        return
    # How srun tells ranks about each other has to suit the MPI library.
    cluster = Cluster("pmix" if is_open_mpi() else "pmi2")
    try:
        cluster.start()
    except CannotStart as error:
        yield str(error)
        return
    yield cluster
    cluster.stop()


@pytest.fixture
def slurm(slurm_or_reason: Cluster | str) -> Cluster:
    """The running cluster; the test is skipped without one."""
    if isinstance(slurm_or_reason, str):
        absent("slurm", slurm_or_reason)
    return slurm_or_reason
