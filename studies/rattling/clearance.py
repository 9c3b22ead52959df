"""The crank-rocker with clearance on the engine: parameters of its studies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from buckler.mbs import Beam, Mechanism, Modal, Rigid, Section
from buckler.mbs.accuracy.words import FINEST
from buckler.mbs.library import STEEL_CRANK_ROCKER
from buckler.mbs.modal import BarModes, CraigBampton

from ..kit.parameters import choices, integer, quantity
from .assumptions import Assumptions
from .bars import PlayParameters
from .mode_sets import damped, section
from .turns import chance

WITH_PLAY = ("", "B", "BC", "ABC", "OABC")
"""Joints that get clearance as their number grows: first those that are looked at, coupler–rocker and rocker–frame."""


def _beam(p: CrankRockerParameters) -> Beam:
    section = p.section.damped(p.rocker_damping, STEEL_CRANK_ROCKER.rocker)
    return Beam(section) if p.accuracy else Beam(section, elements=p.elements)


ROCKERS: dict[str, Callable[[CrankRockerParameters], Any]] = {
    "rigid": lambda p: Rigid(p.section),
    "beam": _beam,
    "modal": lambda p: p.modal(),
}
"""Functions that make the rocker, by name; all but the first make a flexible one."""

COLOURS = {"ideal": "#000000", "rigid": "#D55E00", "flexible": "#0072B2"}
"""Colours of curves by `label`."""


def label(rocker: str) -> str:
    """Return the name of a rocker's results: `rigid` or `flexible`."""
    return "rigid" if rocker == "rigid" else "flexible"


@dataclass(frozen=True)
class CrankRockerParameters(PlayParameters, Assumptions):
    """Parameters of every study of the crank-rocker with clearance on the engine."""

    rocker: tuple[str, ...] = choices(("rigid", "beam"), tuple(ROCKERS), "rockers to run, at most one flexible", "bars")
    rocker_damping: float = quantity(0.01, "1", 0, 1, "damping ratio: first pinned mode (beam), all (modal)", "bars")
    clearance_joints: int = integer(4, 0, 4, "joints with clearance: B, C, A, O in this order", "joints")
    start_angle: float = quantity(0.5, "rad", -7, 7, "crank angle at the start", "drive")
    duration: float = quantity(0.2, "s", 1e-4, 1e3, "length of a run", "numerics")
    settle: float = quantity(0.02, "s", 0, 1e3, "time left out of the metrics: journals start centred", "numerics")
    seed: int = integer(0, 0, 2**31 - 1, "draws the start's offset, 1e-9 rad N(0, 1)", "numerics")
    elements: int = integer(4, 1, 64, "elements of the beam", "numerics")
    tolerance: float = quantity(5e-5, "1", 1e-9, 1e-1, "position error allowed a step, over clearance/10", "numerics")
    accuracy: float = quantity(0, "1", 0, 0.1, "error asked for over the first 10 ms, instead of elements, tolerance", "numerics")
    timeout: float = quantity(120, "s", 0.01, 86400, "longest time a run may take", "numerics")

    def check(self) -> None:
        """Check parameters against each other; build what will be run."""
        if 0 < self.accuracy < FINEST:
            raise ValueError(f"accuracy = {self.accuracy:g}: must be 0, for none asked, or lie in [{FINEST:g}, 0.1]")
        if len({label(rocker) for rocker in self.rocker}) < len(self.rocker):
            raise ValueError(f"rocker = {','.join(self.rocker)}: name one flexible rocker at most")
        if "modal" not in self.rocker and (self.modal_damping, self.modes_of) != ("constant", "free"):
            asked = f"modal_damping = {self.modal_damping}, modes_of = {self.modes_of}"
            raise ValueError(f"{asked}: only a rocker of modes can have them; choose rocker = rigid,modal")
        if self.settle >= self.duration:
            raise ValueError(f"settle = {self.settle:g} s: must be less than duration = {self.duration:g} s")
        for rocker in self.rocker:
            self.mechanism(rocker)

    @property
    def section(self) -> Section:
        """Section of all bars, without damping."""
        return section(self.in_plane_depth)

    @property
    def with_play(self) -> str:
        """Points of the joints with clearance."""
        return WITH_PLAY[self.clearance_joints]

    def mechanism(self, rocker: str, with_play: str | None = None) -> Mechanism:
        """Make the crank-rocker with this rocker and clearance in these joints; by default in `clearance_joints` of them."""
        joints = self.with_play if with_play is None else with_play
        return self.bars(rocker=ROCKERS[rocker](self), joints=joints, angle=self.angle)

    @property
    def angle(self) -> float:
        """Angle of the crank at the start, with its chance offset [rad]."""
        return self.start_angle + chance(self.seed)

    def modal(self) -> Modal:
        """Make the rocker of a solid's modes."""
        plain = Modal(self.section, damping=self.rocker_damping)
        other: dict[str, Any] = {"Craig-Bampton": CraigBampton(), "Euler-Bernoulli": BarModes(2, 1, shear=False)}
        plain = replace(plain, modes=other[self.modes_of]) if self.modes_of in other else plain
        return plain if self.modal_damping == "constant" else damped(plain, self.modal_damping, self.rocker_damping)
