"""Turns of the crank-rocker with clearance on the compiled solver, counted one by one over many runs.

Motion with rattling joints is chaotic: an offset of 1e-12 m grows to 1e-4 m within some 40 ms. Single trajectories mean nothing
beyond that; means over turns of runs that begin almost alike do, with their standard errors. Where joints stay closed the runs
agree, and the standard error is small for that reason.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import pairwise
from math import pi
from typing import Any, NamedTuple

import numpy as np

from buckler.mbs import Controlled, Mechanism, Spectral, Status
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.record.energy import ledger as energies
from buckler.mbs.spectral.dense import Dense
from buckler.mbs.spectral.ensembles import offset
from buckler.mbs.spectral.ledger import Ledger, ledger
from buckler.mbs.spectral.output import Output
from buckler.mbs.spectral.recording import record_of
from buckler.mbs.spectral.run import State, integrate
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.validate import positive, whole
from buckler.studies.rattling.assumptions import JOINTS

Array = np.ndarray[Any, Any]
LANDED = 1e-12
"""How near to no depth a step ends that begins a contact, m."""
LOOSE = 1e-6
"""Tolerance from which on stability, not accuracy, limits explicit steps where contacts are stiffly damped."""
LOOKED = 100
"""States of a turn in which the energy is looked at."""


def period(mechanism: Mechanism) -> float:
    """Time of a turn of the crank, s.

    Raises
    ------
    ValueError
        If it stands.
    """
    speed = mechanism.drives[0].speed
    if not isinstance(speed, int | float) or not speed:
        raise ValueError(f"speed = {speed} rad/s: turns need a crank that turns at one speed")
    return 2 * pi / abs(speed)


def solver(mechanism: Mechanism, tolerance: float) -> Spectral:
    """Steps of this tolerance, no longer than a hundredth of a turn, explicit unless stability would limit them."""
    steps = Controlled(tolerance, max_step=period(mechanism) / 100, max_steps=20_000_000)
    return Spectral(steps, method="chosen" if tolerance >= LOOSE else "explicit")


class Flight(NamedTuple):
    """A run: its scene, what the solver left, and SUSPECT where a pin is deeper in its bush than the clearance."""

    scene: Scene
    out: Output
    book: Ledger

    @property
    def deep(self) -> str:
        """Which pin is deeper in its bush than its clearance, where no law holds; nothing if none is."""
        for joint in clearances(self.scene.mechanism):
            depth = float(self.tops(1)[:, JOINTS.index(joint.point)].max())
            if depth > joint.gap:
                return f"pin {joint.point} {depth:.3g} m deep in its bush, clearance {joint.gap:.3g} m: no law holds there"
        return ""

    def tops(self, kind: int) -> Array:
        """Largest force, N (kind 0), or depth, m (1), of each joint in each step, (steps + 1, 4)."""
        found, count = np.zeros((len(self.out.time), len(JOINTS))), len(self.scene.force_names)
        for k, name in enumerate(self.scene.force_names):
            found[:, JOINTS.index(name[0])] = self.book.top[:, kind * count + k]
        return found


def fly(scene: Scene, end: float, tolerance: float, state: State) -> Flight:
    """Run a scene from a state on.

    Raises
    ------
    RuntimeError
        If it stops before its time.
    """
    out, failure, _ = integrate(scene, end, solver(scene.mechanism, tolerance), state=state)
    if failure is not None:
        raise RuntimeError(f"{failure[0]}: {failure[1]}")
    return Flight(scene, out, ledger(scene, out, watched(scene)))


def start(scene: Scene, spread: float, seed: int) -> State:
    """The mechanism's start, its links offset by chance, m and rad."""
    return State(0.0, scene.q0 + offset(scene, spread, seed), scene.v0, scene.memory())


def gap(mechanism: Mechanism) -> float:
    """The largest clearance, m."""
    return max(joint.gap for joint in clearances(mechanism))


def last_journal(flight: Flight, joint: str) -> Array:
    """Place of a pin in its bush at the end, m, (2,)."""
    record = record_of(flight.scene, Output(*(x[-1:] for x in flight.out)))
    name, element = next(pair for pair in record.mechanism.elements().items() if pair[0].startswith(f"{joint}."))
    found = {signal.name: signal.values[0] for signal in element.signals(name, record)}
    return np.array([found[f"{joint}.journal_{axis}"] for axis in "xy"])


