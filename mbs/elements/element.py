"""What every element has in common: a name, signals, energies; and how an element names a point.

An element answers from plain arrays. It sees a run through its `Record`, which both solvers leave behind.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from enum import StrEnum
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypeAlias

import numpy as np

from buckler.mbs.declare import Declared, specs

if TYPE_CHECKING:
    from buckler.mbs.mechanism import Mechanism
    from buckler.mbs.record.record import Record

Parts: TypeAlias = "Mechanism"
"""A mechanism, as its elements see it: known to types only, for it is made of elements."""
Recorded: TypeAlias = "Record"
"""A run, as elements see it."""
Array = np.ndarray[Any, Any]
GROUND = "ground"


class Kind(StrEnum):
    """What a signal is: it decides how two runs are compared, and how values between samples are found.

    A reaction is a constraint's force, a contact's what pushes while it is closed (its force or depth), an internal force what
    a law makes of a state or of time: strips, springs, motors, loads.
    """

    PLACE = "place"
    RATE = "rate"
    ACCELERATION = "acceleration"
    REACTION = "reaction"
    CONTACT = "contact"
    FRICTION = "friction"
    INTERNAL = "internal"
    ENERGY = "energy"
    COUNT = "count"


class Trait(NamedTuple):
    """What there is to know of a signal besides its values and unit.

    Attributes
    ----------
    kind : Kind
    group : str
        Signals of one group are components of a vector: they are measured by the largest of them. By default it is alone.
    rate : str
        Name of the signal that is its rate.
    scale : float
        What its errors are relative to, where the element knows it: the clearance of a joint.
    period : float
        s, over which the signal is a mean; 0 of a signal as computed.
    """

    kind: Kind
    group: str = ""
    rate: str = ""
    scale: float = 0.0
    period: float = 0.0


class Signal(NamedTuple):
    """A named series and what it is; kind, group, rate, scale and period as in `Trait`.

    Attributes
    ----------
    name : str
    values : array, shape (times,)
    unit : str
    onsets : array, shape (contacts,)
        Times, s, at which a contact closes or opens: its force jumps or has a kink there.
    depth : array, shape (times,)
        m, of a stop's contact; negative where it is open.
    elastic : callable, optional
        Force, N, of its law at rest in depths, m.
    """

    name: str
    values: Array
    unit: str
    kind: Kind
    group: str = ""
    rate: str = ""
    scale: float = 0.0
    period: float = 0.0
    onsets: Array = np.empty(0)
    depth: Array = np.empty(0)
    elastic: Callable[[Any], Any] = np.zeros_like

    @property
    def trait(self) -> Trait:
        """What it is."""
        return Trait(*self[3:8])


def onsets(time: Array, depth: Array, rate: Array) -> Array:
    """Times, s, at which a depth passes zero, by the cubics through its samples and their rates.

    Parameters
    ----------
    time, depth, rate : arrays, shape (times,)
        s, m, m/s.
    """
    found = []
    for k in np.flatnonzero((depth[:-1] > 0) != (depth[1:] > 0)):
        h, start, end = time[k + 1] - time[k], depth[k], depth[k + 1]
        before, after = h * rate[k], h * rate[k + 1]
        bend, twist = 3 * (end - start) - 2 * before - after, before + after - 2 * (end - start)
        roots = np.roots([twist, bend, before, start])
        inside = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real >= 0) & (roots.real <= 1)]
        found.append(time[k] + h * (inside[0] if len(inside) else start / (start - end)))
    return np.array(found)


class Energy(NamedTuple):
    """An energy, J, of shape (times,).

    Attributes
    ----------
    kind : str
        'held' now, 'taken' from the mechanism since t = 0, or 'given' to it since t = 0.
    name : str
        What it is added to in the ledger: `kinetic`, `strain`, `contact`, `weight`, `spring`; `damping`, `friction`, `contact`,
        `resistance`; `drive`, `load`, `motor`.
    values : array, shape (times,)
    """

    kind: str
    name: str
    values: Array


class Burden(NamedTuple):
    """Mass, kg, and moment of inertia, kg m^2, that an element adds to a body at a point reference 'link:point'."""

    at: str
    mass: float
    inertia: float


class Depth(NamedTuple):
    """How deep a contact may be: signal, depth, m, beyond which its law does not hold, what is so deep, and in what."""

    signal: str
    allowed: float
    what: str
    where: str


class Element(Declared):
    """A kind of thing a mechanism is made of: what it is called, whether it fits, its signals, its energies."""

    @property
    def key(self) -> str:
        """Its name in a mechanism; a second one of a name is `name.2`."""
        raise NotImplementedError

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError if what it refers to is not in the mechanism."""

    def rows(self, mechanism: Parts) -> Iterator[Any]:
        """Yield what it asks of the bodies' places, as `buckler.mbs.elements.rows`; nothing by default."""
        yield from ()

    def reactions(self, multipliers: Array) -> dict[str, Array] | None:
        """Channels of a run whose constraints alone decide the motion, from its rows' multipliers (times, rows).

        A multiplier is a force, or torque, on the first body of the row's first term along the row, times that term's
        coefficient; bodies that the row subtracts get the opposite. None, the default, if it cannot tell.
        """
        return None

    @property
    def rubs_on_reaction(self) -> bool:
        """Whether it rubs by its own reaction, so that nobody knows its forces before the motion is solved."""
        return False

    def pushes(self, name: str, record: Recorded) -> Iterator[tuple[str, Array, Array]] | None:
        """Forces it exerts in a motion that is known: (point reference, force (times, 2), moment (times,)).

        None, the default, if it cannot tell.
        """
        return None

    def check_run(self, duration: float, name: str) -> None:
        """Raise a ValueError if it cannot run that long, s; nothing by default."""

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Times in (0, duration), s, at which what it prescribes is known to have a kink or jump; none by default."""
        return ()

    def depths(self, name: str, mechanism: Parts) -> Iterator[Depth]:
        """Yield how deep its contacts may be; nothing by default."""
        yield from ()

    def one_sided(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield its forces that must not be negative, and the depths without which they are zero, or ''; none by default."""
        yield from ()

    def remarks(self, name: str, signals: Mapping[str, Array]) -> Iterator[str]:
        """Yield what is worth knowing of it in a run; nothing by default."""
        yield from ()

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield its signals in a run; none by default."""
        yield from ()

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield its energies in a run; none by default."""
        yield from ()

    def burdens(self, mechanism: Parts) -> Iterator[Burden]:
        """Yield the masses it adds to bodies; none by default."""
        yield from ()


