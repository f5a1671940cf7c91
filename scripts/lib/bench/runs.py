"""The measurements: our workloads alone, and beside the peers in turn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bench import bed, launch
from bench.launch import Failed, Layout
from bench.peers import PEERS
from bench.peers.base import Case
from bench.tables import Lines, Row, say
from bench.workloads import Workload, steps_for, warm_for

RATE, RATE_BESIDE = 80e6, 40e6
"""Particle-steps/s from which the number of steps follows, alone and beside peers: the same steps on any layout, so
that all layouts do the same work and end with the same digest. Beside peers fewer, as these do the same steps."""


def one(workload: Workload, sav: Path, layout: Layout, repeat: int, steps: int, **more: Any) -> Row:
    """One run of ours as a line."""
    warm = warm_for(workload.bed, steps)
    found = launch.ours(
        "run",
        layout,
        file=str(sav),
        pushed=workload.pushed,
        strays=workload.strays,
        own=workload.own,
        warm=warm,
        steps=steps,
    )
    found.pop("output")
    head = {
        "code": "hpcdem", "workload": workload.name, "ranks": layout.ranks, "threads": layout.threads,
        "cores": layout.cores, "repeat": repeat,
    }  # fmt: skip
    return head | found | more


def alone(
    chosen: list[Workload], layouts: list[Layout], repeats: int, seconds: float, lines: Lines, maker: Layout
) -> None:
    """Every workload on every layout; layouts alternate, so that a slow minute of the machine meets all of them."""
    for workload in chosen:
        sav, _ = bed.ready(workload.bed, maker)
        steps = steps_for(workload.bed, workload.pushed, seconds, RATE)
        for repeat in range(repeats):
            for layout in layouts:
                row = lines.add(one(workload, sav, layout, repeat, steps))
                say(f"{workload.name} {layout} #{repeat}: {row['particle_steps_per_s'] / 1e6:.3g} M particle-steps/s")
        digests = {r["digest"] for r in lines.rows if r["workload"] == workload.name}
        if len(digests) > 1:
            say(f"{workload.name}: layouts do not agree: {len(digests)} different ends")


def skipped(names: list[str]) -> dict[str, str]:
    """Peers that cannot be run here, and what is missing."""
    return {name: missing for name in names if (missing := PEERS[name]().missing())}


def beside(
    chosen: list[Workload],
    layouts: list[Layout],
    names: list[str],
    repeats: int,
    seconds: float,
    lines: Lines,
    maker: Layout,
) -> dict[str, str]:
    """Ours, peer, ours, peer, ... for each workload, number of cores and peer. Returns what did not work, by name."""
    absent = skipped(names)
    faults = {name: f"skipped: {why} ({PEERS[name].install})" for name, why in absent.items()}
    for workload in chosen:
        sav, npz = bed.ready(workload.bed, maker)
        for cores in sorted({layout.cores for layout in layouts}):
            case = Case.load(workload.bed, npz, workload.pushed, cores)
            here = [layout for layout in layouts if layout.cores == cores]
            for name in names:
                if name in absent or workload.bed.law not in PEERS[name].laws:
                    continue
                try:
                    _in_turn(workload, sav, case, here, name, repeats, seconds, lines)
                except Failed as error:
                    faults[f"{name}, {workload.name}, {cores} core(s)"] = str(error)
    return faults


def _in_turn(
    workload: Workload, sav: Path, case: Case, layouts: list[Layout], name: str, repeats: int, seconds: float,
    lines: Lines,
) -> None:  # fmt: skip
    peer = PEERS[name]()
    say(f"{workload.name}, {case.cores} core(s): tuning {name} ...")
    options, trials = peer.tuned(case)
    for settings, speed in trials:
        say(f"  {speed / 1e6:.3g} M: {settings}")
    settings, version = peer.describe(options), peer.version(options)
    steps = steps_for(workload.bed, workload.pushed, seconds, RATE_BESIDE)
    theirs = steps if peer.same_steps else steps_for(workload.bed, workload.pushed, seconds, peer.rate * case.cores)
    for repeat in range(repeats):
        for layout in layouts:
            row = lines.add(one(workload, sav, layout, repeat, steps, beside=name))
            say(f"{workload.name} {layout} #{repeat}: hpcdem {row['particle_steps_per_s'] / 1e6:.3g} M")
        found = peer.run(case, options, theirs)
        head = {"code": name, "workload": workload.name, "cores": case.cores, "repeat": repeat}
        result = {
            "particles": found.particles, "steps": found.steps, "wall_s": found.seconds,
            "particle_steps_per_s": found.speed, "contacts_per_particle": found.contacts_per_particle,
            "cpu_use": found.cpu_use,
        }  # fmt: skip
        lines.add(head | result | {"version": version, "settings": settings, "trials": dict(trials)})
        say(f"{workload.name} {case.cores} core(s) #{repeat}: {name} {found.speed / 1e6:.3g} M ({settings})")
