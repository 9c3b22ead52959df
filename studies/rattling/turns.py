"""Run the crank-rocker with clearance on the compiled solver: from numbers to arrays, with the energy balance.

Coordinates are crank x, y | coupler x, y, theta | rocker x, y, theta | the rocker's modes: centres of mass in the plane and
directions of the bars, m and rad. The crank's own angle is prescribed. Integrals over
time are those of `buckler.mbs.spectral.ledger`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Controlled, Spectral, Status
from buckler.mbs.spectral.dense import Dense, at_times
from buckler.mbs.spectral.ledger import ledger
from buckler.mbs.spectral.output import Output
from buckler.mbs.spectral.run import State, integrate
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.validate import number, positive, whole
from buckler.studies.rattling.linkage import JOINTS, FourBar

Array = np.ndarray[Any, Any]
RIGID = np.array([0, 1, 3, 4, 5, 6, 7, 8])
"""Columns of the solver's coordinates that are not modal; column 2 is the crank's angle."""
LANDED = 1e-12
"""How near to no depth a step ends that begins a contact, m."""
LOOSE = 1e-6
"""Tolerance from which on stability, not accuracy, limits explicit steps where contacts are stiffly damped."""
COUPLER, ROCKER = 3, 6
"""Where those of coupler and rocker begin."""


@dataclass(frozen=True, eq=False, repr=False)
class Run:
    """What a run gives back. Second indices: joints O, A, B, C; coordinates as below.

    Attributes
    ----------
    fourbar : FourBar
    status : Status
        SUSPECT where a pin is deeper in its bush than the clearance: no law holds there.
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
        Largest of each joint since the sample before, N, seen four times a step.
    peak_depth : array, shape (samples, 4)
        Largest penetration depth likewise, m; 0 where the joint stayed open.
    peak_a : array, shape (samples, 3)
        Largest |x-acceleration| of the same three points likewise, m/s^2.
    impacts : array, shape (impacts, 6)
        Columns: number of the joint, onset time and speed, end time and speed, peak force; end nan while it lasts.
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
    status: Status
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
        return self.status is Status.OK

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


def ideal_state(fourbar: FourBar, t: float = 0.0) -> Array:
    """Coordinates and velocities of the ideal mechanism, journals centred, rocker undeformed; shape (2 n,)."""
    place, velocity, _ = fourbar.ideal(t)
    still = np.zeros(0 if fourbar.modes is None else len(fourbar.modes.planar(fourbar.rocker)))
    return np.concatenate([place[0, :2], place[1], place[2], still, velocity[0, :2], velocity[1], velocity[2], still])


class Model(NamedTuple):
    """The crank-rocker as the solver has it, and its columns of the coordinates above."""

    fourbar: FourBar
    scene: Scene
    columns: Array

    @classmethod
    def of(cls, fourbar: FourBar) -> Model:
        """Build the scene."""
        scene = Scene.of(fourbar.mechanism())
        return cls(fourbar, scene, np.concatenate([RIGID, np.arange(RIGID[-1] + 1, scene.size)]))

    def state(self, values: Array, t: float = 0.0) -> State:
        """The solver's state from coordinates and velocities."""
        n, bar = len(self.columns), self.fourbar
        if values.shape != (2 * n,) or not np.isfinite(values).all():
            raise ValueError(f"state of shape {values.shape}: must be finite, of shape ({2 * n},)")
        q, v = np.zeros(n + 1), np.zeros(n + 1)
        q[self.columns], v[self.columns] = values[:n], values[n:]
        q[2], v[2] = bar.start + bar.speed * t, bar.speed
        return State(t, q, v, self.scene.memory())


def solver(fourbar: FourBar, tolerance: float, longest: float = inf, most: int = 20_000_000) -> Spectral:
    """Steps of this tolerance, no longer than a hundredth of the crank's period, explicit unless stability would limit them."""
    step, method = min(longest, fourbar.period / 100), "chosen" if tolerance >= LOOSE and longest == inf else "explicit"
    return Spectral(Controlled(tolerance, max_step=None if step == inf else step, max_steps=most), method=method)


