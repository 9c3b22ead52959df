"""How far two runs of one mechanism are apart, signal by signal, as functions of time.

Both are cubics between their samples, by the rates of what has some, compared at the samples of both and half-way between. What
is read off a signal is off by no more than a norm of the difference: two readings that agree by chance hide nothing.

- `name`: the root of the mean square of the difference;
- `name.peak`: its largest magnitude, which bounds the error of the largest value; of places and forces;
- `name.impulse`: the largest magnitude of its integral, which bounds that of an impulse; of forces;
- `name.onset`: how much earlier or later a contact closes or opens, over the run; of contacts.

A place is measured by its range, a force or a rate by its root mean square or its peak, a component by the largest of its
vector, and all at least by `SMALL` of the largest signal of its kind and unit, places by `RESTING` of the mechanism: what is
smaller rests. A state is measured by its own largest value. Energies are measured by what is put through, and by a hundred times
what vibrations that nobody sees may hold.

Contacts that close a little earlier or later would make forces differ wholly for that little while. The onset tells their time;
forces and rates are compared in a time that is bent so that onsets fall together, and not between two samples about one, nor
about kinks of what drives or loads a mechanism. A point that passes a stop by less than its place is off may as well have
touched it: the force that it would have had counts as a difference.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from ..elements.clearance import clearances
from ..elements.element import kinks_of
from ..elements.signal import Kind, Signal
from ..geometry import Array
from ..record.energy import ledger, put_through
from ..record.lookup import between
from ..record.run import Run
from ..record.signals import axial_period, follows, mechanism_mass

SMALL, RESTING = 1e-2, 1e-3
"""Of the largest signal of the same kind and unit, and of the mechanism's size: smaller signals are measured by so much."""
FORCES = (Kind.REACTION, Kind.CONTACT, Kind.FRICTION, Kind.INTERNAL)
STRAIGHT = (Kind.PLACE, Kind.STATE, Kind.ENERGY)
"""Compared in time as it is."""
BENT = tuple(kind for kind in Kind if kind not in STRAIGHT)
TINY = float(np.finfo(float).tiny)


class Apart(NamedTuple):
    """A difference, and what it is measured by, in the signal's unit."""

    off: float
    scale: float

    @property
    def relative(self) -> float:
        """The one over the other; infinite for what is not finite."""
        return self.off / self.scale if np.isfinite(self.off) else np.inf


