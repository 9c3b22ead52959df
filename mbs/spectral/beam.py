"""A geometrically exact strip for the compiled solver: Reissner's, in polynomials for x, y and the angle."""

from __future__ import annotations

from buckler.mbs.elements.link import Link
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.strip_body import StripBody, add_strip
from buckler.mbs.spectral.tables import REISSNER


def add_beam(builder: Builder, link: Link) -> StripBody:
    """Add a `Beam` link."""
    return add_strip(builder, link, REISSNER)
