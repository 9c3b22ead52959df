"""A rigid link for the compiled solver: three coordinates of its centre of mass."""

from __future__ import annotations

from typing import Any

import numpy as np

from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.frame_body import FrameBody, add_frame, line_of


def add_rigid(builder: Builder, link: Any) -> FrameBody:
    """Add a `Rigid` link: a uniform bar, or given mass, inertia and centre of mass in the link's frame."""
    start, end, length, angle = line_of(builder, link)
    body = link.body
    if getattr(body, "mass", None) is not None:
        c, s = np.cos(angle), np.sin(angle)
        x, y = body.centre if body.centre is not None else (0.5 * length, 0.0)
        return add_frame(builder, link, body.mass, start + np.array([c * x - s * y, s * x + c * y]), body.inertia)
    section = body.section
    mass = section.mass_per_length * length
    return add_frame(builder, link, mass, 0.5 * (start + end), mass * (length**2 + section.thickness**2) / 12)
