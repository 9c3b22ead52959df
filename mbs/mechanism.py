"""A planar mechanism in one glance: points, links, joints, guides, stops and a drive.

Everything here is frozen, in SI, validated when made, and free of the engine. Fidelity is the type of a link or joint, never
a flag: `Rigid`, `Strut`, `Beam`, `Cable`; `Revolute`, `Clearance`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot, inf
from typing import Any

from buckler.mbs.elements.connections import Clearance, Guide, GuideFriction, Pair, Revolute, Stop
from buckler.mbs.elements.drive import Drive, Motion, Ramp
from buckler.mbs.elements.links import Beam, Body, Cable, Link, Modal, Rigid, Strut
from buckler.mbs.validate import number, positive

__all__ = [
    "GROUND", "Beam", "Body", "Cable", "Clearance", "Drive", "Guide", "GuideFriction", "Link", "Mechanism", "Modal", "Motion",
    "Ramp", "Revolute", "Rigid", "Stop", "Strut",
]  # fmt: skip

GROUND = "ground"


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
