"""The strip in motion between a driven pin and a slider: a reference for whole runs, sharing nothing with the engine.

A strip without shear is known by the rotation theta(s, t) of its sections and its strain e(s, t). With hinged ends,
theta' - theta0' = 0 there, and

    theta(s, t) = sum a_k(t) cos(k pi s/L),   k = 0 ... n,     e(s, t) = sum b_k(t) cos(k pi s/L),   k = 0 ... m - 1,    (1)
    r(s, t) = p(t) + integral from 0 to s of (1 + e) (cos theta, sin theta),                                        (2)

p(t) the driven pin. The end s = L carries a mass that slides on the x axis: y(L) = 0. Virtual power over q = (a, b) gives

    M q'' = -K (q - q0) - D q' - g + F dx(L)/dq + lambda dy(L)/dq,   y''(L) = 0 (stabilised),                       (3)

M_jk = integral of rho A r_j r_k + rho I theta_j theta_k + (end mass) x_j x_k with r_k = dr/dq_k, g what the accelerations not due
to q'' (those of the pin, centripetal, Coriolis) do, K = E I (k pi/L)^2 L/2 or E A L/2 (L for k = 0), D = beta K in bending, F the
force on the end mass. The natural curvature of a bow h sin(pi s/L) is a0_1 = h pi/L. Integrals are Gauss's and exact to
rounding; a_k falls as k^-4, as the load of inertia does not vanish at the pins. Time steps are scipy's DOP853,
restarted where contact begins and ends. m = 0 is the inextensible strip; m = 1, a uniform strain, keeps the mass on
the coupler's axial spring but none of the axial waves, which cost steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import count
from math import inf, isfinite, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import legendre
from scipy.integrate import solve_ivp

Array = np.ndarray[Any, Any]
PULL = 1e3
"""Rate at which y(L) = 0 is restored, 1/s: rounding and the integrator's errors would let it drift."""
NODES_PER_TERM = 4
"""Gauss nodes a term, and at least `FEWEST`: the integrands hold sines of angles, not only squares of cosines."""
FEWEST = 24
MOST_RESTARTS = 10_000
"""Changes between free and in contact that are allowed."""
SLOWEST_ONSET = 1e-6
"""Least approach speed a contact law is given, m/s."""

Pin = Callable[[float], tuple[tuple[float, float], tuple[float, float], tuple[float, float]]]
"""Position, m, velocity, m/s, and acceleration, m/s^2, of the driven pin at a time, s."""
Push = Callable[[float, float, float], float]
"""Force of a stop, N, never negative, at depth, m, rate, m/s, and the rate at which the contact began, m/s."""


class MotionError(RuntimeError):
    """The integration stopped before its time."""


def turning_crank(radius: float, speed: float, angle: float = 0.0) -> Pin:
    """Pin on a crank about the origin at constant speed."""

    def pin(t: float) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
        x, y = radius * np.cos(angle + speed * t), radius * np.sin(angle + speed * t)
        return (x, y), (-speed * y, speed * x), (-(speed**2) * x, -(speed**2) * y)

    return pin


class Motion(NamedTuple):
    """What a run gives, at the times asked for.

    Attributes
    ----------
    time : array, shape (times,), s
    x, v : array, shape (times,)
        Position, m, and velocity, m/s, of the end mass on its axis.
    deflection : array, shape (times,)
        Of mid-span from the chord, m, positive to the left of the way from the pin to the end mass.
    force : array, shape (times,)
        Of the stop on the end mass, N.
    energy : array, shape (times,)
        Kinetic and bending energy, J.
    contacts : array, shape (contacts, 3)
        Time, s, each contact began, its approach speed, m/s, and time it ended, s.
    evaluations : int
        Of the equations.
    """

    time: Array
    x: Array
    v: Array
    deflection: Array
    force: Array
    energy: Array
    contacts: Array
    evaluations: int


