"""A planar mechanism in one glance: points, links, joints, guides, stops, loads, masses and drives.

Everything here is frozen, in SI, validated when made, and free of the engine. Fidelity is the type of a link or joint, never
a flag: `Rigid`, `Strut`, `Beam`, `Cable`; `Revolute`, `Clearance`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot
from typing import Any

from buckler.mbs.elements import KINDS, Drive, Guide, Link, Rigid
from buckler.mbs.elements.element import GROUND, Element
from buckler.mbs.elements.frozen import Frozen
from buckler.mbs.validate import pair, positive, sequence_of

Pair = tuple[float, float]


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
    drives : sequence of Drive
    gravity : (float, float)
        Acceleration in the plane, m/s^2. Zero, the default, also stands for gravity normal to the plane.

    Raises
    ------
    ValueError
        If a name is unknown or doubled, a link has no length, a joint's link does not reach its point, and so on.
    """

    points: Mapping[str, Pair]
    links: Sequence[Link]
    joints: Sequence[Any] = ()
    guides: Sequence[Guide] = ()
    stops: Sequence[Any] = ()
    drives: Sequence[Drive] = ()
    gravity: Pair = field(default=(0.0, 0.0))

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", Frozen({k: pair(f"points['{k}']", v, "m") for k, v in dict(self.points).items()}))
        for name, kinds in KINDS.items():
            object.__setattr__(self, name, sequence_of(name, getattr(self, name), kinds))
        object.__setattr__(self, "gravity", pair("gravity", self.gravity, "m/s^2"))
        _check_names(self)
        _check_links(self)
        _check_attachments(self)
        _check_drives(self)

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

    def elements(self) -> dict[str, Element]:
        """All elements by their names: a second one of a name is `name.2`."""
        found: dict[str, Element] = {}

        def add(name: str, element: Element) -> None:
            number = 2
            unique = name
            while unique in found:
                unique, number = f"{name}.{number}", number + 1
            found[unique] = element

        for link in self.links:
            add(link.name, link)
        for joint in self.joints:
            add(f"{joint.point}.{joint.first}-{joint.second}", joint)
        for guide in self.guides:
            add(f"guide {guide.point}", guide)
        for stop in self.stops:
            add(stop.point, stop)
        for drive in self.drives:
            add("drive", drive)
        return found


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
    for point, ends in set(joined):
        if joined.count((point, ends)) > 1:
            raise ValueError(f"joint at '{point}': joins {' and '.join(sorted(ends))} twice")
    for guide in mechanism.guides:
        where = f"guide of '{guide.point}'"
        _known("point", guide.point, mechanism.points, where)
        _reaches(links, guide.link, guide.point, where)
    for stop in mechanism.stops:
        _known("guided point", stop.point, {guide.point for guide in mechanism.guides}, "stop")


def _check_drives(mechanism: Mechanism) -> None:
    rigid = {link.name for link in mechanism.links if isinstance(link.body, Rigid)}
    for drive in mechanism.drives:
        _known("rigid link or guided point", drive.target, rigid | {guide.point for guide in mechanism.guides}, "drive")


def _known(kind: str, name: str, known: Any, where: str) -> None:
    if name not in known:
        raise ValueError(f"{where}: unknown {kind} '{name}'; known: {', '.join(sorted(known)) or 'none'}")


def _reaches(links: Mapping[str, Link], name: str, point: str, where: str) -> None:
    _known("link", name, links, where)
    if point not in links[name].points:
        raise ValueError(f"{where}: link '{name}' does not reach it; its points: {', '.join(links[name].points)}")
