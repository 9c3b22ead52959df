"""Who holds and who takes the energy: the balance any run can be asked for."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..geometry import Array
from ..laws import BristleLaw
from ..scene.scene import Scene
from .record import Record
from .signals import follows

BALANCE = 1e-2
"""Energy balance, relative to the energy put through, beyond which a run is suspect."""
AT_REST = 1e-6
"""Way, in lengths of the largest link, below which nothing has moved in the whole run."""
STRETCH = 1e-5
"""Amplitude of axial vibration of a strip that steps leave out, relative to its length. Its energy is missing in the balance."""
BRISTLE = 1e-4
"""Amplitude of a slider on the bristles of its friction that steps leave out, relative to the length; its energy likewise."""


def ledger(record: Record) -> dict[str, Array]:
    """Energies over the run, J, each of shape (times,).

    Returns
    -------
    dict
        Held: `kinetic`, `strain`, `contact`, `weight`. Taken since t = 0: `taken_contact`, `taken_friction`, `taken_damping`.
        Given since t = 0: `given_drive`. `error` = change of what is held + taken - given. `throughput`: the most that was
        held and taken by then, the measure for the error. Of each joint with clearance `<point>.taken_contact` and
    `.taken_friction`.
    """
    zero = np.zeros_like(record.time)
    held = {"kinetic": zero, "strain": zero}
    taken = {"taken_damping": zero}
    given = {"given_drive": zero}
    single: dict[str, Array] = {}
    for name, element in Scene.of(record.mechanism).elements.items():
        for kind, what, values in element.energies(name, record):
            if kind == "single":
                single[what] = values
                continue
            column, key = {"held": (held, what), "taken": (taken, f"taken_{what}"), "given": (given, f"given_{what}")}[kind]
            column[key] = column.get(key, zero) + values
    total, lost = sum(held.values(), zero), sum(taken.values(), zero)
    error = total - total[0] + lost - sum(given.values(), zero)
    active = sum((value - value.min() if name in ("weight", "spring") else value) for name, value in held.items())
    throughput = np.maximum.accumulate(active + lost)
    return {**held, **taken, **given, "error": error, "throughput": throughput, **single}


def put_through(record: Record, energy: Mapping[str, Array], signals: Mapping[str, Array]) -> tuple[float, float]:
    """Energy put through, J, and the share of it that stiff vibrations that nobody sees may hold."""
    mechanism, duration = record.mechanism, float(record.time[-1]) or 1.0
    mass = sum(link.mass(mechanism.length(link.name)) for link in mechanism.links)
    at_rest = mass * (AT_REST * size_of(record) / duration) ** 2 / 2  # at a speed at which nothing moves in a run this long
    through = max(float(energy["throughput"][-1]), at_rest)
    return through, 2 * (_unseen_stretch(record, signals) + _unseen_bristles(record, signals)) / through


def size_of(record: Record) -> float:
    """Longest link, m."""
    return max(record.mechanism.length(link.name) for link in record.mechanism.links)


def _unseen_stretch(record: Record, signals: Mapping[str, Array]) -> float:
    """Largest axial strain energy, J, of strips whose axial strain nobody sees, or whose axial vibration steps do not follow."""
    total, followed = 0.0, follows(record.time, Scene.of(record.mechanism).axial_period)
    for link in record.mechanism.links:
        if link.body.meshed:
            stiffness = link.body.section.axial_stiffness
            strain = float(np.abs(signals[f"{link.name}.axial_force"]).max()) / stiffness
            if strain < STRETCH or not followed:
                total += stiffness * record.mechanism.length(link.name) * strain**2 / 2
    return total


def _unseen_bristles(record: Record, signals: Mapping[str, Array]) -> float:
    """Largest energy, J, of the bristles of sliders that they hold within a way nobody sees."""
    total = 0.0
    for guide in record.mechanism.guides:
        if isinstance(guide.friction, BristleLaw):
            energies = guide.energies(guide.key, record)
            held = max(float(values.max()) for kind, name, values in energies if (kind, name) == ("held", "contact"))
            drags = [signals.get(f"{owner}.friction_force", np.zeros(1)) for owner in (guide.point, guide.key)]
            force = max(float(np.abs(drag).max()) for drag in drags)
            if 2 * held < BRISTLE * size_of(record) * force:
                total += held
    return total
