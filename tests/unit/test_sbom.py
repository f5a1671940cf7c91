"""The bill of materials: what the lock says, each package once per line of it, with all hashes."""

from __future__ import annotations

import re
import runpy
import uuid
from pathlib import Path

ROOT = Path(__file__).parents[2]
SBOM = runpy.run_path(str(ROOT / "scripts" / "lib" / "sbom.py"))
LOCK = (ROOT / "requirements.lock").read_text()


def test_the_bill_is_the_lock() -> None:
    bill = SBOM["bill"](ROOT)
    lines = [re.match(r"([\w.-]+)==([\w.+-]+)", line) for line in LOCK.splitlines() if re.match(r"[A-Za-z]", line)]
    assert [(c["name"], c["version"]) for c in bill["components"]] == [(m[1], m[2]) for m in lines if m]
    assert sum(len(c["hashes"]) for c in bill["components"]) == LOCK.count("--hash=sha256:")
    assert all(c["hashes"] for c in bill["components"])
    assert (bill["bomFormat"], bill["specVersion"]) == ("CycloneDX", "1.5")
    references = [c["bom-ref"] for c in bill["components"]]
    assert len(references) == len(set(references)) and bill["dependencies"][0]["dependsOn"] == references
    uuid.UUID(bill["serialNumber"].removeprefix("urn:uuid:"))


def test_markers_are_kept_and_the_same_lock_gives_the_same_bill() -> None:
    text = (
        "a==1.0 ; python_full_version < '3.12' \\\n    --hash=sha256:"
        + "0" * 64
        + "\nb==2 \\\n    --hash=sha256:"
        + "1" * 64
    )
    first, second = SBOM["locked"](text)
    assert first["properties"][0]["value"] == "python_full_version < '3.12'" and "properties" not in second
    assert second["purl"] == "pkg:pypi/b@2" and second["hashes"][0]["content"] == "1" * 64
    assert SBOM["bill"](ROOT) == SBOM["bill"](ROOT)
