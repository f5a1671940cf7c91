"""Ask pip-audit about a lock file and tell "nothing is known" from "nobody could be asked", which it does not.

usage: audit.py PIP_AUDIT LOCKFILE
"""

from __future__ import annotations

import json
import subprocess
import sys
from typing import Any

SERVICES = ("pypi", "osv")
"""Names by which pip-audit knows the public advisory services; the second is asked where the first gives no answer."""
PATIENCE = 4
"""Seconds for one question, with which a service that cannot be reached is given up."""
WHOLE = 20
"""Seconds for all questions to one service."""


def ask(pip_audit: str, lock: str, service: str) -> tuple[dict[str, Any] | None, str]:
    """What the service says of every package, or None and why."""
    command = [
        pip_audit, "--requirement", lock, "--disable-pip", "--require-hashes", "--vulnerability-service", service,
        "--format", "json", "--progress-spinner", "off", "--timeout", str(PATIENCE),
    ]  # fmt: skip
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=WHOLE, check=False)
    except (OSError, subprocess.TimeoutExpired) as failure:
        return None, f"no answer in {WHOLE} s" if isinstance(failure, subprocess.TimeoutExpired) else str(failure)
    try:
        return json.loads(done.stdout), ""
    except ValueError:
        said = [line for line in done.stderr.splitlines() if line.strip()]
        return None, said[-1].strip() if said else f"exit code {done.returncode}"


def short(text: str, most: int = 100) -> str:
    """What a service or pip-audit gave as a reason, without its details."""
    return text if len(text) <= most else text[: most - 3] + "..."


def verdict(answer: dict[str, Any]) -> tuple[int, int, list[str]]:
    """How many packages were looked up, how many were not, and a line for each known weakness."""
    asked, skipped, known = 0, 0, []
    for package in answer.get("dependencies", []):
        if "skip_reason" in package:
            skipped += 1
            continue
        asked += 1
        for weakness in package.get("vulns", []):
            mended = ", ".join(weakness.get("fix_versions", [])) or "no version yet"
            known.append(f"{package['name']} {package['version']}: {weakness['id']}, mended in {mended}")
    return asked, skipped, known


def main(pip_audit: str, lock: str) -> int:
    """Prints one verdict; returns the exit code."""
    reasons = []
    for service in SERVICES:
        answer, reason = ask(pip_audit, lock, service)
        asked, skipped, known = verdict(answer or {})
        if not asked:
            reasons.append(f"{service}: {short(reason) or 'it knows none of the packages'}")
            continue
        if known:
            print(f"audit: weaknesses are known of versions in {lock}:", *known, sep="\n  ")
            return 1
        left = f"; {skipped} could not be looked up" if skipped else ""
        print(f"audit: nothing is known against the {asked} packages of {lock} that were looked up{left}")
        return 0
    print(f"audit: no advisory service could be asked, so {lock} was not audited", *reasons, sep="\n  ")
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
