"""Frames and arches that snap, sway and branch: each as a mechanism, and as a chain of strips that is solved apart from it.

A chain is solved by shooting, without `buckler.mbs` or `buckler.elastica`. Reissner's strip as in `buckler.elastica.strip`,
with EI = 1: r' = t + R diag(1/EA, 1/GA) R^T n, m' = n x r', phi' = m, where phi is the turn from the stress-free angle, n the
force and m the moment that what is beyond exerts. From the start, where support and unknowns u give the state, SciPy integrates
to the end; what the end's support misses is zero. Derivatives by u and by the load p come with it from imaginary parts. A path
u(p) is followed by its arc; it turns where dp is zero, and branches where the matrix of the unknowns with the path's direction is
singular.

References
----------
E. Reissner, On one-dimensional finite-strain beam theory: the plane problem, doi 10.1007/BF01602645.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise
from math import atan, hypot, pi, radians, sin
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp

from buckler.mbs import Beam, Force, Link, Material, Mechanism, Revolute, Rigid, Section, Weld
from buckler.mbs.geometry import Array

INCH, PSI = 0.0254, 6894.757293168
STRIP, SLENDER = Section(0.02, 0.001), Section(0.01, 0.0005)
Angle = Callable[[float], float]
TINY = 1e-30
"""Of the imaginary parts: their square is nothing beside a rounding."""
NODES = 12
"""Points of a step by which its critical points are found."""


class Piece(NamedTuple):
    """A part of the chain: arc length, stress-free angle at a fraction of it, and how stiff it is, over EI."""

    length: float
    angle: Callable[[float], float]
    axial: float
    shear: float


class Point(NamedTuple):
    """Of a path: unknowns, and place, turn and p/to where the force acts, each with its change along it.

    `singular` is a determinant that is zero where another path crosses.
    """

    u: Array
    along: Array
    place: Array
    way: Array
    singular: float


class Chain(NamedTuple):
    """Pieces welded to each other between two supports, and a dead force p times `force` where a piece ends.

    The force acts after so many pieces, `arm` away from there on an arm that turns with the strip. Start and end are held or
    clamped; `end` is the place of the end from the start. The path ends at the load `to`. `rtol` is that of the integration
    along the path; critical points have a hundredth of it.
    """

    pieces: tuple[Piece, ...]
    at: int
    force: tuple[float, float]
    end: tuple[float, float]
    to: float
    clamped: tuple[bool, bool] = (False, False)
    arm: tuple[float, float] = (0.0, 0.0)
    rtol: float = 1e-10

    def solved(self, u: Array) -> tuple[Array, Array]:
        """What the end misses (3,) of unknowns (nx, ny, start's moment or turn, p); place and turn where the force acts, and p.

        With their derivatives, (7,) and (7, 4).
        """
        (nx, ny, held, p), zero = u[:, None] + 1j * TINY * np.eye(4), np.zeros(4, complex)
        state, loaded = np.array([zero, zero, *((zero, held) if self.clamped[0] else (held, zero))]), zero
        for k, (length, angle, axial, shear) in enumerate(self.pieces, 1):

            def change(s: float, y: Array, nx=nx, ny=ny, length=length, angle=angle, axial=axial, shear=shear) -> Array:  # type: ignore[no-untyped-def]
                _, _, phi, m = y.reshape(4, 4)
                c, sn = np.cos(angle(s / length) + phi), np.sin(angle(s / length) + phi)
                along, across = 1 + (nx * c + ny * sn) / axial, (ny * c - nx * sn) / shear
                x, y = along * c - across * sn, along * sn + across * c
                return np.concatenate([x, y, m, nx * y - ny * x])

            run = solve_ivp(change, (0.0, length), state.ravel(), method="DOP853", rtol=self.rtol, atol=0.1 * self.rtol)
            state = run.y[:, -1].reshape(4, 4)
            if k == self.at:
                c, sn, (a, b), (fx, fy) = np.cos(state[2]), np.sin(state[2]), self.arm, self.force
                loaded, state[3] = state[:3].copy(), state[3] - p * ((a * c - b * sn) * fy - (a * sn + b * c) * fx)
                nx, ny = nx - p * fx, ny - p * fy
        ends = [state[0] - self.end[0], state[1] - self.end[1], state[2] if self.clamped[1] else state[3]]
        out = np.array([*ends, *loaded, p / self.to])
        return out[:, 0].real, out.imag / TINY

    def on_plane(self, u: Array, normal: Array, value: float) -> Point:
        """The equilibrium near u where normal . (place, turn, p/to) is a value."""
        for _ in range(8):
            out, slope = self.solved(u)
            matrix = np.vstack([slope[:3], normal @ slope[3:]])
            off = np.append(out[:3], normal @ out[3:] - value)
            u = u - np.linalg.solve(matrix, off)
            if np.abs(off).max() < 1e2 * self.rtol:  # by Newton's last step its square
                along = np.linalg.solve(matrix, [0.0, 0.0, 0.0, 1.0])
                along /= np.linalg.norm(slope[3:] @ along)
                return Point(u, along, out[3:], slope[3:] @ along, float(np.linalg.det(np.vstack([slope[:3], along]))))
        raise ArithmeticError("no equilibrium near")

    def critical(self) -> Iterator[tuple[str, float]]:
        """Kind, 'limit' or 'branching', and load of the critical points from no load on, until p = to."""
        here, arc = self.on_plane(np.zeros(4), np.array([0.0, 0.0, 0.0, 1.0]), 0.0), 0.02
        sharp = self._replace(rtol=1e-2 * self.rtol)

        def onward(arc: float, chain: Chain = self) -> Point:
            return chain.on_plane(here.u + arc * here.along, here.way, float(here.way @ here.place) + arc)

        while here.u[3] < self.to:
            try:
                new = onward(arc)
                if new.way @ here.way < 0.97:
                    raise ArithmeticError("too far")
            except ArithmeticError:
                arc *= 0.5
                continue
            for kind, value in (("limit", lambda at: at.along[3]), ("branching", lambda at: at.singular)):
                if value(here) * value(new) < 0.0:  # at a branching itself Newton's matrix is singular: by points about it
                    parts = 0.5 * arc * (1 - np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES))
                    points = [onward(part, sharp) for part in parts]
                    of = [
                        Polynomial.fit(parts, each, NODES - 1) for each in ([value(p) for p in points], [p.u[3] for p in points])
                    ]
                    roots = np.array(of[0].roots())
                    roots = roots[np.abs(roots.imag) < 1e-9 * arc].real
                    yield from ((kind, float(of[1](root))) for root in roots if 0.0 <= root <= arc)
            here, arc = new, min(1.3 * arc, 0.1)


# --- frames ------------------------------------------------------------------------------------------------------------


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
