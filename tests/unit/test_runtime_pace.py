"""The number of threads of a model when nobody has said it: by size, by measured cost, without a change of bits."""

from __future__ import annotations

import numpy as np
import pytest

import hpcdem
from hpcdem.core.timers import Timers
from hpcdem.runtime import pace
from hpcdem.runtime.pace import Pace


class Machine:
    """Steps of a model whose cost depends on the number of threads: cost(threads) [s]."""

    def __init__(self, monkeypatch, most, cost, particles=100_000):
        self.said, self.cost, self.particles, self.now, self.step = [], cost, particles, 0.0, 0
        self.pace, self.timers = Pace(most, self), Timers()
        monkeypatch.setattr(pace.time, "monotonic", lambda: self.now)

    def info(self, text):
        self.said.append(text)

    def run(self, seconds):
        """Lists are made every ten steps; the numbers of threads that were chosen, and the time each had."""
        until, spent = self.now + seconds, {}
        while self.now < until:
            threads = self.pace.choose(self.particles, self.timers, self.step)
            time = 10 * self.cost(threads)
            self.step += 10
            self.now += time
            self.timers("force").ns += int(1e9 * time)
            spent[threads] = spent.get(threads, 0.0) + time
        return spent


@pytest.mark.parametrize(("particles", "threads"), [(100, 1), (3999, 1), (4000, 2), (8000, 4), (10**6, 6)])
def test_the_first_number_follows_from_the_size(particles, threads):
    assert Pace(6).choose(particles, Timers(), 0) == threads


def test_threads_that_help_are_kept(monkeypatch):
    machine = Machine(monkeypatch, 4, lambda threads: 0.01 / threads, particles=2000)
    machine.run(30.0)
    assert machine.pace.now == 4 and len(machine.said) == 2
    assert machine.run(300.0)[4] > 0.97 * 300.0


def test_threads_that_cost_more_than_they_save_are_given_up_and_taken_again(monkeypatch):
    busy = [True]
    machine = Machine(monkeypatch, 2, lambda threads: 0.06 if threads == 2 and busy[0] else 0.003 * (3 - threads))
    spent = machine.run(60.0)
    assert spent[1] > 0.8 * 60.0 and machine.pace.now == 1
    assert "1 thread from here on, at 6 ms a step; 2 threads took 60 ms (-j N fixes the number)" in machine.said[0]
    busy[0] = False
    machine.run(150.0)
    assert machine.pace.now == 2


def test_numbers_that_are_as_fast_are_seldom_tried(monkeypatch):
    machine = Machine(monkeypatch, 2, lambda threads: 0.005)
    machine.run(200.0)
    spent = machine.run(600.0)
    assert machine.said == [] and spent[1] < 0.03 * 600.0


def test_states_do_not_depend_on_it(tmp_path):
    class EachTimeAnother:
        count = 0

        def choose(self, particles, timers, step):
            self.count += 1
            return 1 + self.count % 3

    states = []
    for number, chooser in enumerate((None, EachTimeAnother())):
        sim = hpcdem.Simulation(outdir=tmp_path / str(number), log=False)
        sim.engine.pace = chooser
        sim.box(0.0, 10.0, 0.0, 10.0)
        sim.gen(60, rad=[0.2, 0.3], x=(0.5, 9.5), y=(0.5, 9.5))
        sim.prop(density=2000.0, kn=1e6, ks=1e6, fric=0.5)
        sim.set(gravity=(0.0, -9.8), dt=5e-4)
        sim["vx"] = 20.0 * np.sin(np.arange(60.0))
        sim.cycle(400)
        states.append(np.stack([sim.gather(name) for name in ("x", "y", "vx", "vy", "spin")]))
    assert chooser is not None and chooser.count > 3
    assert np.array_equal(*states)
