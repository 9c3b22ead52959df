"""The crank-rocker with clearance in its joints: its mechanism, and the parameters of all studies of it.

The mechanism is that of a paper that leaves much unsaid: clearance, pins, friction speeds, the plane in which the bars
bend. Each of these is a parameter here. The unit of its largest contact damping, 253 "N×S/m", decides the physics
(`damping_unit`): in N.s/m the joints rattle; in N.s/mm, the paper's own 0.1 % of the stiffness, they stay closed.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import pi
from typing import Any

from buckler.mbs import Clearance, Mechanism, Modal, Ramp, Rigid, crank_rocker
from buckler.mbs.elements.element import Body
from buckler.mbs.laws import AdamsFriction, FrictionLaw, Impact, NormalLaw
from buckler.mbs.library import PAPER_STIFFNESS

from ..kit.parameters import choice, quantity
from ..kit.published import CONTACT_DAMPING, DAMPING_UNITS
from .assumptions import JOINTS, JointAssumptions, ModalAssumptions
from .mode_sets import rocker_modes, section, set_damping
from .turns import Runs

OF_MODES = ("modal_damping", "modes_of", "bending", "axial", "frequency_factor")
"""Parameters that only a rocker of modes has."""


def bars(
    law: NormalLaw, friction: FrictionLaw, gap: float, *, depth: float = 20e-3, pin: float = 5e-3, speed: float | Ramp = 10 * pi,
    angle: float = 0.0, rocker: Body | None = None, turned: str = "", gravity: tuple[float, float] = (0.0, 0.0),
    joints: str = JOINTS,
) -> Mechanism:  # fmt: skip
    """Make the crank-rocker with a clearance [m] in some joints, ideal ones if it is 0, and bars of a depth in the plane [m].

    Turned joints have the pin on the body that carries the bush by default.
    """

    def play(point: str, first: str, second: str) -> Clearance:
        pair = (second, first) if point in turned else (first, second)
        return Clearance(point, *pair, pin, gap, law, friction)

    body, loose = rocker or Rigid(section(depth)), joints if gap else ""
    made = crank_rocker(body, speed=speed, play=play, with_play=loose, section=section(depth), angle=angle)
    return replace(made, gravity=gravity)


@dataclass(frozen=True)
class PlayParameters(JointAssumptions):
    """The crank-rocker's bars, joints with clearance, contact and drive."""

    in_plane_depth: float = quantity(20e-3, "m", 5e-3, 20e-3, "side of the 20 mm x 5 mm bars in the plane", "bars")
    clearance: float = quantity(2.5e-4, "m", 1e-7, 2e-3, "radial clearance", "joints")
    pin: float = quantity(5e-3, "m", 1e-3, 1e-2, "radius of the pins", "joints")
    stiffness: float = quantity(PAPER_STIFFNESS, "N/m^1.5", 1e6, 1e14, "contact stiffness K", "contact")
    damping: float = quantity(CONTACT_DAMPING, "1", 0, 1e5, "largest contact damping c_max, in damping_unit", "contact")
    damping_unit: str = choice("N.s/m", tuple(DAMPING_UNITS), "how the published unit of c_max is read", "contact")
    damping_depth: float = quantity(1e-5, "m", 1e-8, 1e-3, "depth d_max at which the damping is full", "contact")
    static_friction: float = quantity(0.3, "1", 0, 2, "static Coulomb coefficient", "contact")
    dynamic_friction: float = quantity(0.1, "1", 0, 2, "dynamic Coulomb coefficient", "contact")
    stiction_speed: float = quantity(0.1, "m/s", 1e-5, 10, "sliding speed at which friction is static", "contact")
    friction_speed: float = quantity(1.0, "m/s", 2e-5, 100, "sliding speed from which friction is dynamic", "contact")
    speed: float = quantity(10 * pi, "rad/s", 0.1, 500, "speed of the crank", "drive")

    @property
    def law(self) -> Impact:
        """Contact law of the joints."""
        return Impact(self.stiffness, self.damping * DAMPING_UNITS[self.damping_unit], self.damping_depth)

    @property
    def friction(self) -> AdamsFriction:
        """Friction law of the joints."""
        return AdamsFriction(self.static_friction, self.dynamic_friction, *self.thresholds)

    @property
    def thresholds(self) -> tuple[float, float]:
        """Sliding speeds [m/s] at which friction is static, and from which it is dynamic."""
        return self.friction_thresholds * self.stiction_speed, self.friction_thresholds * self.friction_speed

    def bars(self, **changes: Any) -> Mechanism:
        """Return the crank-rocker, some arguments of `bars` changed."""
        given: dict[str, Any] = {
            "law": self.law, "friction": self.friction, "gap": self.clearance, "depth": self.in_plane_depth, "pin": self.pin,
            "speed": self.speed, "turned": self.reversed_joints, "gravity": self.pull,
        }  # fmt: skip
        return bars(**given | changes)


@dataclass(frozen=True)
class FourBarParameters(PlayParameters, Runs):
    """Parameters of studies on the compiled solver."""

    def agree(self) -> None:
        """Check parameters against each other; build the bars."""
        super().agree()
        self.bars(rocker=None)


@dataclass(frozen=True)
class RockerParameters(FourBarParameters, ModalAssumptions):
    """Parameters of studies whose rocker is rigid, or one of modes."""

    rocker: str = choice("rigid", ("rigid", "modal"), "rocker", "bars")

    def agree(self) -> None:
        """Check that a rigid rocker is given no modes."""
        plain = {each.name: each.default for each in fields(self)}
        asked = [f"{name} = {getattr(self, name)}" for name in OF_MODES if getattr(self, name) != plain[name]]
        if self.rocker == "rigid" and asked:
            raise ValueError(f"{', '.join(asked)}: only a rocker of modes can have them; choose rocker = modal")
        super().agree()

    def bars(self, **changes: Any) -> Mechanism:
        """Return the crank-rocker, some arguments of `bars` changed."""
        own = "rocker" not in changes and self.rocker == "modal"
        return super().bars(**changes, **({"rocker": flexible(self)} if own else {}))

    def describe(self) -> str:
        """Return the assumptions as a sentence for a table."""
        return super().describe() if self.rocker == "modal" else f"{JointAssumptions.describe(self)}; rocker rigid"


def flexible(p: Any, depth: float | None = None) -> Modal:
    """Make the modal rocker by a study's assumptions."""
    modes = rocker_modes(p.modes_of, depth or p.in_plane_depth, p.bending, p.axial, p.frequency_factor)
    return set_damping(modes, p.modal_damping, p.rocker_damping)
