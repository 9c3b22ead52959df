"""Assumptions that a paper on a crank-rocker leaves open: gravity, pins, friction speeds, modes, damping of the rocker.

`buckler.studies.kit.published` has the paper's numbers. The joints are O crank-frame, A crank-coupler, B coupler-rocker, C
rocker-frame. Each assumption is a parameter of the studies; the study `buffering` varies all of them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.modal import AdamsDamping

from ..kit.parameters import Gravity, choice, choices, quantity

JOINTS = "OABC"
"""Points of the joints, in the order of the mechanism."""
BODIES = {"O": ("ground", "crank"), "A": ("crank", "coupler"), "B": ("coupler", "rocker"), "C": ("ground", "rocker")}
"""Bodies of each joint: by default the first carries the pin, the second the bush."""
PINS = tuple(f"{joint}.{body}" for joint in JOINTS for body in BODIES[joint])
"""Values of `pin_on`, as O.crank: the crank carries the pin of joint O."""
FIRST = PINS[::2]
"""Default of `pin_on`."""


def rayleigh(hertz: Array, ratio: float) -> Array:
    """Compute the damping ratios of Rayleigh damping, `ratio` at the lowest two frequencies: ratio (f1 f2/f + f)/(f1 + f2)."""
    rising = np.sort(hertz)
    low, high = rising[0], rising[min(1, len(rising) - 1)]  # f1 and f2, equal for a single frequency
    return ratio * (low * high / hertz + hertz) / (low + high)


DAMPINGS: dict[str, Callable[[Array, float], Array]] = {
    "constant": lambda hertz, ratio: np.full(len(hertz), ratio),
    "ADAMS": lambda hertz, _: AdamsDamping().ratios(hertz),
    "Rayleigh": rayleigh,
}
"""Damping ratios of modes as functions of their frequencies [Hz] and of a ratio, which the default of ADAMS ignores."""
KINDS = ("free", "Euler-Bernoulli", "Craig-Bampton")
"""Kinds of modes. "free" and "Euler-Bernoulli" are both of the free rocker: "free" means Timoshenko's beam theory, the other
Euler and Bernoulli's. "Craig-Bampton" are those of ADAMS, which add static shapes; `bending` and `axial` do not act on them."""


@dataclass(frozen=True)
class Assumptions(Gravity):
    """Assumptions about gravity, joints and flexible rocker; the last text of a parameter is its heading in the help."""

    pin_on: tuple[str, ...] = choices(FIRST, PINS, "bodies that carry the pins; other joints keep their default", "left open")
    friction_thresholds: float = quantity(
        1.0, "1", 1e-4, 100, "factor on both threshold speeds of the friction, 0.1 and 1 m/s by default", "left open"
    )
    rocker_damping: float = quantity(0.01, "1", 0, 1, "damping ratio of every mode", "bars")
    modal_damping: str = choice(
        "constant", tuple(DAMPINGS), "damping ratios of modes: constant or Rayleigh, of size rocker_damping, or ADAMS's default",
        "left open",
    )  # fmt: skip
    modes_of: str = choice("free", KINDS, "rocker's modes: free, by Timoshenko or Euler-Bernoulli, or Craig-Bampton", "left open")

    @property
    def reversed_joints(self) -> str:
        """Joints whose pin is on the second of their `BODIES`; a ValueError if `pin_on` names a joint twice."""
        joints = [name.partition(".")[0] for name in self.pin_on]
        if len(set(joints)) < len(joints):
            raise ValueError(f"pin_on = {','.join(self.pin_on)}: one body a joint")
        return "".join(joint for joint in JOINTS if f"{joint}.{BODIES[joint][1]}" in self.pin_on)

    @property
    def thresholds(self) -> tuple[float, float]:
        """Sliding speeds [m/s] at which friction is static, and from which it is dynamic."""
        return self.friction_thresholds * 0.1, self.friction_thresholds * 1.0  # multiples of the defaults of ADAMS

    def describe(self) -> str:
        """Return the assumptions as a sentence for a table."""
        ratio = "" if self.modal_damping == "ADAMS" else f" {self.rocker_damping:g}"
        return f"{self.describe_joints()}; modes of the rocker {self.modes_of}, damping ratio {self.modal_damping}{ratio}"

    def describe_joints(self) -> str:
        """Return the assumptions but those about the rocker as a sentence."""
        pins = ", ".join(f"{j} on {BODIES[j][1 if j in self.reversed_joints else 0]}" for j in JOINTS)
        low, high = self.thresholds
        return f"Left open by the paper: gravity {self.gravity_text}; pins: {pins}; friction thresholds {low:g} and {high:g} m/s"
