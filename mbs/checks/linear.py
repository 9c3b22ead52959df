"""Self-check of modal links: deflections and loads must be small, as modal links are linear about their straight shape.

A linear link that bends does not become shorter: the missing end shortening is the mean of w'^2/2 along the link, w the
deflection from the chord; 2.5 (w_max/L)^2 for a half-sine. Nor does an axial load change its stiffness: under a load P the
relative error of the deflection is P/P_cr, and beyond P_cr it stays straight where a strip buckles.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain
from typing import Any

import numpy as np

from ..elements.element import place
from ..elements.joint import Joint
from ..elements.modal import MeshFile
from ..geometry import Array
from ..mechanism import Mechanism
from ..record.result import Result
from ..record.run import Run
from ..scene.scene import Scene
from .check import check, without
from .unbuckled import GROWTH, growth_exponent, recent_mean

LEFT_OUT = 1e-3
"""Largest error of the place of an end, or of mid-length, over the link's length: that allowed of places. A half-sine reaches
it at a deflection of 2 %, and under a tenth of the critical load at 1 %."""


def _modal(run: Run) -> list[str]:
    return [link.name for link in run.record.mechanism.links if link.body.linear and link.name in run.record.links]


@check("LINEAR", without(_modal, "no modal link"))
def linear(run: Run, result: Result) -> Iterator[str]:
    """Check that the terms that linear theory leaves out are small."""
    record = run.record
    for name in _modal(run):
        history, section = record.links[name], record.mechanism.link(name).body.section
        length = record.mechanism.length(name)
        frequency = section.first_frequency(length)
        compression = _compression(run, result, name) / section.euler_load(length)
        loaded = recent_mean(result.time, compression, np.pi / (2 * frequency))
        nearer = history.foreshortening() / length
        softer = np.abs(result.signals[f"{name}.deflection"] / length * loaded)
        for missing, what in (
            (nearer, "bends so far that its ends are nearer"),
            (softer, "is pressed so far that it bends more"),
        ):
            k = int(np.argmax(missing))
            if missing[k] > LEFT_OUT:
                error = f"by {missing[k]:.2g} of its length than linear theory has it; make it a Beam"
                yield f"at t = {result.time[k]:.4g} s '{name}' {what}, {error}"
        over = growth_exponent(result.time, frequency * np.sqrt(np.maximum(loaded - 1.0, 0.0))) > GROWTH
        if over.any():
            k = int(np.argmax(over))
            yield f"at t = {result.time[k]:.4g} s '{name}' carries {loaded[k]:.3g} times its critical load; make it a Beam"


def _compression(run: Run, result: Result, name: str) -> Array:
    """Compute the compression of a link, N, from the joints at one end; 0 if other forces act at both, or the mesh is a file."""
    link: Any = run.record.mechanism.link(name)
    motion = run.record.links[name]
    ends = [motion.point(point)[0] for point in (link.start, link.end)]
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0], axis=1)[:, None]
    for point, sign in ((link.start, 1.0), (link.end, -1.0)):
        force = _by_joints(run.record.mechanism, result, name, point)
        if force is not None and not isinstance(link.body.mesh, MeshFile):
            return np.asarray(sign * (force * along).sum(axis=1))
    return np.zeros(len(result.time))


def _by_joints(mechanism: Mechanism, result: Result, name: str, point: str) -> Array | None:
    """Return the force of joints on a link at a point, N, (times, 2); None without joints or with other forces there."""
    others = chain(mechanism.guides, mechanism.stops, mechanism.loads, mechanism.masses)
    if point in {place(getattr(each, field, "")).point for each in others for field in ("point", "a", "b")}:
        return None
    parts = []
    for key, joint in Scene.of(mechanism).elements.items():
        if isinstance(joint, Joint) and joint.point == point and name in (joint.first, joint.second):
            if f"{key}.fx" not in result.signals:
                return None
            force = np.column_stack([result.signals[f"{key}.f{axis}"] for axis in "xy"])
            parts.append(force if joint.second == name else -force)
    return np.asarray(sum(parts)) if parts else None
