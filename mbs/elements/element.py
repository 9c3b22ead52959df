"""Base of all elements: name, constraints, forces, signals, energies; and references to points.

An element knows its mechanism as `Parts`, and a run of any solver as `Recorded`.
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
    """Reference to a point of a body: a link's name, 'ground', or '' for any link that carries the point."""

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
        """Return the power on the body, W, (times,)."""
        return np.asarray((self.force * record.point(self.at)[1]).sum(axis=1) + self.torque * record.turn(self.at)[1])


class _Texts(Formatter):
    """Formatter of titles and labels, which contain fields of an element."""

    def format_field(self, value: object, format_spec: str) -> str:
        """Write a field as it is, in lower case, or the point or body of a reference."""
        text = str(value)
        return {"": text, "lower": text.lower(), "point": place(text).point, "body": text.partition(":")[0]}[format_spec]

    def of(self, text: str, element: Element) -> str:
        """Fill in the fields of an element."""
        return self.vformat(text, (), {"kind": type(element).__name__, **vars(element)})


TEXTS = _Texts()


class Element(Declared):
    """Base of the elements of a mechanism.

    `title` is the name in messages; `label` that in a mechanism, where a second element of the same name is `name.2`. Both
    contain fields in braces; `{point:point}` and `{link:body}` are parts of a reference, `{kind}` and `{kind:lower}` the class.
    """

    title: ClassVar[str] = ""
    label: ClassVar[str] = ""
    sense: ClassVar[float] = 1.0
    """Sign of the signal of its force relative to the multiplier."""

    @property
    def where(self) -> str:
        """Name in messages."""
        return TEXTS.of(self.title, self)

    @property
    def key(self) -> str:
        """Name in a mechanism."""
        return TEXTS.of(self.label, self)

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError if the element does not fit the mechanism."""

    def rows(self, mechanism: Parts) -> Iterator[Any]:
        """Yield the constraints, as `buckler.mbs.elements.rows`; none by default."""
        yield from ()

    def reactions(self, multipliers: Array) -> dict[str, Array] | None:
        """Return channels from the multipliers (times, rows) of its rows, for a motion that constraints alone determine.

        A multiplier times the coefficient of a term is the force, or torque, on the first body of the term; on the second body
        it is the opposite. None, the default, if the reactions are not known.
        """
        return None

    @property
    def rubs(self) -> str:
        """The point or link on which dry friction acts; '' without friction."""
        return ""

    @property
    def has_states(self) -> bool:
        """True if the force has states, which are integrated with the motion."""
        return False

    @property
    def rubs_on_reaction(self) -> bool:
        """True if friction depends on the reaction of the same element, so that it is unknown in a known motion."""
        return False

    def pushes(self, name: str, record: Recorded) -> Iterator[Push] | None:
        """Return the forces on bodies in a known motion; None, the default, if they are not known."""
        return None

    def check_run(self, duration: float, name: str) -> None:
        """Raise a ValueError if the element is not defined for the duration, s; nothing by default."""

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Return the times in (0, duration), s, at which a prescribed value has a kink or jump; none by default."""
        return ()

    def user_functions(self, name: str, record: Recorded) -> Iterator[Called]:
        """Yield the user's functions with their arguments over a run, except functions of time alone; none by default."""
        yield from ()

    def depths(self, name: str, mechanism: Parts) -> Iterator[Depth]:
        """Yield the largest allowed depths of contacts; none by default."""
        yield from ()

    def one_sided(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield names of forces that must not be negative, each with that of the depth, or ''; none by default."""
        yield from ()

    def remarks(self, name: str, signals: Mapping[str, Array]) -> Iterator[str]:
        """Yield remarks on a run, in sentences; none by default."""
        yield from ()

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the signals of a run; none by default."""
        yield from ()

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the energies of a run; none by default."""
        yield from ()

    def burdens(self, mechanism: Parts) -> Iterator[Burden]:
        """Yield the masses that are added to bodies; none by default."""
        yield from ()


class Body(Declared):
    """Base of the bodies of links.

    Attributes
    ----------
    flexible : bool
        True if the ends can move relative to each other.
    meshed : bool
        True for a strip of finite elements; see `buckler.mbs.elements.beam`.
    massless : bool
        True for a force element between its neighbours; its force has kinks.
    turns : bool
        True if its points have an angle, so that a torque can act there.
    carrying : tuple of str
        Ways to define further points: at a "fraction" of the length, at a "place" in the plane.
    linear : bool
        True if deformations are small: modes of a solid.
    round_off : float
        Rounding error of the internal force, over the axial stiffness.
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
        """Return mass, kg, inertia about the centre of mass, kg m^2, and that centre, m, of the undeformed link."""
        return self.section.bar(length)

    def along(self, chord: float, fraction: float) -> tuple[float, float]:
        """Return the place at a fraction of the stress-free length, m, in the link's frame, for a distance of the ends, m."""
        return chord * fraction, 0.0

    def signals(self, link: Linked, record: Recorded) -> Iterator[Signal]:
        """Yield the signals of the deformation; none by default."""
        yield from ()

    def energies(self, link: Linked, record: Recorded) -> Iterator[Energy]:
        """Yield strain energy and energy dissipated by damping, for each strain of a flexible link."""
        for strain in record.links[link.name].strains() if self.flexible else ():
            yield Energy("held", "strain", strain.energy)
            yield Energy("taken", "damping", record.work(strain.power))


class Joined(Element):
    """A joint, as other elements know it: `ideal` if it is a constraint, not a contact."""

    ideal: ClassVar[bool] = True
    point: str
    first: str
    second: str


class Linked(Element):
    """A link, as other elements know it."""

    name: str
    start: str
    end: str
    body: Body

    @property
    def points(self) -> tuple[str, ...]:
        """All points on the link: start, end, carried."""
        raise NotImplementedError


class Guided(Element):
    """A guide, as other elements know it."""

    point: str
    link: str
    along: Pair


class Driven(Element):
    """A drive, as other elements know it."""

    target: str


class Parts(Declared):
    """A mechanism, as its elements know it."""

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
        """Return the distance of a link's two end points, m."""
        raise NotImplementedError

    def elements(self) -> dict[str, Element]:
        """Return all elements by name; a second element of the same name is `name.2`."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class Recorded:
    """A run as plain arrays over `time` (times,) [s], as elements know it.

    `links` are motions of links that have coordinates, as in `buckler.mbs.record.record`; `blocks` those of guides, by point.
    `channels` (times, columns) are other recorded values, by the names of element and channel.
    """

    mechanism: Parts
    time: Array
    links: Mapping[str, Any]
    blocks: Mapping[str, Slid]
    channels: Mapping[str, Mapping[str, Array]]
    _made: dict[Any, Any] = field(default_factory=dict, init=False, repr=False)

    def once(self, key: Any, make: Callable[[], Any]) -> Any:
        """Return the value of `make()`, computed once for each key, as signals and energies need the same arrays."""
        if key not in self._made:
            self._made[key] = make()
        return self._made[key]

    def channel(self, element: str, name: str) -> Array:
        """Return a recorded channel of an element; no columns if there is none."""
        found: Array = self.channels.get(element, {}).get(name, np.empty((len(self.time), 0)))
        return found

    def point(self, at: str) -> tuple[Array, Array]:
        """Return place and velocity of a point reference, each (times, 2), by the body that carries it; fixed without one."""
        body, point = place(at)
        motion = self._carrier(body, point)
        if motion is not None:
            found: tuple[Array, Array] = self.once(("point", at), lambda: motion.point(point))
            return found
        fixed = np.tile(self.mechanism.points[point], (len(self.time), 1))
        return fixed, np.zeros_like(fixed)

    def turn(self, at: str) -> tuple[Array, Array]:
        """Return the angle since t = 0 at a point reference, rad, and its rate, each (times,)."""
        body, point = place(at)
        motion = self._carrier(body, point)
        if motion is not None:
            return motion.turn(point)
        return np.zeros_like(self.time), np.zeros_like(self.time)

    def work(self, power: Array, sides: tuple[Array, Array] | None = None) -> Array:
        """Return the work, J, of a power, W, since t = 0, each (times,); `sides` are the power just before and after samples."""
        raise NotImplementedError

    def _carrier(self, body: str, point: str) -> Moved | None:
        if body == GROUND:
            return None
        carriers = [link.name for link in self.mechanism.links if point in link.points]
        motions: dict[str, Moved] = {**self.links, **self.blocks}
        return next((motions[name] for name in (body, point, *carriers) if name in motions), None)
