"""Self-check of the energy: what is held, taken and given must add up."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from buckler.mbs.checks.check import Check
from buckler.mbs.laws import BristleLaw
from buckler.mbs.record.energy import ledger
from buckler.mbs.record.record import Record
from buckler.mbs.record.result import Result
from buckler.mbs.record.run import Run

BALANCE = 1e-2
"""Energy balance, relative to the energy put through, beyond which a run is suspect."""
OF_ACCURACY = 3.0
"""The same in units of an accuracy that was asked for, or of what extrapolation changed the places by: the ledger is that of the
finest run, not of the limit."""
AT_REST = 1e-6
"""Way, in lengths of the largest link, below which nothing has moved in the whole run."""
STRETCH, BRISTLE = 1e-5, 1e-4
"""Ways, relative to the length, of stiff vibrations that nobody sees: of a strip along itself, of a slider on the bristles of its
friction. Steps leave them out: the energy they held is lost, and so is that of the work they would have done."""


def _unbalanced(run: Run, result: Result) -> Iterator[str]:
    """What is held, taken and given must add up, and what takes energy must not give it."""
    record, energy = run.record, result.energy or ledger(run.record)
    allowed = max(BALANCE, OF_ACCURACY * result.asked, OF_ACCURACY * _changed(run, result))
    if result.asked > 0:  # of places, say: how far the energies are off is told
        allowed = max([allowed, *(error for name, error in result.error.items() if name.startswith("energy."))])
    through = max(float(energy["throughput"][-1]), _at_rest(record))
    allowed += 2 * (_unseen_stretch(record, result) + _unseen_bristles(record, result)) / through
    balance = float(np.abs(energy["error"]).max()) / through
    if not balance <= allowed:
        yield f"balance {balance:.2e} of the energy put through, allowed {allowed:g}"
    for name, taken in energy.items():
        if name.startswith("taken_"):
            given = float((np.maximum.accumulate(taken) - taken).max()) / through
            if given > allowed:
                yield f"'{name}' gives back {given:.2e} of the energy put through: a law makes energy"


def _idle(run: Run, result: Result) -> str:
    """Work cannot be summed over steps that were not recorded."""
    return "" if result.energy or run.solver.steps.record_every == 1 else "not every step was recorded"


def _size(record: Record) -> float:
    return max(record.mechanism.length(link.name) for link in record.mechanism.links)


def _at_rest(record: Record) -> float:
    """Energy, J, of all links at a speed at which nothing moves in a run this long."""
    mechanism, duration = record.mechanism, float(record.time[-1]) or 1.0
    mass = sum(link.mass(mechanism.length(link.name)) for link in mechanism.links)
    return mass * (AT_REST * _size(record) / duration) ** 2 / 2


def _unseen_stretch(record: Record, result: Result) -> float:
    """Largest axial strain energy, J, of strips whose axial strain nobody sees."""
    total = 0.0
    for link in record.mechanism.links:
        if link.body.meshed:
            stiffness = link.body.section.axial_stiffness
            strain = float(np.abs(result.signals[f"{link.name}.axial_force"]).max()) / stiffness
            if strain < STRETCH:
                total += stiffness * record.mechanism.length(link.name) * strain**2 / 2
    return total


def _unseen_bristles(record: Record, result: Result) -> float:
    """Largest energy, J, of the bristles of sliders that they hold within a way nobody sees."""
    total = 0.0
    for guide in record.mechanism.guides:
        if isinstance(guide.friction, BristleLaw):
            energies = guide.energies(guide.key, record)
            held = max(float(values.max()) for kind, name, values in energies if (kind, name) == ("held", "contact"))
            drags = [result.signals.get(f"{owner}.friction_force", np.zeros(1)) for owner in (guide.point, guide.key)]
            force = max(float(np.abs(drag).max()) for drag in drags)
            if 2 * held < BRISTLE * _size(record) * force:
                total += held
    return total


def _changed(run: Run, result: Result) -> float:
    """Change of the points' places by extrapolation, in lengths of the largest link; 0 where nothing was extrapolated."""
    names = [f"{point}.{axis}" for point in run.record.mechanism.points for axis in "xy"]
    return max(float(np.abs(result.signals[name] - run.signals[name].values).max()) for name in names) / _size(run.record)


CHECK = Check(
    "ENERGY",
    "failed when energy held, taken and given do not add up, or something that takes energy gives it back",
    _unbalanced,
    {
        "balance": BALANCE,
        "of an accuracy": OF_ACCURACY,
        "way of rest": AT_REST,
        "unseen stretch": STRETCH,
        "unseen bristle": BRISTLE,
    },
    _idle,
)
