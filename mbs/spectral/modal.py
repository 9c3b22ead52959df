"""A modal link for the compiled solver: the planar floating frame of `buckler.mbs.modal.planar`."""

from __future__ import annotations

from typing import cast

import numpy as np

from buckler.mbs.elements.link import Link
from buckler.mbs.elements.modal import Modal
from buckler.mbs.modal.planar import STATIONS
from buckler.mbs.spectral.builder import Builder
from buckler.mbs.spectral.frame_body import FrameBody, add_block, line_of


def add_modal(builder: Builder, link: Link) -> FrameBody:
    """Add a `Modal` link, undeformed at t = 0."""
    start, _, length, angle = line_of(builder, link)
    model = cast(Modal, link.body).planar(length)
    c, s, m = np.cos(angle), np.sin(angle), len(model)
    centre = start + np.array([c * model.centre[0] - s * model.centre[1], s * model.centre[0] + c * model.centre[1]])
    o = builder.coordinates((*centre, angle, *np.zeros(m)))
    builder.angles(o + 2)
    reach = np.abs(model.line_shapes).max(axis=(0, 1), initial=0.0)
    builder.units |= {o + 3 + i: float(length / max(reach[i], 1e-12)) for i in range(m)}
    builder.mass(range(o, o + 3 + m), np.diag([model.mass, model.mass, model.inertia, *np.ones(m)]))
    builder.weigh((o, o + 1), model.mass * np.array(builder.mechanism.gravity))
    if m:
        damping = 2 * model.damping * model.frequency
        at = builder.numbers(model.radial, model.gram, model.gyration, model.stiffness, damping)
        builder.modal.append((o, m, at))
        builder.deforms(range(o + 3, o + 3 + m))
    shapes = {p: model.shapes[STATIONS.index(n)].T.copy() for p, n in ((link.start, "start"), (link.end, "end"))}
    body = FrameBody(o, centre, angle, model.mass, model.inertia, start, m, shapes, model)
    for each in builder.attached.get(link.name, ()):
        add_block(builder, body.marker(builder, each.point), each, link.name)
    return body
