"""Base classes of elements and of the bodies of links, and the data on which elements rely.

A point reference is a text that names a point of a body: 'A', 'coupler:A' or 'ground:A'. Elements read their mechanism through
`Parts`, the base of `Mechanism`, and a run of any solver through `Recorded`, the base of `Record`. An argument `name` is the name
of the element in the mechanism.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from math import dist
from typing import Any, ClassVar, NamedTuple, TypeVar, cast

import numpy as np

from ..declare import Declared
from ..functions import Called
from ..geometry import Array
from .signal import DepthLimit, Energy, MovingBody, Signal, SlidingBlock

Pair = tuple[float, float]
Value = TypeVar("Value")
GROUND = "ground"
"""Name of the fixed body in point references."""


class Place(NamedTuple):
    """Point reference in two parts, not a position; the body is a link, a guide's block, 'ground', or '' for any body."""

    body: str
    point: str


def place(at: str) -> Place:
    """Split a point reference at its colon."""
    body, _, point = at.rpartition(":")
    return Place(body, point)


class Burden(NamedTuple):
    """Mass [kg] and moment of inertia about the point [kg m^2] that an element adds to a body at a point reference."""

    at: str
    mass: float
    inertia: float


class Push(NamedTuple):
    """Load of an element on a body at a point reference: force (times, 2) [N] and torque (times,) [N m]."""

    at: str
    force: Array
    torque: Array

    def power(self, record: Recorded) -> Array:
        """Return the power of the load on the body (times,) [W]."""
        (_, velocity), (_, spin) = record.point(self.at), record.turn(self.at)
        return np.asarray((self.force * velocity).sum(axis=1) + self.torque * spin)


def _fill(template: str, element: Element) -> str:
    """Fill in the fields in braces of a title or label, as `Element` defines them."""

    def write_field(match: re.Match[str]) -> str:
        """Return the text for a field in braces."""
        name, form = match.groups()
        text = type(element).__name__ if name == "kind" else str(getattr(element, name))
        return {"": text, "lower": text.lower(), "point": place(text).point, "body": text.partition(":")[0]}[form]

    return re.sub(r"{(\w+):?(\w*)}", write_field, template)


class Element(Declared):
    """Base of the elements of a mechanism.

    The templates `title` and `label` contain fields in braces. `{a}` stands for the text of the field `a`, `{a:point}` for the
    point of this reference, and `{a:body}` for its text before the colon, or all of it. `{kind}` is the name of the class.
    """

    title: ClassVar[str] = ""  # template of `where`
    label: ClassVar[str] = ""  # template of `key`
    sense: ClassVar[float] = 1.0  # sign of the force signal relative to the multiplier of the constraint

    @property
    def where(self) -> str:
        """Name in messages."""
        return _fill(self.title, self)

    @property
    def key(self) -> str:
        """Name in the mechanism and of the signals; a second element of the same key is called `key.2`."""
        return _fill(self.label, self)

    def check(self, mechanism: Parts) -> None:
        """Raise a ValueError if the element does not fit the mechanism."""

    def rows(self, mechanism: Parts) -> Iterator[Any]:
        """Yield the constraint equations, each a `Row` of `buckler.mbs.elements.rows`; none by default."""
        yield from ()

    def reactions(self, multipliers: Array) -> dict[str, Array] | None:
        """Return the reactions by name of channel, from the multipliers (times, rows) of `rows`; None if they are not known.

        A row is a sum of coefficients times measures, each between two bodies. Here multipliers have the sign with which a
        multiplier times a coefficient is the load on the first body of the measure, and its opposite the load on the second. The
        solvers' lambda, in M a + G^T lambda = force, has the other sign.
        """
        return None

    @property
    def friction_at(self) -> str:
        """Point or link at which dry friction acts, for messages; '' without friction."""
        return ""

    @property
    def has_states(self) -> bool:
        """True if the force depends on states, which are integrated with the motion."""
        return False

    def pushes(self, name: str, record: Recorded) -> Iterator[Push] | None:
        """Return the loads on bodies from a known motion; None, the default, if the motion does not give them."""
        return None

    def kinks(self, duration: float) -> tuple[float, ...]:
        """Return the times in (0, duration) at which a prescribed value has a kink or a jump [s]; none by default."""
        return ()

    def user_functions(self, name: str, record: Recorded) -> Iterator[Called]:
        """Yield the user's functions with their arguments over a run, without functions of time alone; none by default."""
        yield from ()

    def depths(self, name: str, mechanism: Parts) -> Iterator[DepthLimit]:
        """Yield the largest depth of each contact at which a run is not suspect; none by default."""
        yield from ()

    def unilateral_forces(self, name: str) -> Iterator[tuple[str, str]]:
        """Yield the names of signals of forces that must not be negative, each with the name of its depth's signal or ''."""
        yield from ()

    def remarks(self, name: str, signals: Mapping[str, Array]) -> Iterator[str]:
        """Yield sentences about a run that its user should know; none by default."""
        yield from ()

    def signals(self, name: str, record: Recorded) -> Iterator[Signal]:
        """Yield the signals of a run; none by default."""
        yield from ()

    def energies(self, name: str, record: Recorded) -> Iterator[Energy]:
        """Yield the energies of a run; none by default."""
        yield from ()

    def burdens(self, mechanism: Parts) -> Iterator[Burden]:
        """Yield the masses and inertias that the element adds to bodies; none by default."""
        yield from ()


