"""Bill of materials of hpcdem in CycloneDX 1.5 (JSON), from requirements.lock: `python scripts/lib/sbom.py [FILE]`.

It names what `scripts/run` installs: every package with its version, the hashes of the files that may be taken, and
where it is needed. The same lock gives the same text; its serial number is made of the lock.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
import tomllib
import uuid
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
_NEED = re.compile(r"^([A-Za-z0-9_.-]+)==(\S+?)(?: ; (.*?))? ?\\?$")


def locked(text: str) -> list[dict[str, Any]]:
    """Components of a lock file, in its order."""
    found: list[dict[str, Any]] = []
    for line in text.splitlines():
        if match := _NEED.match(line):
            name, version, marker = match.groups()
            purl = f"pkg:pypi/{name.lower().replace('_', '-')}@{version}"
            found.append({"type": "library", "bom-ref": f"{purl}#{len(found)}", "name": name, "version": version,
                          "purl": purl, "hashes": []})  # fmt: skip
            if marker:
                found[-1]["properties"] = [{"name": "python:marker", "value": marker}]
        elif match := re.match(r"^ +--hash=sha256:([0-9a-f]{64})", line):
            found[-1]["hashes"].append({"alg": "SHA-256", "content": match[1]})
    return found


def bill(root: Path = ROOT) -> dict[str, Any]:
    """The whole document."""
    project = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    text = (root / "requirements.lock").read_text(encoding="utf-8")
    components = locked(text)
    own = f"pkg:pypi/{project['name']}@{project['version']}"
    serial = uuid.UUID(bytes=hashlib.sha256(f"{own}\n{text}".encode()).digest()[:16], version=4)
    return {
        "bomFormat": "CycloneDX", "specVersion": "1.5", "serialNumber": f"urn:uuid:{serial}", "version": 1,
        "metadata": {"component": {
            "type": "application", "bom-ref": own, "name": project["name"], "version": project["version"], "purl": own,
            "licenses": [{"license": {"id": "MIT"}}],
        }},
        "components": components,
        "dependencies": [{"ref": own, "dependsOn": [component["bom-ref"] for component in components]}],
    }  # fmt: skip


if __name__ == "__main__":
    content = json.dumps(bill(), indent=2) + "\n"
    if len(sys.argv) > 1:
        Path(sys.argv[1]).write_text(content, encoding="utf-8")
    else:
        sys.stdout.write(content)