@dataclass(frozen=True)
class MovingStrip:
    """A strip from a driven pin to a mass on the x axis.

    Parameters
    ----------
    pin : callable
        See `Pin`; `turning_crank` makes one.
    length : float
        Arc length, m.
    bending_stiffness : float
        E I, N m^2.
    mass_per_length : float
        kg/m.
    end_mass : float
        kg.
    bending_damping : float
        Retardation time beta of the moment E I (kappa + beta kappa'), s.
    turning_inertia : float
        Of the section, rho I, kg m.
    bow : float
        Stress-free bow h sin(pi s/L), m, positive to the left of the way from the pin to the end mass.
    friction : float
        Of the end mass, N, against its velocity, linear below `creep`.
    creep : float
        m/s.
    side : int
        -1 if the end mass lies towards negative x of the pin, +1 if towards positive.
    terms : int
        n of (1), 1 to 64.
    axial_stiffness : float
        E A, N; infinite for the inextensible strip.
    strain_terms : int
        m of (1), 0 to 64; 0 with an infinite axial stiffness only.
    """

    pin: Pin
    length: float
    bending_stiffness: float
    mass_per_length: float
    end_mass: float
    bending_damping: float = 0.0
    turning_inertia: float = 0.0
    bow: float = 0.0
    friction: float = 0.0
    creep: float = 1e-3
    side: int = -1
    terms: int = 8
    axial_stiffness: float = inf
    strain_terms: int = 0

    def __post_init__(self) -> None:
        for name in ("length", "bending_stiffness", "mass_per_length", "creep"):
            if not 0 < getattr(self, name) < inf:
                raise ValueError(f"{name} = {getattr(self, name)}: must be positive and finite")
        for name in ("end_mass", "bending_damping", "turning_inertia", "friction"):
            if not 0 <= getattr(self, name) < inf:
                raise ValueError(f"{name} = {getattr(self, name)}: must be finite and not negative")
        if not abs(self.bow) < 0.1 * self.length:
            raise ValueError(f"bow = {self.bow} m: must be below a tenth of the length")
        if self.side not in (-1, 1) or self.terms not in range(1, 65):
            raise ValueError(f"side = {self.side}, terms = {self.terms}: must be -1 or 1, and 1 to 64")
        if self.strain_terms not in range(65) or (self.strain_terms == 0) != (self.axial_stiffness == inf):
            text = "must be 1 to 64 with a finite one, 0 with an infinite one"
            raise ValueError(f"strain_terms = {self.strain_terms}, axial_stiffness = {self.axial_stiffness} N: {text}")
        if not self.axial_stiffness > 0:
            raise ValueError(f"axial_stiffness = {self.axial_stiffness} N: must be positive")

    def move(
        self,
        times: Array,
        *,
        wall: float | None = None,
        push: Push | None = None,
        rtol: float = 1e-9,
        atol: float = 1e-10,
    ) -> Motion:
        """Integrate from t = 0, the strip unstressed and moving with the pin as if rigid.

        Parameters
        ----------
        times : array, shape (times,)
            When to report, s, ascending from 0 or later.
        wall : float, optional
            Position of a stop on the x axis, m, met from the pin's side: on the far side of the end mass.
        push : callable, optional
            Its force; see `Push`.
        rtol, atol : float
            Tolerances of scipy's DOP853 on angles, rad, and their rates over L^2 sqrt(m/(E I)).

        Raises
        ------
        MotionError
            If the integration fails, or contact chatters.
        """
        return _Run(self, wall, push).over(np.asarray(times, dtype=float), rtol, atol)

    @cached_property
    def unstressed(self) -> Array:
        """Coefficients (a, b) of the unstressed strip along the x axis."""
        q = np.zeros(self.terms + 1 + self.strain_terms)
        q[0] = 0.0 if self.side > 0 else pi
        q[1] = self.bow * pi / self.length
        return q


class _Grid:
    """Gauss nodes on [0, L]: weights, integrals from 0 to each node and to L/2 as matrices, the cosines of (1)."""

    def __init__(self, length: float, terms: int, strains: int) -> None:
        n = max(FEWEST, NODES_PER_TERM * max(terms, strains))
        x, w = legendre.leggauss(n)
        coefficients = (np.arange(n) + 0.5)[:, None] * legendre.legvander(x, n - 1).T * w  # of Legendre's series, from values
        self.weights = 0.5 * length * w
        self.integrate = 0.5 * length * _antiderivatives(x, n) @ coefficients
        self.half = 0.5 * length * (_antiderivatives(np.zeros(1), n) @ coefficients)[0]
        waves = np.arange(max(terms + 1, strains)) * pi / length
        cosines = np.cos(np.outer(0.5 * length * (x + 1), waves))
        self.wave, self.cosines, self.stretches = waves[: terms + 1], cosines[:, : terms + 1], cosines[:, :strains]


