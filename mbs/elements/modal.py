"""What a modal link is made of: material and size, a solid mesh, two interfaces, chosen modes, damping."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np

from buckler.mbs.elements.body import Body
from buckler.mbs.elements.element import Energy, Recorded, Signal
from buckler.mbs.elements.section import Section
from buckler.mbs.upper import upper
from buckler.mbs.validate import listed, number, one_of, positive, short, whole

Array = np.ndarray[Any, Any]
COUNTINGS = ("flexible", "free", "in-plane")
Point3 = tuple[float, float, float]


# --- interfaces: which nodes a joint holds ----------------------------------------------------------------------------


@dataclass(frozen=True)
class EndFace:
    """All nodes in the cross-section through the joint's centre.

    Parameters
    ----------
    tolerance : float
        m, positive: how far from it they may be.
    """

    tolerance: float = 1e-7

    def __post_init__(self) -> None:
        positive("tolerance", self.tolerance, "m")

    def __call__(self, nodes: Array, joint: Array) -> Array:
        """Mask of the nodes."""
        return np.abs(nodes[:, 0] - joint[0]) <= self.tolerance


@dataclass(frozen=True)
class PinHole:
    """All nodes on the wall of a hole about the joint's axis (1 % more: walls are faceted).

    Parameters
    ----------
    radius : float
        Of the hole, m, positive.
    """

    radius: float

    def __post_init__(self) -> None:
        positive("radius", self.radius, "m")

    def __call__(self, nodes: Array, joint: Array) -> Array:
        """Mask of the nodes."""
        return np.hypot(*(nodes - joint)[:, :2].T) <= 1.01 * self.radius


@dataclass(frozen=True)
class Nearest:
    """The `count` nodes nearest to the joint's centre."""

    count: int = 12

    def __post_init__(self) -> None:
        whole("count", self.count, 3, 100_000)

    def __call__(self, nodes: Array, joint: Array) -> Array:
        """Mask of the nodes."""
        distance = np.linalg.norm(nodes - joint, axis=1)
        return distance <= np.sort(distance)[min(self.count, len(distance)) - 1] * (1 + 1e-9)


Interface = Callable[[Array, Array], Array]
"""(nodes (n, 3) in link axes, joint's centre (3,)) -> mask (n,)."""


# --- meshes and modes by name -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Box:
    """The bar itself: length between the joints' centres, thickness in the plane, width normal to it.

    `elements` along these three, second order.
    """

    elements: tuple[int, int, int] = (16, 2, 1)

    def __post_init__(self) -> None:
        object.__setattr__(self, "elements", listed("elements", self.elements))
        if len(self.elements) != 3:
            raise ValueError(f"elements = {short(self.elements)}: must be three numbers: along length, depth, width")
        for k, count in enumerate(self.elements):
            whole(f"elements[{k}]", count, 1, 1000)


@dataclass(frozen=True)
class MeshFile:
    """A mesh from a file; the section then gives the material only.

    Parameters
    ----------
    path : str
        Any format meshio reads, with one kind of solid cells.
    start, end : three floats
        The joints' centres in the file's axes and unit.
    normal : three floats
        Normal of the plane of motion in the file's axes.
    scale : float
        Metres in the file's unit of length.
    """

    path: str
    start: Point3
    end: Point3
    normal: Point3 = (0.0, 0.0, 1.0)
    scale: float = 1.0

    def __post_init__(self) -> None:
        for name in ("start", "end", "normal"):
            object.__setattr__(self, name, tuple(float(c) for c in getattr(self, name)))
            if len(getattr(self, name)) != 3:
                raise ValueError(f"{name} = {short(getattr(self, name))}: must be three numbers")
        positive("scale", self.scale, "m")


