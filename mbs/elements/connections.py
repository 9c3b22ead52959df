"""What holds the links: pins, pins with play, guides, stops."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import hypot

from buckler.mbs.laws import BristleLaw, FrictionLaw, NoFriction, NormalLaw
from buckler.mbs.validate import non_negative, number, positive

Pair = tuple[float, float]


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
        Of `buckler.mbs.laws`, with depth in m.
    friction : FrictionLaw or BristleLaw
        Of `buckler.mbs.laws`; none by default.
    """

    point: str
    first: str
    second: str
    pin: float
    gap: float
    law: NormalLaw
    friction: FrictionLaw | BristleLaw = field(default_factory=NoFriction)

    def __post_init__(self) -> None:
        positive("pin", self.pin, "m")
        if self.gap == 0:
            raise ValueError(f"gap = 0 m at '{self.point}': must be positive; a joint without play is a Revolute")
        positive("gap", self.gap, "m")
        if not isinstance(self.law, NormalLaw):
            raise ValueError(
                f"clearance at '{self.point}': law = {self.law!r} is not a NormalLaw, as those of buckler.mbs.laws are"
            )
        if not isinstance(self.friction, FrictionLaw | BristleLaw):
            raise ValueError(f"clearance at '{self.point}': friction = {self.friction!r} is no FrictionLaw or BristleLaw")


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
        Contact law of `buckler.mbs.laws`.
    """

    point: str
    at: float
    law: NormalLaw

    def __post_init__(self) -> None:
        number("at", self.at, -1e6, 1e6, "m")
        if not isinstance(self.law, NormalLaw):
            raise ValueError(f"stop at '{self.point}': law = {self.law!r} is not a NormalLaw, as those of buckler.mbs.laws are")
