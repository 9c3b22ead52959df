"""A drive for the compiled solver: a constraint that moves with time."""

from __future__ import annotations

from typing import Any

from buckler.mbs.spectral import tables as k
from buckler.mbs.spectral.builder import GROUND, Builder


def add_drive(builder: Builder, drive: Any) -> None:
    """Prescribe a link's angle, or a guided point's travel."""
    number = 1 + sum(row.name.split(".")[0] == "drive" for row in builder.rows)
    name = "drive" if number == 1 else f"drive.{number}"
    motion = builder.add_motion(drive, name)
    guides = {guide.point: guide for guide in builder.mechanism.guides}
    if drive.target in guides:
        guide = guides[drive.target]
        a, b = builder.marker(guide.link, guide.point), builder.marker(GROUND, guide.point)
        builder.add_row(name, builder.add_measure(k.FIXED, a, b, guide.along), motion, 0.0)
        return
    link = builder.mechanism.link(drive.target)
    a, b = builder.marker(link.name, link.start), builder.ground(builder.mechanism.points[link.start])
    builder.add_row(name, builder.add_measure(k.ANGLE, a, b), motion)
