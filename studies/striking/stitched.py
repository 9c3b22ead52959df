"""The published model of the compliant slider-crank: three modes of motion in closed form, stitched together.

1. Rigid: the coupler stays straight, the slider follows from the loop closure (eqs 1-5).
2. Impact: the slider, of mass m, meets the stop at speed v and leaves it at e v (eq. 6); the stop feels a pulse
   F = m (1 + e) v / dt. The coupler pushes it back with the constant force F_c of that crank angle; friction f opposes
   its motion. So it comes back at e v sqrt((F_c - f)/(F_c + f)), and so on until its rebounds are negligible.
3. Contact: the slider rests against the stop and feels F_c = p(u) E I/L^2 cos(phi) (eqs 7-13), quasi-statically, until
   the coupler is straight again.

The energy ledger takes the strip's energy at the actual crank angle and slider position, and the drive's work against the
strip's actual force. Its error is the energy that the stitching makes or loses.

References
----------
B. Demirel et al., Compliant Impact Generator for Required Impact and Contact Force, doi 10.1115/IMECE2008-68796.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import pi, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from buckler.elastica import law
from buckler.mbs.elements import Motion, Ramp
from buckler.mbs.geometry import Array
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.mbs.laws.pieces import Reals
from buckler.mbs.library import PAPER, PAPER_STOP

NEGLIGIBLE = 1e-2
"""Share of the first impact's speed below which rebounds are over: 1e-4 of its energy."""
SAMPLES = {"rigid": 240, "impact": 5, "rebound": 41, "held": 240, "contact": 480}
"""Samples of a piece of each mode of motion."""
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)


class Rebound(NamedTuple):
    """Flight of a slider off the stop: time and distance to standstill, time until it returns or stays, speed of return.

    `slow` and `fast` are its deceleration, (F + f)/m, and its acceleration back, (F - f)/m, 0 if friction holds it [m/s^2].
    """

    speed: float
    slow: float
    fast: float
    outward_time: float
    height: float
    duration: float
    return_speed: float

    @classmethod
    def of(cls, speed: float, push: float, friction: float, mass: float) -> Rebound:
        """Compute the flight at a speed [m/s] against a constant push [N] and friction [N] of a mass [kg]."""
        slow, fast = (push + friction) / mass, max(push - friction, 0.0) / mass
        outward, height = speed / slow, speed**2 / (2 * slow)
        back = sqrt(2 * height / fast) if fast else 0.0
        return cls(speed, slow, fast, outward, height, outward + back, speed * sqrt(fast / slow))

    def motion(self, t: Array) -> tuple[Array, Array]:
        """Compute distance from the stop and speed away from it, at times t since it was left."""
        back, out = np.maximum(t - self.outward_time, 0.0), np.minimum(t, self.outward_time)
        place = self.speed * out - self.slow * out**2 / 2 - self.fast * back**2 / 2
        return place, np.where(t < self.outward_time, self.speed - self.slow * out, -self.fast * back)


