"""How pins and bushes wear: Archard's law along their surfaces, and the clearance that worn surfaces leave.

A surface loses the volume k F v dt (Archard: k the wear coefficient, F the normal force, v the sliding speed), spread over the
arc of the contact as an elastic foundation's pressure. A worn surface is a depth h(theta) of material gone, in its own body, over
the direction theta of its normal. A pin of nearly the radius of its bush, moved by e from its middle, is deep by

    g(theta) = e . m(theta) - c - h_bush - h_pin,        m(theta) = (cos theta, sin theta),

in direction theta, so that its centre is free where all of them are negative: within |e| = min over theta of
(c + h)/cos(phi - theta) in direction phi. A groove narrower than the pin's own curve leaves no more room than its shoulders do.

References
----------
J. F. Archard, Contact and rubbing of flat surfaces, Journal of Applied Physics 24 (1953) 981-988, doi 10.1063/1.1721448.
S. Mukras, N. H. Kim, N. A. Mauntler, T. L. Schmitz, W. G. Sawyer, Comparison between elastic foundation and contact force
models in wear analysis of planar multibody system, Journal of Tribology 132 (2010) 031604: pressure of an elastic foundation.
P. Flores, Modeling and simulation of wear in revolute clearance joints in multibody systems, Mechanism and Machine Theory 44
(2009) 1211-1222, doi 10.1016/j.mechmachtheory.2008.08.003: profiles that feed back into the contact.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import pi
from typing import NamedTuple

import numpy as np

from buckler.mbs.elements.journal import HARMONICS
from buckler.mbs.geometry import Array

BUSH, PIN = range(2)
AT_ONCE = 2000
"""Samples whose arcs are held in memory together."""
NEAR = 0.1
"""Least cosine between a direction and a normal that bounds the clearance in it."""
SHORTEST, LONGER = 1e-4, 3.0
"""Shortest jump, over all turns; a jump over the one before at most."""


def directions(bins: int) -> Array:
    """Directions of a surface's normals, rad, (bins,)."""
    return 2 * pi * np.arange(bins) / bins


class Rubbing(NamedTuple):
    """What rubs in a joint, at samples: place of the pin's centre in the bush, m, (times, 2), and depth of the contact, m.

    Further normal force times sliding way since the sample before, N m, and angles of bush and pin since the start, rad.
    """

    place: Array
    depth: Array
    rubbed: Array
    turned: tuple[Array, Array]


def shares(rub: Rubbing, gap: float, worn: Array, side: int) -> Array:
    """Wear of a surface over k, per radian: the integral of F v over the arc of each contact, N m/rad, (bins,).

    Of a radial clearance of the new joint, m; depths gone of bush and pin, m, (2, bins); side `BUSH` or `PIN`.
    """
    own, found = directions(worn.shape[1]), np.zeros(worn.shape[1])
    touching = np.flatnonzero((rub.depth > 0) & (rub.rubbed > 0))
    for rows in np.array_split(touching, max(1, len(touching) // AT_ONCE)):
        mine, other = rub.turned[side][rows], rub.turned[1 - side][rows]
        theta = own + mine[:, None]
        x, y = rub.place[rows].T
        apart = x[:, None] * np.cos(theta) + y[:, None] * np.sin(theta) - gap - worn[side]
        apart -= np.interp(theta - other[:, None], own, worn[1 - side], period=2 * pi)
        pressure = np.maximum(apart - apart.max(axis=1, keepdims=True) + rub.depth[rows][:, None], 0.0)
        found += (rub.rubbed[rows] / pressure.sum(axis=1)) @ pressure
    return found * worn.shape[1] / (2 * pi)


def room(gap: float, worn: Array) -> Array:
    """Clearance in all directions that a worn surface leaves a round partner, m, (bins,)."""
    theta = directions(len(worn))
    cosine = np.cos(theta[:, None] - theta)
    return np.min(np.where(cosine > NEAR, (gap + worn) / np.maximum(cosine, NEAR), np.inf), axis=1)


def fitted(gap: float, worn: Array) -> tuple[float, tuple[float, ...]]:
    """Mean growth of the clearance by one surface's wear, m, and harmonics of the rest as a `Clearance` takes them."""
    grown = room(gap, worn) - gap
    parts = np.fft.rfft(grown)[1 : HARMONICS + 1] * 2 / len(worn)
    return float(grown.mean()), tuple(np.column_stack([parts.real, -parts.imag]).ravel().tolist())


@dataclass(frozen=True)
class Jump:
    """The state after a jump: turns, depths, m, what a turn adds, and the error of all jumps up to here as of `size`, m."""

    turns: float
    worn: Array
    rate: Array
    error: float


def jumps(rate: Callable[[Array], Array], worn: Array, turns: float, allowed: float) -> Iterator[Jump]:
    """Wear over many turns from the wear of a few: Heun's method, one rate a jump.

    A jump j errs by j^3 r''/12 for the trapezoidal rule, and by j^3 J r'/2 because both its rates are those of a predicted wear;
    J, the growth of the rate with wear, is that along the way. The sizes of both are added; r'' is from the last three rates, and
    the first jump errs as Euler's. What earlier jumps left grows and falls as the rate does: two courses of the same wear, one a
    little ahead, stay apart by that time times the rate. All places decide how long a jump may be, or grooves dig in by turns;
    what the contact sees is told. The rate is what a turn takes of surfaces worn so far, m, (..., bins); `allowed` is
    the error of a jump.
    """
    now, error, r = 0.0, np.zeros_like(worn), rate(worn)
    before, slope = 0.0, None
    jump = min(turns, allowed / max(rough(r), 1e-300))
    yield Jump(now, worn, r, 0.0)
    while now < turns * (1 - 1e-12):
        jump = min(jump, turns - now)
        after = rate(worn + jump * r)
        bend = after - r if slope is None else 4 * jump / (3 * (jump + before)) * (after - r - jump * slope)
        off = jump / 2 * rough(bend)
        if off <= allowed or jump <= SHORTEST * turns:
            grown = max(rough(after), 1e-300) / max(rough(r), 1e-300)
            predicted = 0.5 * abs(np.log(grown)) * np.abs(after - r) + np.abs(bend) / 8
            local = jump / 2 * bend if slope is None else jump * np.copysign(predicted, bend)
            worn, now, error = worn + jump * (r + after) / 2, now + jump, grown * error + local
            before, slope, r = jump, (after - r) / jump, after
            yield Jump(now, worn, r, size(error))
        jump *= min(LONGER, max(0.2, 0.9 * float(np.cbrt(allowed / max(off, 1e-300)))))


def rough(depths: Array) -> float:
    """Root mean square around a surface, of the most worn one."""
    return float(np.sqrt((depths**2).mean(axis=-1)).max())


def size(depths: Array) -> float:
    """The same of what goes back into the contact: mean and `HARMONICS`.

    Where in an arc the pin rubs changes from one look to the next, and averages out; the contact does not see it.
    """
    parts = np.abs(np.fft.rfft(depths)[..., : HARMONICS + 1] / depths.shape[-1]) ** 2
    return float(np.sqrt((2 * parts.sum(axis=-1) - parts[..., 0]).max()))
