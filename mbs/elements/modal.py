"""Modal links: section, mesh, interfaces, chosen modes and damping ratios.

An interface is the set of nodes of the mesh that a joint moves as a rigid body. Link axes have x from the first joint to the
second, y in the plane of motion and z normal to it.
"""

from collections.abc import Callable, Iterator
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from ..declare import Declared, Part, Quantity, Whole, choice, declared, field, flag, names, part, quantities, quantity, whole
from ..declare.compound import Either, Several
from ..geometry import Array
from ..imports import import_late
from ..validate import number, positive, short
from .element import Body, LinkBase, Recorded
from .section import Section
from .signal import Kind, Signal

COUNTINGS = ("flexible", "free", "in-plane")
COUNTED = (
    "modes that are numbered, by frequency: 'flexible', all flexible modes, also out of plane; 'free', all of the free body, "
    "1 to 6 being rigid motions; 'in-plane', flexible modes that move in the plane"
)
NUMBERS = Several(Whole(1, 1000), least=1, distinct=True)
MOST_BAR_MODES = 13
"""Most bending modes, and most axial modes: each mode needs some three polynomials, and their degree is 40 at most."""
Point3 = tuple[float, float, float]


@declared
class EndFace(Declared):
    """Interface of all nodes in the cross-section through the joint's centre."""

    tolerance: float = quantity("m", above=0, doc="largest distance of a node from the cross-section", default=1e-7)

    def __call__(self, nodes: Array, joint: Array) -> Array:
        """Return the mask (n,) of the nodes in the interface, from nodes (n, 3) and centre (3,) of the joint [m]."""
        return np.abs(nodes[:, 0] - joint[0]) <= self.tolerance


@declared
class PinHole(Declared):
    """Interface of all nodes within 1.01 radii of the joint's axis: the wall of a hole, which may consist of flat facets."""

    radius: float = quantity("m", above=0, doc="of the hole")

    def __call__(self, nodes: Array, joint: Array) -> Array:
        """Return the mask (n,) of the nodes in the interface, from nodes (n, 3) and centre (3,) of the joint [m]."""
        return np.hypot(*(nodes - joint)[:, :2].T) <= 1.01 * self.radius


Interface = Callable[[Array, Array], Array]
"""Function of nodes (n, 3) and the joint's centre (3,) in link axes [m] that returns the mask (n,) of the interface."""


@declared
class Box(Declared):
    """Mesh of a straight bar of the section between the joints' centres, by elements of second order."""

    elements: tuple[int, int, int] = field(Several(Whole(1, 1000), 3, 3), "along length, thickness, width", default=(16, 2, 1))


@declared
class MeshFile(Declared):
    """A mesh from a file; the section then gives the material, and the width of a planar mesh."""

    path: str = names(doc="of a file in a format that meshio reads, with one kind of solid or planar cells")
    # "": numbers in the unit of the file
    start: Point3 = quantities("", least=3, most=3, doc="the first joint's centre in the file's axes and unit")
    end: Point3 = quantities("", least=3, most=3, doc="the second joint's centre")
    normal: Point3 = quantities("", least=3, most=3, doc="of the plane of motion in the file's axes", default=(0.0, 0.0, 1.0))
    scale: float = quantity("m", above=0, doc="metres in the file's unit of length", default=1.0)


@declared
class FreeModes(Declared):
    """Chosen modes of the unsupported link."""

    numbers: tuple[int, ...] = field(NUMBERS, "numbers of the modes, from 1")
    counting: str = choice(*COUNTINGS, doc=COUNTED, default="flexible")


@declared
class CraigBampton(Declared):
    """Craig-Bampton modes: eigenmodes in the span of `fixed` vibrations and the 6 relative motions of both rigid interfaces."""

    numbers: tuple[int, ...] | None = field(
        NUMBERS, "as in `FreeModes`; by default all that move in the plane, as exact statics need all of them", default=None
    )
    fixed: int = whole(0, 1000, doc="number of vibrations with fixed interfaces, out-of-plane ones included", default=12)
    counting: str = choice(*COUNTINGS, doc=COUNTED, default="flexible")


@declared
class BarModes(Declared):
    """The lowest free modes of a uniform bar of the section, from beam theory, without a mesh."""

    bending: int = whole(0, MOST_BAR_MODES, doc="number of modes in bending, which come first", default=2)
    axial: int = whole(0, MOST_BAR_MODES, doc="number of axial modes", default=1)
    shear: bool = flag(doc="Timoshenko's theory, with shear and rotary inertia, not Euler and Bernoulli's", default=True)

    def agree(self) -> None:
        """Raise a ValueError unless there is a mode."""
        if not self.bending + self.axial:
            raise ValueError("bending + axial = 0: must be one mode at least")

    @property
    def numbers(self) -> tuple[int, ...]:
        """Numbers of the modes, from 1."""
        return tuple(range(1, self.bending + self.axial + 1))


