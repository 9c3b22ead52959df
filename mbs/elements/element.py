"""Base of all elements, from plain arrays: a name, signals, energies; and references to points.

An element sees its mechanism as `Parts`, and a run, which all solvers leave behind alike, as `Recorded`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from string import Formatter
from typing import Any, ClassVar, NamedTuple

import numpy as np

from ..declare import Declared
from ..functions import Called
from ..geometry import Array
from .signal import Depth, Energy, Moved, Signal, Slid

Pair = tuple[float, float]
GROUND = "ground"


class Place(NamedTuple):
    """A point reference: '' for whatever link carries the point, a link's name, or 'ground'."""

    body: str
    point: str


def place(at: str) -> Place:
    """Read a point reference: 'A', 'coupler:A' or 'ground:A'."""
    body, colon, point = at.rpartition(":")
    return Place(body if colon else "", point)


class Burden(NamedTuple):
    """Mass, kg, and moment of inertia, kg m^2, that an element adds to a body at a point reference 'link:point'."""

    at: str
    mass: float
    inertia: float


class Push(NamedTuple):
    """Force of an element on a body at a point reference: a force, N, (times, 2), and a torque, N m, (times,)."""

    at: str
    force: Array
    torque: Array

    def power(self, record: Recorded) -> Array:
        """Power it gives to its body, W, (times,)."""
        return np.asarray((self.force * record.point(self.at)[1]).sum(axis=1) + self.torque * record.turn(self.at)[1])


class _Texts(Formatter):
    """Fields in texts, and parts of those that are references."""

    def format_field(self, value: object, format_spec: str) -> str:
        """Write a field, in small letters, or the point or body that it refers to."""
        text = str(value)
        return {"": text, "lower": text.lower(), "point": place(text).point, "body": text.partition(":")[0]}[format_spec]

    def of(self, text: str, element: Element) -> str:
        """Fill in the fields of an element."""
        return self.vformat(text, (), {"kind": type(element).__name__, **vars(element)})


TEXTS = _Texts()


class Element(Declared):
    """A kind of thing a mechanism is made of: what it is called, whether it fits, its signals, its energies.

    Messages call it `title`; `label` is its name in a mechanism, where a second one is `name.2`. Both are texts with its fields
    in braces; `{point:point}` and `{link:body}` are parts of a point reference, `{kind}` and `{kind:lower}` name the class.
    """

    title: ClassVar[str] = ""
    label: ClassVar[str] = ""
    sense: ClassVar[float] = 1.0
    """Sign of its signal against its effort."""

    @property
    def where(self) -> str:
        """Name in messages."""
        return TEXTS.of(self.title, self)

    @property
    def key(self) -> str:
        """Its name in a mechanism."""
        return TEXTS.of(self.label, self)

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
    def rubs(self) -> str:
        """The point or link on which dry friction acts; '' where there is none."""
        return ""

    @property
    def has_states(self) -> bool:
        """True if its force has states of its own, which are integrated with the motion."""
        return False

    @property
    def rubs_on_reaction(self) -> bool:
        """True if its friction follows its own reaction, so that its forces are unknown before the motion is solved."""
        return False

    def pushes(self, name: str, record: Recorded) -> Iterator[Push] | None:
        """Return the forces it exerts in a known motion.

        None, the default, if it cannot tell.
        """
        return None

    def check_run(self, duration: float, name: str) -> None:
        """Raise a ValueError if it cannot run that long, s; nothing by default."""

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Times in (0, duration), s, at which what it prescribes is known to have a kink or jump; none by default."""
        return ()

    def user_functions(self, name: str, record: Recorded) -> Iterator[Called]:
        """Yield its user's functions with their arguments over a run, but for functions of time alone; none by default."""
        yield from ()

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