def kinks_of(mechanism: Parts, duration: float) -> tuple[float, ...]:
    """Times in (0, duration), s, at which something that acts on a mechanism has a kink or jump, in order."""
    return tuple(sorted({t for element in mechanism.elements().values() for t in element.kinks(duration)}))


class Place(NamedTuple):
    """A point reference: '' for whatever link carries the point, a link's name, or 'ground'."""

    body: str
    point: str


def place(at: str) -> Place:
    """Read a point reference: 'A', 'coupler:A' or 'ground:A'."""
    body, colon, point = at.rpartition(":")
    return Place(body if colon else "", point)


class UnknownError(ValueError):
    """A name that nothing bears."""

    def __init__(self, name: str, message: str) -> None:
        super().__init__(message)
        self.name = name

    def field_of(self, element: Any) -> str:
        """The field in which an element names it; '' if none does."""
        texts = {key: value for key in specs(type(element)) if isinstance(value := getattr(element, key), str)}
        return next((key for key, value in texts.items() if self.name in (value, place(value).point, place(value).body)), "")


def known(kind: str, name: str, names: Iterable[str], where: str) -> None:
    """Raise a ValueError if a name is not among those known."""
    if name not in names:
        raise UnknownError(name, f"{where}: unknown {kind} '{name}'; known: {', '.join(sorted(names)) or 'none'}")