class Body(Declared):
    """Base of the bodies of links."""

    section: Any  # a `Section` or `Profile`; a rigid body of given mass has None
    flexible: ClassVar[bool] = True  # the ends can move relative to each other
    meshed: ClassVar[bool] = False  # a strip of finite elements, a `Beam` or `Cable`
    massless: ClassVar[bool] = False  # a `Strut`, a mere force between the bodies at its ends; the force has kinks
    has_angles: ClassVar[bool] = True  # nodes have an angle as coordinate; those of a `Cable` have a slope instead
    linear: ClassVar[bool] = False  # the model holds for small deformations only; a check warns of runs with large ones
    # forms of points other than the ends: a "fraction" of the length, a "place" in the link's frame
    carried_point_forms: ClassVar[tuple[str, ...]] = ()
    # rounding error of the internal force over E A: no residual of Newton's method can be smaller
    force_rounding: ClassVar[float] = 0.0

    def mass_properties(self, length: float) -> tuple[float, float, tuple[float, float]]:
        """Return mass [kg], inertia about the centre [kg m^2], centre of mass [m] in the link's frame; here of a uniform bar."""
        mass, rotary_inertia = self.section.mass_per_length * length, self.section.inertia_per_length * length
        return mass, mass * length**2 / 12 + rotary_inertia, (length / 2, 0.0)

    def place_at(self, chord: float, fraction: float) -> tuple[float, float]:
        """Return the stress-free place [m] in the link's frame at a fraction of its length; `chord` is the ends' distance [m]."""
        return chord * fraction, 0.0

    def signals(self, link: LinkBase, record: Recorded) -> Iterator[Signal]:
        """Yield the signals of the deformation; none by default."""
        yield from ()

    def energies(self, link: LinkBase, record: Recorded) -> Iterator[Energy]:
        """Yield strain energy and dissipated energy of each strain of a flexible link: bending, axial, shear."""
        for strain in record.links[link.name].strains() if self.flexible else ():
            yield Energy("stored", "strain", strain.energy)
            yield Energy("dissipated", "damping", record.work(strain.power))


class JointBase(Element):
    """Base of joints: the fields that other elements use."""

    ideal: ClassVar[bool] = True  # False for a joint with clearance, whose contact is a force and no constraint
    point: str
    first: str
    second: str


class LinkBase(Element):
    """Base of links: the fields that other elements use."""

    name: str
    start: str
    end: str
    body: Body
    carries: Iterable[str]

    @property
    def points(self) -> tuple[str, ...]:
        """Names of all points on the link: start, end, carried points."""
        return (self.start, self.end, *self.carries)


class GuideBase(Element):
    """Base of guides: the fields that other elements use."""

    point: str
    link: str
    along: Pair


class Parts(Declared):
    """Base of mechanisms: the fields and methods that elements use."""

    in_files = False  # a mechanism is not a part in a file, as the classes are that `Declared` registers by name

    points: Mapping[str, Pair]
    links: Sequence[LinkBase]
    joints: Sequence[JointBase]
    guides: Sequence[GuideBase]
    drives: Sequence[Element]
    gravity: Pair
    link: Callable[[str], LinkBase]  # by its name; KeyError if there is none
    guide: Callable[[str], GuideBase]  # by its point

    def length(self, name: str) -> float:
        """Return the distance of a link's two end points at t = 0 [m]."""
        link = self.link(name)
        return dist(self.points[link.start], self.points[link.end])


@dataclass(frozen=True, eq=False)
class Recorded:
    """Data of a run over `time` (times,) [s] that elements use.

    `links` are the motions of links that have coordinates; those of flexible links have `strains()`, each with `energy` [J] and
    dissipated `power` [W]. `blocks` are the motions of guides' blocks by point. `channels` (times, columns) are other recorded
    values, such as reactions, by the names of element and channel.
    """

    mechanism: Parts
    time: Array
    links: Mapping[str, Any]
    blocks: Mapping[str, SlidingBlock]
    channels: Mapping[str, Mapping[str, Array]]
    _cache: dict[object, Any] = field(default_factory=dict, init=False, repr=False)

    def once(self, key: object, compute: Callable[[], Value]) -> Value:
        """Return the value of `compute()`, computed once for each key: signals and energies need the same arrays."""
        if key not in self._cache:
            self._cache[key] = compute()
        return cast(Value, self._cache[key])

    def channel(self, element: str, name: str) -> Array:
        """Return a channel of an element (times, columns); an array (times, 0) if the solver recorded none."""
        return self.channels.get(element, {}).get(name, np.empty((len(self.time), 0)))

    def point(self, at: str) -> tuple[Array, Array]:
        """Return place [m] and velocity [m/s] at a point reference, each (times, 2); a point without a body is at rest."""
        motion, point = self._motion_at(at), place(at).point
        if motion is not None:
            return self.once(("point", at), lambda: motion.point(point))
        fixed = np.tile(self.mechanism.points[point], (len(self.time), 1))
        return fixed, np.zeros_like(fixed)

    def turn(self, at: str) -> tuple[Array, Array]:
        """Return the angle since t = 0 [rad] and its rate [rad/s] at a point reference, each (times,)."""
        motion = self._motion_at(at)
        return (np.zeros_like(self.time),) * 2 if motion is None else motion.turn(place(at).point)

    def work(self, power: Array, sides: tuple[Array, Array] | None = None) -> Array:
        """Return the work [J] of a power [W] that may jump at samples; `sides` are the powers just before and after them."""
        raise NotImplementedError

    def _motion_at(self, at: str) -> MovingBody | None:
        """Return the motion of the body at a point reference, or of another body at a strut's end; None on the ground."""
        body, point = place(at)
        if body == GROUND:
            return None
        carriers = [link.name for link in self.mechanism.links if point in link.points]
        motions: dict[str, MovingBody] = {**self.links, **self.blocks}  # a block has the name of its point
        return next((motions[name] for name in (body, point, *carriers) if name in motions), None)
