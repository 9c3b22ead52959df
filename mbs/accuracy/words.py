"""Names of the signals that an accuracy can be asked of; this module imports nothing heavy."""

from collections.abc import Sequence

from ..validate import short

PLACES = "places"
"""Places of points, deflections of flexible links, journals over their clearance."""
ALL_FORCES = "forces"
"""All forces and torques; of contacts their peaks and impulses too."""
WORDS = PLACES, ALL_FORCES
"""Groups of signals that an accuracy can be asked of, besides signals by their names."""
FINEST = 1e-6
"""Finest accuracy that can be requested [1]."""
COARSEST = 0.1
"""Coarsest accuracy that can be requested [1]; contact laws are known no better."""


def read_signals(of: str | Sequence[str]) -> str | tuple[str, ...]:
    """Return one of `WORDS`, or names of signals; a ValueError if it is neither."""
    if isinstance(of, str) and of in WORDS:
        return of
    listed = isinstance(of, Sequence) and not isinstance(of, str)
    if not listed or not of or not all(isinstance(name, str) and "." in name for name in of):
        raise ValueError(f"of = {short(of)}: must be one of {', '.join(map(repr, WORDS))}, or a list of signals' names")
    return tuple(of)


def write_signals(of: str | Sequence[str]) -> str:
    """Write the signals as words of a sentence."""
    return of if isinstance(of, str) else ", ".join(of)