# --- the three places ------------------------------------------------------------------------------------------------------


def _frames(scene: Scene) -> tuple[Any, Any]:
    """Bodies of coupler and rocker, each with a frame and perhaps modes."""
    return scene.builder.bodies["coupler"], scene.builder.bodies["rocker"]


def watched(scene: Scene) -> list[int]:
    """Markers of the coupler's centre, the rocker's, and the material point in the rocker's middle."""
    coupler, rocker = _frames(scene)
    shape = rocker.model.shapes[2].T if rocker.modes else None
    found = [body.marker_at(scene.builder, body.centre) for body in (coupler, rocker)]
    found.append(rocker.marker_at(scene.builder, rocker.centre, shape))
    scene.refresh()
    return found


def along(scene: Scene, at: Dense) -> tuple[Array, Array]:
    """Velocities, m/s, and accelerations, m/s^2, of these places along x, each (times, 3)."""
    coupler, rocker = _frames(scene)
    columns = [coupler.offset, rocker.offset, rocker.offset]
    v, a = at.v[:, columns], at.a[:, columns]
    if rocker.modes:
        part = slice(rocker.offset, rocker.offset + 3 + rocker.modes)
        middle = rocker.model.motion("centre", at.q[:, part], at.v[:, part], at.a[:, part])
        v[:, 2], a[:, 2] = middle.velocity[:, 0], middle.acceleration[:, 0]
    return v, a


# --- what a turn shows -----------------------------------------------------------------------------------------------------


def by_turn(flight: Flight, turns: int, settle: int = 0) -> dict[str, Array]:
    """Measures of each turn after the first `settle`, arrays of shape (turns - settle, ...).

    `impacts` of each joint, its largest `force`, N, and `depth`, m; largest and root-mean-square x-acceleration of coupler
    centre, rocker centre, rocker mid-point (`peak_a`, `rms_a`, m/s^2); energy `lost` in all contacts and their friction, J.
    """
    scene, out, book = flight
    turn, count = period(scene.mechanism), len(scene.force_names)
    edges = turn * np.arange(settle, turns + 1)
    steps, last = np.searchsorted(out.time, edges * (1 + 1e-12)), len(out.time) - 1
    inside = list(pairwise(steps))
    squares = 2 * count + len(scene.row_names) + 2 * np.arange(3)
    done = np.diff(book.at(edges, [*range(2 * count), *squares]), axis=0)
    stored = _energies(scene, out, np.minimum(steps, last))["contact"]
    begun = _onsets(flight)
    return {
        "impacts": np.stack([begun[a:b].sum(axis=0) for a, b in inside]),
        "force": np.stack([flight.tops(0)[a:b].max(axis=0) for a, b in inside]),
        "depth": np.stack([flight.tops(1)[a:b].max(axis=0) for a, b in inside]),
        "peak_a": np.stack([book.top[a:b, 2 * count :: 2].max(axis=0) for a, b in inside]),
        "rms_a": np.sqrt(done[:, 2 * count :] / turn),
        "lost": done[:, : 2 * count].sum(axis=1) - np.diff(stored),
    }


def _energies(scene: Scene, out: Output, rows: Array) -> dict[str, Array]:
    return energies(record_of(scene, Output(*(x[rows] for x in out))))


def _onsets(flight: Flight) -> Array:
    """Whether a contact of each joint begins in each step, (steps + 1, 4)."""
    ends, deepest = np.zeros((2, len(flight.out.time), len(JOINTS)))
    for k, name in enumerate(flight.scene.force_names):
        ends[:, JOINTS.index(name[0])] = flight.book.reports[:, k, 2]
    deepest = flight.tops(1)
    closed = np.maximum(ends[:-1], deepest[1:]) > LANDED
    flat = np.maximum(np.abs(ends[:-1]), np.abs(ends[1:])) < LANDED
    closed[1:] |= flat[1:] & closed[:-1]
    return np.concatenate([np.zeros((1, len(JOINTS)), dtype=bool), closed & ~np.roll(closed, 1, axis=0)])