def reaches(mechanism: Parts, name: str, point: str, where: str) -> None:
    """Raise a ValueError if a link is unknown or does not reach a point."""
    links = {link.name: link for link in mechanism.links}
    known("link", name, links, where)
    if point not in links[name].points:
        raise ValueError(f"{where}: link '{name}' does not reach it; its points: {', '.join(links[name].points)}")


def refers(mechanism: Parts, at: str, where: str) -> None:
    """Raise a ValueError if a point reference names an unknown point or link, or a link that does not reach its point."""
    body, point = place(at)
    known("point", point, mechanism.points, where)
    if body and body != GROUND:
        reaches(mechanism, body, point, where)


def holder(mechanism: Parts, at: str) -> str:
    """Body that a load at a point reference acts on: a link with coordinates, a guide's block (by its point) or 'ground'.

    The end of a strut, which has no mass, is held by what it is pinned to, there or through other struts.

    Raises
    ------
    ValueError
        If nothing with mass holds it.
    """
    body, point = place(at)
    links = {link.name: link for link in mechanism.links}
    if not body:
        carriers = [link for link in mechanism.links if point in link.points]
        body = next((link.name for link in carriers if not link.body.massless), carriers[0].name if carriers else GROUND)
    if body == GROUND or not links[body].body.massless:
        return body
    pinned, found = [body], {body}
    for each in pinned:
        if each == GROUND or not links[each].body.massless:
            return each
        if any(guide.point == point and guide.link == each for guide in mechanism.guides):
            return point
        for joint in mechanism.joints:
            if joint.point == point and each in (joint.first, joint.second):
                pinned += sorted({joint.first, joint.second} - found)
                found |= {joint.first, joint.second}
    needed = "a link with mass, a guide or ground"
    raise ValueError(f"link '{body}': a Strut is massless, so '{point}' must be pinned to {needed}")


def takes_moments(mechanism: Parts, names: tuple[str, ...], where: str) -> None:
    """Raise a ValueError if one of these links is massless: a force between two points takes no moment."""
    for link in mechanism.links:
        if link.name in names and link.body.massless:
            kind = type(link.body).__name__
            raise ValueError(f"{where}: link '{link.name}' is a {kind}, a force between two points; it takes no moment")


class Joint(Element):
    """What joins two bodies, links or the ground, at a point.

    Attributes
    ----------
    ideal : bool
        Whether it is a constraint; else contact holds it.
    """

    ideal: ClassVar[bool] = True
    point: str
    first: str
    second: str

    @property
    def where(self) -> str:
        """'joint at' and its point."""
        return f"joint at '{self.point}'"

    @property
    def key(self) -> str:
        """Point and bodies."""
        return f"{self.point}.{self.first}-{self.second}"

    def check(self, mechanism: Parts) -> None:
        """Two different bodies that reach the point, not joined there already."""
        known("point", self.point, mechanism.points, self.where)
        self.apart(mechanism)
        for name in (self.first, self.second):
            if name != GROUND:
                reaches(mechanism, name, self.point, self.where)

    def apart(self, mechanism: Parts) -> None:
        """Raise a ValueError if it joins a body to itself, or two that are joined at the point already."""
        if self.first == self.second:
            raise ValueError(f"{self.where}: joins '{self.first}' to itself")
        ends = {self.first, self.second}
        if sum(joint.point == self.point and {joint.first, joint.second} == ends for joint in mechanism.joints) > 1:
            raise ValueError(f"{self.where}: joins {' and '.join(sorted(ends))} twice")


def turned(angle: Array, vector: Any) -> Array:
    """A fixed vector (2,) turned by angles (times,): (times, 2)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.column_stack([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def left(vectors: Array) -> Array:
    """Vectors (..., 2) turned a quarter to the left."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)
