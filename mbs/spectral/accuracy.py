"""Runs of the compiled solver until an error is known and small enough: each is compared with the coarser one before it.

The finer of two neighbours is told to have their whole difference as its error. Where three runs shrink the difference more than
threefold, what is left of the geometric series is told, doubled: the order is the one that is seen. With clearance three runs
must tell: two may agree by chance. Two kinds of series, both of fifth order where the motion is smooth:

- implicit: a tolerance 8 times smaller each, and so steps 0.6 times as long, and strips of two degrees more;
- explicit, for scenes in which nothing is stiff but contacts: a tolerance 30 times smaller each.

Where the explicit series fails, as it does at singular poses, the implicit one is tried. With clearance the time that can be
predicted is compared, and the finest run goes all the way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import inf, log, nan
from typing import Any

import numpy as np
from numba.core.errors import NumbaError

from buckler.mbs.accuracy.aim import MOTION
from buckler.mbs.accuracy.band import unresolved
from buckler.mbs.accuracy.by_signal import by_energy, by_signal
from buckler.mbs.accuracy.delivery import Delivering, Delivery, Task, comparable
from buckler.mbs.accuracy.difference import difference
from buckler.mbs.accuracy.predictable import predictable
from buckler.mbs.accuracy.tolerance import left_with_play
from buckler.mbs.elements.clearance import clearances
from buckler.mbs.kinematics.inertias import axial_period
from buckler.mbs.laws import BristleLaw, FrictionLaw
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.record.errors import Errors
from buckler.mbs.record.run import Run
from buckler.mbs.record.status import Status
from buckler.mbs.solvers.choice import stiffly_damped
from buckler.mbs.solvers.spectral import Spectral
from buckler.mbs.solvers.steps import Controlled
from buckler.mbs.spectral.run import explicitly, once
from buckler.mbs.spectral.scene import Scene
from buckler.mbs.spectral.tables import DRY, SEAT, STRUT
from buckler.mbs.validate import number, positive

FIRST, FIRST_FOR, SHORTER, MOST = 1e-5, 1e-2, 8.0, 9
"""Implicit series: first tolerance for this accuracy, ratio of neighbours, most runs. Errors go by the tolerance to 2/3."""
COARSEST_DEGREE, HIGHEST_DEGREE = 4, 24
EXPLICIT, STRICTER, MOST_EXPLICIT = 1e-2, 30.0, 6
"""Explicit series: first tolerance, over the accuracy; ratio of neighbours; most runs."""
BESIDE = 1e-7
"""Tolerance of one run beside another solver's, explicit, or where something strikes, snaps or sticks."""
SAFE, LEAST = 2.0, 0.1
"""So many times what is left of the geometric series of differences is told, and at least this share of the last one."""
TAUT, MOST_TAUT = 6, 10_000
"""Steps of the first run in a period in which a strut rings, unless they are more than this in all."""
GIVEN_UP = (Status.TIMED_OUT, Status.TOO_MANY_STEPS, Status.FUNCTION_FAILED)
"""Failures that no finer run cures."""


def known(
    mechanism: Mechanism, duration: float, accuracy: float, solver: Spectral | None = None,
    run: Callable[..., Run] = once, aim: Any = MOTION, patience: float = inf, begun: Run | None = None,
) -> Delivery:  # fmt: skip
    """Run a mechanism so that its error is below the accuracy asked for, and known.

    Parameters
    ----------
    mechanism : Mechanism
    duration : float
        s.
    accuracy : float
        Largest relative error, 1e-7 to 0.1.
    solver : Spectral, optional
        Its steps and degree are chosen here, the rest stays.
    run : callable
        `run(mechanism, duration, solver)` makes one run; one that ends for want of time ends the series.
    aim : Aim or Usual
        What the accuracy is asked of.
    patience : float
        Wall time, s, that all runs may take.
    begun : Run, optional
        One that is there already: finer ones go on from it.

    Returns
    -------
    Delivery
        The last run; its error is larger than asked where the series ended first, and not known where runs failed.
    """
    positive("duration", duration, "s"), number("accuracy", accuracy, 1e-7, 0.1, "1")
    solver, task = solver or Spectral(), Task(mechanism, duration, accuracy, aim, patience, begun)
    if not _nothing_stiff(mechanism, solver):
        return _Implicit(task, run, solver).deliver()
    found = _Explicit(task, run, replace(solver, method="explicit")).deliver()
    failure = found.run.failure
    if found.kept(accuracy) or (failure is not None and failure[0] is Status.TIMED_OUT):
        return found
    return _Implicit(task, run, replace(solver, method="implicit")).deliver().after(found)


def share_told(off: float, last: float) -> float:
    """Share of a difference that is told as the finer run's error, from the difference before it, infinite if there is none."""
    if not off < last < inf:
        return 1.0
    return min(1.0, max(LEAST, SAFE * off / (last - off)))


def beside(mechanism: Mechanism, duration: float) -> Spectral:
    """Settings of one run that stands beside another solver's."""
    if _nothing_stiff(mechanism, Spectral()):
        return Spectral(Controlled(tolerance=BESIDE, max_step=duration / 200), method="explicit")
    longest = _ringing(mechanism, duration)
    struts = any(link.body.massless for link in mechanism.links)
    snaps = struts or mechanism.stops or any(guide.friction for guide in mechanism.guides)  # forces have spikes
    return Spectral(Controlled(BESIDE, longest if longest < inf else None)) if snaps else Spectral()


