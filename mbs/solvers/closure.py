"""The solver `Closure` as a value."""

from __future__ import annotations

from buckler.mbs.declare import Declared, declared, part
from buckler.mbs.solvers.steps import Controlled, Equal


@declared
class Closure(Declared):
    """Loop closure and inverse dynamics, for linkages whose motion joints and drives alone decide; nothing is integrated."""

    in_files = False

    steps: Controlled | Equal = part(
        Controlled, Equal, default_factory=Controlled,
        doc="where the motion is sampled: 400 times a turn of the drive, both sides of its kinks and closely within contacts, no "
        "farther apart than `max_step` and no more often than `max_steps`; or at equal steps alone; no tolerance is needed, as "
        "all that errs is rounding",
    )  # fmt: skip
