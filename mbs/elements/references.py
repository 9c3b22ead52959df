"""References of elements to points and bodies."""

from __future__ import annotations

from collections.abc import Iterable
from math import dist

from ..declare import declarations
from .element import GROUND, Element, Parts, Place, place

FIXED = Place(GROUND, "")


class UnknownError(ValueError):
    """A name that the mechanism does not have."""

    def __init__(self, name: str, message: str) -> None:
        super().__init__(message)
        self.name = name

    def field_of(self, element: Element) -> str:
        """Return the field of an element that contains the name; '' if none does."""
        texts = {key: value for key in declarations(type(element)) if isinstance(value := getattr(element, key), str)}
        return next((key for key, value in texts.items() if self.name in (value, place(value).point, place(value).body)), "")


def check_known(kind: str, name: str, names: Iterable[str], where: str) -> None:
    """Raise a ValueError if a name is not among those known."""
    if name not in names:
        raise UnknownError(name, f"{where}: unknown {kind} '{name}'; known: {', '.join(sorted(names)) or 'none'}")


def known_link(mechanism: Parts, name: str, where: str) -> None:
    """Raise a ValueError if no link has that name."""
    check_known("link", name, {link.name for link in mechanism.links}, where)


def reaches(mechanism: Parts, name: str, point: str, where: str) -> None:
    """Raise a ValueError if a link is unknown or does not have a point."""
    known_link(mechanism, name, where)
    if point not in mechanism.link(name).points:
        raise ValueError(f"{where}: link '{name}' does not reach it; its points: {', '.join(mechanism.link(name).points)}")


def refers(mechanism: Parts, at: str, where: str) -> None:
    """Raise a ValueError if a point reference names an unknown point or link, or a link without the point."""
    body, point = place(at)
    check_known("point", point, mechanism.points, where)
    if body and body != GROUND:
        reaches(mechanism, body, point, where)


def takes_moments(mechanism: Parts, names: tuple[str, ...], where: str) -> None:
    """Raise a ValueError if one of these links is massless: a force between two points takes no moment."""
    for link in mechanism.links:
        if link.name in names and link.body.massless:
            kind = type(link.body).__name__
            raise ValueError(f"{where}: link '{link.name}' is a {kind}, a force between two points; it takes no moment")


def holder(mechanism: Parts, at: str) -> str:
    """Return the body that a load at a point reference acts on: a link, a guide's block (by its point) or 'ground'.

    At the end of a strut, which has no mass, it is the body pinned to the strut, directly or through other struts. A ValueError
    says that there is none with mass.
    """
    body, point = place(at)
    links = {link.name: link for link in mechanism.links}
    if not body:
        carriers = [link for link in mechanism.links if point in link.points]
        body = next((link.name for link in carriers if not link.body.massless), carriers[0].name if carriers else GROUND)
    pinned = [body]  # grows within the loop
    for each in pinned:
        if each == GROUND or not links[each].body.massless:
            return each
        if any(guide.point == point and guide.link == each for guide in mechanism.guides):
            return point
        joined = [{joint.first, joint.second} for joint in mechanism.joints if joint.point == point]
        pinned += sorted({other for ends in joined if each in ends for other in ends}.difference(pinned))
    needed = "a link with mass, a guide or ground"
    raise ValueError(f"link '{body}': a Strut is massless, so '{point}' must be pinned to {needed}")


def holder_reference(mechanism: Parts, at: str) -> str:
    """Return the reference 'body:point' of the body that a load at a point reference acts on; see `holder`."""
    return f"{holder(mechanism, at)}:{place(at).point}"


def holder_place(mechanism: Parts, at: str, where: str) -> Place:
    """Return the place of a point on the body that a load acts on; ValueError if that is a guide's block."""
    body, point = place(holder_reference(mechanism, at))
    if body != GROUND and body not in {link.name for link in mechanism.links}:
        raise ValueError(f"{where}: '{at}' is the end of a strut on a guide's block; name a link with mass")
    return Place(body, point)


def turning(mechanism: Parts, at: str, near: str | None = None) -> str:
    """Return the reference 'link:point' of a link given as 'crank' or 'beam:B'; by default at the point `near`, or the start."""
    if ":" in at:
        return at
    if at == GROUND:
        return f"{GROUND}:{GROUND}"
    link = mechanism.link(at)
    return f"{at}:{near if near in link.points else link.start}"


def check_turning(mechanism: Parts, at: str, where: str) -> None:
    """Raise a ValueError if a reference, 'crank' or 'beam:B', is not to a link that turns."""
    body, colon, point = at.partition(":")
    known_link(mechanism, body, where)
    if colon:
        reaches(mechanism, body, point, where)
    takes_moments(mechanism, (body,), where)


def carried_by(mechanism: Parts, carrier: str, point: str = "") -> Place:
    """Return the place of a carrier, at a point or at its start."""
    if carrier == GROUND:
        return Place(GROUND, point) if point else FIXED
    return Place(carrier, point or mechanism.link(carrier).start)


def distance(mechanism: Parts, a: str, b: str) -> float:
    """Return the distance of two point references at t = 0, m."""
    return dist(*(mechanism.points[place(at).point] for at in (a, b)))
