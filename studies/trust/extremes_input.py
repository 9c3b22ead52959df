"""Cases of the study `extremes` that nothing can compute: wrong input, which must be refused before the run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import inf, nan
from typing import Any

from buckler.mbs import Beam, Clearance, Controlled, Equal, Exudyn, GuideFriction, Material, Rigid, Section, crank_rocker
from buckler.mbs.laws import AdamsFriction, CarvalhoMartins, Coulomb, Hertz, Impact, KelvinVoigt, NoFriction
from buckler.mbs.library import CrankRocker
from buckler.studies.trust.extremes_case import DEFAULT, Case, simulated
from buckler.studies.trust.extremes_linkages import BARS, SPEED
from buckler.studies.trust.extremes_play import Play
from buckler.studies.trust.extremes_strips import Corner

WRONG: dict[str, Callable[[], Any]] = {
    "thickness 0": lambda: Section(0.030, 0.0),
    "thickness not a number": lambda: Section(0.030, nan),
    "modulus negative": lambda: Material(-210e9, 7850.0),
    "density infinite": lambda: Material(210e9, inf),
    "no elements": lambda: Beam(BARS, elements=0),
    "stop stiffness 0": lambda: CarvalhoMartins(0.0, 0.8, exponent=1.0),
    "restitution above 1": lambda: CarvalhoMartins(7.2e4, 1.2, exponent=1.0),
    "contact damping negative": lambda: KelvinVoigt(1e7, -1.0),
    "contact damping depth 0": lambda: Impact(1e9, 1e3, 0.0),
    "friction negative": lambda: Coulomb(-0.1, 1e-3),
    "friction from 0 m/s": lambda: Coulomb(0.1, 0.0),
    "static friction below sliding": lambda: AdamsFriction(0.1, 0.3),
    "guide friction negative": lambda: GuideFriction.of_weight(-0.1, 0.3),
    "clearance 0": lambda: Clearance("A", "crank", "coupler", 5e-3, 0.0, Hertz(1e9), NoFriction()),
    "clearance negative": lambda: Clearance("A", "crank", "coupler", 5e-3, -1e-4, Hertz(1e9), NoFriction()),
    "tolerance 0": lambda: Exudyn(Controlled(tolerance=0.0)),
    "no steps": lambda: Exudyn(Equal(0)),
    "integrator undamped": lambda: Exudyn(spectral_radius=1.0),
    "speed infinite": lambda: replace(Corner(), speed=inf).mechanism("beam"),
    "bars that do not reach": lambda: crank_rocker(
        Rigid(BARS), speed=SPEED, section=BARS, lengths=CrankRocker(0.1, 0.05, 0.1, 0.5), angle=0.5
    ),
}  # fmt: skip
DURATIONS = {"duration 0": 0.0, "duration negative": -1.0, "duration not a number": nan}


def every() -> Iterator[Case]:
    """All cases of this file; nothing is right where nothing can be computed."""
    for name, make in WRONG.items():
        yield Case("wrong input", name, simulated(lambda make=make: _then(make()), 0.01, DEFAULT, lambda _: {}))  # type: ignore[misc]
    for name, duration in DURATIONS.items():
        yield Case("wrong input", name, simulated(Play().mechanism, duration, DEFAULT, lambda _: {}))


def _then(_made: Any) -> Any:
    """What was made should not have been: run something, to be found out."""
    return Play().mechanism()