@dataclass(frozen=True)
class Functions:
    """A run as functions of time, s, and the signals that are compared.

    Attributes
    ----------
    size : float
        Of the mechanism, m.
    balance : float
        What its energies do not add up by, over the energy put through.
    kinks : tuple of float
        Times, s, at which accelerations and forces jump, as what drives or loads the mechanism does.
    push : float
        Force, N, that moves the mechanism by its size, or by its clearance, in the time of the run: a hundredth of it is none.
    taken : float
        Amplitude, m, of the axial vibration of a strut that holds the energy that is missing: numerical damping took no more. A
        strut is stiffer before its Euler load than beyond, so that a vibration moves its mean; 0 without struts.
    """

    time: Array
    signals: Mapping[str, Signal]
    size: float
    balance: float = 0.0
    kinks: tuple[float, ...] = ()
    push: float = 0.0
    taken: float = 0.0

    @classmethod
    def of(cls, run: Run) -> Functions:
        """Signals and energies of a run."""
        record, mechanism, end = run.record, run.record.mechanism, float(run.record.time[-1])
        energies = ledger(record)
        through, unseen = put_through(record, energies, run.values)
        missing, mass = float(np.abs(energies.pop("error")).max()), mechanism_mass(mechanism)
        del energies["throughput"]
        found = {name: signal for name, signal in run.signals.items() if signal.kind not in (Kind.COUNT, Kind.UNDETERMINED)}
        whole = through * (1 + unseen / SMALL)
        found |= {f"energy.{n}": Signal(f"energy.{n}", v, "J", Kind.ENERGY, scale=whole) for n, v in energies.items()}
        size = max(mechanism.length(link.name) for link in mechanism.links)
        push = mass * min([size, *(joint.gap for joint in clearances(mechanism))]) / end**2
        struts = any(link.body.flexible and link.body.massless for link in mechanism.links)
        taken = axial_period(mechanism) / (2 * np.pi) * float(np.sqrt(2 * missing / mass)) if struts else 0.0
        return cls(record.time, found, size, max(0.0, missing / through - unseen), kinks_of(mechanism, end), push, taken)

    @property
    def unresolved(self) -> list[str]:
        """Forces that ring in periods that the steps do not follow."""
        rings = {name.removesuffix(".mean"): signal.period for name, signal in self.signals.items() if signal.period > 0}
        return [name for name, period in rings.items() if not follows(self.time, period)]

    def at(self, times: Array, kinds: Collection[Kind] = tuple(Kind)) -> dict[str, Array]:
        """All signals of some kinds at other times within the run."""
        found, signals = dict[str, Array](), self.signals
        for known, smooth in product((True, False), repeat=2):
            alike = {n: s for n, s in signals.items() if (s.rate in signals, s.kind is Kind.PLACE) == (known, smooth)}
            if names := [name for name, signal in alike.items() if signal.kind in kinds]:
                values = np.stack([signals[name].values for name in names], axis=1)
                rates = np.stack([signals[signals[name].rate].values for name in names], axis=1) if known else None
                found |= zip(names, np.ascontiguousarray(between(self.time, values, rates, times, smooth).T), strict=True)
        return found

    @cached_property
    def own(self) -> dict[str, Array]:
        """The size of each signal: of a place or an energy its range, else the root of its mean square and its largest."""
        found = {}
        for name, signal in self.signals.items():
            if signal.kind in STRAIGHT:
                found[name] = np.full(2, signal.scale or np.ptp(signal.values))
            else:
                square = np.trapezoid(signal.values**2, self.time) / max(np.ptp(self.time), TINY)
                found[name] = np.array([np.sqrt(square), np.abs(signal.values).max()])
        return found

    @cached_property
    def scales(self) -> dict[str, Array]:
        """What each signal is measured by: its difference's root mean square, and its largest."""
        vectors: dict[str, Array] = {}
        kinds: dict[tuple[str, str], Array] = {}
        for name, signal in self.signals.items():
            group, family = signal.group or name, _family(signal)
            vectors[group] = np.maximum(vectors.get(group, TINY), self.own[name])
            kinds[family] = np.maximum(kinds.get(family, TINY), self.own[name])
        force, torque = ("force", "N"), ("force", "N m")
        kinds[force] = np.maximum(kinds.get(force, self.push), np.maximum(kinds.get(torque, TINY) / self.size, self.push))
        kinds[torque] = kinds[force] * self.size
        found = {}
        for name, signal in self.signals.items():
            rests = RESTING * (self.size if signal.unit == "m" else 1.0)
            least = rests if signal.kind is Kind.PLACE else SMALL * kinds[_family(signal)]
            found[name] = self.own[name] if signal.scale else np.maximum(vectors[signal.group or name], least)
        return found


def _family(signal: Signal) -> tuple[str, str]:
    """Signals that are small or large by each other."""
    return ("force" if signal.kind in FORCES else signal.kind), signal.unit


