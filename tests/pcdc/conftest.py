"""A bench for each test of the language."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.pcdc.fake import Bench


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    """Runs scripts on a simulation that only notes what it is told."""
    return Bench(tmp_path)
