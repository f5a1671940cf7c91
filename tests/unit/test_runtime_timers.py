"""Stopwatches and the clock."""

from __future__ import annotations

import time

import pytest

from hpcdem.core.clock import Clock
from hpcdem.core.comm import SerialComm
from hpcdem.core.timers import Timers


class Ranks(SerialComm):
    """A communicator whose other ranks have already handed in their part."""

    def __init__(self, others: list) -> None:
        self.others = others
        self.size = 1 + len(others)

    def allgather(self, obj: object) -> list:
        return [obj, *self.others]


def spent(timers: Timers, **seconds: float) -> Timers:
    for name, s in seconds.items():
        timers(name).ns = int(s * 1e9)
        timers(name).calls = 10
    return timers


def test_a_clock_adds_up_the_steps_it_was_given():
    clock = Clock(dt=0.5)
    clock.tick()
    clock.dt = 0.25
    clock.tick()
    assert (clock.step, clock.time) == (2, 0.75)


def test_both_forms_of_a_stopwatch_measure():
    timers = Timers()
    with timers("force"):
        time.sleep(0.002)
    timers.start("force")
    time.sleep(0.002)
    timers.stop("force")
    assert timers("force").calls == 2
    assert 0.004 <= timers.seconds("force") < 2.0


def test_an_error_inside_a_stage_still_stops_the_watch():
    timers = Timers()
    with pytest.raises(ValueError), timers("force"):
        raise ValueError
    assert timers("force").calls == 1


def test_own_work_leaves_out_waiting():
    timers = spent(Timers(), force=2.0, neighbour=1.0, halo=5.0, output=7.0)
    assert timers.seconds() == pytest.approx(3.0)
    assert timers.seconds("force", "halo", "never met") == pytest.approx(7.0)


def test_ranks_are_merged_stage_by_stage():
    mine = spent(Timers(), force=3.0, halo=1.0)
    mine.count(steps=100, particles=50)
    other = ({"force": (1.0, 12), "figure": (0.5, 1)}, 9.0, 1.0, 100, 3000)
    summary = mine.merge(Ranks([other]))
    force, halo, figure = summary.stages
    assert (force.name, force.mean, force.largest, force.calls) == ("force", 2.0, 3.0, 12)
    assert (halo.mean, halo.largest) == (0.5, 1.0)
    assert (figure.name, figure.mean) == ("figure", 0.25)
    assert summary.imbalance == pytest.approx(3.0 / 2.0)
    assert (summary.steps, summary.particle_steps, summary.ranks) == (100, 8000, 2)
    assert summary.wall == 9.0


def test_a_run_without_work_is_balanced():
    assert Timers().merge(SerialComm()).imbalance == 1.0


def test_a_stage_around_others_counts_its_own_time_only():
    timers = Timers()
    with timers.around("callback"):
        with timers("force"):
            time.sleep(0.02)
        time.sleep(0.002)
    assert timers("callback").calls == timers("force").calls == 1
    assert 0.002 <= timers.seconds("callback") < 0.02 <= timers.seconds("force")


def test_timers_of_two_models_in_one_table():
    one, other = spent(Timers(), force=2.0, couple=0.5, halo=4.0), spent(Timers(), force=1.0, couple=0.25)
    both = Timers.joined({"discs": one, "blocks": other}, {"couple": "between: contact"})
    assert {name: watch.seconds for name, watch in both.watches.items()} == pytest.approx(
        {"discs: force": 2.0, "between: contact": 0.75, "discs: halo": 4.0, "blocks: force": 1.0}
    )
    assert both("between: contact").calls == 20 and both.seconds() == pytest.approx(3.75)  # waiting is no work
