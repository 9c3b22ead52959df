"""Crank-rocker with clearance in its joints: the mechanism, the modes of its rocker, and the parameters of all its studies.

The joints are O crank-frame, A crank-coupler, B coupler-rocker, C rocker-frame. `kit.published` has the paper's numbers. It does
not give gravity, clearance, pins, friction speeds, modes, damping and the plane in which the bars bend: each is a parameter, and
the study `buffering` varies all of them. The largest contact damping c_max is printed as 253 "N×S/m". Its unit decides the
physics (`damping_unit`): in N.s/m the joints rattle, in N.s/mm they stay closed. The paper recommends for c_max 0.1 % of the
stiffness K. Its numbers are then those of c_max in N.s/mm and of K in N/mm^1.5.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Clearance, Mechanism, Modal, Rigid, Section, crank_rocker
from buckler.mbs.elements.element import Body
from buckler.mbs.geometry import Array
from buckler.mbs.laws import AdamsFriction, Impact
from buckler.mbs.library import BAR, JOINT_STIFFNESS, STEEL_CRANK_ROCKER
from buckler.mbs.modal import AdamsDamping, BarModes, Box, CraigBampton, FreeModes, ReducedModel, reduced

from ..kit.parameters import Gravity, choice, choices, integer, quantity
from ..kit.published import CONTACT_DAMPING, DAMPING_UNITS, STEEL
from .turns import JOINTS, Runs

BODIES = {"O": ("ground", "crank"), "A": ("crank", "coupler"), "B": ("coupler", "rocker"), "C": ("ground", "rocker")}
"""Bodies of each joint: by default the first carries the pin, the second the bush."""
PINS = tuple(f"{joint}.{body}" for joint in JOINTS for body in BODIES[joint])
"""Values of `pin_on`, as O.crank: the crank carries the pin of joint O."""
LENGTH = STEEL_CRANK_ROCKER.rocker
"""Length of the rocker [m]."""
MESH = Box((24, 2, 1))
"""Mesh of the solid rocker: elements along its length, its depth in the plane, and its width."""
BENDING = "in-plane bending"
"""Name of the modes that bend the bar in the plane."""
AXIAL = "axial"
"""Name of the modes along the bar."""


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


class ModeSet(NamedTuple):
    """Set of modes of the solid rocker: its label, and its modes in the plane by their numbers, or other modes."""

    label: str
    bending: Sequence[int] = ()
    axial: Sequence[int] = ()
    others: FreeModes | CraigBampton | None = None


SETS = {
    "none": ModeSet("none: rigid"),
    "bending_1": ModeSet("bending 1", [1]),
    "bending_1_2": ModeSet("bending 1–2", [1, 2]),
    "bending_1_3": ModeSet("bending 1–3", [1, 2, 3]),
    "axial_1": ModeSet("axial 1", axial=[1]),
    "bending_1_3_axial_1": ModeSet("bending 1–3, axial 1", [1, 2, 3], [1]),
    "bending_1_6_axial_1_3": ModeSet("bending 1–6, axial 1–3", range(1, 7), range(1, 4)),
    "bending_1_8_axial_1_4": ModeSet("bending 1–8, axial 1–4", range(1, 9), range(1, 5)),
    "456_free": ModeSet("4, 5, 6 of a free body", others=FreeModes((4, 5, 6), "free")),
    "456_flexible": ModeSet("4, 5, 6 flexible", others=FreeModes((4, 5, 6), "flexible")),
    "456_in_plane": ModeSet("4, 5, 6 in the plane", others=FreeModes((4, 5, 6), "in-plane")),
    "456_bending": ModeSet("bending 4–6", [4, 5, 6]),
    "craig_bampton": ModeSet("Craig–Bampton", others=CraigBampton()),
}
"""Sets of modes by their names in metrics. The four with 4, 5, 6 count the paper's "modes four, five and six" in four ways."""


def section(depth: float) -> Section:
    """Return the section of the bars, with a side of `depth` [m] in the plane and always the area of 20 mm x 5 mm."""
    return Section(width=BAR.width * BAR.thickness / depth, thickness=depth, material=STEEL)


def solid_modes(depth: float) -> ReducedModel:
    """Compute the 40 lowest flexible modes in space of the free rocker, meshed by solid elements; `SETS` has no higher ones."""
    return reduced(Modal(section(depth), FreeModes(tuple(range(1, 41))), mesh=MESH), LENGTH)


