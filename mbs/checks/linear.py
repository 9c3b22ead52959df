"""Self-check of modal links: deflections and loads must be small, as modal links are linear about their straight shape.

Let w be the deflection from the chord. Linear theory leaves out two effects. The relative shortening of a bent link
is the mean of w'^2/2 along it, for a half-sine 2.5 (w_max/L)^2. An axial load P changes the stiffness: the relative error of the
deflection is P/P_cr to first order. Beyond the critical load P_cr a modal link stays straight where a strip buckles.
"""

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
from .check import check
from .unbuckled import GROWTH, growth_exponent, recent_mean


def _modal(run: Run) -> list[str]:
    """Return the names of the modal links."""
    return [link.name for link in run.record.mechanism.links if link.body.linear and link.name in run.record.links]


@check("LINEAR", _modal, "no modal link")
def check_linear(run: Run, result: Result) -> Iterator[str]:
    """Check that the terms that linear theory leaves out are small.

    Under a load above the critical one a deflection grows at the rate omega_1 sqrt(P/P_cr - 1), omega_1 the first frequency. The
    link should have buckled when the exponent of this growth, the time integral of the rate, exceeds `GROWTH`.
    """
    record = run.record
    for name in _modal(run):
        motion, section = record.links[name], record.mechanism.link(name).body.section
        length = record.mechanism.length(name)
        omega_1 = section.first_frequency(length)
        compression = _compression(run, result, name) / section.euler_load(length)
        quarter_period = np.pi / (2 * omega_1)  # [s] of the lateral vibration; chosen: many periods of axial vibrations
        load_ratio = recent_mean(result.time, compression, quarter_period)  # a mean over the quarter before each time
        shortening = motion.foreshortening() / length
        missing_deflection = np.abs(result.signals[f"{name}.deflection"] / length * load_ratio)
        for missing, fault in (
            (shortening, "bends so far that its ends are nearer than in linear theory"),
            (missing_deflection, "is pressed so far that it bends more than in linear theory"),
        ):
            k = int(np.argmax(missing))
            if missing[k] > 1e-3:  # error of a half-sine at 2 % deflection, or at 1 % and a tenth of P_cr
                yield f"at t = {result.time[k]:.4g} s '{name}' {fault}, by {missing[k]:.2g} of its length; make it a Beam"
        growth_rate = omega_1 * np.sqrt(np.maximum(load_ratio - 1.0, 0.0))
        buckles = growth_exponent(result.time, growth_rate) > GROWTH
        if buckles.any():
            k = int(np.argmax(buckles))
            yield f"at t = {result.time[k]:.4g} s '{name}' carries {load_ratio[k]:.3g} times its critical load; make it a Beam"


def _compression(run: Run, result: Result, name: str) -> Array:
    """Compute the compression of a link [N], (times,), by the joints at an end where nothing else acts; 0 without one."""
    link: Any = run.record.mechanism.link(name)
    if isinstance(link.body.mesh, MeshFile):  # the section does not give its bending stiffness: the critical load is not known
        return np.zeros(len(result.time))
    motion = run.record.links[name]
    ends = [motion.point(point)[0] for point in (link.start, link.end)]
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0], axis=1)[:, None]
    for point, sign in ((link.start, 1.0), (link.end, -1.0)):
        force = _joint_force(run.record.mechanism, result, name, point)
        if force is not None:
            return np.asarray(sign * (force * along).sum(axis=1))
    return np.zeros(len(result.time))


def _joint_force(mechanism: Mechanism, result: Result, name: str, point: str) -> Array | None:
    """Return the force of joints on a link at a point [N], (times, 2); None without signals or if other elements act there."""
    others = chain(mechanism.guides, mechanism.stops, mechanism.loads, mechanism.masses)
    point_fields = "point", "a", "b"  # `a` and `b` are the ends of a spring, which is one of the loads
    references = [getattr(element, field, "") for element in others for field in point_fields]
    if point in {place(reference).point for reference in references}:
        return None
    forces = []
    for key, joint in Scene.of(mechanism).elements.items():
        if isinstance(joint, Joint) and joint.point == point and name in (joint.first, joint.second):
            if f"{key}.fx" not in result.signals:
                return None
            force = np.column_stack([result.signals[f"{key}.f{axis}"] for axis in "xy"])
            forces.append(force if joint.second == name else -force)  # signals are the force on the second link
    return np.asarray(sum(forces)) if forces else None
