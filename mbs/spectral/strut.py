"""A massless post-buckled strip for the compiled solver: a spring between the bodies to which it is pinned."""

from dataclasses import dataclass, field
from typing import cast

from ..elements import Link, Strut
from ..elements.element import GROUND
from ..elements.strut import StrutLaw
from ..functions import numbers_of
from ..laws.compiled import function_pointer
from .builder import Builder
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
    """Add masses that elements attach to a `Strut` link as point masses with own coordinates; `join_strut` adds its spring."""
    body = StrutBody(link)
    for each in builder.attached.get(link.name, ()):
        if each.point not in body.hosts and each.mass > 0:
            x, y = builder.mechanism.points[each.point]
            builder.separate_masses.append((len(builder.q), link.name, each.point, False))  # False: a point mass, no rotor
            mass = sum(a.mass for a in builder.attached[link.name] if a.point == each.point)
            body.hosts[each.point] = builder.add_point(x, y, mass)
    return body


def find_hosts(builder: Builder, body: StrutBody) -> None:
    """Find the markers of the neighbours at both ends, once all links are added; a neighbour may be another strut."""
    link = body.link
    for joint in builder.mechanism.joints:
        if link.name not in (joint.first, joint.second) or joint.point in body.hosts:
            continue
        other = joint.second if joint.first == link.name else joint.first
        neighbour = None if other == GROUND else builder.bodies[other]
        if not isinstance(neighbour, StrutBody):
            body.hosts[joint.point] = builder.marker(other, joint.point)
        elif joint.point in neighbour.hosts:  # if not yet, a later call finds it: `CompiledScene.of` repeats this for chains
            body.hosts[joint.point] = neighbour.hosts[joint.point]


def join_strut(builder: Builder, body: StrutBody) -> None:
    """Add the spring between a strut's ends; `lawtable.strut` lists its numbers."""
    link, strut = body.link, cast(Strut, body.link.body)
    spring = StrutLaw(strut, builder.mechanism.length(link.name))
    (load_function,) = numbers_of(strut.load, ["u"])  # of the shortening over the length
    load = function_pointer(load_function, 1)
    key = ("strut", strut.load)  # struts with the same load share a law
    law = builder.add_law(key, ForceKind.STRUT, numbers=(), pointers=[load], about=f"the load of strut '{link.name}'")
    measure = builder.add_measure(MeasureKind.DISTANCE, body.marker(builder, link.start), body.marker(builder, link.end))
    numbers = (spring.length, spring.rigidity, spring.force_unit, spring.strain_unit, spring.critical, spring.damping)
    builder.add_force(f"strut.{link.name}", ForceKind.STRUT, measure, law=law, numbers=numbers)
