"""Who holds and who takes the energy: the balance any run can be asked for."""

from __future__ import annotations

import numpy as np

from buckler.mbs.elements.element import Array
from buckler.mbs.record.record import Record


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
    for name, element in record.mechanism.elements().items():
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
