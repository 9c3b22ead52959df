"""References to points: "A" (on the link that carries it), "coupler:A", "ground:P"."""

from __future__ import annotations

from buckler.mbs.spectral.builder import GROUND, Builder


def split(builder: Builder, reference: str, link: str | None = None) -> tuple[str, str]:
    """Link (or 'ground') and point of a reference."""
    if ":" in reference:
        owner, point = reference.split(":", 1)
        return owner, point
    if link is not None:
        return link, reference
    for each in builder.mechanism.links:
        if reference in each.points and builder.bodies[each.name].offset >= 0:
            return each.name, reference
    for each in builder.mechanism.links:
        if reference in each.points:
            return each.name, reference
    return GROUND, reference


def marker_of(builder: Builder, reference: str, link: str | None = None) -> int:
    """Marker of a reference."""
    return builder.marker(*split(builder, reference, link))


def marker_of_link(builder: Builder, link: str) -> int:
    """Marker that turns with a link: at its start; one of the ground."""
    if link == GROUND:
        return builder.ground((0.0, 0.0))
    return builder.marker(link, builder.mechanism.link(link).start)
