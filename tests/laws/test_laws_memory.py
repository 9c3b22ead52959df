"""What a run leaves in memory: nothing that grows with the number of runs or of laws."""

import gc
import resource
import sys

import numpy as np
import pytest

from buckler.mbs import Clearance, Exudyn, Rigid, Section, crank_rocker, simulate
from buckler.mbs.laws import AdamsFriction, Coulomb, Impact, LuGre
from buckler.mbs.laws.contact import kernel_of as kernel

PAGE = resource.getpagesize()
pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads the process's memory from /proc")


def held():
    """Memory this process holds, MB."""
    gc.collect()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * PAGE / 1e6


def grows(run, first, last):
    """Growth over the runs after the first ones, MB a run."""
    for k in range(first):
        run(k)
    before = held()
    for k in range(first, last):
        run(k)
    return (held() - before) / (last - first)


def test_a_law_more_is_a_few_numbers_more():
    pytest.importorskip("numba")
    frictions = [AdamsFriction(0.3, 0.1), Coulomb(0.1, 1e-3), LuGre(0.3, 0.1, 0.1, 1e5, 10.0, 0.01)]
    assert grows(lambda k: kernel(Impact(8e9 + k, 253.0, 1e-5), frictions[k % 3]), 30, 1030) < 5e-3


def rattle(k):
    """A short run of a crank-rocker whose contact law no other run has."""
    law, friction = Impact(8e9 + 1e5 * k, 253.0, 1e-5), AdamsFriction(0.3, 0.1 + 1e-6 * k)

    def play(point, first, second):
        return Clearance(point, first, second, 5e-3, 2.5e-4, law, friction)

    made = crank_rocker(Rigid(Section(0.005, 0.020)), speed=10 * np.pi, play=play)
    assert simulate(made, 2e-5, solver=Exudyn()).ok


@pytest.mark.slow
def test_a_thousand_runs_with_a_thousand_laws_leave_nothing():
    pytest.importorskip("numba")
    assert grows(rattle, 50, 1050) < 0.02
