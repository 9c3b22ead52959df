"""A run without settings: which it is, and what it is held to.

It is Exudyn's with its usual settings, held against the first rung of the compiled solver, which shares none of the equations.
Where the two are farther apart than `Usual` allows, the compiled solver climbs its ladder, or Exudyn its own where elements are
named, as the answer is that of these. What the compiled solver does not take, or would have to compile from a function in Python,
climbs Exudyn's ladder at once; what constraints alone decide, that of loop closure.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf, nan
from typing import ClassVar

from buckler.mbs.accuracy.compare import TINY, Functions
from buckler.mbs.accuracy.deliver import UNKNOWN, Climb, Delivery, Rung, beside, deliver, delivered
from buckler.mbs.accuracy.ladder import PLAIN, Runner, compilable, ladder_of, suited
from buckler.mbs.elements.signal import Kind
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.errors import Errors
from buckler.mbs.solvers.exudyn import Exudyn
from buckler.mbs.solvers.spectral import Spectral
from buckler.mbs.solvers.steps import Controlled
from buckler.mbs.units import FORCES

PLACE, STRUCK_PLACE = 1e-3, 5e-3
"""Error allowed of places at any time, over the longest link or a radian; where something strikes, in the mean over time, as a
rebound that is 5 % wrong errs by so much, and one that is a little later by more for that little while."""
FORCE, IMPULSE = 0.1, 0.05
"""Error allowed of forces as functions of time, and of impulses and energies: contact laws are known no better. Forces that ring
are looked at as their means."""
JOURNAL = 0.1
"""Error allowed of the place of a journal, over the clearance."""

LEVEL = 3e-4
"""Error for which the ladders begin: a part of what is allowed of places."""
MOST = 20
"""Steps of the compiled solver, of Exudyn's, beyond which it does not suit a mechanism; at least a thousand times as many."""


class Usual:
    """What a run without settings is held to.

    Of places, energies, and forces; of contacts their impulses too, and where pins rattle in their bushes impulses alone, as each
    blow rings in what it strikes. Rates and accelerations are not looked at one by one, as those of strips ring: the kinetic
    energy tells of them. Nor is friction: where a contact sticks, it is what its regularisation makes of it.
    """

    asked: ClassVar[float] = nan
    words: ClassVar[str] = "a run without settings"

    def limits(self, run: Functions) -> Mapping[str, float]:
        """Relative error allowed of signals and of what is read off them."""
        signals, scales = run.signals, run.scales
        struck = any(signal.kind is Kind.CONTACT for signal in signals.values())
        rattles = any(signal.kind is Kind.PLACE and signal.scale for signal in signals.values())
        place, norm = (STRUCK_PLACE, "") if struck else (PLACE, ".peak")
        found = dict[str, float]()
        for name, signal in signals.items():
            if signal.kind is Kind.PLACE:
                whole = run.size if signal.unit == "m" else 1.0
                moves = {name + norm: place * max(1.0, whole / max(scales[name][1], TINY))}
                found |= {name: JOURNAL} if signal.scale else moves
            elif signal.kind is Kind.ENERGY and "friction" not in name:
                found[name] = IMPULSE
            elif signal.kind is Kind.CONTACT and signal.unit in FORCES:
                found |= {f"{name}.impulse": IMPULSE} | ({} if rattles else {name: FORCE})
            elif signal.kind in (Kind.REACTION, Kind.INTERNAL) and signal.unit in FORCES and f"{name}.mean" not in signals:
                found |= {f"{name}.impulse": IMPULSE} if rattles else {name: FORCE}
        return found


def plain(mechanism: Mechanism, duration: float, run: Runner) -> Delivery:
    """Run without settings; see above."""
    goal, solver = Usual(), suited(mechanism)
    engine = Climb(ladder_of(mechanism, duration, PLAIN, Exudyn() if isinstance(solver, Spectral) else solver), run)
    if not (isinstance(solver, Spectral) or (isinstance(solver, Exudyn) and compilable(mechanism))):
        return deliver(engine, goal)
    base = engine.functions(Rung())
    if base is None:
        return Delivery(engine.run(Rung()), Errors(), UNKNOWN, engine.made)
    steps = Controlled(max_steps=MOST * (1000 + len(base.time)))
    compiled = Climb(ladder_of(mechanism, duration, LEVEL, Spectral(steps)), run, engine.made)
    finer = compiled.functions(Rung())
    if finer is None:
        return deliver(engine, goal)
    look = beside(base, finer)
    first = delivered(engine, goal, Rung(), look)
    if first.worst.ratio <= 1:
        return first
    if isinstance(solver, Exudyn):
        return deliver(engine, goal)
    second = deliver(compiled, goal, parts_at=look.parts_at if look.parts_at < inf else 0.0)
    return min(second, first, key=lambda each: each.worst.ratio)
