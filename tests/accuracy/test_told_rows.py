"""Mechanisms whose errors were once told far too small, each against its own equations by another integrator, or a closed form.

Each is right within what is told, or SUSPECT. Others of that list stand elsewhere: free pendulums and blocks in
`test_told_against_true`; the strip that only rings, and the four-bar through singular poses, in `test_asked`; columns pressed
beyond their critical load in `tests/checks/test_unbuckled`; blows by functions in `tests/elements/test_breaks`; turned signs in
`test_verify`.
"""

import sys
from dataclasses import replace
from functools import cache
from itertools import count, product

import numpy as np
import pytest
import told_moved
import told_struck
from exact.problems import four_bars

from buckler.mbs import Beam, Exudyn, Spectral, simulate, slider_crank
from buckler.mbs.accuracy.compare import Functions, compare
from buckler.mbs.accuracy.deliver import Climb, deliver, plain
from buckler.mbs.accuracy.goal import Asked, Usual
from buckler.mbs.accuracy.ladder import ladder_of, suited
from buckler.mbs.elements.signal import Kind
from buckler.mbs.simulation import SOLVERS

pytest.importorskip("numba")

LOW = 0.5
"""Told over true error at least, as in `tests/validation`."""
DENSE = 20_001
NONE = np.empty(0)
TINY, FORCE = 3e-7, 2e-4
"""Relative errors below are not judged: rounding, and what is left of ringing that steps damp away; of forces, a fiftieth of what
is asked, as a graze makes far more of an error of its depth, and a blow on a strut is 7e-5 off until steps follow its ringing."""


MOVED = ("truss", "shaken", "sliding_links", "hummer", "trammel", "jerked", "kinked", "boxed", "belted")
STRUCK = ("pressing", "striking_strut", "ringing_strut", "hopping", "graze", "bounces", "stick_slip")
ROWS = {name: cache(getattr(scenes, name)) for scenes, names in ((told_moved, MOVED), (told_struck, STRUCK)) for name in names}
HOW = {"default": Usual(), "places": Asked(1e-3), "forces": Asked(1e-2, "forces")}


def delivered(mechanism, duration, goal):
    """A run with its errors."""

    def run(mechanism, duration, solver):
        return SOLVERS[type(solver)](mechanism, duration, solver, None, None)

    if isinstance(goal, Usual):
        return plain(mechanism, duration, run)
    return deliver(Climb(ladder_of(mechanism, duration, goal.asked, suited(mechanism)), run), goal)


def closes(force, t):
    """Times at which a contact closes and opens, by halving: its force begins and ends then, or its depth where that is given."""
    right = getattr(force, "depth", force)
    pushes = right(t) > 0
    k = np.flatnonzero(pushes[1:] != pushes[:-1])
    before, after, then = t[k], t[k + 1], pushes[k + 1]
    for _ in range(40 if len(k) else 0):
        middle = (before + after) / 2
        late = (right(middle) > 0) == then
        before, after = np.where(late, before, middle), np.where(late, middle, after)
    return after


def held(found, truth):
    """True and told errors of the signals that are known, and of what is read off them."""
    mine = Functions.of(found.run)
    finer = np.interp(np.arange(8 * len(mine.time) - 7) / 8, np.arange(len(mine.time)), mine.time)
    sides = [kink * (1 + side) for kink in mine.kinks for side in (-1e-8, 1e-8)]
    t, known = np.unique([*np.linspace(0, mine.time[-1], DENSE), *finer, *sides]), {}
    onsets = {name: closes(right, t) for name, right in truth.items() if mine.signals[name].kind is Kind.CONTACT}
    jumps = [time + side * t[-1] for each in onsets.values() for time in each for side in (-1e-9, 1e-9)]  # of the truth
    t = np.unique(np.clip([*t, *jumps], 0.0, t[-1]))
    t = t[np.diff(t, prepend=-1.0) > 1e-10 * t[-1]]
    for name, right in truth.items():
        touched = onsets.get(name, NONE)
        known[name] = mine.signals[name]._replace(values=np.asarray(right(t)), rate="", onsets=touched, depth=NONE)
    scales, apart = compare(mine, mine), compare(mine, Functions(t, known, mine.size, kinks=mine.kinks))
    off = {name: each.off / scales.get(name, each).scale for name, each in apart.items()}
    return {name: (each, found.errors[name]) for name, each in off.items() if name in found.errors}


SLOW = {("shaken", "forces"), ("striking_strut", "forces")}


@pytest.mark.parametrize(
    ("name", "how"), [pytest.param(*row, marks=[pytest.mark.slow] * (row in SLOW)) for row in product(ROWS, HOW)]
)
def test_right_within_what_is_told_or_suspect(name, how):
    mechanism, duration, truth = ROWS[name]()
    found = delivered(mechanism, duration, HOW[how])
    assert found.run.failure is None
    if not found.missed(HOW[how]):
        assert found.errors.until == pytest.approx(duration)  # none of them is chaotic
        for signal, (true, told) in held(found, truth).items():
            assert true <= max(told / LOW, FORCE if "force" in signal else TINY), signal


@pytest.mark.parametrize("how", ["default", "forces"])
def test_a_tight_tolerance_of_depths_does_not_stall_in_rounding(how):
    """Depths of 1e-7 m beside a link of 0.1 m, to 1e-6: steps shrank to the shortest there are, and runs ended unfinished."""
    mechanism, duration, _ = told_struck.hopping()
    assert not delivered(mechanism, duration, HOW[how]).missed(HOW[how])


def test_no_clock_decides(monkeypatch):
    """The four-bar through singular poses, on a machine on which each look at the clock takes a minute."""
    mechanism, runs = four_bars(2), []
    for slow in (False, True):
        if slow:
            ticks = count(step=60.0)
            for module in [module for name, module in sys.modules.items() if name.startswith("buckler.mbs")]:
                for clock in ("perf_counter", "process_time", "working_time"):
                    if hasattr(module, clock):
                        monkeypatch.setattr(module, clock, lambda ticks=ticks: next(ticks))
        runs.append(simulate(mechanism, 1.0, 1e-3))
    assert runs[0].work["runs"] == runs[1].work["runs"]
    assert runs[0].provenance["settings"] == runs[1].provenance["settings"]
    np.testing.assert_array_equal(runs[0]["B0.x"], runs[1]["B0.x"])


@pytest.mark.parametrize("solver", [Exudyn(), Spectral()], ids=["engine", "compiled"])
def test_the_mechanism_that_runs_is_the_one_that_was_asked_for(solver):
    """But for the elements of its strip: a density other than its own ran once, and nothing told."""
    mechanism, made = slider_crank(Beam(told_moved.ROD), law=None, mass=0.3, speed=20.0), []

    def run(mechanism, duration, solver):
        made.append(mechanism)
        return SOLVERS[type(solver)](mechanism, duration, solver, None, None)

    deliver(Climb(ladder_of(mechanism, 0.02, 1e-2, solver), run), Asked(1e-2))
    assert len(made) >= 3
    for each in made:
        links = [replace(link, body=replace(link.body, elements=None) if link.body.meshed else link.body) for link in each.links]
        assert replace(each, links=links) == mechanism