@dataclass(frozen=True)
class FreeModes:
    """Chosen modes of the unsupported link.

    Parameters
    ----------
    numbers : sequence of int
        Any, from 1.
    counting : str
        What is counted, by frequency: 'flexible', all flexible modes, out-of-plane ones too; 'free', all modes of the
        free body, so that 1 to 6 are rigid and carry no flexibility; 'in-plane', flexible ones that move in the plane.
    """

    numbers: tuple[int, ...]
    counting: str = "flexible"

    of_solid: ClassVar[bool] = True

    def __post_init__(self) -> None:
        _check_numbers(self)

    def planar(self, modal: Modal, length: float) -> Any:
        """What the plane of motion sees of a link of these modes."""
        return upper("modal.reduction", "reduced")(modal, length).planar()


@dataclass(frozen=True)
class CraigBampton:
    """Craig-Bampton modes, each interface moving as a rigid body: 6 static and `fixed` vibrating ones, made orthogonal.

    Parameters
    ----------
    numbers : sequence of int, optional
        As in `FreeModes`; by default all that move in the plane. Leaving one out gives up the exact static response.
    fixed : int
        Number of fixed-interface modes, out-of-plane ones included.
    counting : str
        As in `FreeModes`.
    """

    numbers: tuple[int, ...] | None = None
    fixed: int = 12
    counting: str = "flexible"

    of_solid: ClassVar[bool] = True

    def __post_init__(self) -> None:
        whole("fixed", self.fixed, 0, 1000)
        if self.numbers is not None:
            _check_numbers(self)

    def planar(self, modal: Modal, length: float) -> Any:
        """What the plane of motion sees of a link of these modes."""
        return upper("modal.reduction", "reduced")(modal, length).planar()


@dataclass(frozen=True)
class BarModes:
    """The lowest free modes of the section as a uniform bar, from beam theory: no mesh is made.

    Parameters
    ----------
    bending, axial : int
        Number of modes of each kind, those in bending first.
    shear : bool
        Timoshenko's theory (shear deformation and rotary inertia); otherwise Euler and Bernoulli's, without either.
    """

    bending: int = 2
    axial: int = 1
    shear: bool = True

    of_solid: ClassVar[bool] = False

    def __post_init__(self) -> None:
        one_of("shear", self.shear, (bool,))
        whole("bending", self.bending, 0, 13), whole("axial", self.axial, 0, 13)
        whole("bending + axial", self.bending + self.axial, 1, 26)

    @property
    def numbers(self) -> tuple[int, ...]:
        """From 1 on."""
        return tuple(range(1, self.bending + self.axial + 1))

    def planar(self, modal: Modal, length: float) -> Any:
        """What the plane of motion sees of a link of these modes."""
        return upper("modal.bar", "bar_model")(modal, self, length)


def _check_numbers(modes: Any) -> None:
    object.__setattr__(modes, "numbers", listed("numbers", modes.numbers))
    for n in modes.numbers:
        whole("numbers", n, 1, 1000)
    if not modes.numbers or len(set(modes.numbers)) < len(modes.numbers):
        raise ValueError(f"numbers = {short(modes.numbers)}: must be one mode at least, none of them twice")
    if modes.counting not in COUNTINGS:
        raise ValueError(f"counting = {short(modes.counting)}: must be one of {', '.join(map(repr, COUNTINGS))}")


@dataclass(frozen=True)
class AdamsDamping:
    """Damping ratios that MSC ADAMS gives the modes of a flexible body by default: by frequency, in three bands.

    Parameters
    ----------
    low, middle, high : float
        Damping ratio of modes below 100 Hz, from there to 1 kHz, and above, in [0, 10]: 1 %, 10 % and critical.
    """

    low: float = 0.01
    middle: float = 0.1
    high: float = 1.0

    def __post_init__(self) -> None:
        for name in ("low", "middle", "high"):
            number(name, getattr(self, name), 0.0, 10.0, "1")

    def ratios(self, frequencies: Any) -> Array:
        """Damping ratios of modes of these frequencies, Hz."""
        f = np.asarray(frequencies, dtype=float)
        return np.where(f < 100.0, self.low, np.where(f <= 1000.0, self.middle, self.high))


