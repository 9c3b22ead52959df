"""Measures of each turn of the crank-rocker with clearance, over one run or many.

Motion with rattling joints is chaotic: an offset of 1e-12 m grows to 1e-4 m within some 40 ms. Beyond that only means over turns
of runs that begin almost alike are results, with their standard errors. All is read off signals, of whichever solver.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from math import atan2, pi
from typing import NamedTuple, TypeVar

import numpy as np

from buckler.mbs import Controlled, Exudyn, Mechanism, Result, Spectral, Status, simulate
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.geometry import Array
from buckler.mbs.library import CrankRocker
from buckler.mbs.record.energy import ledger
from buckler.mbs.record.lookup import corrected_trapezoidal
from buckler.mbs.record.record import Record
from buckler.mbs.record.run import Run
from buckler.mbs.spectral.dense import refined
from buckler.mbs.spectral.recording import record_of
from buckler.mbs.spectral.run import State, integrate
from buckler.mbs.spectral.scene import CompiledScene
from buckler.mbs.spectral.start import begin, offset
from buckler.mbs.spectral.tables import work_for
from buckler.mbs.validate import whole

from .assumptions import BODIES, JOINTS

T = TypeVar("T")
LOOSE = 1e-6
"""Tolerance from which on stability, not accuracy, limits explicit steps where contacts are stiffly damped."""
BETWEEN = 3
"""States recorded within each of such steps, which go over the peaks of impacts."""
START_OFFSET = 1e-9
"""Scale [rad] of the chance offset of the start: far below all errors, yet rattling joints soon move otherwise."""
STEPS_A_TURN = 720
"""Least number of the engine's steps for a turn of the crank."""
BALANCED = 1e-3
"""Energy balance beyond which an ensemble is suspect."""


def period(mechanism: Mechanism) -> float:
    """Return the time of a turn of the crank [s]; ValueError if it stands."""
    speed = mechanism.drives[0].speed
    if not isinstance(speed, int | float) or not speed:
        raise ValueError(f"speed = {speed} rad/s: turns need a crank that turns at one speed")
    return 2 * pi / abs(speed)


def solver(mechanism: Mechanism, tolerance: float) -> Spectral:
    """Make a solver with steps of this tolerance, at most a hundredth of a turn, explicit unless stability would limit them."""
    steps = Controlled(tolerance, max_step=period(mechanism) / 100, max_steps=20_000_000)
    return Spectral(steps, method="chosen" if tolerance >= LOOSE else "explicit")


def gap(mechanism: Mechanism) -> float:
    """Return the largest clearance [m]."""
    return max(joint.gap for joint in clearances(mechanism))


def chance(seed: int) -> float:
    """Draw the offset of the crank at the start [rad]."""
    return START_OFFSET * float(np.random.default_rng(seed).standard_normal())


def another(made: Mechanism, seed: int) -> Mechanism:
    """The same, its crank offset at the start by chance."""
    (ax, ay), (cx, _) = made.points["A"], made.points["C"]
    crank, coupler, rocker = (made.length(link) for link in ("crank", "coupler", "rocker"))
    return replace(made, points=CrankRocker(crank, coupler, rocker, cx).places(atan2(ay, ax) + chance(seed)))


def on_engine(made: Mechanism, turns: int, settle: int, tolerance: float | None = None) -> Result:
    """Run turns, and those that settle, on the engine; RuntimeError if the run stops before its time."""
    turn = period(made)
    steps, end = Exudyn(Controlled(tolerance, max_step=turn / STEPS_A_TURN)), (settle + turns) * turn
    result = simulate(made, end, solver=steps, ledger=True, timeout=300)
    if result.time[-1] < end * (1 - 1e-9):
        raise RuntimeError(f"engine: {result.status}, {result.message}")
    return result


def deep(mechanism: Mechanism, result: Result) -> str:
    """Name a pin that is deeper in its bush than its clearance, where no law holds; '' if none is."""
    for joint in clearances(mechanism):
        depth = float(result[f"{joint.point}.penetration"].max())
        if depth > joint.gap:
            return f"pin {joint.point} {depth:.3g} m deep in its bush, clearance {joint.gap:.3g} m: no law holds there"
    return ""


