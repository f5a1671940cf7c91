"""The job of the tutorial (docs/tutorials/cluster_job.md): submitted as the page says."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.conftest import BIN
from tests.docs.pages import DOCS, blocks
from tests.docs.test_tutorials import SHORTER, shorten
from tests.slurm.cluster import Cluster

pytestmark = pytest.mark.slurm


def test_the_job_of_the_tutorial(slurm: Cluster, tmp_path: Path) -> None:
    for page in ("thrust_belt", "cluster_job"):
        for block in blocks(DOCS / "tutorials" / f"{page}.md"):
            if block.mark == "file":
                (tmp_path / block.value).write_text(block.text)
    assert shorten(tmp_path, SHORTER["thrust_belt"]) == set(SHORTER["thrust_belt"])
    number = slurm.sbatch("job.sh", cwd=tmp_path, HPCDEM_BIN=str(BIN), SLURM_MPI_TYPE=slurm.mpi)
    job = slurm.wait(number)
    log = (tmp_path / f"belt-{number}.out").read_text()
    assert job.state == "COMPLETED", log
    assert "2 ranks" in log and (tmp_path / "data" / "walls.csv").is_file()