class Body(Declared):
    """Base of the bodies of links.

    Attributes
    ----------
    flexible : bool
        Whether its ends can move against each other.
    meshed : bool
        Whether it is a strip of finite elements; see `buckler.mbs.elements.beam`.
    massless : bool
        Whether it is a spring between its neighbours; its force has kinks.
    turns : bool
        Whether its points have an angle, so that a torque can act there.
    carrying : tuple of str
        How it can carry points besides its ends: at a "fraction" of its length, at a "place" in the plane.
    linear : bool
        Whether its deformation is taken for small: modes of a solid.
    round_off : float
        What round-off leaves of its internal force, of its axial stiffness.
    """

    section: Any
    flexible: ClassVar[bool] = True
    meshed: ClassVar[bool] = False
    massless: ClassVar[bool] = False
    turns: ClassVar[bool] = True
    linear: ClassVar[bool] = False
    carrying: ClassVar[tuple[str, ...]] = ()
    round_off: ClassVar[float] = 0.0

    def mass_properties(self, length: float) -> tuple[float, float, tuple[float, float]]:
        """Mass, kg, inertia about the centre of mass, kg m^2, and that centre, m, of the undeformed link."""
        return self.section.bar(length)

    def along(self, chord: float, fraction: float) -> tuple[float, float]:
        """Place at a fraction of the stress-free length, m, in the link's frame, for a distance of its ends, m."""
        return chord * fraction, 0.0

    def signals(self, link: Linked, record: Recorded) -> Iterator[Signal]:
        """Yield those besides the link's."""
        yield from ()

    def energies(self, link: Linked, record: Recorded) -> Iterator[Energy]:
        """Yield strain energy and what damping took, of each strain of a flexible link."""
        for strain in record.links[link.name].strains() if self.flexible else ():
            yield Energy("held", "strain", strain.energy)
            yield Energy("taken", "damping", record.work(strain.power))


class Joined(Element):
    """A joint, as other elements see it: `ideal` if it is a constraint, else contact holds it."""

    ideal: ClassVar[bool] = True
    point: str
    first: str
    second: str


class Linked(Element):
    """A link, as other elements see it."""

    name: str
    start: str
    end: str
    body: Body

    @property
    def points(self) -> tuple[str, ...]:
        """All points on the link: start, end, carried."""
        raise NotImplementedError


class Guided(Element):
    """A guide, as other elements see it."""

    point: str
    link: str
    along: Pair


class Driven(Element):
    """A drive, as other elements see it."""

    target: str


class Parts(Declared):
    """A mechanism, as its elements see it."""

    in_files = False

    points: Mapping[str, Pair]
    links: Sequence[Linked]
    joints: Sequence[Joined]
    guides: Sequence[Guided]
    drives: Sequence[Driven]
    gravity: Pair

    def link(self, name: str) -> Linked:
        """Return the link of that name; KeyError if there is none."""
        raise NotImplementedError

    def guide(self, point: str) -> Guided:
        """Return the guide of that point; KeyError if there is none."""
        raise NotImplementedError

    def length(self, name: str) -> float:
        """Distance of a link's two end points, m."""
        raise NotImplementedError

    def elements(self) -> dict[str, Element]:
        """Return all elements by their names: a second one of a name is `name.2`."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Recorded:
    """A run as plain arrays over `time` (times,) [s], as its elements see it.

    `links` are motions of links with coordinates of their own, as in `buckler.mbs.record.record`; `blocks` those of guides, by
    point. `channels` (times, columns) are what was recorded besides, by the element's name and the channel's.
    """

    mechanism: Parts
    time: Array
    links: Mapping[str, Any]
    blocks: Mapping[str, Slid]
    channels: Mapping[str, Mapping[str, Array]]
    _made: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    def once(self, key: Any, make: Callable[[], Any]) -> Any:
        """Return what `make()` makes, once for a key: signals and energies ask for the same arrays."""
        if key not in self._made:
            self._made[key] = make()
        return self._made[key]

    def channel(self, element: str, name: str) -> Array:
        """Return a recorded channel of an element; no columns if there is none."""
        found: Array = self.channels.get(element, {}).get(name, np.empty((len(self.time), 0)))
        return found

    def point(self, at: str) -> tuple[Array, Array]:
        """Place and velocity of a point reference, each (times, 2), from whatever body carries it; fixed if none does."""
        body, point = place(at)
        motion = self._carrier(body, point)
        if motion is not None:
            found: tuple[Array, Array] = self.once(("point", at), lambda: motion.point(point))
            return found
        fixed = np.tile(self.mechanism.points[point], (len(self.time), 1))
        return fixed, np.zeros_like(fixed)

    def turn(self, at: str) -> tuple[Array, Array]:
        """Angle turned since t = 0 at a point reference, rad, and its rate, each (times,)."""
        body, point = place(at)
        motion = self._carrier(body, point)
        if motion is not None:
            return motion.turn(point)
        return np.zeros_like(self.time), np.zeros_like(self.time)

    def work(self, power: Array, sides: tuple[Array, Array] | None = None) -> Array:
        """Work, J, of a power, W, since t = 0, each (times,); `sides` are what it is just before and just after each sample."""
        raise NotImplementedError

    def _carrier(self, body: str, point: str) -> Moved | None:
        if body == GROUND:
            return None
        carriers = [link.name for link in self.mechanism.links if point in link.points]
        motions: dict[str, Moved] = {**self.links, **self.blocks}
        return next((motions[name] for name in (body, point, *carriers) if name in motions), None)