def beam_frequencies(depth: float, shear: bool = True) -> dict[str, Array]:
    """Compute eight bending and eight axial frequencies [Hz] of the free bar, by Timoshenko's or Euler-Bernoulli's theory."""
    hertz = Modal(section(depth), BarModes(bending=8, axial=8, shear=shear)).frequencies(LENGTH)
    return {BENDING: hertz[:8], AXIAL: hertz[8:]}


def planar_modes(depth: float, name: str) -> tuple[int, ...]:
    """Return the numbers of the flexible modes of a set that move in the plane, which alone a planar mechanism excites."""
    modes = SETS[name]
    if isinstance(modes.others, FreeModes):
        return tuple(int(n) for n in reduced(Modal(section(depth), modes.others, mesh=MESH), LENGTH).plane.numbers)
    table = [(number, kind) for number, _hertz, kind, *_ in solid_modes(depth).table()]
    bending, axial = ([number for number, each in table if each == kind] for kind in (BENDING, AXIAL))
    return tuple([bending[n - 1] for n in modes.bending] + [axial[n - 1] for n in modes.axial])


def make_rocker_of_set(depth: float, name: str, damping: float) -> Modal | None:
    """Make a modal rocker of the modes of a set, but only those in the plane, by rising frequency; None if there is none."""
    craig_bampton = SETS[name].others
    if isinstance(craig_bampton, CraigBampton):
        return Modal(section(depth), craig_bampton, damping, MESH)  # with its default modes
    modes = tuple(sorted(planar_modes(depth, name)))
    return Modal(section(depth), FreeModes(modes), damping, MESH) if modes else None


def set_damping(rocker: Modal, kind: str, ratio: float) -> Modal:
    """Return the rocker with a damping ratio for each mode by one of the `DAMPINGS`, of size `ratio`."""
    model = rocker.planar(LENGTH)
    ratios = tuple(DAMPINGS[kind](model.frequency / (2 * np.pi), ratio).tolist())
    # A ratio belongs to a mode by its number, so the planar modes, the default of `CraigBampton`, are named.
    is_craig_bampton = isinstance(rocker.modes, CraigBampton)
    modes = CraigBampton(tuple(model.numbers.tolist())) if is_craig_bampton else rocker.modes
    return replace(rocker, modes=modes, damping=ratios)


@dataclass(frozen=True)
class Assumptions(Gravity):
    """Assumptions about gravity, joints and flexible rocker; the last text of a parameter is its heading in the help."""

    pin_on: tuple[str, ...] = choices(
        PINS[::2], PINS, "bodies that carry the pins; other joints keep their default", "unpublished"
    )
    friction_thresholds: float = quantity(
        1.0, "1", 1e-4, 100, "factor on both threshold speeds of the friction, 0.1 and 1 m/s by default", "unpublished"
    )
    rocker_damping: float = quantity(0.01, "1", 0, 1, "damping ratio of every mode", "bars")
    modal_damping: str = choice(
        "constant", tuple(DAMPINGS), "damping ratios of modes: constant or Rayleigh, of size rocker_damping, or ADAMS's default",
        "unpublished",
    )  # fmt: skip
    modes_of: str = choice(
        "free", KINDS, "rocker's modes: free, by Timoshenko or Euler-Bernoulli, or Craig-Bampton", "unpublished"
    )

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


