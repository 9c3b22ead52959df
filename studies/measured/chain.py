"""A chain of arms that hang from a fixed pivot: equations of motion, the same as a mechanism, and its fit to measured segments.

With absolute angles t, 0 upwards, and speeds s, for arms of mass m, centre of mass a and length L from their upper joints:

    sum_j A_ij (cos(t_i - t_j) s_j' + sin(t_i - t_j) s_j^2) = G_i sin(t_i - tilt) - T_i + T_(i+1) - q_i |s_i| s_i
    T_i = k_i r_i + c_i tanh(r_i/r_0),  r_i = s_i - s_(i-1)

T is the torque of a joint's friction, viscous and dry, q the drag of the air. The classical fourth-order Runge-Kutta method runs
all segments, and each with one parameter changed, side by side: a fit needs nothing else. `mechanism` is what `simulate` runs.

The start of each segment is free in the fit. Standard errors are those of blocks of time: what a model leaves is no noise,
neighbours in time err alike, and the usual covariance would be far too small (sandwich of block sums; H. White,
doi 10.2307/1912934).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from math import cos, sin
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from buckler.mbs import Link, Mechanism, Revolute, Rigid, Torque, TorsionSpring
from buckler.mbs.geometry import Array

from ..kit.published import GRAVITY

CREEP = 0.02
"""Relative speed, rad/s, at which dry friction has tanh 1 of its size."""
GROUPS = {"a": 1e-3, "I": 1e-5, "k": 1e-4, "c": 1e-4, "q": 1e-5}
"""What each arm has, with a change of it that matters: m, kg m^2, N m s, N m, N m s^2."""
TILT = 1e-2
LEAST = {"I": 1e-9, "k": 0.0, "c": 0.0, "q": 0.0}
"""Of what cannot be negative."""
FRICTIONS = "kcq"
CHANGE = 1e-3
"""Of a parameter for its derivative, in its scale."""
START = np.array([0.01, 0.1])
"""Scales of a start's angle, rad, and speed, rad/s."""


