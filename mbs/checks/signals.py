"""Self-checks of signals and energies: finite values, time, energy balance, sign and depth of contacts, ends of struts."""

from collections.abc import Iterator

import numpy as np

from ..elements.signal import DepthLimit
from ..record.errors import Norm
from ..record.result import Result
from ..record.run import BALANCE, Run, compute_throughput
from ..scene.scene import Scene
from .check import check


@check("NOT_FINITE")
def check_finite(_run: Run, result: Result) -> Iterator[str]:
    """Check that all values are finite."""
    if not all(np.isfinite(values).all() for values in result.signals.values()):
        yield "a signal is not finite"


@check("TIME")
def check_time(_run: Run, result: Result) -> Iterator[str]:
    """Check that the time increases."""
    if not (np.diff(result.time) > 0).all():
        yield "time does not increase"


@check("ENERGY")
def check_balance(run: Run, result: Result) -> Iterator[str]:
    """Check that energies balance within the error of the run, and that no dissipated energy decreases."""
    energy = result.energy or run.ledger  # a result keeps the energies (`ledger`) only if asked for
    throughput, unresolved = compute_throughput(run.record, energy, result.signals)  # share that fast vibrations may store
    balance = float(np.abs(energy["error"]).max()) / throughput
    dissipated = [name for name in energy if name.startswith("taken_")]  # names of dissipated energies, see `run.ledger`
    decreases = {n: float((np.maximum.accumulate(energy[n]) - energy[n]).max()) / throughput for n in dissipated}
    allowed = BALANCE + unresolved
    if not max([balance, *decreases.values()]) <= allowed:  # errors, relative to the throughput, take long to read
        errors = [error for (name, norm), error in result.error.items() if name.startswith("energy.") and norm is Norm.RMS]
        allowed = max([BALANCE, *errors]) + unresolved
    if not balance <= allowed:
        yield f"balance {balance:.2e} of the energy put through, allowed {allowed:g}"
    for name, share in decreases.items():
        if share > allowed:
            yield f"'{name}' gives back {share:.2e} of the energy put through: a law makes energy"


def _one_sided(run: Run) -> list[tuple[str, str]]:
    """Return the signals of forces that must not be negative, each with the signal of its depth; '' for ropes."""
    elements = Scene.of(run.record.mechanism).elements.items()
    return [signals for name, element in elements for signals in element.unilateral_forces(name)]


@check("CONTACT", _one_sided, "no stop, no joint with clearance and no rope")
def check_directions(run: Run, result: Result) -> Iterator[str]:
    """Check that contacts push only while closed and never pull, and that ropes pull."""
    for name, depth in _one_sided(run):
        force = result.signals[name]
        allowed = 1e-9 * float(np.abs(force).max(initial=0.0))  # ascribed to rounding
        if not depth:  # a rope
            wrong = {"would have to push (a real rope goes slack)": force < -allowed}
        else:
            acts_open = (np.abs(force) > allowed) & (result.signals[depth] <= 0)
            wrong = {"pulls": force < -allowed, "acts without touching": acts_open}
        for fault, samples in wrong.items():
            if samples.any():
                k = int(np.argmax(samples))
                yield f"'{name}' {fault} with {force[k]:.3g} N at t = {result.time[k]:.4g} s"


def _depths(run: Run) -> list[DepthLimit]:
    """Return the depths of contacts that elements limit."""
    elements = Scene.of(run.record.mechanism).elements.items()
    return [depth for name, element in elements for depth in element.depths(name, run.record.mechanism)]


@check("PENETRATION", _depths, "no stop and no joint with clearance")
def check_depths(run: Run, result: Result) -> Iterator[str]:
    """Check that no contact is deeper than its element allows: contact laws do not hold beyond."""
    for depth in _depths(run):
        deepest = float(result.signals[depth.signal].max(initial=0.0))
        if deepest > depth.allowed:
            yield f"{depth.what} is {deepest:.3g} m {depth.where}"


def _struts(run: Run) -> list[str]:
    return [link.name for link in run.record.mechanism.links if link.body.massless]


@check("CROSSED", _struts, "no strut")
def check_crossing(run: Run, result: Result) -> Iterator[str]:
    """Check that the ends of no strut have met: beyond, the force would have the wrong direction."""
    for name in _struts(run):
        # ends have met at a distance of 2 % of the length: chosen
        if (result.signals[f"{name}.end_shortening"] > 0.98 * run.record.mechanism.length(name)).any():
            yield f"the ends of strut '{name}' met; its force law ends there"
