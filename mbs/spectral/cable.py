"""A shear-rigid strip for the compiled solver: Kirchhoff's, extensible, in polynomials for x and y."""

from __future__ import annotations

from buckler.mbs.elements.link import Link
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.strip_body import StripBody, add_strip
from buckler.mbs.spectral.tables import KIRCHHOFF


def add_cable(builder: Builder, link: Link) -> StripBody:
    """Add a `Cable` link."""
    return add_strip(builder, link, KIRCHHOFF)
