"""Restitution delivered by every contact law in a drop test on the engine, against its exact relation or closed form.

A bush driven at constant speed strikes the pin of a bar at rest along the bar, which leaves (1 + e) times as fast. The same e
follows from chi (1 + e) = ln[(1 + chi)/(1 - chi e)], or from the law's closed form; where there is none, from the equation of
motion of one mass. docs/theory-contact.md has the laws and their sources.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from buckler import mbs
from buckler.mbs import Clearance, Drive, Guide, Link, Mechanism, Ramp, Rigid, Section, laws
from buckler.mbs.laws import Hertz, Impact, KelvinVoigt, NormalLaw, delivered
from buckler.studies.kit.published import CONTACT_DAMPING, DAMPING_UNITS

from .known import Answer, Known

HYSTERESIS = (
    "HuntCrossley", "LankaraniNikravesh", "HerbertMcWhannell", "LeeWang", "Gonthier",
    "ZhiyingQishao", "Flores", "HuGuo", "CarvalhoMartins", "ExactRestitution",
)  # fmt: skip
"""Laws F = K d^n (1 + chi(e) d'/v0), by their names in `buckler.mbs.laws`."""
LENGTH, SECTION = 0.1, Section(0.020, 0.005)
"""Bar: its length [m] and section."""
STIFFNESS, LINEAR = 8e9, 1e7
"""Contact stiffness of all laws but `KelvinVoigt` [N/m^1.5], and of that [N/m]."""
GAP, SPEED = 1e-3, 0.3
"""Radial clearance [m]; approach speed [m/s]."""


class Interpreted:
    """Contact law evaluated in Python: compiling fifty of them takes longer than their use."""

    def __init__(self, law: NormalLaw) -> None:
        self.stiffness, self.exponent, self.force = law.stiffness, law.exponent, law.force
        self.elastic, self.potential = law.elastic, law.potential


def striker(law: object, speed: float) -> Mechanism:
    """Make the bush of a guided block that reaches its speed before it meets the pin of a free bar, in a central impact."""
    return Mechanism(
        points={"P": (0.0, 0.0), "Q": (-LENGTH, 0.0), "R": (LENGTH, 0.0)},
        links=[Link("bar", "P", "Q", Rigid(SECTION)), Link("block", "P", "R", Rigid(SECTION))],
        joints=[Clearance("P", "bar", "block", pin=5e-3, gap=GAP, law=law)],
        guides=[Guide("P", "block"), Guide("R", "block")],
        drives=[Drive("P", Ramp(0.0, speed, 0.5 * GAP / speed))],
    )


def drop(law: NormalLaw, speed: float = SPEED) -> Answer:
    """Restitution of one impact; the run ends when the pin should have moved off by a tenth of the clearance."""
    exact, unit = delivered(law, SECTION.mass_per_length * LENGTH, speed), GAP / speed
    solver = mbs.Exudyn(mbs.Controlled(tolerance=1e-8, max_step=0.02 * unit))
    result = mbs.simulate(striker(Interpreted(law), speed), (1.5 + 0.1 / exact) * unit, solver=solver, ledger=True, timeout=60)
    found = float(result.signals["bar.vx"][-1] / speed - 1)
    inside = result.signals["P.penetration"][-1] > 0
    return Answer(float("nan") if inside else found, exact, 1e-3, status=str(result.status), message=result.message)


def list_known() -> Iterator[Known]:
    """List the drop tests."""
    ask = partial(Known, "restitution")
    for e in (0.1, 0.3, 0.5, 0.7, 0.9):
        for name in HYSTERESIS:
            law = getattr(laws, name)(STIFFNESS, e)
            yield ask("ten laws with hysteresis, e = 0.1 to 0.9", f"{name} {e:g}", partial(drop, law), slow=e != 0.5)
        law = KelvinVoigt.from_restitution(LINEAR, e, SECTION.mass_per_length * LENGTH)
        yield ask("Kelvin and Voigt, e = 0.1 to 0.9", f"{e:g}", partial(drop, law), slow=e != 0.5)
    yield ask("Hertz, without loss", "hertz", partial(drop, Hertz(STIFFNESS)))
    for unit, factor in DAMPING_UNITS.items():
        for speed in (0.02, 0.1, 0.5):
            law = Impact(STIFFNESS, CONTACT_DAMPING * factor, 1e-5)
            yield ask("Impact, c_max = 253 N s/m and N s/mm, 0.02 to 0.5 m/s", f"{unit} {speed:g}", partial(drop, law, speed))