def _ringing(mechanism: Mechanism, span: float) -> float:
    """Longest step, s, that resolves how struts ring, far below any tolerance of places; infinite without, and in long runs."""
    struts = any(link.body.massless for link in mechanism.links)
    longest = axial_period(mechanism) / TAUT
    return longest if struts and span / longest <= MOST_TAUT else inf


def takes(mechanism: Mechanism) -> bool:
    """Whether the compiled solver answers for all kinds of a mechanism, and can compile its functions."""
    if any(isinstance(guide.friction, FrictionLaw | BristleLaw) for guide in mechanism.guides):
        return False  # it runs them, but the energy of bristles does not add up, and near a wedge it starts wrongly
    try:
        Scene.of(mechanism)
    except (ValueError, NotImplementedError, NumbaError):
        return False
    return True


def _nothing_stiff(mechanism: Mechanism, solver: Spectral) -> bool:
    """Whether the explicit integrator suits: no strips, no struts, no friction that sticks, no stiff damper."""
    scene = Scene.of(mechanism, solver.degree)
    if solver.method != "chosen" or explicitly(scene, solver):
        return solver.method != "implicit"
    kinds = scene.tables.forces[:, 0]
    if len(scene.tables.strips) or len(scene.tables.modal) or np.isin(kinds, (STRUT, SEAT, DRY)).any():
        return False
    return not stiffly_damped(mechanism)


class _Series(Delivering):
    """Runs finer and finer until two neighbours agree."""

    most: int

    def __init__(self, task: Task, run: Callable[..., Run], solver: Spectral) -> None:
        super().__init__(task, run)
        self.solver = solver
        self.play = bool(clearances(task.mechanism))
        self.span = predictable(task.mechanism, task.duration)

    def settings(self, k: int) -> Spectral:
        """Of the k-th run."""
        raise NotImplementedError

    def deliver(self) -> Delivery:
        asked, aim = self.task.asked, self.task.aim
        before, first = self.begun()
        best: tuple[float, Run, Run, float] | None = None
        last = inf
        for k in range(first, self.most):
            found = self.run(self.task.mechanism, self.span, self.settings(k))
            if found.failure is not None:
                before, last = None, inf
                if found.failure[0] in GIVEN_UP:
                    break
                continue
            if before is not None:
                off = aim.apart(comparable(before), comparable(found))
                share = share_told(off, last)
                error = left_with_play(off, last, asked) if self.play else share * off
                last = off
                if best is None or error <= best[0]:
                    best = error, found, before, share
                if error <= asked:
                    break
            before = found
        if best is None:
            return Delivery(found, nan if found.failure else inf, Errors(), {}, self.runs)
        reached, fine, coarse, share = best
        told = self._errors(fine, coarse, share)
        if self.play and aim.motion:
            told = replace(told, motion=reached)  # the rest of the series, not its last difference alone
        if self.span < self.task.duration:
            fine = self.run(self.task.mechanism, self.task.duration, fine.solver)
        return Delivery(fine, reached if fine.failure is None else nan, told, {}, self.runs)

    def begun(self) -> tuple[Run | None, int]:
        """The run that is there already, if it is of this series but for its tolerance, and the number of the first finer one."""
        run, settings = self.task.begun, [self.settings(k) for k in range(self.most)]
        if run is None or any(link.body.meshed for link in self.task.mechanism.links):
            return None, 0  # strips are made finer by their degree, too
        finer = [k for k, each in enumerate(settings) if each.tolerance < run.solver.tolerance / SHORTER]
        same = finer and run.solver.method in (settings[0].method, "chosen")
        return (run, finer[0]) if same else (None, 0)

    def _errors(self, fine: Run, coarse: Run, share: float) -> Errors:
        """Of the motion and of all signals."""
        a, b = comparable(coarse), comparable(fine)
        signals = {name: share * d for name, d in by_signal(a, b).items()}
        if self.task.aim.motion and not self.play:
            signals = unresolved(self.task.mechanism, self.span / (len(b.time) - 1), signals, b.units)
        energies = {name: share * d for name, d in by_energy(coarse, fine).items()}
        over = f", over the first {1e3 * self.span:g} ms" if self.span < self.task.duration else ""
        kind = f"two runs of the compiled solver{over}"
        return Errors(share * difference(a, b), signals | energies, kind, fine.solver.degree != coarse.solver.degree)


class _Implicit(_Series):
    """Steps half as long each, and strips of two degrees more."""

    most = MOST

    def settings(self, k: int) -> Spectral:
        n = k + max(0, int(1.5 * log(FIRST_FOR / self.task.asked) / log(SHORTER)))
        longest = min(self.span / (100 * 2 ** (n / 2)), _ringing(self.task.mechanism, self.span) / 2 ** (k / 2))
        steps = Controlled(tolerance=FIRST / SHORTER**n, max_step=longest)
        degree = min(COARSEST_DEGREE + 2 * n, HIGHEST_DEGREE)
        return replace(self.solver, steps=steps, degree=degree, contact_tolerance=self.solver.contact_tolerance / 2**n)


class _Explicit(_Series):
    """Tolerances that fall faster."""

    most = MOST_EXPLICIT

    def settings(self, k: int) -> Spectral:
        tolerance = max(1e-13, EXPLICIT * self.task.asked / STRICTER**k)
        return replace(self.solver, steps=Controlled(tolerance=tolerance, max_step=self.span / (100 * 2 ** (k / 2))))
