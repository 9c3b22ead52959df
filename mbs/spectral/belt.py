"""A belt with stiffness for the compiled solver: a spring on a sum of turns."""

from __future__ import annotations

from buckler.mbs.elements.belt import Belt
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.connect import connect, marker_of
from buckler.mbs.spectral.tables import ANGLE, LINE_SPRING


def add_belt(builder: Builder, name: str, belt: Belt) -> None:
    """Add its row, or its spring."""
    connect(builder, name, belt)
    if belt.stiffness is None:
        return
    terms = []
    for share, measure in belt.shares(builder.mechanism):
        for end, sign in ((measure.first, share), (measure.second, -share)):
            terms.append((sign, marker_of(builder, end.body, end.point)))
    ahead = builder.sum_of_turns(terms)
    measure_ = builder.add_measure(ANGLE, ahead, builder.ground((0.0, 0.0)))
    builder.add_force(name, LINE_SPRING, measure_, numbers=(belt.stiffness, belt.damping, builder.angle_of(ahead)))