def balance(flight: Flight, turns: int) -> float:
    """Largest change of energy that nothing accounts for, over the most that was held and taken."""
    scene, out, book = flight
    rows = np.unique(np.linspace(0, len(out.time) - 1, LOOKED * turns + 1).astype(int))
    count, found = len(scene.force_names), _energies(scene, out, rows)
    held = sum((found[name] for name in ("kinetic", "strain", "weight") if name in found), np.zeros(len(rows)))
    taken = book.work[rows][:, [*range(2 * count), -1]].sum(axis=1)
    given = book.work[rows, 2 * count + scene.row_names.index("drive")]
    through = held - found.get("weight", np.zeros(1)).min() + taken
    return float(np.abs(held - held[0] + taken - given).max() / max(through.max(), np.finfo(float).tiny))


# --- many runs -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Ensemble:
    """Turns of all members.

    Attributes
    ----------
    gap : float
        The largest clearance, m.
    turns : dict of str to array, shape (members, turns, ...)
        What `by_turn` gives, and what `measure` of `ensemble` gave.
    outcomes : tuple of Status
        Of each member.
    balances : tuple of float
        Energy balance of each member.
    """

    gap: float
    turns: dict[str, Array]
    outcomes: tuple[Status, ...]
    balances: tuple[float, ...] = ()

    @property
    def ok(self) -> bool:
        """True if all members ended well."""
        return all(outcome is Status.OK for outcome in self.outcomes)

    def mean(self, name: str) -> Array:
        """Mean over members and turns."""
        return np.asarray(self.turns[name].mean(axis=(0, 1)))

    def error(self, name: str) -> Array:
        """Standard error of the mean: from the members' means, which are independent; of one member, from its turns."""
        values = self.turns[name]
        draws = values.mean(axis=1) if len(values) > 1 else values[0]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(draws.std(axis=0) / np.sqrt(len(draws) - 1))

    @classmethod
    def joined(cls, parts: Sequence[Ensemble]) -> Ensemble:
        """Members of several."""
        turns = {name: np.concatenate([each.turns[name] for each in parts]) for name in parts[0].turns}
        outcomes, balances = (tuple(x for each in parts for x in getattr(each, name)) for name in ("outcomes", "balances"))
        return cls(parts[0].gap, turns, outcomes, balances)


def ensemble(
    mechanism: Mechanism, turns: int, seeds: Iterable[int], *, spread: float = 1e-9, settle: int = 1, tolerance: float = 1e-8,
    workers: int = 1, measure: Callable[[Flight, int, int], dict[str, Array]] | None = None,
) -> Ensemble:  # fmt: skip
    """Run the mechanism once for each seed.

    Parameters
    ----------
    mechanism : Mechanism
        A crank-rocker with clearance.
    turns : int
        Of the crank, to measure, after `settle` that are discarded.
    seeds : iterable of int
        One a member, for the offset of its start.
    spread : float
        Standard deviation of that offset, m and rad. It must leave pins in their bushes.
    tolerance : float
        Of a step; see `Spectral`.
    workers : int
        Threads; the compiled run does not hold the interpreter's lock.
    measure : callable
        Further measures, (flight, turns, settle) as `by_turn`.

    Raises
    ------
    RuntimeError
        If a member stops before its time.
    """
    whole("turns", turns, 1, 1_000_000), whole("settle", settle, 0, 1_000_000), whole("workers", workers, 1, 1024)
    positive("spread", spread, "m")
    if not (seeds := tuple(seeds)):
        raise ValueError("seeds = (): must be one number or more, one for each member")
    every, turn = turns + settle, period(mechanism)

    def member(seed: int) -> tuple[dict[str, Array], Status, float]:
        scene = Scene.of(mechanism)
        try:
            flight = fly(scene, every * turn, tolerance, start(scene, spread, seed))
        except RuntimeError as failure:
            raise RuntimeError(f"seed {seed}: {failure}") from None
        more = measure(flight, every, settle) if measure else {}
        return by_turn(flight, every, settle) | more, Status.SUSPECT if flight.deep else Status.OK, balance(flight, every)

    with ThreadPoolExecutor(workers) as pool:
        measured, outcomes, balances = zip(*pool.map(member, seeds), strict=True)
    found = {name: np.stack([each[name] for each in measured]) for name in measured[0]}
    return Ensemble(gap(mechanism), found, outcomes, balances)