@dataclass(frozen=True)
class Chain:
    """Arms with what is known, and with first values of what is fitted.

    Attributes
    ----------
    mass, length : of each arm, kg and m; the last one's length is not used
    values : what `GROUPS` names, one number an arm; 0 where it is left out
    tilt : angle of the vertical in the measured zero, rad
    gravity : m/s^2
    """

    mass: tuple[float, ...]
    length: tuple[float, ...]
    values: Mapping[str, tuple[float, ...]]
    tilt: float = 0.0
    gravity: float = GRAVITY

    def __post_init__(self) -> None:
        nothing = dict.fromkeys(GROUPS, (0.0,) * len(self.mass))
        object.__setattr__(self, "values", {**nothing, **self.values})

    @property
    def names(self) -> list[str]:
        """Of all numbers of `vector`: a1, a2, ..., tilt."""
        return [f"{group}{i + 1}" for group in GROUPS for i in range(len(self.mass))] + ["tilt"]

    @property
    def vector(self) -> Array:
        """All numbers in the order of `names`."""
        return np.array([x for group in GROUPS for x in self.values[group]] + [self.tilt])

    @property
    def scales(self) -> Array:
        """A change of each number that matters."""
        return np.array([size for size in GROUPS.values() for _ in self.mass] + [TILT])

    def of(self, vector: Array) -> Chain:
        """The chain with other numbers."""
        n = len(self.mass)
        values = {group: tuple(map(float, vector[k * n : (k + 1) * n])) for k, group in enumerate(GROUPS)}
        return replace(self, values=values, tilt=float(vector[-1]))

    def without_friction_but(self, names: Sequence[str]) -> Chain:
        """The chain with only the named ones of its frictions."""
        kept = [name[0] not in FRICTIONS or name in names for name in self.names]
        return self.of(np.where(kept, self.vector, 0.0))

    def constants(self, vector: Array) -> tuple[Array, Array]:
        """A and G of many vectors, (..., arms, arms) and (..., arms)."""
        n, mass, length = len(self.mass), np.array(self.mass), np.array(self.length)
        centre, inertia = vector[..., :n], vector[..., n : 2 * n]
        beyond = np.append(np.cumsum(mass[::-1])[::-1][1:], 0.0)
        first = mass * centre + beyond * length
        A = first[..., None, :] * length[:, None]
        upper = np.triu(np.ones((n, n)), 1)
        A = A * upper + np.swapaxes(A * upper, -1, -2)
        A = A + (inertia + mass * centre**2 + beyond * length**2)[..., None] * np.eye(n)
        return A, self.gravity * first

    def moved(self, vector: Array, angle: Array, speed: Array, times: int, step: float) -> Array:
        """Angles at `times` equal steps from the start, (times, ..., arms); vector, angle and speed of one shape but the last."""
        A, G = self.constants(vector)
        out = np.empty((times, *angle.shape))
        for i in range(times):
            out[i] = angle
            k1 = self._rates(vector, A, G, angle, speed)
            o2 = speed + step / 2 * k1
            k2 = self._rates(vector, A, G, angle + step / 2 * speed, o2)
            o3 = speed + step / 2 * k2
            k3 = self._rates(vector, A, G, angle + step / 2 * o2, o3)
            o4 = speed + step * k3
            k4 = self._rates(vector, A, G, angle + step * o3, o4)
            angle = angle + step / 6 * (speed + 2 * o2 + 2 * o3 + o4)
            speed = speed + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return out

    def _rates(self, vector: Array, A: Array, G: Array, angle: Array, speed: Array) -> Array:
        """Angular accelerations."""
        n = len(self.mass)
        viscous, dry, drag = (vector[..., k * n : (k + 1) * n] for k in (2, 3, 4))
        relative = speed.copy()
        relative[..., 1:] -= speed[..., :-1]
        torque = viscous * relative + dry * np.tanh(relative / CREEP)
        force = G * np.sin(angle - vector[..., -1:]) - torque - drag * np.abs(speed) * speed
        force[..., :-1] += torque[..., 1:]
        apart = angle[..., :, None] - angle[..., None, :]
        force -= np.einsum("...ij,...j->...i", A * np.sin(apart), speed**2)
        if n == 1:
            return np.asarray(force / A[..., 0])
        return np.asarray(np.linalg.solve(A * np.cos(apart), force[..., None])[..., 0])

    def mechanism(self, angle: Array, speed: Array) -> Mechanism:
        """The chain as a mechanism that starts from these angles and speeds; x upwards is the angle 0."""
        n, points, place = len(self.mass), {"P0": (0.0, 0.0)}, np.zeros(2)
        ends = [length or 2 * self.values["a"][i] for i, length in enumerate(self.length)]
        for i in range(n):
            place = place + ends[i] * np.array([np.sin(angle[i]), np.cos(angle[i])])
            points[f"P{i + 1}"] = (float(place[0]), float(place[1]))
        links, joints, loads = [], [], list[Any]()
        for i in range(n):
            name, above = f"arm{i + 1}", f"arm{i}" if i else "ground"
            body = Rigid.of(mass=self.mass[i], inertia=self.values["I"][i], centre=(self.values["a"][i], 0.0))
            links.append(Link(name, f"P{i}", f"P{i + 1}", body))
            joints.append(Revolute(f"P{i}", above, name))
            loads.append(TorsionSpring(above, name, stiffness=0.0, law=Friction(self.values["k"][i], self.values["c"][i])))
            if self.values["q"][i]:
                loads.append(Torque(name, Drag(self.values["q"][i])))
        down = (-self.gravity * sin(self.tilt), -self.gravity * cos(self.tilt))
        # The angles here turn clockwise from the upward direction, those of links against the clock.
        spins: dict[str, Any] = {f"arm{i + 1}": -float(speed[i]) for i in range(n)}
        return Mechanism(points=points, links=links, joints=joints, loads=loads, gravity=down, velocities=spins)


@dataclass(frozen=True)
class Friction:
    """Torque of a joint by the rate of its angle, N m."""

    viscous: float
    dry: float

    def __call__(self, angle: float, rate: float) -> float:
        """Evaluate it."""
        return float(self.viscous * rate + self.dry * np.tanh(rate / CREEP))


@dataclass(frozen=True)
class Drag:
    """Torque of the air on an arm, N m, by its speed."""

    size: float

    def __call__(self, time: float, angle: float, speed: float) -> float:
        """Evaluate it."""
        return -self.size * abs(speed) * speed


# --- the fit -----------------------------------------------------------------------------------------------------------


class Data(NamedTuple):
    """Segments of equal length: angles and speeds, (segments, times, arms), and the step, s."""

    angle: Array
    speed: Array
    step: float

    @property
    def scatter(self) -> float:
        """Of a measured angle, rad: third differences of neighbours, in which a smooth motion cancels."""
        third = np.diff(self.angle, 3, axis=1)
        return float(np.sqrt(np.mean(third**2) / 20))

    def some(self, which: Array | slice, times: int | None = None) -> Data:
        """Some segments, or their first samples."""
        return Data(self.angle[which, :times], self.speed[which, :times], self.step)


class Fit(NamedTuple):
    """What a fit found.

    Attributes
    ----------
    chain : Chain
    errors : standard errors of the parameters, by name
    starts : array, shape (segments, 2, arms)
    residual : root mean square of what is left, rad
    """

    chain: Chain
    errors: dict[str, float]
    starts: Array
    residual: float


