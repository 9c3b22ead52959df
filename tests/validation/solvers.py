"""Exudyn against the compiled solver, which share the elements and no equation of motion, on the same mechanisms.

Both run the mechanisms of the library, published problems and random mechanisms. Their difference in any signal must stay within
three times the sum of the errors that both report; a force of the wrong sign does not.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from math import nan
from typing import Any

from exact import problems

from buckler.mbs import Beam, Cable, Clearance, Exudyn, Mechanism, Rigid, Section, Strut, simulate
from buckler.mbs.laws import AdamsFriction, CarvalhoMartins, Impact
from buckler.mbs.library import BAR, PAPER, crank_rocker, slider_crank
from buckler.studies.kit.drawn import EVERYTHING, Draw, draw
from buckler.studies.kit.published import STRIP_WIDTH

from .known import Answer, Known

ACCURACY = 1e-2
"""Accuracy asked of both solvers."""
BEYOND = 3.0
"""Difference over the sum of both reported errors, up to which an answer is right."""
CONTRADICTION = r"SOLVERS: .* are (\S+) apart in .*, allowed ([^,\s]+)"
"""Sentence of a run whose difference is larger than the sum of both reported errors, with groups for these two numbers."""


def list_ready() -> Iterator[Draw]:
    """Yield mechanisms of the library and published problems, with short durations."""
    strip = Section(STRIP_WIDTH, 2e-3).damped(0.01, PAPER.coupler)

    def play(point: str, pin: str, bush: str) -> Clearance:
        return Clearance(point, pin, bush, 5e-3, 1e-4, Impact(1e8, 1e3, 1e-4), AdamsFriction(0.3, 0.2))

    def slider(coupler: Any, speed: float = 20.0, law: Any = None) -> Mechanism:
        return slider_crank(coupler, law=law, mass=0.3, speed=speed)

    struck = slider(Strut(Section(STRIP_WIDTH, 3e-4)), 6.0, CarvalhoMartins(1e5, 0.5, exponent=1.0))
    yield Draw("slider-crank, strut, stop", struck, 0.5)
    yield Draw("slider-crank, beam", slider(Beam(strip)), 0.2)
    yield Draw("slider-crank, cable", slider(Cable(strip, imperfection=1e-3)), 0.2)
    yield Draw("crank-rocker", crank_rocker(Rigid(BAR), speed=30.0), 0.2)
    yield Draw("Andrews", problems.andrews(), 0.01)
    yield Draw("crank-rocker, clearance", crank_rocker(Rigid(BAR), speed=30.0, play=play), 0.01)
    yield Draw("crank-rocker, clearance, beam", crank_rocker(Beam(BAR), speed=30.0, play=play), 0.01)
    yield Draw("four-bars", problems.four_bars(2), 1.0)
    yield Draw("Simeon", problems.simeon(), 0.02)
    yield Draw("double pendulum", problems.double_pendulum(), 1.0)
    yield Draw("Princeton", problems.princeton(8.896), 0.05)


def compare(drawn: Draw) -> Answer:
    """Find the difference of the solvers in positions, or, where another signal differs by more than both report, in that."""
    result = simulate(drawn.mechanism, drawn.duration, ACCURACY, solver=Exudyn(), verify=True)
    if contradiction := re.search(CONTRADICTION, result.message):
        difference, reported = map(float, contradiction.groups())
        return Answer(difference, 0.0, BEYOND * reported, message=result.message)
    return Answer(result.verified, 0.0 if result.verified >= 0 else nan, 2 * ACCURACY, message=result.message)


def list_known() -> Iterator[Known]:
    """Yield the mechanisms that both solvers run."""
    for ready in list_ready():
        slow = ready.name in ("slider-crank, cable", "Simeon", "crank-rocker, clearance, beam")
        yield Known("solvers", "ready mechanisms and published problems", ready.name, partial(compare, ready), slow)
    for k in range(2 * len(EVERYTHING)):
        drawn = draw(0, k, EVERYTHING)
        yield Known("solvers", "random mechanisms of every kind", drawn.name, partial(compare, drawn), slow=True)
