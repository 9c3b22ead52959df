"""Point references that loads and masses give, "body:point": body a link, a guide's block by its point, or the ground."""

from __future__ import annotations

from ..elements.element import GROUND, place
from .builder import Builder
from .connect import marker_of


def link_of(builder: Builder, reference: str) -> tuple[str, str]:
    """Link, or the ground, and point; a block is part of the link it is pinned to."""
    body, point = place(reference)
    if body != GROUND and body not in {link.name for link in builder.mechanism.links}:
        return builder.mechanism.guide(body).link, point
    return body, point


def marker_at(builder: Builder, reference: str) -> int:
    """Marker of a reference; 'ground:ground' is any place of the ground."""
    link, point = link_of(builder, reference)
    if link == GROUND and point == GROUND:
        return builder.ground((0.0, 0.0))
    return marker_of(builder, link, point)
