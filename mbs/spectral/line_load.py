"""A load along a strip for the compiled solver: forces and torques in Gauss's points, as many as its polynomials take."""

from __future__ import annotations

from typing import cast

from buckler.mbs.elements.line_load import LineLoad
from buckler.mbs.spectral.basis import gauss
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.strip_body import StripBody
from buckler.mbs.spectral.tables import ANGLE, GIVEN, PUSH


def add_line_load(builder: Builder, name: str, load: LineLoad) -> None:
    """Add one of them: of each Gauss point its share of the length."""
    strip = cast(StripBody, builder.bodies[load.link])
    ground = builder.ground((0.0, 0.0))
    for piece, element in enumerate(strip.elements):
        for x, w in zip(*gauss(element.places.shape[1] + 2), strict=True):
            length = float(w) * element.jacobian
            marker = strip.marker_at(builder, element.start + (1.0 + float(x)) * element.jacobian, piece)
            if any(load.force):
                b, turn = (marker, builder.angle_of(marker)) if load.turns else (ground, 0.0)
                builder.add_force(name, PUSH, marker, b, numbers=[*(length * each for each in load.force), turn])
            if load.moment:
                measure = builder.add_measure(ANGLE, marker, ground)
                builder.add_force(name, GIVEN, measure, numbers=(length * load.moment,))
