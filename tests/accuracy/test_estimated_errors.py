"""Estimated errors against true ones: mechanisms with their own equations by another integrator, or a closed form.

Each is right within what is estimated, or its run says that it is not.
"""

from functools import cache
from itertools import product

import moved
import numpy as np
import pytest
import struck
import swung

from buckler.mbs import Spectral
from buckler.mbs.accuracy.demand import Asked, Usual
from buckler.mbs.accuracy.difference import Difference
from buckler.mbs.accuracy.levels import LEVELS_BY_SOLVER
from buckler.mbs.accuracy.refine import refine
from buckler.mbs.accuracy.trajectory import Trajectory
from buckler.mbs.elements.signal import Kind
from buckler.mbs.functions import EdgeMemory, use_memory
from buckler.mbs.scene.scene import Scene
from buckler.mbs.simulation import SOLVERS
from buckler.mbs.solvers import Closure

pytest.importorskip("numba")

LOW = 0.5
"""Estimated over true error, at least."""
DENSE = 20_001
NONE = np.empty(0)
TINY, FORCE = 3e-7, 2e-4
"""True errors below are not judged: rounding; of forces what is left of ringing that steps damp away."""
SWUNG = ("pendulum", "braked", "piped")
MOVED = ("truss", "shaken", "sliding_links", "hummer", "trammel", "jerked", "kinked")
STRUCK = ("pressing", "striking_strut", "ringing_strut", "hopping", "graze", "bounces", "stick_slip")
CASES = {
    name: cache(getattr(scenes, name))
    for scenes, names in ((swung, SWUNG), (moved, MOVED), (struck, STRUCK)) for name in names
}  # fmt: skip
DEMANDS = {"default": Usual(), "places": Asked(1e-3), "fine": Asked(1e-4), "forces": Asked(1e-2, "forces")}


def delivered(mechanism, duration, demand, solver=None):
    """A run with its errors."""
    solver = solver or (Closure() if Scene.of(mechanism).is_kinematic else Spectral())
    levels = LEVELS_BY_SOLVER[type(solver)](mechanism, duration, solver, place_error=demand.place_error)
    with use_memory(EdgeMemory()):
        return refine(lambda *what: SOLVERS[type(solver)](*what, None, None), levels, demand)


def touches(force, t):
    """Times at which a contact closes and opens, by bisection of its force, or of its depth where that is given."""
    right = getattr(force, "depth", force)
    pushes = right(t) > 0
    k = np.flatnonzero(pushes[1:] != pushes[:-1])
    before, after, then = t[k], t[k + 1], pushes[k + 1]
    for _ in range(40 if len(k) else 0):
        middle = (before + after) / 2
        late = (right(middle) > 0) == then
        before, after = np.where(late, before, middle), np.where(late, middle, after)
    return after


def true_errors(run, truth):
    """Relative errors of the signals that are known, by signal and norm."""
    mine = Trajectory.of(run)
    finer = np.interp(np.arange(8 * len(mine.time) - 7) / 8, np.arange(len(mine.time)), mine.time)
    sides = [kink * (1 + side) for kink in mine.kinks for side in (-1e-8, 1e-8)]
    t = np.unique([*np.linspace(0, mine.time[-1], DENSE), *finer, *sides])
    events = {name: touches(right, t) for name, right in truth.items() if mine.signals[name].kind is Kind.CONTACT}
    jumps = [time + side * t[-1] for each in events.values() for time in each for side in (-1e-9, 1e-9)]  # of the truth
    t = np.unique(np.clip([*t, *jumps], 0.0, t[-1]))
    t = t[np.diff(t, prepend=-1.0) > 1e-10 * t[-1]]
    known = {
        name: mine.signals[name]._replace(
            values=np.asarray(f(t)), rate="", contact_events=events.get(name, np.empty(0)), depth=np.empty(0)
        )
        for name, f in truth.items()
    }
    apart, sizes = Difference(mine, Trajectory(t, known, mine.longest_link, mine.kinks)).norms()
    return {key: off * sizes[key] / mine.sizes.get(key, sizes[key]) for key, off in apart.items()}


SLOW = {("shaken", "forces"), ("striking_strut", "forces"), ("hummer", "forces")}


@pytest.mark.parametrize(
    ("name", "demand"), [pytest.param(*row, marks=[pytest.mark.slow] * (row in SLOW)) for row in product(CASES, DEMANDS)]
)
def test_right_within_the_estimate_or_suspect(name, demand):
    mechanism, duration, truth = CASES[name]()
    found = delivered(mechanism, duration, DEMANDS[demand])
    assert found.run.failure is None
    if not found.shortfall(DEMANDS[demand]) and not found.chaos:
        assert found.errors.until == pytest.approx(duration)
        for key, true in true_errors(found.run, truth).items():
            if key in found.errors:
                assert true <= max(found.errors[key] / LOW, FORCE if "force" in key[0] else TINY), key
