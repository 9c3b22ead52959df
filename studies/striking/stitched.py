"""Published model of the compliant slider-crank: three modes of motion in closed form, one after another in each turn.

1. Rigid: the coupler is straight, and the loop closure gives the slider's motion (eqs 1-5).
2. Impact: the slider of mass m meets the stop at speed v and leaves it at e v (eq. 6). The stop feels a constant force
   F = m (1 + e) v/dt for the time dt. The coupler then pushes the slider back to the stop, against friction f, with the force
   F_c (3.) that it has at the end of the impact. The slider returns with the speed e v sqrt((F_c - f)/(F_c + f)), until rebounds
   are negligible.
3. Contact: the slider rests against the stop, which feels F_c = p(u) E I/L^2 cos(phi) in equilibrium (eqs 7-13), until the
   coupler is straight again. Here u is the end shortening over length, phi the angle of the coupler to the slider's line.

The energy ledger takes the strip's energy and the drive's work at the actual crank angle and slider position. The error of the
ledger is the energy that the model creates or loses, because its three modes do not fit together exactly.
Source: B. Demirel et al., 2008, doi 10.1115/IMECE2008-68796.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi, sqrt
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from buckler.elastica import law
from buckler.mbs.elements import Ramp
from buckler.mbs.geometry import Array
from buckler.mbs.laws.pieces import Reals
from buckler.mbs.library import PAPER, PAPER_STOP


class Rebound(NamedTuple):
    """Motion of the slider off the stop, in SI units."""

    speed: float  # at the start, away from the stop
    deceleration: float  # (F_c + f)/m
    acceleration: float  # back to the stop, (F_c - f)/m, or 0 if friction holds the slider
    outward_time: float  # to standstill
    height: float  # distance from the stop at standstill
    duration: float  # until the slider returns or is held
    return_speed: float

    @classmethod
    def of(cls, speed: float, push: float, friction: float, mass: float) -> Self:
        """Compute the motion with an initial speed [m/s] against a constant push [N] and friction [N], for a mass [kg]."""
        deceleration, acceleration = (push + friction) / mass, max(push - friction, 0.0) / mass
        outward, height = speed / deceleration, speed**2 / (2 * deceleration)
        back, returned = sqrt(2 * height / acceleration) if acceleration else 0.0, speed * sqrt(acceleration / deceleration)
        return cls(speed, deceleration, acceleration, outward, height, duration=outward + back, return_speed=returned)

    def motion(self, t: Array) -> tuple[Array, Array]:
        """Compute distance and velocity from the stop at times t [s] since the slider has left it."""
        back, out = np.maximum(t - self.outward_time, 0.0), np.minimum(t, self.outward_time)
        distance = self.speed * out - self.deceleration * out**2 / 2 - self.acceleration * back**2 / 2
        return distance, np.where(t < self.outward_time, self.speed - self.deceleration * out, -self.acceleration * back)


@dataclass(frozen=True)
class Stitched:
    """Slider-crank with a stop, as published, in SI units."""

    mass: float  # of the slider
    restitution: float
    friction: float  # on the slider
    impact_duration: float  # dt
    stiffness: float  # E I of the strip
    stop: float = PAPER_STOP  # place of the stop on the slider's line

    @property
    def contact_angle(self) -> float:
        """Crank angle at which the slider meets the stop [rad]; at 2 pi minus this angle it leaves the stop."""
        return PAPER.contact_angle(self.stop)

    def strip_force(self, shortening: Reals) -> Reals:
        """Compute the force of the buckled strip, p(u) E I/L^2 [N], with the published quartic p(u) (eq. 12)."""
        return law.quartic(shortening) * self.stiffness / PAPER.coupler**2

    def strip_energy(self, shortening: Array) -> Array:
        """Integrate the force of the strip from u = 0, by the integral of the quartic [J]."""
        return np.polyval(np.polyint(law.QUARTIC), shortening) * self.stiffness / PAPER.coupler

    def contact_force(self, angle: Reals) -> Reals:
        """Compute the quasi-static force on the stop, p(u) E I/L^2 cos(phi) [N], for angles in contact (eq. 13)."""
        return PAPER.push(law.quartic, self.stiffness, angle, self.stop)

    def impact_force(self, speed: float) -> float:
        """Compute the force on the stop in an impact, m (1 + e) v/dt [N]."""
        return self.mass * (1 + self.restitution) * speed / self.impact_duration

    def compression(self, angle: Reals, speed: Reals, acceleration: Reals = 0.0) -> Reals:
        """Compute the compression N of a rigid coupler [N] from the crank's angle, speed and acceleration.

        N cos(phi) = -(m x_tt + f sign(x_t)), where x is the position of the slider.
        """
        rate, second = PAPER.slider_rate(angle), PAPER.slider_second_rate(angle)  # dx/dangle, d2x/dangle2
        resistance = self.mass * (second * speed**2 + rate * acceleration) + self.friction * np.sign(rate * speed)
        cosine = PAPER.lean_cosine(angle, PAPER.slider(angle))  # of phi
        return -resistance / cosine


class Trace(NamedTuple):
    """Motion and energy ledger of a run; arrays of shape (samples,), with two samples at a time where a quantity jumps."""

    time: Array  # [s]
    angle: Array  # of the crank [rad]
    position: Array  # of the slider [m]
    speed: Array  # velocity of the slider [m/s]
    force: Array  # on the stop [N]
    shortening: Array  # end shortening of the strip over its length
    push: Array  # compression of the strip [N]
    buckling_ratio: Array  # compression of the rigid coupler over the Euler load; above 1 it buckles, and the model does not hold
    energy: dict[str, Array]  # [J]: kinetic, strain; taken by impacts and friction, given by the drive since t = 0; error
    held: bool  # friction has held the slider off the stop

    @property
    def energy_balance(self) -> float:
        """Largest error of the ledger over the largest sum of kinetic, strain and dissipated energy."""
        active = sum(self.energy[name] for name in ("kinetic", "strain", "taken_impact", "taken_friction"))
        return float(np.abs(self.energy["error"]).max() / np.max(active))


def _sample(motion: Ramp, times: Array) -> Array:
    """Compute angle, speed and acceleration of the crank, (3, times), in SI units."""
    return np.array([[each(t) for t in times] for each in (motion.position, motion.speed, motion.acceleration)])


def _find_time(motion: Ramp, angle: float, duration: float) -> float:
    """Find the time at which the crank reaches an angle, or the duration of the run if it ends first [s]."""
    if motion.position(duration) <= angle:
        return duration
    return float(brentq(lambda t: motion.position(t) - angle, 0.0, duration, xtol=1e-14))


class _Piece(NamedTuple):
    """Samples of one mode of motion."""

    mode: str
    time: Array
    position: Array
    speed: Array
    force: Array


def follow(model: Stitched, motion: Ramp, duration: float) -> Trace:
    """Run the model from crank angle 0 for a duration [s], forward by `motion`; a ValueError for a stop beyond reach."""
    pieces: list[_Piece] = []
    time, turn, contact = 0.0, 0, model.contact_angle
    while time < duration:
        start, end = (_find_time(motion, each, duration) for each in (2 * pi * turn + contact, 2 * pi * (turn + 1) - contact))
        times = _times("rigid", time, start)
        angle, speed, _ = _sample(motion, times)
        pieces.append(_piece("rigid", times, PAPER.slider(angle), PAPER.slider_rate(angle) * speed))
        pieces += _strike(model, motion, start, end)
        time, turn = float(pieces[-1].time[-1]), turn + 1
    return _trace(model, motion, pieces)


def _piece(mode: str, time: Array, position: ArrayLike, speed: ArrayLike = 0.0, force: ArrayLike = 0.0) -> _Piece:
    return _Piece(mode, *np.broadcast_arrays(time, position, speed, force))


def _times(mode: str, start: float, end: float) -> Array:
    # ten times as many samples change the energies of a turn by 1e-5 of the drive's work at most
    samples = {"rigid": 240, "impact": 5, "rebound": 41, "held": 240, "contact": 480}
    return np.linspace(start, end, samples[mode])


def _strike(model: Stitched, motion: Ramp, start: float, end: float) -> Iterator[_Piece]:
    """Compute impacts and rebounds until they are negligible or friction holds the slider, then contact until `end` [s]."""
    time = start
    first = speed = abs(PAPER.slider_rate(model.contact_angle)) * motion.speed(start)
    while time < end and speed > 1e-2 * first:  # chosen: below it, 1e-4 of the energy of the first impact, rebounds are over
        pulse, rebound_speed = _times("impact", time, min(time + model.impact_duration, end)), model.restitution * speed
        yield _piece("impact", pulse, model.stop, np.linspace(-speed, rebound_speed, len(pulse)), model.impact_force(speed))
        time = float(pulse[-1])
        rebound = Rebound.of(rebound_speed, float(model.contact_force(motion.position(time))), model.friction, model.mass)
        flight = _times("rebound", time, min(time + rebound.duration, end))
        travel, rate = rebound.motion(flight - time)
        yield _piece("rebound", flight, model.stop + travel, rate)
        time, speed = float(flight[-1]), rebound.return_speed
        if not rebound.acceleration:  # it counts as held to the end, though F_c changes with the crank angle
            yield _piece("held", _times("held", time, end), model.stop + rebound.height)
            return
    if time < end:
        rest = _times("contact", time, end)
        yield _piece("contact", rest, model.stop, force=model.contact_force(_sample(motion, rest)[0]))


def _trace(model: Stitched, motion: Ramp, pieces: list[_Piece]) -> Trace:
    """Join the pieces, and compute the energy ledger."""
    time, position, speed, force = (np.concatenate([getattr(piece, name) for piece in pieces]) for name in _Piece._fields[1:])
    piece_number = np.repeat(np.arange(len(pieces)), [len(piece.time) for piece in pieces])
    modes = np.array([piece.mode for piece in pieces])[piece_number]
    angle, crank_speed, crank_acceleration = _sample(motion, time)
    chord, is_rigid = PAPER.chord(angle, position), modes == "rigid"
    shortening = np.where(is_rigid, 0.0, np.maximum(1 - chord / PAPER.coupler, 0.0))
    is_inside = np.diff(piece_number, prepend=-1) == 0  # false at the first sample of a piece, where quantities jump

    def accumulate(increments: Array, where: Array | bool = True) -> Array:
        """Sum increments within pieces, where the condition holds."""
        return np.cumsum(np.where(is_inside & where, increments, 0.0))

    kinetic, strip_push = model.mass * speed**2 / 2, model.strip_force(shortening)
    rise = np.diff(kinetic, prepend=0.0)
    rubbing = model.friction * np.abs(np.diff(position, prepend=position[0]))
    # The strip's push P on the crank pin acts along the chord, away from the slider at x. Its moment about the crank's axis, the
    # origin, is P R sin(angle) x/chord, which the moment of the drive balances.
    drive_power = -strip_push * PAPER.crank * np.sin(angle) * position / chord * crank_speed
    # Trapezoidal rule; np.roll brings the last value to the first sample, which `accumulate` leaves out.
    work = np.diff(time, prepend=0.0) * (drive_power + np.roll(drive_power, 1)) / 2
    energy = {
        "kinetic": kinetic,
        "strain": model.strip_energy(shortening),
        "taken_impact": accumulate(-rise, modes == "impact"),
        "taken_friction": accumulate(rubbing),
        "given_drive": accumulate(np.where(is_rigid, rise + rubbing, work)),  # a rigid coupler stores no energy
    }
    stored, dissipated = energy["kinetic"] + energy["strain"], energy["taken_impact"] + energy["taken_friction"]
    energy["error"] = stored - stored[0] + dissipated - energy["given_drive"]
    compression = is_rigid * model.compression(angle, crank_speed, crank_acceleration)
    push = np.where(is_rigid, compression, strip_push)
    buckling_ratio = compression / model.strip_force(shortening=0.0)
    return Trace(time, angle, position, speed, force, shortening, push, buckling_ratio, energy, bool((modes == "held").any()))
