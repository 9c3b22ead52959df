"""What all answers of the statics have in common: how they ended, in a word and a sentence, and checks of what is asked."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from html import escape

import numpy as np

from buckler.mbs.geometry import Array
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.validate import one_of, whole

RISE = 4
"""By how much the degree of strips is raised at once."""
HIGHEST = 40
"""Degree at which that ends."""
PLACES, CRITICAL = 1e-8, 1e-6
"""Errors up to which it is raised, relative: of states of rest and frequencies; of critical points and motions."""
FIRST, LONGEST = 0.02, 0.1
"""First and longest arc of a path, by default."""


class Ending(StrEnum):
    """How a search for rest ended. Anything but OK comes with a sentence a person can act on."""

    OK = "OK"
    FREE_MOTION = "FREE_MOTION"
    """No equilibrium: a load pushes along a motion that nothing resists."""
    OPEN_CONTACT = "OPEN_CONTACT"
    """Likewise, and contacts that could resist it stay open."""
    NOT_REACHED = "NOT_REACHED"
    """Newton's method did not get there; the message says how far the load came."""
    INACCURATE = "INACCURATE"
    """Found, with an error larger than asked for."""
    SINGULAR = "SINGULAR"
    """A path cannot be followed further."""
    TOO_MANY_STEPS = "TOO_MANY_STEPS"
    """A path did not reach its end, or a search for a periodic motion used up its steps."""
    SLACK = "SLACK"
    """A rope would have to push."""


@dataclass(frozen=True)
class Answer:
    """An answer with a status, a message, and a table."""

    status: Ending
    message: str

    def rows(self) -> list[tuple[str, str]]:
        """What it found: name and value with unit."""
        raise NotImplementedError

    def __str__(self) -> str:
        """Status, message and a line a number."""
        return "\n".join(
            [f"{self.status}: {self.message}" if self.message else str(self.status), *(f"{a}: {b}" for a, b in self.rows())]
        )

    def _repr_html_(self) -> str:
        """The same as a table for a notebook."""
        lines = "".join(f"<tr><td>{escape(a)}</td><td>{escape(b)}</td></tr>" for a, b in self.rows())
        return f"<p><b>{self.status}</b> {escape(self.message)}</p><table>{lines}</table>"


def check(mechanism: Mechanism, degree: int | None) -> None:
    """Raise a ValueError if this is no mechanism, a load of it has states, or this is no degree of its strips."""
    one_of("mechanism", mechanism, (Mechanism,))
    for name, element in mechanism.elements().items():
        if element.integrated:
            raise ValueError(f"'{name}' has states, which statics do not know: they are integrated with a motion only")
    if degree is not None:
        whole("degree", degree, 2, 200)


def left_out(mechanism: Mechanism, friction: str) -> list[str]:
    """What statics do not know of a mechanism: dry friction, which holds it in an interval, and how good modes are."""
    rubs = [element.rubs for element in mechanism.elements().values() if element.rubs]
    modes = [link.name for link in mechanism.links if link.body.linear]
    said = [f"{friction}: {', '.join(map(repr, rubs))}"] if rubs else []
    return said + ([f"errors leave out the choice of modes of {', '.join(map(repr, modes))}"] if modes else [])


def check_coordinates(name: str, value: object, scene: Scene) -> Array:
    """Coordinates of a scene, (n,), as they were given.

    Raises
    ------
    ValueError
        If they are none.
    """
    try:
        found = np.array(value, dtype=float)
    except (TypeError, ValueError):
        found = np.empty(0)
    if found.shape != (scene.size,) or not np.isfinite(found).all():
        raise ValueError(f"{name}: must be {scene.size} finite coordinates, as of a scene of degree {scene.degree}")
    return found