@dataclass(frozen=True)
class Modal(Body):
    """A link of chosen modes of a solid.

    Parameters
    ----------
    section : Section
        Thickness in the plane, width normal to it, material.
    modes : FreeModes, CraigBampton or BarModes
        By default the three lowest free modes in the plane. `BarModes` need no solid: mesh, interface and order do not count.
    damping : float, sequence of float, or AdamsDamping
        Damping ratio of all modes, in [0, 10], one for each number in `modes`, or by frequency as ADAMS does: `AdamsDamping()`.
    mesh : Box or MeshFile
    interface : callable
        Which nodes the joints hold: `EndFace`, `PinHole`, `Nearest`, or any (nodes, joint) -> mask in link axes.
    order : int
        Of the finite-element displacement, 1 or 2.
    """

    section: Section
    modes: FreeModes | CraigBampton | BarModes = field(default_factory=lambda: FreeModes((1, 2, 3), counting="in-plane"))
    damping: float | tuple[float, ...] | AdamsDamping = 0.01
    mesh: Box | MeshFile = field(default_factory=Box)
    interface: Interface = field(default_factory=EndFace)
    order: int = 2

    def first_frequency(self, length: float) -> float:
        """Of the section as a beam, rad/s."""
        return self.section.first_frequency(length)

    def __post_init__(self) -> None:
        if not isinstance(self.modes, FreeModes | CraigBampton | BarModes):
            raise ValueError(f"modes = {short(self.modes)}: must be FreeModes(numbers), CraigBampton(numbers) or BarModes()")
        if isinstance(self.damping, Iterable):
            object.__setattr__(self, "damping", listed("damping", self.damping))
            if self.modes.numbers is None or len(self.damping) != len(self.modes.numbers):
                each = f"one for each of modes.numbers = {self.modes.numbers}"
                raise ValueError(f"damping = {short(self.damping)}: must be one ratio, or {each}")
        if not isinstance(self.damping, AdamsDamping):
            for ratio in self.damping if isinstance(self.damping, tuple) else (self.damping,):
                number("damping", ratio, 0.0, 10.0, "1")
        one_of("section", self.section, (Section,))
        one_of("mesh", self.mesh, (Box, MeshFile))
        if not callable(self.interface):
            raise ValueError(f"interface = {short(self.interface)}: must be a function of nodes and joint, as EndFace()")
        number("poisson", self.section.material.poisson, -0.999, 0.499, "1")
        whole("order", self.order, 1, 2)

    def frequencies(self, length: float) -> Array:
        """Natural frequencies of its modes in the plane, Hz, (modes,), of a link this long [m]: free, or as its modes are made.

        The other modes that it names have no part in the motion. `buckler.mbs.modal.reduced` tells all of them.
        """
        return np.asarray(self.planar(length).frequency / (2 * np.pi))

    def planar(self, length: float) -> Any:
        """What the plane of motion sees of a link this long [m]: a `PlanarModel`."""
        return self.modes.planar(self, positive("length", length, "m"))

    def ratios(self, omega: Any) -> Any:
        """Damping ratio of all modes, or one for each of their angular frequencies, rad/s."""
        return self.damping.ratios(omega / (2 * np.pi)) if isinstance(self.damping, AdamsDamping) else self.damping

    def signals(self, link: Any, record: Recorded) -> Iterator[Signal]:
        """Yield end shortening and deflection of mid-length from the chord, m."""
        motion = record.links[link.name]
        yield Signal(f"{link.name}.end_shortening", motion.end_shortening(), "m")
        yield Signal(f"{link.name}.deflection", motion.deflection(), "m")

    def energies(self, link: Any, record: Recorded) -> Iterator[Energy]:
        """Yield strain energy and what damping took."""
        (strain,) = record.links[link.name].strains()
        yield Energy("held", "strain", strain.energy)
        yield Energy("taken", "damping", record.work(strain.power))