@dataclass(frozen=True)
class PlayParameters(Assumptions):
    """Bars, joints with clearance, contact and drive of the crank-rocker."""

    in_plane_depth: float = quantity(20e-3, "m", 5e-3, 20e-3, "side of the 20 mm x 5 mm bars in the plane", "bars")
    clearance: float = quantity(2.5e-4, "m", 1e-7, 2e-3, "radial clearance", "joints")
    pin: float = quantity(5e-3, "m", 1e-3, 1e-2, "radius of the pins", "joints")
    stiffness: float = quantity(JOINT_STIFFNESS, "N/m^1.5", 1e6, 1e14, "contact stiffness K", "contact")
    damping: float = quantity(CONTACT_DAMPING, "1", 0, 1e5, "largest contact damping c_max, in damping_unit", "contact")
    damping_unit: str = choice("N.s/m", tuple(DAMPING_UNITS), "how the published unit of c_max is read", "contact")
    damping_depth: float = quantity(1e-5, "m", 1e-8, 1e-3, "depth d_max at which the damping is full", "contact")
    static_friction: float = quantity(0.3, "1", 0, 2, "static Coulomb coefficient", "contact")
    dynamic_friction: float = quantity(0.1, "1", 0, 2, "dynamic Coulomb coefficient", "contact")
    speed: float = quantity(10 * pi, "rad/s", 0.1, 500, "speed of the crank", "drive")

    def bars(
        self, *, gap: float | None = None, speed: float | None = None, rocker: Body | None = None, joints: str = JOINTS,
        angle: float = 0.0,
    ) -> Mechanism:  # fmt: skip
        """Make the crank-rocker, by default with a rigid rocker; `gap` [m] and `speed` [rad/s] replace the study's.

        Joints other than `joints` are ideal; with a gap of 0 all are. The crank starts at `angle` [rad].
        """
        law = Impact(self.stiffness, self.damping * DAMPING_UNITS[self.damping_unit], self.damping_depth)
        friction = AdamsFriction(self.static_friction, self.dynamic_friction, *self.thresholds)
        bar = section(self.in_plane_depth)
        clearance = self.clearance if gap is None else gap

        def make_joint(point: str, first: str, second: str) -> Clearance:
            """Make a joint whose pin is on the first body, or on the second one if `pin_on` says so."""
            pin, bush = (second, first) if point in self.reversed_joints else (first, second)
            return Clearance(point, pin, bush, self.pin, clearance, law, friction)

        mechanism = crank_rocker(
            rocker or Rigid(bar), speed=self.speed if speed is None else speed, play=make_joint,
            with_play=joints if clearance else "", section=bar, angle=angle,
        )  # fmt: skip
        return replace(mechanism, gravity=self.gravity_vector)


@dataclass(frozen=True)
class RockerParameters(PlayParameters, Runs):
    """Parameters of studies on the compiled solver, whose rocker is rigid or modal."""

    rocker: str = choice("rigid", ("rigid", "modal"), "rocker", "bars")
    bending: int = integer(3, 0, 8, "bending modes of a free rocker", "unpublished")
    axial: int = integer(1, 0, 8, "axial modes of a free rocker", "unpublished")
    frequency_factor: float = quantity(
        1.0, "1", 0.5, 2, "factor on the frequencies of a plain bar, because the real rocker has ends with holes", "unpublished"
    )

    def agree(self) -> None:
        """Check that only a modal rocker is given modes, and that it has one; check the other numbers by making the mechanism."""
        kind = type(self)  # whose attributes are the defaults
        names = ("modal_damping", "modes_of", "bending", "axial", "frequency_factor")
        changed = [f"{name} = {getattr(self, name)}" for name in names if getattr(self, name) != getattr(kind, name)]
        if self.rocker == "rigid" and changed:
            raise ValueError(f"{', '.join(changed)}: only a rocker of modes can have them; choose rocker = modal")
        if self.bending + self.axial == 0 and self.modes_of != "Craig-Bampton":
            raise ValueError("bending = 0 with axial = 0: the flexible rocker needs one mode at least")
        self.bars(rocker=None)  # a rigid rocker, so that this check computes no modes

    def bars(self, **changes: Any) -> Mechanism:
        """Make the crank-rocker; `changes` are arguments of the base's `bars`, and the default rocker is the study's."""
        if "rocker" not in changes and self.rocker == "modal":
            changes["rocker"] = make_modal_rocker(self)
        return super().bars(**changes)

    def describe(self) -> str:
        """Return the assumptions as a sentence for a table."""
        if self.rocker == "rigid":
            return f"{self.describe_joints()}; rocker rigid"
        number = "" if self.modes_of == "Craig-Bampton" else f", {self.bending} bending and {self.axial} axial"
        return f"{super().describe()}{number}, frequencies × {self.frequency_factor:g}"


def make_modal_rocker(p: RockerParameters) -> Modal:
    """Make the modal rocker of a study: Craig-Bampton modes, or modes of the free bar by Timoshenko or Euler-Bernoulli.

    `frequency_factor` multiplies all frequencies. The modulus has its square as a factor, so that static stiffness changes, too.
    """
    bar = section(p.in_plane_depth)
    bar = replace(bar, material=replace(bar.material, modulus=bar.material.modulus * p.frequency_factor**2))
    if p.modes_of == "Craig-Bampton":
        rocker = Modal(bar, CraigBampton(), 0.0, MESH)
    else:
        is_timoshenko = p.modes_of == "free"
        rocker = Modal(bar, BarModes(p.bending, p.axial, shear=is_timoshenko), 0.0)
    return set_damping(rocker, p.modal_damping, p.rocker_damping)
