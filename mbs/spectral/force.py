"""A force at a point for the compiled solver."""

from __future__ import annotations

from typing import Any

import numpy as np

from buckler.mbs.laws.compiled import function_pointer
from buckler.mbs.spectral.builder import GROUND, Builder
from buckler.mbs.spectral.reference import marker_of, marker_of_link
from buckler.mbs.spectral.tables import GIVEN, PUSH


def add_force(builder: Builder, name: str, load: Any) -> None:
    """Add a force, constant or given in time; its direction is fixed, or turns with a link."""
    a = marker_of(builder, load.point)
    b = marker_of_link(builder, load.follows or GROUND)
    law, numbers = -1, [0.0, 0.0]
    if callable(load.force):
        parts = [function_pointer(_component(load.force, i), 1) for i in range(2)]
        law = builder.add_law(None, GIVEN, (), parts, f"the function of {name}")
    else:
        numbers = [float(x) for x in load.force]
    angle = 0.0 if load.follows in (None, GROUND) else builder.angle_of(b)
    builder.add_force(name, PUSH, a, b, law=law, numbers=[*numbers, angle])


def _component(function: Any, i: int) -> Any:
    """One component of a function of time with two."""

    def component(t: float) -> float:
        return function(t)[i]  # type: ignore[no-any-return]

    component.__name__ = f"component{i}"
    assert np.shape(function(0.0)) == (2,)
    return component