@dataclass(frozen=True)
class Stitched:
    """The slider-crank with a stop, as published.

    Mass of the slider [kg], restitution e, friction at any speed [N], dt of one impact [s], E I of the strip [N m^2]; lengths,
    place of the stop on the slider's line [m], and normalised force p(u).
    """

    mass: float
    restitution: float
    friction: float
    impact_duration: float
    stiffness: float
    lengths: SliderCrank = PAPER
    stop: float = PAPER_STOP
    load: Callable[[Reals], Reals] = law.quartic

    @property
    def contact_angle(self) -> float:
        """Crank angle at which the slider meets the stop [rad]; it leaves it at 2 pi minus this."""
        return self.lengths.contact_angle(self.stop)

    def strip_force(self, shortening: Reals) -> Reals:
        """Compute the force of the buckled strip, p(u) E I/L^2 [N] (eq. 12)."""
        return self.load(shortening) * self.stiffness / self.lengths.coupler**2

    def strip_energy(self, shortening: Array) -> Array:
        """Integrate that force from u = 0 [J] by Gauss quadrature, exact for the quartic."""
        u = np.asarray(shortening)
        mean = (_WEIGHTS * self.load(np.multiply.outer(u, (_NODES + 1) / 2))).sum(axis=-1) / 2
        return u * mean * self.stiffness / self.lengths.coupler

    def contact_force(self, angle: Reals) -> Reals:
        """Compute the quasi-static force on the stop, p(u) E I/L^2 cos(phi) [N], for angles in contact (eq. 13)."""
        return self.lengths.push(self.load, self.stiffness, angle, self.stop)

    def impact_force(self, speed: float) -> float:
        """Compute the force of a pulse, m (1 + e) v/dt [N]."""
        return self.mass * (1 + self.restitution) * speed / self.impact_duration

    def compression(self, angle: Reals, speed: Reals, acceleration: Reals = 0.0) -> Reals:
        """Compute the compression [N] of the coupler, taken as rigid, by the slider's inertia and friction.

        N cos(phi) = -(m x_tt + f sign(x_t)), x the slider's position, from crank angle, speed and acceleration.
        """
        rate, second = self.lengths.slider_rate(angle), self.lengths.slider_second_rate(angle)
        resisting = self.mass * (second * speed**2 + rate * acceleration) + self.friction * np.sign(rate * speed)
        return -resisting / self.lengths.lean_cosine(angle, self.lengths.slider(angle))


class Trace(NamedTuple):
    """Motion and ledger of a stitched run; arrays of shape (samples,), two samples where a quantity jumps.

    Attributes
    ----------
    time, angle, position, speed, force, shortening : time [s]; crank angle [rad]; slider position [m] and velocity [m/s];
        force on the stop [N]; relative end shortening
    push : compression of the strip [N]
    load : compression the rigid mode asks of the coupler, over the Euler load; 0 in the other modes. Above 1 the strip
        buckles, and the model does not hold.
    energy : `kinetic`, `strain`, and since t = 0 `taken_impact`, `taken_friction`, `given_drive`, `error` [J]
    held : whether friction held the slider off the stop
    """

    time: Array
    angle: Array
    position: Array
    speed: Array
    force: Array
    shortening: Array
    push: Array
    load: Array
    energy: dict[str, Array]
    held: bool

    @property
    def energy_balance(self) -> float:
        """Largest ledger error over the largest sum of held and dissipated energy."""
        active = sum(self.energy[name] for name in ("kinetic", "strain", "taken_impact", "taken_friction"))
        return float(np.abs(self.energy["error"]).max() / np.max(active))


class _Crank(NamedTuple):
    """The crank's motion up to the end of the run."""

    motion: Ramp | Motion
    duration: float

    def along(self, times: Array) -> Array:
        m = self.motion
        return np.array([[each(t) for t in times] for each in (m.position, m.speed, m.acceleration)])

    def time(self, angle: float) -> float:
        """Find the time at which the crank reaches an angle, at most the end of the run."""
        late = self.motion.position(self.duration) <= angle
        return self.duration if late else float(brentq(lambda t: self.motion.position(t) - angle, 0.0, self.duration, xtol=1e-14))


class _Piece(NamedTuple):
    """Samples of one mode of motion."""

    mode: str
    time: Array
    position: Array
    speed: Array
    force: Array


def follow(model: Stitched, motion: Ramp | Motion, duration: float) -> Trace:
    """Run the model for `duration` seconds from crank angle 0, its crank turned forward by `motion`.

    Raises
    ------
    ValueError
        If the slider never reaches the stop's place.
    """
    crank = _Crank(motion, duration)
    pieces: list[_Piece] = []
    time, turn, meeting = 0.0, 0, model.contact_angle
    while time < duration:
        meets, leaves = crank.time(2 * pi * turn + meeting), crank.time(2 * pi * (turn + 1) - meeting)
        moving = _times("rigid", time, meets)
        angle, speed, _ = crank.along(moving)
        pieces.append(_piece("rigid", moving, model.lengths.slider(angle), model.lengths.slider_rate(angle) * speed))
        pieces += _strike(model, crank, meets, leaves)
        time, turn = float(pieces[-1].time[-1]), turn + 1
    return _trace(model, crank, pieces)


