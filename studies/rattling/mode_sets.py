"""Sets of modes of a solid rocker by their numbers, and those of each set that move in the plane of motion.

"Modes four, five and six" may be counted among a free body's modes, the first six of which are rigid; among its flexible
modes in space; among those in the plane; or among the bending modes in the plane.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from buckler.mbs import Modal, Section
from buckler.mbs.geometry import Array
from buckler.mbs.library import STEEL_CRANK_ROCKER
from buckler.mbs.modal import BarModes, Box, CraigBampton, FreeModes, ReducedModel, reduced

from ..kit.published import BAR_AREA, STEEL
from .assumptions import DAMPINGS

LENGTH = STEEL_CRANK_ROCKER.rocker
"""Length of the rocker [m]."""
MESH = Box((24, 2, 1))
COUNTED = 40
"""Flexible modes of the solid that are computed; all in `SETS` are among them."""
BENDING, AXIAL = "in-plane bending", "axial"
LETTERS = {"b": BENDING, "a": AXIAL}
SETS: dict[str, Any] = {
    "none": (),
    "bending_1": ("b1",),
    "bending_1_2": ("b1", "b2"),
    "bending_1_3": ("b1", "b2", "b3"),
    "axial_1": ("a1",),
    "bending_1_3_axial_1": ("b1", "b2", "b3", "a1"),
    "bending_1_6_axial_1_3": ("b1", "b2", "b3", "b4", "b5", "b6", "a1", "a2", "a3"),
    "bending_1_8_axial_1_4": ("b1", "b2", "b3", "b4", "b5", "b6", "b7", "b8", "a1", "a2", "a3", "a4"),
    "456_free": FreeModes((4, 5, 6), "free"),
    "456_flexible": FreeModes((4, 5, 6), "flexible"),
    "456_in_plane": FreeModes((4, 5, 6), "in-plane"),
    "456_bending": ("b4", "b5", "b6"),
    "craig_bampton": CraigBampton(),
}
"""Modes by `LETTERS` and number, or counted as `FreeModes` does; or all of Craig and Bampton's."""
NAMES = {
    "none": "none: rigid", "bending_1": "bending 1", "bending_1_2": "bending 1–2", "bending_1_3": "bending 1–3",
    "axial_1": "axial 1", "bending_1_3_axial_1": "bending 1–3, axial 1", "bending_1_6_axial_1_3": "bending 1–6, axial 1–3",
    "bending_1_8_axial_1_4": "bending 1–8, axial 1–4", "456_free": "4, 5, 6 of a free body",
    "456_flexible": "4, 5, 6 flexible", "456_in_plane": "4, 5, 6 in the plane", "456_bending": "bending 4–6",
    "craig_bampton": "Craig–Bampton",
}  # fmt: skip


def section(depth: float) -> Section:
    """Return the section of all bars with this side in the plane [m]."""
    return Section(width=BAR_AREA / depth, thickness=depth, material=STEEL)


def solid_modes(depth: float) -> ReducedModel:
    """Compute the lowest flexible modes of the free solid rocker, in space."""
    return reduced(Modal(section(depth), FreeModes(tuple(range(1, COUNTED + 1))), mesh=MESH), LENGTH)


def beam_frequencies(depth: float, shear: bool = True) -> dict[str, Array]:
    """Compute eight bending and eight axial frequencies [Hz] of the free bar: Timoshenko's, or Euler–Bernoulli's."""
    found = Modal(section(depth), BarModes(8, 8, shear)).frequencies(LENGTH)
    return {BENDING: found[:8], AXIAL: found[8:]}


def numbers(depth: float, name: str) -> tuple[int, ...]:
    """Return the flexible modes of a set that move in the plane; a planar mechanism does not excite the others."""
    wanted = SETS[name]
    if isinstance(wanted, FreeModes):
        return tuple(int(n) for n in reduced(Modal(section(depth), wanted, mesh=MESH), LENGTH).plane.numbers)
    table = solid_modes(depth).table()
    found = {letter: [row[0] for row in table if row[2] == kind] for letter, kind in LETTERS.items()}
    return tuple(found[mode[0]][int(mode[1:]) - 1] for mode in wanted)


def flexibility(depth: float, name: str, damping: float) -> Modal | None:
    """Make a rocker of the modes of a set that move in the plane, by rising frequency; None if there are none."""
    if isinstance(SETS[name], CraigBampton):
        return Modal(section(depth), SETS[name], damping, MESH)
    wanted = tuple(sorted(numbers(depth, name)))
    return Modal(section(depth), FreeModes(wanted), damping, MESH) if wanted else None


def rocker_modes(kind: str, depth: float, bending: int = 3, axial: int = 1, factor: float = 1.0) -> Modal:
    """Make a rocker of modes without damping, by `KINDS`: free ones from beam theory, or all of Craig and Bampton's.

    All frequencies take the factor, the modulus its square.
    """
    bar = section(depth)
    bar = replace(bar, material=replace(bar.material, modulus=bar.material.modulus * factor**2))
    if kind == "Craig-Bampton":
        return Modal(bar, CraigBampton(), 0.0, MESH)
    return Modal(bar, BarModes(bending, axial, shear=kind == "free"), 0.0)


def set_damping(rocker: Modal, kind: str, ratio: float) -> Modal:
    """Return the same rocker with damping ratios by `DAMPINGS`."""
    model = rocker.planar(LENGTH)
    ratios = tuple(DAMPINGS[kind](model.frequency / (2 * np.pi), ratio).tolist())
    modes = CraigBampton(tuple(model.numbers.tolist())) if isinstance(rocker.modes, CraigBampton) else rocker.modes
    return replace(rocker, modes=modes, damping=ratios)
