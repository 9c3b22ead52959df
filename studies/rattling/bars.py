"""The crank-rocker with clearance in its joints: its mechanism, and the parameters of all studies of it.

The mechanism is that of a paper that leaves much unsaid: clearance, pins, friction speeds, the plane in which the bars
bend. Each of these is a parameter here. The unit of its largest contact damping, 253 "N×S/m", decides the physics
(`damping_unit`): in N.s/m the joints rattle; in N.s/mm, the paper's own 0.1 % of the stiffness, they stay closed.

"Modes four, five and six" may be counted among a free body's modes, the first six of which are rigid; among its flexible
modes in space; among those in the plane; or among the bending modes in the plane.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import pi
from typing import Any

import numpy as np

from buckler.mbs import Clearance, Mechanism, Modal, Rigid, Section, crank_rocker
from buckler.mbs.elements.element import Body
from buckler.mbs.geometry import Array
from buckler.mbs.laws import AdamsFriction, Impact
from buckler.mbs.library import PAPER_STIFFNESS, STEEL_CRANK_ROCKER
from buckler.mbs.modal import BarModes, Box, CraigBampton, FreeModes, ReducedModel, reduced

from ..kit.parameters import choice, quantity
from ..kit.published import BAR_AREA, CONTACT_DAMPING, DAMPING_UNITS, STEEL
from .assumptions import DAMPINGS, JOINTS, JointAssumptions, ModalAssumptions
from .turns import Runs

OF_MODES = ("modal_damping", "modes_of", "bending", "axial", "frequency_factor")
"""Parameters that only a rocker of modes has."""
LENGTH = STEEL_CRANK_ROCKER.rocker
"""Length of the rocker [m]."""
MESH = Box((24, 2, 1))
COUNTED = 40
"""Flexible modes of the solid that are computed; all in `SETS` are among them."""
BENDING, AXIAL = "in-plane bending", "axial"
LETTERS = {"b": BENDING, "a": AXIAL}
SETS: dict[str, Any] = {
    "none": (),
    "bending_1": ("b1",),
    "bending_1_2": ("b1", "b2"),
    "bending_1_3": ("b1", "b2", "b3"),
    "axial_1": ("a1",),
    "bending_1_3_axial_1": ("b1", "b2", "b3", "a1"),
    "bending_1_6_axial_1_3": ("b1", "b2", "b3", "b4", "b5", "b6", "a1", "a2", "a3"),
    "bending_1_8_axial_1_4": ("b1", "b2", "b3", "b4", "b5", "b6", "b7", "b8", "a1", "a2", "a3", "a4"),
    "456_free": FreeModes((4, 5, 6), "free"),
    "456_flexible": FreeModes((4, 5, 6), "flexible"),
    "456_in_plane": FreeModes((4, 5, 6), "in-plane"),
    "456_bending": ("b4", "b5", "b6"),
    "craig_bampton": CraigBampton(),
}
"""Modes by `LETTERS` and number, or counted as `FreeModes` does; or all of Craig and Bampton's."""
NAMES = {
    "none": "none: rigid", "bending_1": "bending 1", "bending_1_2": "bending 1–2", "bending_1_3": "bending 1–3",
    "axial_1": "axial 1", "bending_1_3_axial_1": "bending 1–3, axial 1", "bending_1_6_axial_1_3": "bending 1–6, axial 1–3",
    "bending_1_8_axial_1_4": "bending 1–8, axial 1–4", "456_free": "4, 5, 6 of a free body",
    "456_flexible": "4, 5, 6 flexible", "456_in_plane": "4, 5, 6 in the plane", "456_bending": "bending 4–6",
    "craig_bampton": "Craig–Bampton",
}  # fmt: skip


def section(depth: float) -> Section:
    """Return the section of all bars with this side in the plane [m]."""
    return Section(width=BAR_AREA / depth, thickness=depth, material=STEEL)


def solid_modes(depth: float) -> ReducedModel:
    """Compute the lowest flexible modes of the free solid rocker, in space."""
    return reduced(Modal(section(depth), FreeModes(tuple(range(1, COUNTED + 1))), mesh=MESH), LENGTH)