def _piece(mode: str, time: Array, position: ArrayLike, speed: ArrayLike = 0.0, force: ArrayLike = 0.0) -> _Piece:
    return _Piece(mode, *np.broadcast_arrays(time, position, speed, force))


def _times(mode: str, start: float, end: float) -> Array:
    return np.linspace(start, end, SAMPLES[mode])


def _strike(model: Stitched, crank: _Crank, start: float, end: float) -> Iterator[_Piece]:
    """Follow impacts and rebounds until they are negligible, then rest against the stop to the end of contact."""
    time = start
    first = speed = abs(model.lengths.slider_rate(model.contact_angle)) * crank.motion.speed(start)
    while time < end and speed > NEGLIGIBLE * first:
        pulse, away = _times("impact", time, min(time + model.impact_duration, end)), model.restitution * speed
        yield _piece("impact", pulse, model.stop, np.linspace(-speed, away, len(pulse)), model.impact_force(speed))
        time = float(pulse[-1])
        rebound = Rebound.of(away, float(model.contact_force(crank.motion.position(time))), model.friction, model.mass)
        flight = _times("rebound", time, min(time + rebound.duration, end))
        travel, rate = rebound.motion(flight - time)
        yield _piece("rebound", flight, model.stop + travel, rate)
        time, speed = float(flight[-1]), rebound.return_speed
        if not rebound.fast:
            yield _piece("held", _times("held", time, end), model.stop + rebound.height)
            return
    if time < end:
        rest = _times("contact", time, end)
        yield _piece("contact", rest, model.stop, force=model.contact_force(crank.along(rest)[0]))


def _trace(model: Stitched, crank: _Crank, pieces: list[_Piece]) -> Trace:
    """Join the pieces and draw up the ledger."""
    time, position, speed, force = (np.concatenate([piece[i] for piece in pieces]) for i in range(1, 5))
    number_of = np.repeat(np.arange(len(pieces)), [len(piece.time) for piece in pieces])
    modes = np.array([piece.mode for piece in pieces])[number_of]
    angle, turning, faster = crank.along(time)
    chord, rigid = model.lengths.chord(angle, position), modes == "rigid"
    shortening = np.where(rigid, 0.0, np.maximum(1 - chord / model.lengths.coupler, 0.0))
    within = np.diff(number_of, prepend=-1) == 0

    def since_start(increments: Array, where: Array | bool = True) -> Array:
        return np.cumsum(np.where(within & where, increments, 0.0))

    kinetic, push = model.mass * speed**2 / 2, model.strip_force(shortening)
    rise = np.diff(kinetic, prepend=0.0)
    rubbing = model.friction * np.abs(np.diff(position, prepend=position[0]))
    power = -push * model.lengths.crank * np.sin(angle) * position / chord * turning
    work = np.diff(time, prepend=0.0) * (power + np.roll(power, 1)) / 2
    energy = {
        "kinetic": kinetic,
        "strain": model.strip_energy(shortening),
        "taken_impact": since_start(-rise, modes == "impact"),
        "taken_friction": since_start(rubbing),
        "given_drive": since_start(np.where(rigid, rise + rubbing, work)),  # a rigid coupler stores no energy
    }
    held, taken = energy["kinetic"] + energy["strain"], energy["taken_impact"] + energy["taken_friction"]
    energy["error"] = held - held[0] + taken - energy["given_drive"]
    asked = rigid * model.compression(angle, turning, faster)
    push = np.where(rigid, asked, push)
    load = asked / model.strip_force(0.0)
    return Trace(time, angle, position, speed, force, shortening, push, load, energy, bool((modes == "held").any()))