def along(record: Record) -> tuple[Array, Array]:
    """Return velocities [m/s] and accelerations [m/s^2] along x, each (samples, 3): of the coupler's centre, the rocker's, and
    the material point in the rocker's middle.
    """  # fmt: skip
    rocker = record.links["rocker"]
    places = [record.links["coupler"].centre(), rocker.centre()]
    middle = rocker.motion("centre") if record.mechanism.link("rocker").body.flexible else None
    places.append((middle.position, middle.velocity, middle.acceleration) if middle else places[1])
    v, a = (np.stack([place[k][:, 0] for place in places], axis=1) for k in (1, 2))
    return v, a


def force_on_second(result: Result, joint: str, axis: str) -> Array:
    """Return the force on the second of a joint's `BODIES` [N], whichever of the two carries the pin."""
    first, second = BODIES[joint]
    s, turned = result.signals, f"{joint}.{second}-{first}.f{axis}"
    return -s[turned] if turned in s else s[f"{joint}.{first}-{second}.f{axis}"]


def joint_force(result: Result, joint: str) -> Array:
    """Return the size of a joint's force [N]."""
    return np.hypot(*(force_on_second(result, joint, axis) for axis in "xy"))


def by_turn(result: Result, turn: float, turns: int, settle: int = 0, a: Array | None = None) -> dict[str, Array]:
    """Measure each turn [s] after the first `settle` of a run with a ledger, arrays of shape (turns - settle, ...).

    `impacts` of each joint, its largest `force` [N] and `depth` [m]; largest and root-mean-square x-acceleration [m/s^2] of
    coupler and rocker centre (`peak_a`, `rms_a`), or of `a`, (samples, columns); energy `lost` in contacts and friction [J].
    """
    time, edges = result.time, turn * np.arange(settle, turns + 1)
    parts = list(pairwise(np.searchsorted(time, edges * (1 + 1e-12), side="right")))
    a = np.stack([result.signals[f"{bar}.ax"] for bar in ("coupler", "rocker")], axis=1) if a is None else a
    force = np.stack([joint_force(result, joint) for joint in JOINTS], axis=1)
    none = np.zeros_like(time)  # what ideal joints have
    depth, begun = (
        np.stack([result.signals.get(f"{joint}.{what}", none) for joint in JOINTS], axis=1)
        for what in ("penetration", "contacts")
    )
    lost = sum((result.energy.get(f"taken_{what}", none) for what in ("contact", "friction")), none)
    return {
        "impacts": np.stack([begun[j - 1] - begun[i - 1] for i, j in parts]),
        "force": np.stack([force[i:j].max(axis=0) for i, j in parts]),
        "depth": np.stack([depth[i:j].max(axis=0) for i, j in parts]),
        "peak_a": np.stack([np.abs(a[i:j]).max(axis=0) for i, j in parts]),
        "rms_a": root_mean_squares(time, a, edges),
        "lost": np.diff(np.interp(edges, time, lost)),
    }


def root_mean_squares(time: Array, values: Array, edges: Array) -> Array:
    """Return root mean squares of each column between each two times, (edges - 1, columns)."""
    summed = np.stack([np.interp(edges, time, corrected_trapezoidal(time, column**2)) for column in values.T], axis=1)
    return np.asarray(np.sqrt(np.maximum(np.diff(summed, axis=0), 0.0) / np.diff(edges)[:, None]))


@dataclass(frozen=True)
class Ensemble:
    """Measures of all members' turns, (members, turns, ...): of `by_turn` for the places of `along`, and of `measure`.

    Further the largest clearance [m], and the status and energy balance of each member.
    """

    gap: float
    turns: dict[str, Array]
    outcomes: tuple[Status, ...]
    balances: tuple[float, ...] = ()

    @property
    def ok(self) -> bool:
        """True if all members ended well."""
        return all(outcome is Status.OK for outcome in self.outcomes)

    @property
    def notes(self) -> tuple[str, ...]:
        """Objections to the ensemble, each beginning with a name."""
        most, deep = max(self.balances), self.turns["depth"].max() / self.gap
        many = sum(outcome is not Status.OK for outcome in self.outcomes)
        runs = f"in {many} of {len(self.outcomes)} runs: no law holds there"
        energy = [f"ENERGY: balance {most:.1e}, allowed {BALANCED:g}"] if not most <= BALANCED else []
        return (*energy, *([f"PENETRATION: a pin {deep:.2g} clearances deep in its bush, {runs}"] if many else []))

    def mean(self, name: str) -> Array:
        """Return the mean over members and turns."""
        return np.asarray(self.turns[name].mean(axis=(0, 1)))

    def error(self, name: str) -> Array:
        """Return the standard error of the mean, from the members' independent means; of one member, from its turns."""
        values = self.turns[name]
        draws = values.mean(axis=1) if len(values) > 1 else values[0]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(draws.std(axis=0) / np.sqrt(len(draws) - 1))

    @classmethod
    def join(cls, parts: Sequence[Ensemble]) -> Ensemble:
        """Join the members of several ensembles."""
        turns = {name: np.concatenate([each.turns[name] for each in parts]) for name in parts[0].turns}
        outcomes, balances = (tuple(x for each in parts for x in getattr(each, name)) for name in ("outcomes", "balances"))
        return cls(parts[0].gap, turns, outcomes, balances)