@declared
class AdamsDamping(Declared):
    """Damping ratios by frequency, in the three bands that MSC ADAMS uses for flexible bodies by default.

    >>> AdamsDamping(low=0.02).high
    1.0
    """

    low: float = quantity("1", low=0, high=10, doc="of modes below 100 Hz", default=0.01)
    middle: float = quantity("1", low=0, high=10, doc="of modes from 100 Hz to 1 kHz", default=0.1)
    high: float = quantity("1", low=0, high=10, doc="of modes above 1 kHz: critical", default=1.0)

    def ratios(self, frequencies: ArrayLike) -> Array:
        """Return the damping ratios [1] of modes from their frequencies [Hz], both (modes,)."""
        f = np.asarray(frequencies, dtype=float)
        return np.where(f < 100.0, self.low, np.where(f <= 1000.0, self.middle, self.high))


class InterfaceSpec(Part):
    """Specification of an interface: `EndFace`, `PinHole` or an `Interface` function."""

    def fits(self, raw: object) -> bool:
        """Return True for an interface, the mapping of one in a file, or a user's function, which is no class."""
        return super().fits(raw) or (callable(raw) and not isinstance(raw, type))


@declared
class Modal(Body):
    """A link whose deformation is a sum of chosen modes of a solid.

    >>> Modal(Section(width=0.03, thickness=5e-3), damping=0.02).mesh.elements
    (16, 2, 1)
    """

    linear: ClassVar[bool] = True  # the modes describe small deformations only

    section: Section = part(Section, doc="thickness in the plane, width normal to it, material")
    modes: FreeModes | CraigBampton | BarModes = part(
        FreeModes, CraigBampton, BarModes, example="FreeModes(numbers), CraigBampton(numbers) or BarModes()",
        doc="by default the three lowest free modes in the plane; `BarModes` need no solid: no mesh or interface",
        default_factory=lambda: FreeModes((1, 2, 3), counting="in-plane"),
    )  # fmt: skip
    damping: float | tuple[float, ...] | AdamsDamping = field(
        Either((Quantity("1", 0.0, 10.0), Several(Quantity("1", 0.0, 10.0)), Part((AdamsDamping,)))),
        "damping ratio of all modes, one for each number in `modes`, or by frequency as ADAMS does",
        default=0.01,
    )
    mesh: Box | MeshFile = part(Box, MeshFile, doc="the solid", default_factory=Box)
    interface: Interface = field(
        InterfaceSpec((EndFace, PinHole), "EndFace()"),
        "nodes that the joints hold; or any function as `Interface` describes",
        default_factory=EndFace,
    )

    def agree(self) -> None:
        """Raise a ValueError unless each mode has a damping ratio and Poisson's ratio suits solid elements."""
        numbers = self.modes.numbers  # None for all modes in the plane: their number is unknown, so that no tuple is allowed
        if isinstance(self.damping, tuple) and (numbers is None or len(self.damping) != len(numbers)):
            raise ValueError(f"damping = {short(self.damping)}: must be one ratio, or one for each of modes.numbers = {numbers}")
        # at -1 and 0.5 the elasticity of a solid is singular; `BarModes`, without a solid, have the same limits
        number("poisson", self.section.material.poisson, -0.999, 0.499, "1")

    def frequencies(self, length: float) -> Array:
        """Return the frequencies [Hz] of the chosen modes in the plane, for an unsupported link of a length [m]."""
        return np.asarray(self.planar(length).frequency / (2 * np.pi))

    def planar(self, length: float) -> Any:
        """Return the reduction of a link of a length [m] to the plane of motion, a `buckler.mbs.modal.planar.PlanarModel`."""
        return import_late("modal.bar:planar_model")(self, positive("length", length, "m"))

    def ratios(self, omega: Any) -> Any:
        """Return one damping ratio, or (modes,) ratios, for all chosen modes; `omega` (modes,) are their frequencies [rad/s]."""
        return self.damping.ratios(omega / (2 * np.pi)) if isinstance(self.damping, AdamsDamping) else self.damping

    def signals(self, link: LinkBase, record: Recorded) -> Iterator[Signal]:
        """Yield end shortening [m], and deflection of mid-length from the chord [m]."""
        motion = record.links[link.name]
        yield Signal(f"{link.name}.end_shortening", motion.end_shortening(), "m", Kind.STRETCH)
        yield Signal(f"{link.name}.deflection", motion.deflection(), "m", Kind.PLACE)
