"""Self-check of contacts: they push while they are closed, and do nothing while they are open."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.record.result import Result

ROUNDING = 1e-9
"""Of the largest force: a pull smaller than that is none."""


def pulls(result: Result) -> Iterator[str]:
    """A contact pushes while it is closed, outwards on the bush, and does nothing while it is open."""
    signals = result.signals
    for name, force in signals.items():
        point, _, kind = name.rpartition(".")
        if kind not in ("contact_force", "normal_force") or f"{point}.penetration" not in signals:
            continue  # the force of a slider may have either sign
        allowed = ROUNDING * float(np.abs(force).max(initial=0.0))
        pulling = force < -allowed
        apart = (np.abs(force) > allowed) & (signals[f"{point}.penetration"] <= 0)
        for wrong, what in ((pulling, "pulls"), (apart, "acts without touching")):
            if wrong.any():
                k = int(np.argmax(wrong))
                yield f"CONTACT: '{point}' {what} with {force[k]:.3g} N at t = {result.time[k]:.4g} s"
