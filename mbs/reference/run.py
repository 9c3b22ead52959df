"""Run the crank-rocker with clearance: from numbers to arrays, with the energy balance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from functools import lru_cache
from math import inf
from time import perf_counter
from typing import Any

import numpy as np

from buckler.mbs.reference import dopri
from buckler.mbs.reference.compiled import Laws, compile_laws
from buckler.mbs.reference.equations import BAUMGARTE, GAP, LEDGER, NUMBERS, REPORT, WATCHED, motion
from buckler.mbs.reference.fourbar import JOINTS, FourBar
from buckler.mbs.validate import non_negative, number, positive, whole

Array = np.ndarray[Any, Any]
STABILISE = 1e3
"""Rate at which ideal joints are pulled together, 1/s."""
LANDING = 1e-12
"""How near to zero depth a step must end that begins an impact, m."""
CAPACITY = 200_000
"""Most impacts kept of one run; later ones are counted only."""
compile_once: Callable[[Any, Any], Laws] = lru_cache(maxsize=64)(compile_laws)
"""Laws that can be hashed are compiled once."""


class Outcome(StrEnum):
    """How a run ended. Anything but OK comes with a sentence a person can act on."""

    OK = "OK"
    TOO_DEEP = "TOO_DEEP"
    STEP_UNDERFLOW = "STEP_UNDERFLOW"
    NOT_FINITE = "NOT_FINITE"
    TOO_MANY_STEPS = "TOO_MANY_STEPS"


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """What a run gives back. Second indices: joints O, A, B, C; coordinates as in `equations`.

    Attributes
    ----------
    fourbar : FourBar
    status : Outcome
    message : str
        Why, where the status is not OK.
    time : array, shape (samples,)
        s; those reached.
    q, q_t, q_tt : array, shape (samples, 8 + modes)
        Crank x, y; coupler x, y, theta; rocker x, y, theta; modal coordinates; and their rates.
    force : array, shape (samples, 4, 2)
        On the first body of each joint in `BODIES`, which carries the pin unless `turned` says otherwise, N.
    normal, depth, rate, sliding : array, shape (samples, 4)
        Normal force, N; penetration depth, m; its rate and the sliding speed, m/s.
    coupler_a, rocker_a, middle_a : array, shape (samples, 2)
        Accelerations of the coupler's centre, the rocker's centre and the rocker's mid-point, m/s^2.
    peak_force : array, shape (samples, 4)
        Largest of each joint since the sample before, N, seen at every step.
    peak_depth : array, shape (samples, 4)
        Largest penetration depth likewise, m; 0 where the joint stayed open.
    peak_a : array, shape (samples, 3)
        Largest |x-acceleration| of the same three points likewise, m/s^2.
    impacts : array, shape (impacts, 6)
        Columns `dopri.IMPACT`: number of the joint, onset time and speed, end time and speed, peak force; nan while it lasts.
    taken_contact, taken_friction : array, shape (samples, 4)
        Energy lost since t = 0 in each joint, J.
    taken_modes, given : array, shape (samples,)
        Energy lost in modal damping; work of the drive, J.
    squares : array, shape (samples, 3)
        Integrals of the squared x-accelerations of the three points, m^2/s^3.
    kinetic, strain, contact, weight : array, shape (samples,)
        Energies held, J.
    work : dict
        steps, rejected, evaluations, impacts, wall_s.
    """

    fourbar: FourBar
    status: Outcome
    message: str
    time: Array
    q: Array
    q_t: Array
    q_tt: Array
    force: Array
    normal: Array
    depth: Array
    rate: Array
    sliding: Array
    coupler_a: Array
    rocker_a: Array
    middle_a: Array
    peak_force: Array
    peak_depth: Array
    peak_a: Array
    impacts: Array
    taken_contact: Array
    taken_friction: Array
    taken_modes: Array
    given: Array
    squares: Array
    kinetic: Array
    strain: Array
    contact: Array
    weight: Array
    work: dict[str, float] = field(default_factory=dict)

    @property
    def ok(self) -> bool:
        """True if the run finished and the contact laws held."""
        return self.status is Outcome.OK

    @property
    def taken(self) -> Array:
        """Energy lost since t = 0, J, shape (samples,)."""
        return self.taken_contact.sum(axis=1) + self.taken_friction.sum(axis=1) + self.taken_modes

    @property
    def held(self) -> Array:
        """Energy held, J, shape (samples,)."""
        return self.kinetic + self.strain + self.contact + self.weight

    @property
    def energy_error(self) -> Array:
        """Change of what is held + taken - given, J, shape (samples,)."""
        return self.held - self.held[0] + self.taken - self.given

    @property
    def energy_balance(self) -> float:
        """Largest energy error, relative to the most that was held and taken."""
        through = self.kinetic + self.strain + self.contact + self.weight - self.weight.min() + self.taken
        return float(np.abs(self.energy_error).max() / max(through.max(), np.finfo(float).tiny))


def numbers(fourbar: FourBar) -> Array:
    """The four-bar as `equations` reads it."""
    masses, inertias = fourbar.masses, fourbar.inertias
    table = np.concatenate([
        [fourbar.start, fourbar.speed], fourbar.gravity, fourbar.lengths, [fourbar.frame], masses, inertias[1:],
        [fourbar.pin] * 4, fourbar.gaps, [joint in fourbar.turned for joint in JOINTS],
        [STABILISE],
    ])  # fmt: skip
    assert table.size == NUMBERS and table[BAUMGARTE] == STABILISE and table[GAP] == fourbar.gaps[0]
    return table


def table(fourbar: FourBar) -> Array:
    """Modal data as `equations` reads them."""
    return np.zeros((16, 0)) if fourbar.modes is None else fourbar.modes.table


def ideal_state(fourbar: FourBar, t: float = 0.0) -> Array:
    """Coordinates and velocities of the ideal mechanism, journals centred, rocker undeformed; shape (2 n,)."""
    place, velocity, _ = fourbar.ideal(t)
    still = np.zeros(0 if fourbar.modes is None else len(fourbar.modes))
    return np.concatenate([place[0, :2], place[1], place[2], still, velocity[0, :2], velocity[1], velocity[2], still])


def laws_of(fourbar: FourBar) -> Laws:
    """Compiled laws, kept for the next run where the laws can be hashed."""
    try:
        return compile_once(fourbar.law, fourbar.friction)
    except TypeError:
        return compile_laws(fourbar.law, fourbar.friction)


def simulate(
    fourbar: FourBar,
    duration: float,
    *,
    rtol: float = 1e-7,
    atol: float = 1e-7,
    samples: int = 1001,
    state: Array | None = None,
    longest: float = inf,
    most: int = 20_000_000,
) -> Run:
    """Simulate from t = 0 to duration.

    Parameters
    ----------
    fourbar : FourBar
    duration : float
        s.
    rtol, atol : float
        Relative and absolute tolerance of every coordinate (m, rad) and velocity (m/s, rad/s).
    samples : int
        Equidistant, first and last included.
    state : array, shape (2 n,), optional
        Coordinates and velocities at t = 0; by default the ideal mechanism's.
    longest : float
        Longest step, s; by default a hundredth of the crank's period, and no longer than a sample.
    most : int
        Steps, rejected ones included.
    """
    positive("duration", duration, "s"), non_negative("rtol", rtol, "1"), positive("atol", atol, "m")
    number("longest", longest, 0.0, inf, "s", open_low=True) if longest != inf else None
    whole("samples", samples, 2, 10_000_000), whole("most", most, 1, 2**62)
    still = ideal_state(fourbar)
    started, n = np.array(still if state is None else state, dtype=float), still.size
    if started.shape != (n,) or not np.isfinite(started).all():
        raise ValueError(f"state of shape {started.shape}: must be finite, of shape ({n},)")
    y = np.concatenate([started, np.zeros(LEDGER)])
    controls = np.array([n, rtol, atol, min(longest, fourbar.period / 100), fourbar.slowest_onset, LANDING, most])
    outputs = [np.zeros((samples + dopri.SPARE, *shape)) for shape in ((y.size,), (y.size,), REPORT, (WATCHED,))]
    impacts, counts = np.empty((CAPACITY, len(dopri.IMPACT))), np.zeros(dopri.COUNTERS, dtype=np.int64)
    times, bar, modes, onset = (
        np.linspace(0.0, duration, samples),
        numbers(fourbar),
        table(fourbar),
        np.full(4, fourbar.slowest_onset),
    )
    laws = laws_of(fourbar)
    clock = perf_counter()
    dopri.integrate(motion, y, times, bar, modes, onset, controls, *outputs, impacts, counts, *laws)
    return _collect(fourbar, times, outputs, impacts, counts, perf_counter() - clock)


def _collect(fourbar: FourBar, times: Array, outputs: list[Array], impacts: Array, counts: Array, wall: float) -> Run:
    reached = int(counts[dopri.SAMPLES])
    states, rates, reports, peaks = (array[:reached] for array in outputs)
    n = (states.shape[1] - LEDGER) // 2
    q, q_t, ledger, joints = states[:, :n], states[:, n : 2 * n], states[:, 2 * n :], reports[:, :4]
    stored = _stored(fourbar, joints[:, :, 0])
    status, message = _verdict(fourbar, counts, peaks[:, 4:8], times[reached - 1])
    names = {"steps": dopri.STEPS, "rejected": dopri.REJECTED, "evaluations": dopri.EVALUATIONS, "impacts": dopri.IMPACTS}
    work: dict[str, float] = {name: int(counts[place]) for name, place in names.items()}
    return Run(
        fourbar, status, message, times[:reached], q, q_t, rates[:, n : 2 * n],
        force=joints[:, :, 4:6], normal=joints[:, :, 3], depth=joints[:, :, 0], rate=joints[:, :, 1], sliding=joints[:, :, 2],
        coupler_a=reports[:, 4, 0:2], rocker_a=reports[:, 4, 2:4], middle_a=reports[:, 4, 4:6],
        peak_force=peaks[:, :4], peak_depth=peaks[:, 4:8], peak_a=peaks[:, 8:],
        impacts=impacts[: min(work["impacts"], CAPACITY)].copy(),
        taken_contact=ledger[:, 1:5] - stored + stored[0], taken_friction=ledger[:, 5:9], taken_modes=ledger[:, 9],
        given=ledger[:, 0], squares=ledger[:, 10:], contact=stored.sum(axis=1), **_energies(fourbar, q, q_t),
        work=work | {"wall_s": wall},
    )  # fmt: skip


def _verdict(fourbar: FourBar, counts: Array, depths: Array, t: float) -> tuple[Outcome, str]:
    """Status and message."""
    ends = {
        dopri.UNDERFLOW: (Outcome.STEP_UNDERFLOW, "the step shrank to rounding: tolerance too tight, or a law that jumps"),
        dopri.NOT_FINITE: (Outcome.NOT_FINITE, "a force or an acceleration is not finite: check law and parameters"),
        dopri.TOO_MANY: (Outcome.TOO_MANY_STEPS, "raise `most`, or loosen the tolerance"),
    }
    if counts[dopri.STATUS] in ends:
        outcome, why = ends[int(counts[dopri.STATUS])]
        return outcome, f"stopped after t = {t:g} s: {why}"
    for joint, gap, depth in zip(JOINTS, fourbar.gaps, depths.max(axis=0), strict=True):
        if 0.0 < gap < depth:
            return Outcome.TOO_DEEP, f"pin {joint} {depth:.3g} m deep in its bush, clearance {gap:.3g} m: no law holds there"
    return Outcome.OK, ""


def _energies(fourbar: FourBar, q: Array, q_t: Array) -> dict[str, Array]:
    """Energies held by the bars, by formulas that the equations of motion do not use."""
    masses, inertias = fourbar.masses, fourbar.inertias
    kinetic = 0.5 * fourbar.inertias[0] * fourbar.speed**2 + np.zeros(len(q))
    for mass, i in zip(masses, (0, 2, 5), strict=True):
        kinetic = kinetic + 0.5 * mass * (q_t[:, i] ** 2 + q_t[:, i + 1] ** 2)
    weight = -sum(mass * q[:, i : i + 2] @ np.array(fourbar.gravity) for mass, i in zip(masses, (0, 2, 5), strict=True))
    inertia, strain = inertias[2], np.zeros(len(q))
    if fourbar.modes is not None:
        data, e, e_t = fourbar.modes, q[:, 8:], q_t[:, 8:]
        c, s = np.cos(q[:, 7]), np.sin(q[:, 7])
        moved, flow = e @ data.translation.T, e_t @ data.translation.T - q_t[:, 7:8] * (e @ data.translation.T)[:, ::-1] * [1, -1]
        inertia = inertia + 2 * e @ data.radial + e**2 @ data.modal_mass
        kinetic = kinetic + 0.5 * e_t**2 @ data.modal_mass
        kinetic = kinetic + q_t[:, 7] * (e_t @ data.turning + np.einsum("ti,ij,tj->t", e, data.gyration, e_t))
        kinetic = kinetic + q_t[:, 5] * (c * flow[:, 0] - s * flow[:, 1]) + q_t[:, 6] * (s * flow[:, 0] + c * flow[:, 1])
        strain = 0.5 * e**2 @ data.stiffness
        weight = weight - np.stack([c * moved[:, 0] - s * moved[:, 1], s * moved[:, 0] + c * moved[:, 1]], -1) @ fourbar.gravity
    kinetic = kinetic + 0.5 * inertias[1] * q_t[:, 4] ** 2 + 0.5 * inertia * q_t[:, 7] ** 2
    return {"kinetic": kinetic, "strain": strain, "weight": weight}


def _stored(fourbar: FourBar, depth: Array) -> Array:
    """Elastic energy of each joint's contact, shape (samples, 4)."""
    return np.where(np.array(fourbar.gaps) > 0, fourbar.law.potential(depth), 0.0)
