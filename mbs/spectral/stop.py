"""A stop for the compiled solver: a contact force along a line of the ground or of a link."""

from __future__ import annotations

from buckler.mbs.elements.element import GROUND, place
from buckler.mbs.elements.stop import Stop
from buckler.mbs.spectral import tables as k
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.connect import marker_of, turned_back
from buckler.mbs.spectral.laws import add_normal


def add_stop(builder: Builder, name: str, stop: Stop) -> None:
    """Add the contact of a point against a face; it is kept on the side on which it starts."""
    mechanism = builder.mechanism
    side, face, across = stop.side(mechanism), stop.face(mechanism), stop.across(mechanism)
    a, origin = builder.marker(stop.body(mechanism), stop.point), place(stop.origin(mechanism))
    b = marker_of(builder, origin.body, origin.point)
    before = [mechanism.points[stop.point][i] - mechanism.points[origin.point][i] for i in range(2)]
    start = before[0] * across[0] + before[1] * across[1]
    if stop.carrier == GROUND:
        measure = builder.add_measure(k.FIXED, a, b, across)
    else:
        measure = builder.add_measure(k.TURNING, a, b, turned_back(builder, b, across))
    law = add_normal(builder, stop.law)
    builder.add_force(name, k.CONTACT, measure, law=law, numbers=(side, start + face))
