"""Natural frequencies of Timoshenko's beam and of frames made of it: exact, without shape functions.

A member bends with E I, shears with k G A, stretches with E A and has the mass rho A and the rotary inertia rho I a length.
Over a piece of length l, with b^2 = rho A omega^2 l^4/(E I), r^2 = rho I/(rho A l^2), q = rho A omega^2 l^2/(k G A), deflection
w/l and rotation theta of the section obey

    w'''' + (q + b^2 r^2) w'' - b^2 (1 - q r^2) w = 0,    theta' = w'' + q w,    (E I/l^2) V' = -rho A omega^2 l^2 w      (1)

with the squared exponents A = -(q + b^2 r^2)/2 -+ sqrt((q - b^2 r^2)^2/4 + b^2). With C = cosh(sqrt(A) x), S = sinh(sqrt(A)
x)/sqrt(A), which are entire in A, each A gives two solutions whose moment and shear force are finite for any shear stiffness,

    (w, theta, M, V) = (C, (A + q) S, (A + q) C, -b^2 S)   and   (A S, (A + q) C, (A + q) A S, -b^2 C).                   (2)

From them follows the dynamic stiffness K(omega) of a piece: what its ends must be given to move harmonically. By Wittrick and
Williams the natural frequencies below omega are as many as K has negative eigenvalues, plus those of all pieces with both ends
held. Members are cut so short that no piece has one; then K has no pole, its eigenvalues fall steadily with omega, and the n-th
frequency is the zero of the n-th smallest. It is found by a bracketing search to the last digits, close and equal frequencies
too.

References
----------
S. P. Timoshenko, On the correction for shear of the differential equation for transverse vibrations of prismatic bars,
doi 10.1080/14786442108636264.
T. C. Huang, The effect of rotatory inertia and of shear deformation on the frequency and normal mode equations of uniform beams,
doi 10.1115/1.3641787.
W. H. Wittrick, F. W. Williams, A general algorithm for computing natural frequencies of elastic structures,
doi 10.1093/qjmam/24.3.263.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import isfinite

import numpy as np
from scipy.optimize import brentq

from buckler.elastica.collocation import Array

from .member import Member, piece_stiffness, pieces, turned

HELD = {"clamped": (1, 2), "pinned": (1,), "free": ()}
"""Which of (along, across, rotation) a support of a beam holds."""
ENDS = {
    "cantilever": ("clamped", "free"),
    "clamped-pinned": ("clamped", "pinned"),
    "clamped-clamped": ("clamped", "clamped"),
    "pinned-pinned": ("pinned", "pinned"),
    "free-free": ("free", "free"),
}
RIGID = {"free-free": 2}
"""Motions without deformation; their frequency, zero, is not listed."""


@dataclass(frozen=True)
class Frame:
    """A plane frame of members with rigid corners.

    Attributes
    ----------
    nodes : places (x, y) of the corners and feet, m
    members : (first node, second node, Member); the member's length must be the distance of the nodes
    held : node -> which of its motions are held: 0 along x, 1 along y, 2 rotation
    """

    nodes: Sequence[tuple[float, float]]
    members: Sequence[tuple[int, int, Member]]
    held: Mapping[int, Sequence[int]]

    def count_below(self, frequency: float) -> int:
        """Count the natural frequencies, those of rigid motions included, below a frequency in rad/s."""
        return int(np.count_nonzero(self._eigenvalues(frequency, self._cuts(frequency)) < 0.0))

    def frequencies(self, modes: int, rigid: int = 0) -> Array:
        """Compute the lowest natural frequencies, rad/s, without so many motions without deformation."""
        return np.array([self._frequency(rigid + n) for n in range(modes)])

    def _frequency(self, index: int) -> float:
        low, high = 0.0, min(member.unit for _, _, member in self.members)
        while self.count_below(high) <= index:
            low, high = high, 2.0 * high
        while high > 1.2 * low:
            middle = (low + high) / 2.0
            low, high = (middle, high) if self.count_below(middle) <= index else (low, middle)
        cuts = self._cuts(high)
        return float(brentq(lambda f: self._eigenvalues(f, cuts)[index], low, high, xtol=1e-15 * low, rtol=1e-14))

    def _cuts(self, frequency: float) -> list[int]:
        return [pieces(member, frequency) for _, _, member in self.members]

    def _eigenvalues(self, frequency: float, cuts: Sequence[int]) -> Array:
        """Eigenvalues of the dynamic stiffness, in ascending order, forces over E I/l^2 of the first member."""
        return np.linalg.eigvalsh(self._stiffness(frequency, cuts))

    def _stiffness(self, frequency: float, cuts: Sequence[int]) -> Array:
        """Dynamic stiffness of all free motions, in units of the first member's length and bending stiffness."""
        first = self.members[0][2]
        places = len(self.nodes) + sum(cuts) - len(cuts)
        whole = np.zeros((3 * places, 3 * places))
        new = len(self.nodes)
        for (a, b, member), cut in zip(self.members, cuts, strict=True):
            along = np.subtract(self.nodes[b], self.nodes[a]) / member.length
            piece = turned(piece_stiffness(member, member.length / cut, frequency), along)
            scale = np.tile((first.length, first.length, 1.0), 2)
            piece = piece * np.outer(scale, scale) * first.length / first.bending
            chain = [a, *range(new, new + cut - 1), b]
            new += cut - 1
            for i, j in pairwise(chain):
                rows = np.r_[3 * i : 3 * i + 3, 3 * j : 3 * j + 3]
                whole[np.ix_(rows, rows)] += piece
        gone = {3 * node + motion for node, motions in self.held.items() for motion in motions}
        if not isfinite(first.axial):
            gone |= set(range(0, 3 * places, 3))
        kept = [k for k in range(3 * places) if k not in gone]
        return whole[np.ix_(kept, kept)]


def beam(member: Member, ends: str) -> Frame:
    """A member between two supports, one of `ENDS`, for its bending vibrations."""
    bending_only = Member(member.length, member.bending, member.mass, member.shear, member.rotary)
    held = {node: HELD[support] for node, support in enumerate(ENDS[ends])}
    return Frame(((0.0, 0.0), (member.length, 0.0)), ((0, 1, bending_only),), held)


def beam_frequencies(member: Member, ends: str, modes: int = 6) -> Array:
    """Compute the lowest bending frequencies of a member, rad/s, rigid motions left out; ends as in `ENDS`."""
    return beam(member, ends).frequencies(modes, RIGID.get(ends, 0))


def portal(column: Member, beam: Member) -> Frame:
    """Portal frame with clamped feet: two equal columns, and a beam between their tops, with rigid corners."""
    height, span = column.length, beam.length
    nodes = ((0.0, 0.0), (0.0, height), (span, height), (span, 0.0))
    return Frame(nodes, ((0, 1, column), (1, 2, beam), (3, 2, column)), {0: (0, 1, 2), 3: (0, 1, 2)})
