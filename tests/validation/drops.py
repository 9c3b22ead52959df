"""Restitution e that every contact law delivers in one impact on Exudyn, against its exact relation or closed form.

A bush, driven at constant speed along a bar at rest, strikes the bar's pin; the bar leaves (1 + e) times as fast as the bush. The
reference (`delivered`) is chi (1 + e) = ln[(1 + chi)/(1 - chi e)], the law's closed form, or, for laws that have none, the
equation of motion of one mass. docs/theory-contact.md has the laws and their sources.
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
"""Names in `buckler.mbs.laws` of laws F = K d^n (1 + chi(e) d'/v0) of depth d and approach speed v0."""
LENGTH, SECTION = 0.1, Section(0.020, 0.005)
"""Length [m] and section of the bar."""
STIFFNESS, LINEAR = 8e9, 1e7
"""Contact stiffness of all laws but `KelvinVoigt` [N/m^1.5], and of `KelvinVoigt` [N/m]."""
GAP, SPEED = 1e-3, 0.3
"""Radial clearance [m]; approach speed [m/s]."""


class Interpreted:
    """Contact law that is evaluated in Python: to compile fifty laws takes longer than to use them."""

    def __init__(self, law: NormalLaw) -> None:
        self.stiffness, self.exponent, self.force = law.stiffness, law.exponent, law.force
        self.elastic, self.potential = law.elastic, law.potential


def make_impact(law: object, speed: float) -> Mechanism:
    """Make a guided block with a bush and a free bar with a pin, for a central impact.

    The block reaches its speed [m/s] when half the clearance is left.
    """
    return Mechanism(
        points={"P": (0.0, 0.0), "Q": (-LENGTH, 0.0), "R": (LENGTH, 0.0)},
        links=[Link("bar", "P", "Q", Rigid(SECTION)), Link("block", "P", "R", Rigid(SECTION))],
        joints=[Clearance("P", "bar", "block", pin=5e-3, gap=GAP, law=law)],
        guides=[Guide("P", "block"), Guide("R", "block")],
        drives=[Drive("P", Ramp(0.0, speed, 0.5 * GAP / speed))],
    )


def strike(law: NormalLaw, speed: float = SPEED) -> Answer:
    """Measure the restitution of one impact.

    The run ends when the pin should have left the bush by a tenth of the clearance; if it has not, there is no number.
    """
    exact, crossing = delivered(law, SECTION.mass_per_length * LENGTH, speed), GAP / speed  # restitution [1]; time [s]
    solver = mbs.Exudyn(mbs.Controlled(tolerance=1e-8, max_step=0.02 * crossing))
    duration = (1.5 + 0.1 / exact) * crossing
    result = mbs.simulate(make_impact(Interpreted(law), speed), duration, solver=solver, ledger=True)
    found = float(result.signals["bar.vx"][-1] / speed - 1)
    is_in_contact = result.signals["P.penetration"][-1] > 0
    return Answer(float("nan") if is_in_contact else found, exact, 1e-3, status=str(result.status), message=result.message)


def list_known() -> Iterator[Known]:
    """Yield the impacts."""
    case = partial(Known, "restitution")
    for e in (0.1, 0.3, 0.5, 0.7, 0.9):
        for name in HYSTERESIS:
            law = getattr(laws, name)(STIFFNESS, e)
            yield case("ten laws with hysteresis, e = 0.1 to 0.9", f"{name} {e:g}", partial(strike, law), slow=e != 0.5)
        law = KelvinVoigt.from_restitution(LINEAR, e, SECTION.mass_per_length * LENGTH)
        yield case("Kelvin and Voigt, e = 0.1 to 0.9", f"{e:g}", partial(strike, law), slow=e != 0.5)
    yield case("Hertz, without loss", "hertz", partial(strike, Hertz(STIFFNESS)))
    for unit, factor in DAMPING_UNITS.items():
        for speed in (0.02, 0.1, 0.5):
            law = Impact(STIFFNESS, CONTACT_DAMPING * factor, 1e-5)
            yield case("Impact, c_max = 253 N s/m and N s/mm, 0.02 to 0.5 m/s", f"{unit} {speed:g}", partial(strike, law, speed))