def simulate(
    fourbar: FourBar,
    duration: float,
    *,
    tolerance: float = 1e-8,
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
    tolerance : float
        Local error allowed a step, of the longest bar's length and a radian; see `Spectral`.
    samples : int
        Equidistant, first and last included.
    state : array, shape (2 n,), optional
        Coordinates and velocities at t = 0; by default the ideal mechanism's.
    longest : float
        Longest step, s; by default a hundredth of the crank's period.
    most : int
        Steps, rejected ones included.
    """
    positive("duration", duration, "s"), whole("samples", samples, 2, 10_000_000)
    number("longest", longest, 0.0, inf, "s", open_low=True) if longest != inf else None
    model = Model.of(fourbar)
    begin = model.state(np.array(ideal_state(fourbar) if state is None else state, dtype=float))
    clock = perf_counter()
    out, failure, counts = integrate(model.scene, duration, solver(fourbar, tolerance, longest, most), state=begin)
    names = {"steps": 1, "rejected": 2, "evaluations": 4}
    work = {name: float(counts[place]) for name, place in names.items()} | {"wall_s": perf_counter() - clock}
    times = np.linspace(0.0, duration, samples)
    times = times[times <= out.time[-1] * (1 + 1e-12)]
    return _collect(model, at_times(model.scene, out, times), out, failure, work)


class Joints(NamedTuple):
    """What joints O, A, B, C do, arrays of shape (times, 4, ...): as in `Run`."""

    force: Array
    normal: Array
    depth: Array
    rate: Array
    sliding: Array


def _places(model: Model, joint: str) -> tuple[int | None, list[int]]:
    """A joint's force, if it has clearance, and its constraints, if it is ideal."""
    scene = model.scene
    forces = [k for k, name in enumerate(scene.force_names) if name.partition(".")[0] == joint]
    return (forces[0] if forces else None), [r for r, name in enumerate(scene.row_names) if name.partition(".")[0] == joint]


def _joints(model: Model, reports: Array, lam: Array) -> Joints:
    bar, count = model.fourbar, len(reports)
    force, found = np.zeros((count, 4, 2)), np.zeros((4, count, 4))
    found[1] = -np.array(bar.gaps)
    for j, joint in enumerate(JOINTS):
        k, rows = _places(model, joint)
        if k is not None:
            push, drag, *found[1:4, :, j], _, nx, ny = reports[:, k].T
            side = -1.0 if joint in bar.turned else 1.0
            force[:, j] = -side * np.stack([push * nx - drag * ny, push * ny + drag * nx], axis=1)
            found[0, :, j] = push
        if rows:
            force[:, j] = -lam[:, rows]
    return Joints(force, *found)


def _collect(model: Model, at: Dense, out: Output, failure: tuple[Status, str] | None, work: dict[str, float]) -> Run:
    bar, scene, columns, times = model.fourbar, model.scene, model.columns, at.time
    book, count = ledger(scene, out, _watched(model)), len(scene.force_names)
    here, ends = _joints(model, at.reports, at.lam), _joints(model, book.reports, out.lam)
    squares = 2 * count + len(scene.row_names) + 2 * np.arange(3)
    taken, peaks = np.zeros((2, len(times), 4)), [np.linalg.norm(ends.force, axis=2), np.zeros((len(out.time), 4))]
    impacts: list[list[float]] = []
    for j, joint in enumerate(JOINTS):
        if (k := _places(model, joint)[0]) is not None:
            taken[:, :, j] = book.at(times, [k, count + k]).T
            peaks[0][:, j], peaks[1][:, j] = book.top[:, k], book.top[:, count + k]
            found = _impacts(book.time, ends.depth[:, j], ends.rate[:, j], peaks[0][:, j], peaks[1][:, j])
            impacts += [[j, *row] for row in found]
    table = np.array(sorted(impacts, key=lambda row: row[1])).reshape(-1, 6)
    stored = np.where(np.isfinite(here.depth) & (np.array(bar.gaps) > 0), bar.law.potential(np.maximum(here.depth, 0.0)), 0.0)
    peaks.append(book.top[:, 2 * count + 2 * np.arange(3)])
    accelerations = _accelerations(model, at)
    own = (np.linalg.norm(here.force, axis=2), np.maximum(here.depth, 0.0), np.abs([a[:, 0] for a in accelerations]).T)
    peaks = [_since(times, book.time, steps, sample) for steps, sample in zip(peaks, own, strict=True)]
    status, message = _verdict(bar, failure, peaks[1])
    drive = 2 * count + scene.row_names.index("drive")
    return Run(
        bar, status, message, times, at.q[:, columns], at.v[:, columns], at.a[:, columns],
        force=here.force, normal=here.normal, depth=here.depth, rate=here.rate, sliding=here.sliding,
        coupler_a=accelerations[0], rocker_a=accelerations[1], middle_a=accelerations[2],
        peak_force=peaks[0], peak_depth=peaks[1], peak_a=peaks[2], impacts=table,
        taken_contact=taken[0] - stored + stored[0], taken_friction=taken[1], taken_modes=book.at(times, [-1])[:, 0],
        given=book.at(times, [drive])[:, 0], squares=book.at(times, squares), contact=stored.sum(axis=1),
        **_energies(model, at), work=work | {"impacts": float(len(table))},
    )  # fmt: skip


def _planar(model: Model) -> Any:
    """The rocker's modes."""
    body: Any = model.scene.builder.bodies["rocker"]
    return body.model


def _watched(model: Model) -> list[int]:
    """Markers of the coupler's centre, the rocker's, and the rocker's mid-point; the run is over, so they cost it nothing."""
    scene = model.scene
    coupler, rocker = (scene.builder.bodies[name] for name in ("coupler", "rocker"))
    shape = None if model.fourbar.modes is None else _planar(model).shapes[2].T
    found = [body.marker_at(scene.builder, body.centre) for body in (coupler, rocker)]  # type: ignore[attr-defined]
    found.append(rocker.marker_at(scene.builder, rocker.centre, shape))  # type: ignore[attr-defined]
    scene.refresh()
    return found


def _accelerations(model: Model, dense: Dense) -> list[Array]:
    """Of coupler's centre, rocker's centre, rocker's mid-point, each (times, 2)."""
    coupler, rocker = (dense.a[:, i : i + 2] for i in (COUPLER, ROCKER))
    if model.fourbar.modes is None:
        return [coupler, rocker, rocker]
    return [coupler, rocker, _planar(model).motion("centre", *(x[:, ROCKER:] for x in (dense.q, dense.v, dense.a))).acceleration]


def _since(times: Array, steps: Array, values: Array, own: Array) -> Array:
    """Largest value since the sample before, at the sample itself included."""
    out = own.copy()
    kept = steps <= times[-1]
    np.maximum.at(out, np.searchsorted(times, steps[kept]), values[kept])
    return out


def _impacts(time: Array, depth: Array, rate: Array, force: Array, deepest: Array) -> list[list[float]]:
    """Rows of the table of impacts of one joint: runs of steps within which or at whose ends it is closed."""
    closed = np.maximum(depth[:-1], deepest[1:]) > LANDED
    flat = np.maximum(np.abs(depth[:-1]), np.abs(depth[1:])) < LANDED
    closed[1:] |= flat[1:] & closed[:-1]
    edges = np.flatnonzero(np.diff(np.concatenate([[False], closed, [False]]).astype(int)))
    rows = []
    for a, b in edges.reshape(-1, 2):
        over = depth[b] <= LANDED and b < len(depth) - 1
        end = _leaving(time[b - 1 : b + 1], depth[b - 1 : b + 1], rate[b - 1 : b + 1]) if over else np.nan
        rows.append([time[a], rate[a], end, -rate[b] if over else np.nan, force[a + 1 : b + 1].max()])
    return rows


def _leaving(time: Array, depth: Array, rate: Array) -> float:
    """Time of leaving in a step, on the cubic through the depths and rates at its ends."""
    h = time[1] - time[0]
    rise, go, arrive = depth[1] - depth[0], h * rate[0], h * rate[1]
    roots = np.roots([go + arrive - 2 * rise, 3 * rise - 2 * go - arrive, go, depth[0]])
    inside = [x.real for x in roots if abs(x.imag) < 1e-9 and 0.0 <= x.real <= 1.0]
    return float(time[0] + h * max(inside, default=1.0))


def _verdict(bar: FourBar, failure: tuple[Status, str] | None, depths: Array) -> tuple[Status, str]:
    """Status and message."""
    if failure is not None:
        return failure
    for joint, gap, depth in zip(JOINTS, bar.gaps, depths.max(axis=0), strict=True):
        if 0.0 < gap < depth:
            return Status.SUSPECT, f"pin {joint} {depth:.3g} m deep in its bush, clearance {gap:.3g} m: no law holds there"
    return Status.OK, ""


def _energies(model: Model, at: Dense) -> dict[str, Array]:
    """Energies held by the bars."""
    tables, strain = model.scene.tables, np.zeros(len(at.time))
    kinetic = 0.5 * (at.v[:, :ROCKER] ** 2 @ np.diag(tables.mass)[:ROCKER])
    if model.fourbar.modes is None:
        kinetic += 0.5 * (at.v[:, ROCKER:] ** 2 @ np.diag(tables.mass)[ROCKER:])
    else:
        kinetic += _planar(model).kinetic(at.q[:, ROCKER:], at.v[:, ROCKER:])
        strain = _planar(model).strain(at.q[:, ROCKER:])
    return {"kinetic": kinetic, "strain": strain, "weight": -at.q @ tables.weight}