def beam_frequencies(depth: float, shear: bool = True) -> dict[str, Array]:
    """Compute eight bending and eight axial frequencies [Hz] of the free bar: Timoshenko's, or Euler–Bernoulli's."""
    found = Modal(section(depth), BarModes(8, 8, shear)).frequencies(LENGTH)
    return {BENDING: found[:8], AXIAL: found[8:]}


def numbers(depth: float, name: str) -> tuple[int, ...]:
    """Return the flexible modes of a set that move in the plane; a planar mechanism does not excite the others."""
    wanted = SETS[name]
    if isinstance(wanted, FreeModes):
        return tuple(int(n) for n in reduced(Modal(section(depth), wanted, mesh=MESH), LENGTH).plane.numbers)
    table = solid_modes(depth).table()
    found = {letter: [row[0] for row in table if row[2] == kind] for letter, kind in LETTERS.items()}
    return tuple(found[mode[0]][int(mode[1:]) - 1] for mode in wanted)


def flexibility(depth: float, name: str, damping: float) -> Modal | None:
    """Make a rocker of the modes of a set that move in the plane, by rising frequency; None if there are none."""
    if isinstance(SETS[name], CraigBampton):
        return Modal(section(depth), SETS[name], damping, MESH)
    wanted = tuple(sorted(numbers(depth, name)))
    return Modal(section(depth), FreeModes(wanted), damping, MESH) if wanted else None


def rocker_modes(kind: str, depth: float, bending: int = 3, axial: int = 1, factor: float = 1.0) -> Modal:
    """Make a rocker of modes without damping, by `KINDS`: free ones from beam theory, or all of Craig and Bampton's.

    All frequencies take the factor, the modulus its square.
    """
    bar = section(depth)
    bar = replace(bar, material=replace(bar.material, modulus=bar.material.modulus * factor**2))
    if kind == "Craig-Bampton":
        return Modal(bar, CraigBampton(), 0.0, MESH)
    return Modal(bar, BarModes(bending, axial, shear=kind == "free"), 0.0)


def set_damping(rocker: Modal, kind: str, ratio: float) -> Modal:
    """Return the same rocker with damping ratios by `DAMPINGS`."""
    model = rocker.planar(LENGTH)
    ratios = tuple(DAMPINGS[kind](model.frequency / (2 * np.pi), ratio).tolist())
    modes = CraigBampton(tuple(model.numbers.tolist())) if isinstance(rocker.modes, CraigBampton) else rocker.modes
    return replace(rocker, modes=modes, damping=ratios)


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

    def bars(
        self, *, gap: float | None = None, speed: float | None = None, rocker: Body | None = None, joints: str = JOINTS,
        angle: float = 0.0,
    ) -> Mechanism:  # fmt: skip
        """Return the crank-rocker, by default rigid; a clearance [m] or speed [rad/s] given replaces the study's.

        Joints without clearance are ideal. Turned joints have the pin on the body that carries the bush by default.
        """
        law, friction, turned, bar = self.law, self.friction, self.reversed_joints, section(self.in_plane_depth)
        clearance = self.clearance if gap is None else gap

        def play(point: str, first: str, second: str) -> Clearance:
            pair = (second, first) if point in turned else (first, second)
            return Clearance(point, *pair, self.pin, clearance, law, friction)

        made = crank_rocker(
            rocker or Rigid(bar), speed=self.speed if speed is None else speed, play=play,
            with_play=joints if clearance else "", section=bar, angle=angle,
        )  # fmt: skip
        return replace(made, gravity=self.pull)


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
        if "rocker" not in changes and self.rocker == "modal":
            changes["rocker"] = flexible(self)
        return super().bars(**changes)

    def describe(self) -> str:
        """Return the assumptions as a sentence for a table."""
        return super().describe() if self.rocker == "modal" else f"{JointAssumptions.describe(self)}; rocker rigid"


def flexible(p: Any, depth: float | None = None) -> Modal:
    """Make the modal rocker by a study's assumptions."""
    modes = rocker_modes(p.modes_of, depth or p.in_plane_depth, p.bending, p.axial, p.frequency_factor)
    return set_damping(modes, p.modal_damping, p.rocker_damping)
