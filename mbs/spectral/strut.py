"""A massless post-buckled strip for the compiled solver: a spring between the bodies to which it is pinned."""

from dataclasses import dataclass, field
from typing import cast

from ..elements import Link, Strut
from ..elements.element import GROUND
from ..elements.strut import StrutLaw
from ..functions import component_functions
from ..laws.compiled import function_pointer
from .builder import Builder, SeparateMass
from .tables import ForceKind, MeasureKind


@dataclass
class StrutBody:
    """Strut without coordinates: its ends are markers of neighbouring bodies, or free point masses."""

    link: Link
    hosts: dict[str, int] = field(default_factory=dict)  # marker that carries each end, by point

    def marker(self, builder: Builder, point: str) -> int:
        """Return the marker of the body at one of its ends."""
        if point not in self.hosts:
            raise ValueError(f"link '{self.link.name}': a Strut is massless, so '{point}' must be pinned to a body")
        return self.hosts[point]


def add_strut(builder: Builder, link: Link) -> StrutBody:
    """Add masses that elements attach to a `Strut` link as point masses with own coordinates; `join_struts` adds its spring."""
    body = StrutBody(link)
    for each in builder.attached.get(link.name, ()):
        if each.point not in body.hosts and each.mass > 0:
            x, y = builder.mechanism.points[each.point]
            builder.separate_masses.append(SeparateMass(len(builder.q), link.name, each.point))
            mass = sum(a.mass for a in builder.attached[link.name] if a.point == each.point)
            body.hosts[each.point] = builder.add_point(x, y, mass)
    return body


def join_struts(builder: Builder) -> None:
    """Add the springs of all struts between the bodies to which they are pinned, once all links are added."""
    struts = [body for body in builder.bodies.values() if isinstance(body, StrutBody)]
    for _ in struts:  # a strut pinned to another one ends at that one's marker: each pass finds one more in a chain of struts
        for body in struts:
            _find_hosts(builder, body)
    for body in struts:
        _add_spring(builder, body)


def _find_hosts(builder: Builder, body: StrutBody) -> None:
    """Find the markers of the neighbours at both ends; that of another strut may not be known yet."""
    link = body.link
    for joint in builder.mechanism.joints:
        if link.name not in (joint.first, joint.second) or joint.point in body.hosts:
            continue  # nothing to find for a point mass at the end, which the joint's rows pin to the neighbour
        other = joint.second if joint.first == link.name else joint.first
        neighbour = None if other == GROUND else builder.bodies[other]
        if not isinstance(neighbour, StrutBody):
            body.hosts[joint.point] = builder.marker(other, joint.point)
        elif joint.point in neighbour.hosts:
            body.hosts[joint.point] = neighbour.hosts[joint.point]


def _add_spring(builder: Builder, body: StrutBody) -> None:
    """Add the spring between a strut's ends; `lawtable.strut` lists its numbers."""
    link, strut = body.link, cast(Strut, body.link.body)
    spring = StrutLaw(strut, builder.mechanism.length(link.name))
    (load_function,) = component_functions(strut.load, ["u"])  # of the shortening over the length
    load = function_pointer(load_function, arguments=1)
    key = ("strut", strut.load)  # struts with the same load share a law
    law = builder.add_law(key, ForceKind.STRUT, numbers=(), pointers=[load], about=f"the load of strut '{link.name}'")
    measure = builder.add_measure(MeasureKind.DISTANCE, body.marker(builder, link.start), body.marker(builder, link.end))
    numbers = (spring.length, spring.rigidity, spring.force_unit, spring.strain_unit, spring.critical, spring.damping)
    builder.add_force(f"strut.{link.name}", ForceKind.STRUT, measure, law=law, numbers=numbers)
