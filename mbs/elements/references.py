"""Checks of point references, such as 'A' or 'coupler:A', and of links that elements name; bodies on which loads act."""

from collections.abc import Iterable
from math import dist

from ..declare import declarations
from .element import GROUND, Element, Parts, place


class UnknownError(ValueError):
    """Error of a name that the mechanism does not have."""

    def __init__(self, name: str, message: str) -> None:
        super().__init__(message)
        self.name = name

    def field_of(self, element: Element) -> str:
        """Return the field of an element that holds the unknown name, alone or in a point reference; '' if none does."""
        # every text is split like a point reference: `place` accepts any text
        texts = {key: value for key in declarations(type(element)) if isinstance(value := getattr(element, key), str)}
        return next((key for key, value in texts.items() if self.name in (value, place(value).point, place(value).body)), "")


def check_known(kind: str, name: str, names: Iterable[str], where: str) -> None:
    """Raise a ValueError if a name is not among the known names of its kind, such as 'link'."""
    if name not in names:
        raise UnknownError(name, f"{where}: unknown {kind} '{name}'; known: {', '.join(sorted(names)) or 'none'}")


def check_link(mechanism: Parts, name: str, where: str) -> None:
    """Raise a ValueError if no link has this name."""
    check_known("link", name, {link.name for link in mechanism.links}, where)


def check_point_of(mechanism: Parts, name: str, point: str, where: str) -> None:
    """Raise a ValueError if a link is unknown or does not have a point."""
    check_link(mechanism, name, where)
    if point not in mechanism.link(name).points:
        raise ValueError(f"{where}: link '{name}' does not reach '{point}'; its points: {', '.join(mechanism.link(name).points)}")


def check_reference(mechanism: Parts, at: str, where: str) -> None:
    """Check a point reference: raise a ValueError for an unknown point or link, or a link without the point."""
    body, point = place(at)
    check_known("point", point, mechanism.points, where)
    if body and body != GROUND:
        check_point_of(mechanism, body, point, where)


def check_no_strut(mechanism: Parts, names: tuple[str, ...], where: str) -> None:
    """Raise a ValueError if one of the named links is a strut, a mere force between two points: it has no angle and no moment."""
    for link in mechanism.links:
        if link.name in names and link.body.massless:
            kind = type(link.body).__name__
            raise ValueError(f"{where}: link '{link.name}' is a {kind}, a force between two points; it takes no moment")


def holder(mechanism: Parts, at: str) -> str:
    """Return the body that a load at a point reference acts on: a link, a guide's block (by its point) or 'ground'.

    A point without a body belongs to the first link with mass that has it, or else to the first strut, or else to the ground.
    A load at the end of a strut acts on the body with mass that is pinned to it there, directly or through other struts.
    """
    carrier, point = place(at)
    links = {link.name: link for link in mechanism.links}
    if not carrier:
        carriers = [link for link in mechanism.links if point in link.points]
        with_mass = [link for link in carriers if not link.body.massless]
        carrier = next((link.name for link in with_mass + carriers), GROUND)
    pins = [{joint.first, joint.second} for joint in mechanism.joints if joint.point == point]
    candidates = [carrier]  # links or the ground, as joints have; grows in the loop: breadth-first search through struts
    for candidate in candidates:
        if candidate == GROUND or not links[candidate].body.massless:
            return candidate
        if any(guide.point == point and guide.link == candidate for guide in mechanism.guides):
            return point  # by which the guide's block is named
        pinned = {other for pair in pins if candidate in pair for other in pair}
        candidates += sorted(pinned.difference(candidates))
    raise ValueError(f"link '{carrier}': a Strut is massless, so '{point}' must be pinned to a link with mass, a guide or ground")


def holder_reference(mechanism: Parts, at: str) -> str:
    """Return the reference 'body:point' at which a load at a point reference acts, on the body `holder` finds."""
    return f"{holder(mechanism, at)}:{place(at).point}"


def angle_reference(mechanism: Parts, at: str, near: str | None = None) -> str:
    """Return 'beam:B' unchanged; complete 'beam' by the point `near` if the link has that point, or else by its start."""
    if ":" in at:
        return at
    if at == GROUND:
        return f"{GROUND}:"  # without a point, as the ground's angle is zero everywhere
    link = mechanism.link(at)
    return f"{at}:{near if near in link.points else link.start}"


def check_turning(mechanism: Parts, at: str, where: str) -> None:
    """Raise a ValueError unless a link, given as 'crank' or 'beam:B', is known, has the point and has an angle."""
    body, colon, point = at.partition(":")
    check_link(mechanism, body, where)
    if colon:
        check_point_of(mechanism, body, point, where)
    check_no_strut(mechanism, (body,), where)


def distance(mechanism: Parts, a: str, b: str) -> float:
    """Return the distance of two points at t = 0 [m], from their references."""
    return dist(*(mechanism.points[place(at).point] for at in (a, b)))
