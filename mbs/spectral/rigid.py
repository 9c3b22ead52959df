"""A rigid link for the compiled solver: three coordinates of its centre of mass."""

from __future__ import annotations

import numpy as np

from buckler.mbs.elements.link import Link
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.frame_body import FrameBody, add_frame, line_of


def add_rigid(builder: Builder, link: Link) -> FrameBody:
    """Add a `Rigid` link: a uniform bar, or given mass, inertia and centre of mass in the link's frame."""
    start, _, length, angle = line_of(builder, link)
    mass, inertia, (x, y) = link.body.inertia(length)
    c, s = np.cos(angle), np.sin(angle)
    return add_frame(builder, link, mass, start + np.array([c * x - s * y, s * x + c * y]), inertia)