def _antiderivatives(x: Array, n: int) -> Array:
    """Integrals from -1 to x of the first n Legendre polynomials, shape (x.size, n)."""
    p = legendre.legvander(x, n)
    k = np.arange(1, n)
    return np.hstack([x[:, None] + 1, (p[:, 2:] - p[:, :-2]) / (2 * k + 1)])


class _Run:
    """The equations of one strip, and their integration from contact to contact."""

    def __init__(self, strip: MovingStrip, wall: float | None, push: Push | None) -> None:
        if (wall is None) != (push is None):
            raise ValueError("a stop needs both a wall and a push")
        self.strip, self.wall, self.push = strip, wall, push
        self.grid = g = _Grid(strip.length, strip.terms, strip.strain_terms)
        self.angles, self.n = strip.terms + 1, strip.terms + 1 + strip.strain_terms
        bending = 0.5 * strip.length * strip.bending_stiffness * g.wave**2
        stretch = np.full(strip.strain_terms, 0.5 * strip.length) * (strip.axial_stiffness if strip.strain_terms else 1.0)
        stretch[:1] *= 2
        self.stiffness = np.concatenate([bending, stretch])
        self.damping = np.concatenate([strip.bending_damping * bending, 0.0 * stretch])
        self.onset: float | None = None

    # --- the equations ---

    def rates(self, t: float, y: Array) -> Array:
        """Equation (3), solved for q''."""
        strip, g, n, angles = self.strip, self.grid, self.n, self.angles
        q, v = y[:n], y[n:]
        place, speed, push = strip.pin(t)
        cos, sin, spin, long, longer = self._sections(q, v)
        # integrands of dr/dq and of what of r'' is not due to q''
        along = np.hstack([-(long * sin)[:, None] * g.cosines, cos[:, None] * g.stretches])
        across = np.hstack([(long * cos)[:, None] * g.cosines, sin[:, None] * g.stretches])
        fall_x, fall_y = -long * cos * spin**2 - 2 * longer * spin * sin, -long * sin * spin**2 + 2 * longer * spin * cos
        jx, jy, ex, ey = g.integrate @ along, g.integrate @ across, g.weights @ along, g.weights @ across
        gx, gy = push[0] + g.integrate @ fall_x, push[1] + g.integrate @ fall_y
        mass = strip.mass_per_length * g.weights
        system, right = np.zeros((n + 1, n + 1)), np.empty(n + 1)
        system[:n, :n] = jx.T @ (mass[:, None] * jx) + jy.T @ (mass[:, None] * jy) + strip.end_mass * np.outer(ex, ex)
        system[:angles, :angles] += strip.turning_inertia * g.cosines.T @ (g.weights[:, None] * g.cosines)
        system[:n, n] = system[n, :n] = ey
        x, rate = place[0] + g.weights @ (long * cos), speed[0] + ex @ v
        force = -strip.side * self.contact(x, rate) - strip.friction * min(1.0, max(-1.0, rate / strip.creep))
        right[:n] = -self.stiffness * (q - strip.unstressed) - self.damping * v - jx.T @ (mass * gx) - jy.T @ (mass * gy)
        right[:n] += ex * (force - strip.end_mass * (push[0] + g.weights @ fall_x))
        off, drift = place[1] + g.weights @ (long * sin), speed[1] + ey @ v
        right[n] = -(push[1] + g.weights @ fall_y) - 2 * PULL * drift - PULL**2 * off
        return np.concatenate([v, np.linalg.solve(system, right)[:n]])

    def _sections(self, q: Array, v: Array) -> tuple[Array, Array, Array, Array, Array]:
        """At the nodes: cos and sin of theta, theta', stretch 1 + e and its rate e'."""
        g, k = self.grid, self.angles
        theta = g.cosines @ q[:k]
        return np.cos(theta), np.sin(theta), g.cosines @ v[:k], 1.0 + g.stretches @ q[k:], g.stretches @ v[k:]

    def contact(self, x: float, rate: float) -> float:
        """Force of the stop, N, while there is contact."""
        if self.onset is None or self.wall is None or self.push is None:
            return 0.0
        return self.push(self.strip.side * (x - self.wall), self.strip.side * rate, self.onset)

    def end(self, t: float, y: Array) -> tuple[float, float]:
        """Position, m, and velocity, m/s, of the end mass."""
        place, speed, _ = self.strip.pin(t)
        cos, sin, spin, long, longer = self._sections(y[: self.n], y[self.n :])
        return (
            float(place[0] + self.grid.weights @ (long * cos)),
            float(speed[0] + self.grid.weights @ (longer * cos - long * sin * spin)),
        )

    def start(self) -> Array:
        """State of the unstressed strip between pin and axis, turning as the pin demands."""
        place, speed, _ = self.strip.pin(0.0)
        q, g, k = self.strip.unstressed.copy(), self.grid, self.angles
        for _ in range(50):
            theta = g.cosines @ q[:k]
            off = place[1] + g.weights @ np.sin(theta)
            q[0] -= off / (g.weights @ np.cos(theta))
            if abs(off) < 1e-15 * self.strip.length:
                break
        v = np.zeros(self.n)
        v[0] = -speed[1] / (g.weights @ np.cos(g.cosines @ q[:k]))
        return np.concatenate([q, v])

    # --- the run ---

    def over(self, times: Array, rtol: float, atol: float) -> Motion:
        """Integrate, restarting at each beginning and end of contact."""
        t, y, stop = 0.0, self.start(), float(times[-1])
        scale = self.strip.length**2 * sqrt(self.strip.mass_per_length / self.strip.bending_stiffness)
        tolerances = np.concatenate([np.full(self.n, atol), np.full(self.n, atol / scale)])
        pieces: list[Any] = []
        contacts: list[list[float]] = []
        evaluations = 0
        for restarts in count():
            if restarts > MOST_RESTARTS:
                raise MotionError(f"contact chatters: {restarts} changes by t = {t:.6g} s")
            found = solve_ivp(
                self.rates, (t, stop), y, method="DOP853", rtol=rtol, atol=tolerances, dense_output=True,
                events=self._crossing() if self.push else None,
            )  # fmt: skip
            evaluations += found.nfev
            if not found.success or not isfinite(found.y[0, -1]):
                raise MotionError(f"after t = {found.t[-1]:.6g} s: {found.message}")
            pieces.append((found.t[-1], found.sol, self.onset))
            t, y = float(found.t[-1]), found.y[:, -1]
            if found.status == 0:
                break
            if self.onset is None:
                self.onset = max(self.strip.side * self.end(t, y)[1], SLOWEST_ONSET)
                contacts.append([t, self.onset, inf])
            else:
                self.onset = None
                contacts[-1][2] = t
        return self._collect(times, pieces, np.array(contacts).reshape(-1, 3), evaluations)

    def _crossing(self) -> Callable[[float, Array], float]:
        """Event of the next change between free and in contact."""

        def crossing(t: float, y: Array) -> float:
            return self.strip.side * (self.end(t, y)[0] - float(self.wall or 0.0))

        crossing.terminal, crossing.direction = True, 1 if self.onset is None else -1  # type: ignore[attr-defined]
        return crossing

    def _collect(self, times: Array, pieces: list[Any], contacts: Array, evaluations: int) -> Motion:
        rows = np.empty((len(times), 5))
        ends = np.array([piece[0] for piece in pieces])
        for i, t in enumerate(times):
            _, solution, self.onset = pieces[min(int(np.searchsorted(ends, t)), len(pieces) - 1)]
            rows[i] = self._row(float(t), solution(t))
        x, v, deflection, force, energy = rows.T
        return Motion(times, x, v, deflection, force, energy, contacts, evaluations)

    def _row(self, t: float, y: Array) -> tuple[float, ...]:
        strip, g = self.strip, self.grid
        cos, sin, spin, long, longer = self._sections(y[: self.n], y[self.n :])
        place, speed, _ = strip.pin(t)
        x, rate = self.end(t, y)
        chord, sag = (x - place[0], g.weights @ (long * sin)), (g.half @ (long * cos), g.half @ (long * sin))
        deflection = (chord[0] * sag[1] - chord[1] * sag[0]) / np.hypot(*chord)
        vx = speed[0] + g.integrate @ (longer * cos - long * sin * spin)
        vy = speed[1] + g.integrate @ (longer * sin + long * cos * spin)
        kinetic = strip.mass_per_length * g.weights @ (vx**2 + vy**2) + strip.end_mass * rate**2
        kinetic += strip.turning_inertia * g.weights @ spin**2
        strained = self.stiffness @ (y[: self.n] - strip.unstressed) ** 2
        return x, rate, float(deflection), self.contact(x, rate), float(0.5 * (kinetic + strained))