def fitted(chain: Chain, data: Data, free: Sequence[str], blocks: int = 1, starts: Array | None = None) -> Fit:
    """Fit parameters and starts by least squares; frictions stay at least 0.

    Parameters
    ----------
    free : names of the parameters
    blocks : pieces of a segment that are taken to err apart
    starts : first values, shape (segments, 2, arms); else the first samples
    """
    places = [chain.names.index(name) for name in free]
    count, _, arms = data.angle.shape
    begin = np.stack([data.angle[:, 0], data.speed[:, 0]], 1) if starts is None else starts
    scales = np.concatenate([chain.scales[places], np.tile(np.repeat(START, arms), count)])
    low = [LEAST.get(name[0], -np.inf) for name in free] + [-np.inf] * begin.size
    kept: dict[bytes, tuple[Array, Array]] = {}

    def left(x: Array) -> tuple[Array, Array]:
        if x.tobytes() not in kept:
            kept.clear()
            kept[x.tobytes()] = _residuals(chain, data, places, x)
        return kept[x.tobytes()]

    inner = np.maximum(np.concatenate([chain.vector[places], begin.ravel()]), np.array(low) + 1e-3 * scales)
    found = least_squares(
        lambda x: left(x)[0], inner, jac=lambda x: left(x)[1], bounds=(low, np.inf), x_scale=scales, ftol=1e-7, max_nfev=40
    )
    vector = chain.vector
    vector[places] = found.x[: len(places)]
    errors = dict(zip(free, _errors(found.jac, found.fun, count, blocks, len(places)), strict=True))
    return Fit(chain.of(vector), errors, found.x[len(places) :].reshape(count, 2, arms), float(np.sqrt(np.mean(found.fun**2))))


def _residuals(chain: Chain, data: Data, places: Sequence[int], x: Array) -> tuple[Array, Array]:
    """Angles less the measured ones, and their derivatives by differences; all runs side by side."""
    count, times, arms = data.angle.shape
    vector = chain.vector
    vector[places] = x[: len(places)]
    starts = x[len(places) :].reshape(count, 2 * arms)
    n = 1 + len(places) + 2 * arms
    vectors = np.tile(vector, (n, count, 1))
    begin = np.tile(starts, (n, 1, 1))
    steps = np.concatenate([chain.scales[places], np.repeat(START, arms)]) * CHANGE
    for i, place in enumerate(places):
        vectors[1 + i, :, place] += steps[i]
    for j in range(2 * arms):
        begin[1 + len(places) + j, :, j] += steps[len(places) + j]
    runs = chain.moved(vectors, begin[..., :arms], begin[..., arms:], times, data.step)  # (times, n, segments, arms)
    runs = np.moveaxis(runs, 0, 2)  # (n, segments, times, arms)
    slopes = (runs[1:] - runs[0]) / steps[:, None, None, None]
    jacobian = np.zeros((*data.angle.shape, x.size))
    jacobian[..., : len(places)] = np.moveaxis(slopes[: len(places)], 0, -1)
    for segment in range(count):
        own = len(places) + segment * 2 * arms
        jacobian[segment, ..., own : own + 2 * arms] = np.moveaxis(slopes[len(places) :, segment], 0, -1)
    return (runs[0] - data.angle).ravel(), jacobian.reshape(-1, x.size)


def _errors(jacobian: Array, left: Array, count: int, blocks: int, parameters: int) -> Array:
    """Standard errors of the parameters, the sums of blocks of each segment taken to be independent."""
    bread = np.linalg.pinv(jacobian.T @ jacobian)
    size = left.size // count
    edges = np.linspace(0, size, blocks + 1).astype(int)
    pieces = [slice(s * size + a, s * size + b) for s in range(count) for a, b in pairwise(edges)]
    sums = np.array([jacobian[piece].T @ left[piece] for piece in pieces])
    n = len(pieces)
    spread = bread @ (sums.T @ sums * n / max(1, n - parameters)) @ bread
    return np.asarray(np.sqrt(np.diag(spread)[:parameters]))


def predicted(chain: Chain, data: Data) -> Array:
    """Angles of each segment from its first sample alone, (segments, times, arms)."""
    vectors = np.tile(chain.vector, (len(data.angle), 1))
    return np.moveaxis(chain.moved(vectors, data.angle[:, 0], data.speed[:, 0], data.angle.shape[1], data.step), 0, 1)


def apart(angle: Array, data: Data) -> float:
    """Root mean square of the distance from the measured angles, rad."""
    return float(np.sqrt(np.mean((angle - data.angle) ** 2)))