def compare(a: Functions, b: Functions, until: float = np.inf) -> dict[str, Apart]:
    """How far run a is from run b, which it is measured by, up to a time, s; by signal and by what is read off it, see above."""
    end = max(min(float(a.time[-1]), float(b.time[-1]), until), TINY)
    mine, theirs = _bend(a, b, end)
    plain, own = _grid([a.time, b.time], end), _grid([a.time, np.interp(b.time, theirs, mine), mine[1:-1]], end)
    other = np.interp(own, mine, theirs)
    jumps = np.append(mine[1:-1], [t for t in b.kinks if t < end])
    seen = _seen(own, a.time, jumps) * _seen(other, b.time, np.interp(jumps, mine, theirs))
    evenly, bent, found = _weights(plain), _weights(own) * seen, dict[str, Apart]()
    with np.errstate(all="ignore"):
        flat = a.at(plain, STRAIGHT + FORCES), b.at(plain, STRAIGHT + FORCES)
        warped = a.at(own, BENT), b.at(other, BENT)
        for name in [name for name in b.signals if name in a.signals]:
            signal, scales = b.signals[name], b.scales[name]
            (here, there), weights = (flat, evenly) if signal.kind in STRAIGHT else (warped, bent)
            off, missed = here[name] - there[name], _missed(a, b, name, plain)
            norm = np.sqrt(weights @ off**2 / end) + np.sqrt(evenly @ missed**2 / end)
            found[name] = Apart(float(norm), float(scales[0]))
            if signal.kind in (Kind.PLACE, Kind.STATE) or signal.kind in FORCES:
                largest = np.abs(off[weights > 0]).max(initial=0.0) + missed.max()
                found[f"{name}.peak"] = Apart(float(largest), float(scales[1]))
            if signal.kind in FORCES:
                through = max(evenly @ np.abs(flat[1][name]), SMALL * scales[0] * end)
                along = np.abs(np.cumsum(evenly * (flat[0][name] - flat[1][name]))).max() + evenly @ missed
                found[f"{name}.impulse"] = Apart(float(along), float(through))
            if len(signal.onsets):
                found[f"{name}.onset"] = _onset(a.signals[name].onsets, signal.onsets, end)
    return found


def _grid(times: list[Array], end: float) -> Array:
    """Times of all, once each, and half-way between."""
    every = np.unique(np.concatenate(times))
    every = np.append(every[every < end * (1 - 1e-12)], end)
    return np.sort(np.concatenate([every, (every[1:] + every[:-1]) / 2]))


def _weights(times: Array) -> Array:
    """Of Simpson's rule over times with their middles."""
    out = np.zeros(len(times))
    for k, share in enumerate((1, 4, 1)):
        out[k : len(times) - 2 + k : 2] += share * (times[2::2] - times[:-2:2]) / 6
    return out


def _bend(a: Functions, b: Functions, end: float) -> Array:
    """Times of a and of b, shape (2, times), that belong together by the onsets of their contacts."""
    both = [(a.signals[name].onsets, b.signals[name].onsets) for name in b.signals if name in a.signals]
    kept = [(0.0, 0.0)]
    for one, other in sorted(pair for onsets in both for pair in zip(*onsets, strict=False)):
        if one > kept[-1][0] and other > kept[-1][1] and max(one, other) < end:
            kept.append((float(one), float(other)))
    return np.array([*kept, (end, end)]).T


def _seen(times: Array, samples: Array, jumps: Array) -> Array:
    """0 at times between two samples about an onset or a kink, else 1; samples of both sides of one leave nothing between."""
    out, near = np.ones(len(times)), 1e-6 * float(samples[-1])
    for t in jumps:
        last = min(int(np.searchsorted(samples, t - near)), len(samples) - 1)
        first = max(int(np.searchsorted(samples, t + near, side="right")) - 1, 0)
        out[(times >= samples[min(first, last)]) & (times <= samples[max(first, last)])] = 0.0
    return out


def _missed(a: Functions, b: Functions, name: str, times: Array) -> Array:
    """Force, N, of contacts that neither run has, in depths as much larger as those of the two are apart."""
    if not len(b.signals[name].depth):
        return np.zeros(len(times))
    depths = [between(run.time, run.signals[name].depth, None, times, smooth=True) for run in (a, b)]
    deeper = np.max(depths, axis=0) + np.abs(depths[0] - depths[1]).max()
    spell = np.cumsum(np.diff(deeper > 0, prepend=False))
    touching = np.unique(spell[np.max(depths, axis=0) > 0])
    return np.asarray(np.where(np.isin(spell, touching), 0.0, b.signals[name].elastic(np.maximum(deeper, 0.0))))


def _onset(mine: Array, theirs: Array, end: float) -> Apart:
    """How far apart the onsets are that both have; a whole run where one has none."""
    mine, theirs = mine[mine < end], theirs[theirs < end]
    count = min(len(mine), len(theirs))
    lonely = end if len(mine) or len(theirs) else 0.0
    return Apart(float(np.abs(mine[:count] - theirs[:count]).max()) if count else lonely, end)


def relative(apart: Mapping[str, Apart]) -> dict[str, float]:
    """The relative differences."""
    return {name: each.relative for name, each in apart.items()}
