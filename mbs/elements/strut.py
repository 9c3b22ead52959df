"""Massless pinned strips: springs with the force of the exact elastica."""

from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np

from buckler.elastica import law, pinned

from ..declare import declared, field, part
from ..functions.fields import Function
from ..geometry import Array
from ..laws.pieces import Reals
from .element import Body, LinkBase, Recorded
from .section import Profile, Section
from .signal import Energy, Kind, Signal


@declared
class Strut(Body):
    """A massless pinned strip: straight and stiff up to the Euler load, buckled with the force of the exact elastica beyond.

    >>> Strut(Section(width=0.03, thickness=3e-4)).massless
    True
    """

    section: Section | Profile = part(Section, Profile, doc="of the strip")
    load: Callable[[Reals], Reals] = field(
        Function("u", "1", named={"fast": law.fast, "quartic": law.quartic, "exact": pinned.load}),
        "normalised force p(u), p = P L^2/(E I), of the normalised bending shortening u >= 0: `elastica.law.fast`, exact to "
        "1e-12 for u <= 1, `elastica.pinned.load`, for u <= 1.7, or the published `elastica.law.quartic`",
        default=law.fast,
    )

    massless: ClassVar[bool] = True
    force_rounding: ClassVar[float] = 5e-15  # error of the force over E A: twenty roundings of a float; chosen

    def signals(self, link: LinkBase, record: Recorded) -> Iterator[Signal]:
        """Yield end shortening, here not over length but in [m], and the compressive force without damping [N]."""
        elongation, _ = state(link, record)
        tension = StrutLaw(self, record.mechanism.length(link.name)).elastic
        yield Signal(f"{link.name}.end_shortening", -elongation, "m", Kind.STRETCH)
        yield Signal(f"{link.name}.compression", -np.array([tension(float(e)) for e in elongation]), "N", Kind.INTERNAL)

    def energies(self, link: LinkBase, record: Recorded) -> Iterator[Energy]:
        """Yield strain energy and the energy dissipated by damping."""
        elongation, rate = state(link, record)
        spring = StrutLaw(self, record.mechanism.length(link.name))
        yield Energy("stored", "strain", spring.stored_energy(elongation))
        yield Energy("dissipated", "damping", record.work(spring.damping_power(elongation, rate)))


def state(link: LinkBase, record: Recorded) -> tuple[Array, Array]:
    """Return the elongation of a link's chord since t = 0 [m] and its rate [m/s], each (times,)."""
    (start, start_t), (end, end_t) = record.point(link.start), record.point(link.end)
    chord = end - start
    span = np.hypot(*chord.T)
    return span - record.mechanism.length(link.name), (chord * (end_t - start_t)).sum(axis=1) / span


class StrutLaw:
    """Force of one strut of length L over its elongation.

    Down to the elongation `kink` < 0 [m], at which the Euler load is reached, the strut is straight and has the axial stiffness
    `rigidity` E A/L [N/m]. Beyond it the end shortening is the sum of bending, u L, and compression, P L/(E A), with
    P = p(u) `force_unit`, `force_unit` = E I/L^2 [N]. One step of fixed-point iteration for u starts from the compression under
    the Euler load. At u = 0.1 its relative error is 2e-13 for a thickness of L/1000 and 2e-9 for L/100. Axial damping acts only
    where the chord is longer than L.
    """

    def __init__(self, strut: Strut, length: float) -> None:
        section = strut.section
        self.load, self.length = strut.load, length
        self.rigidity = section.axial_stiffness / length
        self.damping = self.rigidity * section.material.axial_damping
        self.force_unit = section.bending_stiffness / length**2
        self.strain_unit = self.force_unit / section.axial_stiffness  # axial strain at p = 1
        self.critical = float(self.load(0.0))
        self.kink = -self.critical * self.strain_unit * length

    def elastic(self, elongation: float) -> float:
        """Return the tension without damping [N]."""
        if elongation >= self.kink:
            return self.rigidity * elongation
        total = -elongation / self.length
        first_u = max(0.0, total - self.strain_unit * self.critical)
        u = max(0.0, total - self.strain_unit * float(self.load(first_u)))
        return -self.force_unit * float(self.load(u))

    def force(self, elongation: float, rate: float) -> float:
        """Return the tension [N]; damping does not make a taut strut push."""
        if elongation > 0:
            return max(0.0, self.rigidity * elongation + self.damping * rate)
        return self.elastic(elongation)

    def damping_power(self, elongation: Reals, rate: Reals) -> Reals:
        """Return the power dissipated by axial damping of the taut strut [W]."""
        force = np.where(elongation > 0, self.damping * rate, 0.0)
        elastic = self.rigidity * np.maximum(elongation, 0.0)
        return np.maximum(force, -elastic) * rate  # as in `force`, the sum of both forces is not negative

    def stored_energy(self, elongation: Array) -> Array:
        """Compute the work of the elastic force [J]: in closed form if straight, by a cubic spline of the force if buckled."""
        straight = 0.5 * self.rigidity * np.maximum(elongation, self.kink) ** 2
        deepest = float(elongation.min())
        if deepest >= self.kink:
            return straight
        from scipy.interpolate import CubicSpline  # it takes a while to load, and straight struts need none

        grid = np.linspace(deepest, self.kink, 400)  # chosen; the spline's error falls with the number to the power -4
        work = CubicSpline(grid, [self.elastic(float(e)) for e in grid]).antiderivative()
        return straight + np.asarray(work(np.minimum(elongation, self.kink)) - work(self.kink))
