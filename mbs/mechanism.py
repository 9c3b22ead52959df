"""A planar mechanism in one glance: points, links, joints, guides, stops and a drive.

Everything here is frozen, in SI, validated when made, and free of the engine. Fidelity is the type of a link or joint, never
a flag: `Rigid`, `Strut`, `Beam`, `Cable`; `Revolute`, `Clearance`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot, inf
from typing import Any

from elastica import law
from mbs.laws import FrictionLaw, LuGre, NoFriction, NormalLaw
from mbs.sections import Section
from mbs.validate import non_negative, number, positive, whole

GROUND = "ground"
Pair = tuple[float, float]


# --- links ------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Rigid:
    """A uniform rigid bar of this section."""

    section: Section


@dataclass(frozen=True)
class Strut:
    """A massless pinned strip: straight and stiff up to the Euler load, then the post-buckled force of the exact elastica.

    Parameters
    ----------
    section : Section
    load : callable
        Normalised force p(u), p = P L^2/(E I), of the normalised bending shortening u >= 0: `elastica.law.fast` (default,
        exact to 1e-12 for u <= 1), `elastica.pinned.load` (to u = 1.5) or the published `elastica.law.quartic`.
    """

    section: Section
    load: Callable[[Any], Any] = law.fast


@dataclass(frozen=True)
class Beam:
    """A flexible link of geometrically exact (shear-deformable) beam elements.

    Parameters
    ----------
    section : Section
    elements : int
        Number of elements, 1 to 1000.
    nodes : int
        Nodes an element, 2 (linear) or 3 (quadratic; far more accurate for its price).
    imperfection : float
        Stress-free half-sine bow, m, at mid-span; positive to the left of the direction from start to end.
    """

    section: Section
    elements: int = 8
    nodes: int = 3
    imperfection: float = 0.0

    def __post_init__(self) -> None:
        whole("elements", self.elements, 1, 1000)
        whole("nodes", self.nodes, 2, 3)
        number("imperfection", self.imperfection, -1.0, 1.0, "m")


@dataclass(frozen=True)
class Cable:
    """A flexible link of shear-rigid ANCF cable elements (cubic Hermite).

    Parameters
    ----------
    section : Section
    elements : int
        Number of elements, 1 to 1000.
    imperfection : float
        Stress-free half-sine bow, m, at mid-span; positive to the left of the direction from start to end.
    """

    section: Section
    elements: int = 8
    imperfection: float = 0.0

    def __post_init__(self) -> None:
        whole("elements", self.elements, 1, 1000)
        number("imperfection", self.imperfection, -1.0, 1.0, "m")


Body = Rigid | Strut | Beam | Cable


@dataclass(frozen=True)
class Link:
    """A named link from one point to another.

    Parameters
    ----------
    name, start, end : str
        Its name, and the names of the points at its two ends.
    body : Rigid, Strut, Beam or Cable
        What it is made of, and so how it is modelled.
    carries : sequence of str
        Further points fixed to a rigid link (a coupler point, a third joint).
    """

    name: str
    start: str
    end: str
    body: Body
    carries: Sequence[str] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "carries", tuple(self.carries))
        if self.carries and not isinstance(self.body, Rigid):
            raise ValueError(f"link '{self.name}': only a Rigid link carries further points, not a {type(self.body).__name__}")

    @property
    def points(self) -> tuple[str, ...]:
        """All points on the link: start, end, carried."""
        return (self.start, self.end, *self.carries)


# --- what holds and moves the links -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Revolute:
    """An ideal pin at a point between two links, or a link and 'ground'."""

    point: str
    first: str
    second: str


@dataclass(frozen=True)
class Clearance:
    """A pin of the first body in a bush of the second, with play between them, contact and friction.

    Parameters
    ----------
    point, first, second : str
        The point and the two bodies, links or 'ground'; the pin is the first's, the bush the second's.
    pin : float
        Radius of the pin, m.
    gap : float
        Radial clearance, m: bush radius minus pin radius. A joint without play is a `Revolute`.
    law : NormalLaw
        Of `mbs.laws`, with depth in m.
    friction : FrictionLaw
        Of `mbs.laws`; none by default.
    """

    point: str
    first: str
    second: str
    pin: float
    gap: float
    law: NormalLaw
    friction: FrictionLaw = field(default_factory=NoFriction)

    def __post_init__(self) -> None:
        positive("pin", self.pin, "m")
        if self.gap == 0:
            raise ValueError(f"gap = 0 m at '{self.point}': must be positive; a joint without play is a Revolute")
        positive("gap", self.gap, "m")
        if not isinstance(self.law, NormalLaw):
            raise ValueError(f"clearance at '{self.point}': law = {self.law!r} is not a NormalLaw, as those of mbs.laws are")
        if not isinstance(self.friction, FrictionLaw) or isinstance(self.friction, LuGre):
            raise ValueError(f"clearance at '{self.point}': friction = {self.friction!r} has no coefficient(speed) of its own")


@dataclass(frozen=True)
class GuideFriction:
    """Dry and viscous friction of a guide, regularised near zero speed (Stribeck).

    F = dynamic + (static - dynamic) exp(-(|v| - v_r)/v_s) + viscous (|v| - v_r) beyond the regularisation speed v_r, and
    linear through zero below it, so a resting slider creeps instead of sticking.

    Parameters
    ----------
    dynamic, static : float
        Friction forces, N; `static` at least `dynamic` (default: equal).
    viscous : float
        N s/m.
    regularisation, stribeck : float
        Speeds v_r and v_s, m/s.
    """

    dynamic: float
    static: float | None = None
    viscous: float = 0.0
    regularisation: float = 1e-3
    stribeck: float = 1e-2

    def __post_init__(self) -> None:
        non_negative("dynamic", self.dynamic, "N")
        if self.static is not None:
            number("static", self.static, self.dynamic, float("inf"), "N")
        non_negative("viscous", self.viscous, "N s/m")
        positive("regularisation", self.regularisation, "m/s")
        positive("stribeck", self.stribeck, "m/s")

    @property
    def static_offset(self) -> float:
        """Static minus dynamic friction, N."""
        return 0.0 if self.static is None else self.static - self.dynamic

    @classmethod
    def of_weight(cls, coefficient: float, mass: float, gravity: float = 9.81, **kw: float) -> GuideFriction:
        """Coulomb friction of a slider lying on its guide, gravity normal to the plane of motion: mu m g."""
        non_negative("coefficient", coefficient, "1")
        return cls(coefficient * mass * gravity, **kw)


@dataclass(frozen=True)
class Guide:
    """A slider block pinned to a link's point, free to move along a straight line through the point's initial place.

    Parameters
    ----------
    point, link : str
        The guided point and the link whose end (or carried point) it is.
    along : (float, float)
        Direction of the line; need not be a unit vector.
    mass : float
        Of the block, kg.
    friction : GuideFriction, optional
    """

    point: str
    link: str
    along: Pair = (1.0, 0.0)
    mass: float = 0.0
    friction: GuideFriction | None = None

    def __post_init__(self) -> None:
        x, y = (float(c) for c in self.along)
        positive("along (length)", hypot(x, y), "1")
        object.__setattr__(self, "along", (x / hypot(x, y), y / hypot(x, y)))
        non_negative("mass", self.mass, "kg")


@dataclass(frozen=True)
class Stop:
    """A stopper in the way of a guided point.

    Parameters
    ----------
    point : str
        A guided point.
    at : float
        Place of the stopper's face along the guide: the dot product of its position with the guide's direction, m. The point
        starts on one side of it and is kept there.
    law : NormalLaw
        Contact law of `mbs.laws`.
    """

    point: str
    at: float
    law: NormalLaw

    def __post_init__(self) -> None:
        number("at", self.at, -1e6, 1e6, "m")
        if not isinstance(self.law, NormalLaw):
            raise ValueError(f"stop at '{self.point}': law = {self.law!r} is not a NormalLaw, as those of mbs.laws are")


@dataclass(frozen=True)
class Ramp:
    """Speed that changes linearly from `start` to `end` (rad/s or m/s) over `duration` seconds, then stays."""

    start: float
    end: float
    duration: float

    def __post_init__(self) -> None:
        number("start", self.start, -inf, inf, "rad/s or m/s")
        number("end", self.end, -inf, inf, "rad/s or m/s")
        positive("duration", self.duration, "s")

    def speed(self, t: float) -> float:
        """Speed at time t >= 0."""
        return self.start + (self.end - self.start) * min(t, self.duration) / self.duration

    def position(self, t: float) -> float:
        """Angle or displacement since t = 0: the exact integral of `speed`."""
        s = min(t, self.duration)
        return self.start * s + (self.end - self.start) * s * s / (2 * self.duration) + self.end * (t - s)

    def acceleration(self, t: float) -> float:
        """Rate of the speed at time t >= 0."""
        return (self.end - self.start) / self.duration if t < self.duration else 0.0


@dataclass(frozen=True)
class Motion:
    """Any motion: `position(t)` (rad or m, zero at t = 0) with its derivative `speed(t)`."""

    position: Callable[[float], float]
    speed: Callable[[float], float]

    def __post_init__(self) -> None:
        number("position(0)", self.position(0.0), -1e-12, 1e-12, "rad or m")
        h = 1e-4
        for t in (0.1, 0.5):
            slope = (self.position(t + h) - self.position(t - h)) / (2 * h)
            if abs(slope - self.speed(t)) > 1e-3 * (abs(slope) + abs(self.speed(t))) + 1e-6:
                raise ValueError(f"speed({t:g}) = {self.speed(t):g} is not the derivative of position: {slope:g}")

    def acceleration(self, t: float) -> float:
        """Central difference of the speed over 2e-4 s; at the start to second order from times after it."""
        h = 1e-4
        if t < h:
            return (4 * self.speed(t + h) - 3 * self.speed(t) - self.speed(t + 2 * h)) / (2 * h)
        return (self.speed(t + h) - self.speed(t - h)) / (2 * h)


@dataclass(frozen=True)
class Drive:
    """Prescribed rotation of a link, or prescribed travel of a guided point along its guide.

    Parameters
    ----------
    target : str
        Name of a rigid link (rotation, rad/s) or of a guided point (translation, m/s).
    speed : float, Ramp or Motion
    """

    target: str
    speed: float | Ramp | Motion

    def __post_init__(self) -> None:
        if not isinstance(self.speed, Ramp | Motion):
            number("speed", self.speed, -inf, inf, "rad/s or m/s")

    @property
    def motion(self) -> Motion | Ramp:
        """The drive as an object with position(t) and speed(t)."""
        if isinstance(self.speed, Ramp | Motion):
            return self.speed
        speed = float(self.speed)
        return Ramp(speed, speed, 1.0)


# --- the whole --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Mechanism:
    """A planar mechanism, checked for consistency when made.

    Parameters
    ----------
    points : mapping of str to (float, float)
        Named points at t = 0, m.
    links : sequence of Link
    joints : sequence of Revolute or Clearance
    guides : sequence of Guide
    stops : sequence of Stop
    drive : Drive, optional
    gravity : (float, float)
        Acceleration in the plane, m/s^2. Zero, the default, also stands for gravity normal to the plane.

    Raises
    ------
    ValueError
        If a name is unknown or doubled, a link has no length, a joint's link does not reach its point, and so on.
    """

    points: Mapping[str, Pair]
    links: Sequence[Link]
    joints: Sequence[Revolute | Clearance] = ()
    guides: Sequence[Guide] = ()
    stops: Sequence[Stop] = ()
    drive: Drive | None = None
    gravity: Pair = field(default=(0.0, 0.0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", {k: (float(x), float(y)) for k, (x, y) in dict(self.points).items()})
        for name in ("links", "joints", "guides", "stops"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        _check_numbers(self)
        _check_names(self)
        _check_links(self)
        _check_attachments(self)
        _check_drive(self)

    def link(self, name: str) -> Link:
        """The link of that name; KeyError if there is none."""
        return {link.name: link for link in self.links}[name]

    def guide(self, point: str) -> Guide:
        """The guide of that point; KeyError if there is none."""
        return {guide.point: guide for guide in self.guides}[point]

    def length(self, name: str) -> float:
        """Distance of a link's two end points, m."""
        link = self.link(name)
        (x0, y0), (x1, y1) = self.points[link.start], self.points[link.end]
        return hypot(x1 - x0, y1 - y0)


