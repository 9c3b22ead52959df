"""Frames and arches that snap, sway and branch: each as a mechanism, and as a chain of strips that is solved apart from it."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from math import atan, hypot, pi, radians, sin
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Beam, Force, Link, Material, Mechanism, Revolute, Rigid, Section, Weld
from buckler.studies.trust.chains import Chain, Piece

INCH, PSI = 0.0254, 6894.757293168
STRIP, SLENDER = Section(0.02, 0.001), Section(0.01, 0.0005)
Angle = Callable[[float], float]


class Frame(NamedTuple):
    """A mechanism under a force of EI/L^2, L its first strip's length, and the same as a chain."""

    mechanism: Mechanism
    chain: Chain


def _frame(
    section: Section, strips: list[tuple[float, float | Angle]], to: float, clamped: tuple[bool, bool] = (False, False),
    after: int = 1, arm: float = 0.0,
) -> Frame:  # fmt: skip
    """Strips welded in a row, each a length and its angle, or that over its own fraction; the force is down after so many."""
    names, unit = [f"s{k}" for k in range(len(strips))], strips[0][0]
    place, points, links, pieces = np.zeros(2), {"P0": (0.0, 0.0)}, [], []
    scale = unit**2 / section.bending_stiffness
    for k, (length, given) in enumerate(strips):
        angle = given if callable(given) else partial(_constant, given)
        shape = _shape(angle, length)
        place = place + shape(1.0)
        points[f"P{k + 1}"] = (float(place[0]), float(place[1]))
        links.append(Link(names[k], f"P{k}", f"P{k + 1}", Beam(section, shape=shape if callable(given) else None)))
        pieces.append(Piece(length / unit, angle, section.axial_stiffness * scale, section.shear_stiffness * scale))
    joints: list[Any] = [Weld(f"P{k}", *pair) for k, pair in enumerate(pairwise(names), 1)]
    ends = zip(clamped, ("P0", f"P{len(names)}"), (names[0], names[-1]), strict=True)
    joints += [(Weld if held else Revolute)(p, "ground", name) for held, p, name in ends]
    at = f"P{after}"
    if arm:
        points["E"], at = (points[at][0] + arm * unit, points[at][1]), "E"
        links.append(Link("arm", f"P{after}", "E", Rigid.of(mass=1e-3, inertia=1e-6)))
        joints.append(Weld(f"P{after}", names[after - 1], "arm"))
    chain = Chain(tuple(pieces), after, (0.0, -1.0), tuple(place / unit), to, clamped, (arm, 0.0))
    return Frame(Mechanism(points, links, joints, loads=[Force(at, (0.0, -1.0 / scale))]), chain)


def _constant(angle: float, _: float) -> float:
    return angle


def _shape(angle: Angle, length: float) -> Callable[[float], Any]:
    """Place at a fraction of a strip's arc, by Gauss' rule."""
    x, w = np.polynomial.legendre.leggauss(30)
    x, w = (1 + x) / 2, w / 2

    def place(fraction: float) -> Any:
        theta = np.array([angle(each * fraction) for each in x])
        return length * fraction * np.array([w @ np.cos(theta), w @ np.sin(theta)])

    return place


def toggle() -> Frame:
    """F. W. Williams, Q. J. Mech. Appl. Math. 17 (1964) 451: two clamped bars that meet in a low ridge."""
    section = Section(0.753 * INCH, 0.243 * INCH, Material(1.03e7 * PSI, 2700.0, 0.3))
    half, rise = 12.943 * INCH, 0.386 * INCH
    length, tilt = hypot(half, rise), atan(rise / half)
    return _frame(section, [(length, tilt), (length, -tilt)], 0.8, (True, True))


def lee() -> Frame:
    """S. L. Lee, F. S. Manuel, E. C. Rossow, J. Eng. Mech. Div. 94 (1968) 527: a hinged frame of two bars of 1.2 m."""
    section = Section(0.03, 0.02, Material(72e9, 2700.0, 0.3))
    return _frame(section, [(1.2, pi / 2), (0.24, 0.0), (0.96, 0.0)], 21.0, after=2)


def roorda(arm: float) -> Frame:
    """W. T. Koiter 1967, J. Roorda 1965: a column that carries a beam; the load stands off its axis by a part of its length."""
    return _frame(STRIP, [(0.5, pi / 2), (0.5, 0.0)], 14.5, arm=arm)


def deep_arch() -> Frame:
    """D. A. DaDeppo, R. Schmidt, J. Appl. Mech. 42 (1975) 894: a circle's 215 degrees, clamped and hinged; 8.97 EI/R^2."""
    half = radians(215) / 2
    left, right = (lambda f, k=k: half * (1 - k - f) for k in (0, 1))
    return _frame(STRIP, [(0.5 * half, left), (0.5 * half, right)], 9.5 * half**2, (True, False))


def cosine_arch() -> Frame:
    """A clamped arch of the angle A sin(2 pi s/l), twelve thicknesses high, that is pushed through."""
    slope = pi * 12 * SLENDER.thickness / 0.2
    left, right = (lambda f, k=k: slope * sin(pi * (f + k)) for k in (0, 1))
    return _frame(SLENDER, [(0.1, left), (0.1, right)], 9.0, (True, True))