class Member(NamedTuple):
    """One run of an ensemble: its seed, its signals and energies, which no check has looked at, its record, its last state."""

    seed: int
    result: Result
    record: Record
    state: State


def resume(scene: CompiledScene, end: float, solver: Spectral, state: State, seed: int = 0, between: int = 0) -> Member:
    """Run a scene from a state on; see `run_members`."""
    out, failure, counts = integrate(scene, end, solver, state=state)
    record = record_of(scene, refined(scene, out, between) if between and len(out.time) > 1 else out)
    run = Run(solver, record, failure, {"steps": float(counts.steps)})
    ended = failure or (Status.OK, "")
    result = Result(*ended, record.time, run.values, run.units, run.work, ledger(record), traits=run.traits)
    return Member(seed, result, record, State(float(out.time[-1]), out.q[-1], out.v[-1], out.memory[-1].copy()))


def run_members(
    mechanism: Mechanism, duration: float, seeds: Iterable[int], measure: Callable[[Member], T], *, spread: float = START_OFFSET,
    solver: Spectral, workers: int = 1, between: int = 0,
) -> list[T]:  # fmt: skip
    """Run a mechanism once for each seed, and measure each run where it was made, with its record and its signals.

    Measures that are formulas of statistics need no record: see `buckler.mbs.ensemble`. Starts are offset by `spread` [m, rad]
    where constraints leave it free. `between` states of each step beside its end are recorded: peaks that loose steps go over.
    """
    if not (seeds := tuple(seeds)):
        raise ValueError("seeds = (): must be one number or more, one for each member")
    scene = CompiledScene.of(mechanism, solver.degree)
    start = State(0.0, *begin(scene), scene.memory())
    shifts = [offset(scene, spread, seed) for seed in seeds]

    def member(k: int) -> T:
        own = replace(scene, work=work_for(scene.tables))
        return measure(resume(own, duration, solver, start._replace(q=start.q + shifts[k]), seeds[k], between))

    if workers == 1:
        return [member(k) for k in range(len(seeds))]
    with ThreadPoolExecutor(workers) as pool:
        return list(pool.map(member, range(len(seeds))))


def ensemble(
    mechanism: Mechanism, turns: int, seeds: Iterable[int], *, spread: float = 1e-9, settle: int = 1, tolerance: float = 1e-8,
    workers: int = 1, measure: Callable[[Member, int, int], dict[str, Array]] | None = None,
) -> Ensemble:  # fmt: skip
    """Run a crank-rocker with clearance once for each seed; see `run_members`.

    Turns after those that settle are measured by `by_turn` and by `measure`(member, turns, settle). The spread of the starts must
    leave pins in their bushes. RuntimeError if a member stops before its time.
    """
    whole("turns", turns, 1, 1_000_000), whole("settle", settle, 0, 1_000_000)
    every, turn = turns + settle, period(mechanism)

    def read(member: Member) -> tuple[dict[str, Array], Status, float]:
        """Measure the turns of a member."""
        result = result_of(member)
        more = measure(member, every, settle) if measure else {}
        found = by_turn(result, turn, every, settle, along(member.record)[1]) | more
        return found, Status.SUSPECT if deep(mechanism, result) else Status.OK, result.energy_balance

    made = run_members(
        mechanism, every * turn, seeds, read, spread=spread, solver=solver(mechanism, tolerance), workers=workers,
        between=BETWEEN if tolerance >= LOOSE else 0,
    )  # fmt: skip
    measured, outcomes, balances = zip(*made, strict=True)
    found = {name: np.stack([each[name] for each in measured]) for name in measured[0]}
    return Ensemble(gap(mechanism), found, outcomes, balances)


def result_of(member: Member) -> Result:
    """Return a member's signals; RuntimeError if it stopped before its time."""
    if not member.result.ok:
        raise RuntimeError(f"seed {member.seed}: {member.result.status}: {member.result.message}")
    return member.result