def _check_numbers(mechanism: Mechanism) -> None:
    for name, place in mechanism.points.items():
        for axis, value in zip("xy", place, strict=True):
            number(f"points['{name}'].{axis}", value, -inf, inf, "m")
    for axis, value in zip("xy", mechanism.gravity, strict=True):
        number(f"gravity.{axis}", value, -inf, inf, "m/s^2")


def _check_names(mechanism: Mechanism) -> None:
    names = [link.name for link in mechanism.links]
    if not names:
        raise ValueError("links: a mechanism needs at least one link")
    doubled = {name for name in names if names.count(name) > 1} | ({GROUND} & set(names)) | (set(names) & set(mechanism.points))
    if doubled:
        raise ValueError(f"link names must be unique, not '{GROUND}' and not a point's name; doubled: {sorted(doubled)}")
    guided = [guide.point for guide in mechanism.guides]
    if len(set(guided)) < len(guided):
        raise ValueError("guides: a point has at most one guide")


def _check_links(mechanism: Mechanism) -> None:
    for link in mechanism.links:
        for point in link.points:
            _known("point", point, mechanism.points, f"link '{link.name}'")
        positive(f"length of link '{link.name}'", mechanism.length(link.name), "m")


def _check_attachments(mechanism: Mechanism) -> None:
    links = {link.name: link for link in mechanism.links}
    for joint in mechanism.joints:
        where = f"joint at '{joint.point}'"
        _known("point", joint.point, mechanism.points, where)
        if joint.first == joint.second:
            raise ValueError(f"{where}: joins '{joint.first}' to itself")
        for name in (joint.first, joint.second):
            if name != GROUND:
                _reaches(links, name, joint.point, where)
    joined = [(joint.point, frozenset((joint.first, joint.second))) for joint in mechanism.joints]
    for point, pair in set(joined):
        if joined.count((point, pair)) > 1:
            raise ValueError(f"joint at '{point}': joins {' and '.join(sorted(pair))} twice")
    for guide in mechanism.guides:
        where = f"guide of '{guide.point}'"
        _known("point", guide.point, mechanism.points, where)
        _reaches(links, guide.link, guide.point, where)
    for stop in mechanism.stops:
        _known("guided point", stop.point, {guide.point for guide in mechanism.guides}, "stop")


def _check_drive(mechanism: Mechanism) -> None:
    if mechanism.drive is None:
        return
    target = mechanism.drive.target
    rigid = {link.name for link in mechanism.links if isinstance(link.body, Rigid)}
    _known("rigid link or guided point", target, rigid | {guide.point for guide in mechanism.guides}, "drive")


def _known(kind: str, name: str, known: Any, where: str) -> None:
    if name not in known:
        raise ValueError(f"{where}: unknown {kind} '{name}'; known: {', '.join(sorted(known)) or 'none'}")


def _reaches(links: Mapping[str, Link], name: str, point: str, where: str) -> None:
    _known("link", name, links, where)
    if point not in links[name].points:
        raise ValueError(f"{where}: link '{name}' does not reach it; its points: {', '.join(links[name].points)}")
