"""How fast a sweep is: what it costs beside its cases, and what a second worker is worth."""

import statistics
import time

import pytest
import sweep_toy
from sweep_toy import Parameters, toys

from buckler.studies.striking import slider_crank
from buckler.studies.sweeping.sweep import sweep


class Clock:
    """A progress that notes when each row comes."""

    def __call__(self, items, total=None, label=""):
        self.times = []
        for item in items:
            self.times.append(time.perf_counter())
            yield item

    @property
    def span(self):
        return self.times[-1] - self.times[0]


def test_store_and_engine_cost_little_beside_a_case(tmp_path):
    """Under 5 ms a case, from the first row to the last; the bar gives way on a machine that takes long to start a process."""
    begin = time.perf_counter()
    sweep(sweep_toy, toys(1), workers=1)
    start_up, clock = time.perf_counter() - begin, Clock()
    cases = [Parameters(length=i / 1000) for i in range(400)]
    rows = sweep(sweep_toy, cases, workers=1, store=tmp_path / "s.sqlite", progress=clock)
    cost = clock.span / (len(rows) - 1) - statistics.mean(row.wall_s for row in rows)
    print(f"overhead {1e3 * cost:.2f} ms a case, start-up {1e3 * start_up:.0f} ms")
    assert cost < 5e-3 * max(1.0, start_up / 0.2)


def busy():
    """Share of the time in which two workers have a case that waits at hand, once both are there."""
    clock = Clock()
    rows = sweep(sweep_toy, toys(30, pause=0.1), workers=2, progress=clock)
    return sum(row.wall_s for row in rows[10:]) / (2 * (clock.times[-1] - clock.times[9]))


def test_two_workers_are_never_idle():
    """Cases that wait need no core of their own. One case in flight at a time would be a half, whatever else the machine does."""
    assert max(busy() for _ in range(2)) > 0.75


@pytest.mark.slow
def test_two_workers_are_nearly_twice_as_fast():
    """64 equal beam cases, by the share of the time in which workers have a case at work: what a shared machine gives two
    processes more than one is not the sweep's. Medians of interleaved runs.
    """
    # one case a speed that differs in the ninth digit: equal work, different cases
    cases = [slider_crank.Parameters(models=("beam",), speed=1.25 * (1 + 1e-9 * i)) for i in range(64)]
    busy, rows = {1: [], 2: []}, {}
    for _ in range(3):
        for n in (1, 2):
            begin = time.perf_counter()
            rows[n] = sweep("slider-crank", cases, workers=n)
            busy[n].append(sum(row.wall_s for row in rows[n]) / (time.perf_counter() - begin) / n)
    assert [repr(row.metrics) for row in rows[1]] == [repr(row.metrics) for row in rows[2]]
    assert 2 * statistics.median(busy[2]) / statistics.median(busy[1]) > 1.85
