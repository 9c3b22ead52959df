"""What is right in a drawn case of the study `extremes`: the compiled solver twice, or a closed form.

A measure counts where two runs of the compiled solver agree in it: one with steps and meshes finer than the other. With clearance
a third one, with a clearance a thousandth larger, tells how long the motion is one trajectory.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial
from time import perf_counter

import numpy as np
from scipy.integrate import solve_ivp

from buckler.elastica import pinned
from buckler.mbs import Controlled, Exudyn, Mechanism, Result, Spectral, Status, simulate
from buckler.mbs.accuracy.compare import FORCES
from buckler.mbs.elements.clearance import Clearance, clearances
from buckler.mbs.elements.signal import Kind
from buckler.mbs.engine.solve import once
from buckler.mbs.geometry import Array
from buckler.mbs.record.signals import axial_period

from ..kit.drawn import Draw, draw
from ..kit.published import GRAVITY
from .extremes_case import KINDS, Case, CaseOutcome, Measures, largest
from .extremes_listed import Listed

SAMPLES = np.linspace(0.02, 0.98, 49)
"""When places are compared, of the run's length."""
AGREED = 0.3
"""Difference of the two reference runs, of what is allowed, up to which they are one truth."""
KNOWN = 1e-3
"""How well a clearance is taken to be known, relative."""
SMALL = 0.02
"""Forces below this share of the largest in the mechanism are not judged."""
RINGING = 12
"""Steps of the coarser reference for a period in which a strut rings."""
PATIENCE = 30.0
"""Longest time, s, of a reference run."""
ACCURACIES = (None, None, None, 1e-2, 1e-3)
"""What is asked of a run; most often nothing."""


def drawn_case(family: str, seed: int, number: int) -> Case:
    """The case of a family, of a seed, of a number."""
    made = draw(seed, number, (family,))
    return case_of(family, made, ACCURACIES[int(np.random.default_rng([seed, number]).integers(len(ACCURACIES)))], priced=True)


def listed_case(row: Listed) -> Case:
    """A row of the lists as a case."""
    try:
        made = Draw(row.name, row.mechanism(), row.duration)
    except ValueError as error:  # KinematicsError among them
        return Case(row.family, row.name, partial(_refuse, error))
    return case_of(row.family, made, None, row.solver, row.possible)


def _refuse(error: ValueError, _timeout: float) -> CaseOutcome:
    raise error


def case_of(
    family: str, made: Draw, asked: float | None, solver: Exudyn | None = None, possible: bool = True, priced: bool = False
) -> Case:
    """A mechanism as a case: with an accuracy asked for, a solver, or neither; its time may be measured against a plain run's."""
    name, mechanism, duration = made

    def run(timeout: float) -> CaseOutcome:
        if priced:
            once(mechanism, 1e-3 * duration, Exudyn(), None, None)  # laws are compiled now, not in the time that is measured
        start = perf_counter()
        result = simulate(mechanism, duration, asked, solver=solver, timeout=timeout)
        wall, ended = perf_counter() - start, result.status in (Status.OK, Status.SUSPECT)
        read = _read(made, result) if ended else {}
        return CaseOutcome(str(result.status), result.message, read, wall, _told(result, read))

    def plain() -> None:
        once(mechanism, duration, Exudyn(), PATIENCE, None)

    scales = dict(_scales(mechanism, asked))
    name += f", accuracy {asked:g}" if asked else ""
    right = partial(_right, made, scales) if possible else None
    return Case(family, name, run, right, scales, plain if priced else None)


def _scales(mechanism: Mechanism, asked: float | None) -> Iterator[tuple[str, float]]:
    """Lengths that places are compared with; an accuracy of 1 % allows ten times what the status does."""
    size = max(mechanism.length(link.name) for link in mechanism.links)
    yield "place", size * max(1.0, (asked or 0.0) / KINDS["place"].allowed)
    yield "path", size * max(1.0, (asked or 0.0) / KINDS["path"].allowed)
    if clearances(mechanism):
        yield "journal", min(joint.gap for joint in clearances(mechanism))


def _read(made: Draw, result: Result) -> Measures:
    """What is compared of a result."""
    mechanism, duration = made.mechanism, made.duration
    if _pressed(mechanism):
        return {"force of the push": np.array([_push(result)])}
    kind = "journal" if clearances(mechanism) else "path" if mechanism.stops else "place"
    names = [f"{point}.{axis}" for point in mechanism.points for axis in "xy"]
    found: dict[str, Array] = {kind: np.stack([result.at(name, SAMPLES * duration, outside=np.nan) for name in names])}
    span = result.time[-1] - result.time[0]
    for name, parts in _forces(result).items():
        found[f"force, rms of {name}"] = np.sqrt(np.trapezoid(parts**2, result.time) / span)
        found[f"force, peak of {name}"] = np.abs(parts).max(axis=1)
        if name.endswith(("contact_force", "normal_force")):
            found[f"impulse of {name}"] = np.trapezoid(parts, result.time)
    return found


def _forces(result: Result) -> dict[str, Array]:
    """Forces and torques, (1 or 2 components, times), of what rings the means: components are measured over the larger one."""
    found: dict[str, list[Array]] = {}
    for name, owner in _judged(result).items():
        found.setdefault(owner, []).append(result.signals[name])
    return {name: np.stack(parts) for name, parts in found.items()}


def _judged(result: Result) -> dict[str, str]:
    """Forces and torques that are judged, and what each is a component of."""
    found = {}
    for name, trait in result.traits.items():
        force = trait.kind in FORCES and trait.kind is not Kind.FRICTION and result.units[name] in ("N", "N m")
        if force and f"{name}.mean" not in result.traits:
            found[name] = (trait.group or name).removesuffix(".mean")
    return found


def _told(result: Result, read: Measures) -> dict[str, float]:
    """Errors of places and forces that a run tells; of what rings in periods that it does not follow it tells that."""
    found: dict[str, float] = {}
    for kind in {"place", "path"} & set(read):
        ways = [f"{name}.peak" for name, trait in result.traits.items() if trait.kind is Kind.PLACE and result.units[name] == "m"]
        off = [result.error[way] * result.error.sizes[way] for way in ways if way in result.error]
        found[kind] = max(off, default=0.0) / np.nanmax(np.abs(read[kind]))
    for name, owner in _judged(result).items():
        for part, what in (("", "force, rms of"), (".peak", "force, peak of"), (".impulse", "impulse of")):
            measure = f"{what} {owner}"
            told = np.inf if name.removesuffix(".mean") in result.error.unresolved else result.error.get(f"{name}{part}", 0.0)
            found[measure] = max(found.get(measure, 0.0), told)
    return found


def _push(result: Result) -> float:
    """Force of the drive at the end, the block's inertia taken off."""
    late = result.time > 0.999 * result.time[-1]
    inertia = 0.1 * np.gradient(result.signals["A.vx"], result.time)
    return float(np.mean((result.signals["drive.force"] - inertia)[late]))


def _right(made: Draw, scales: Mapping[str, float]) -> Measures | None:
    """The measures that are known; None if none is."""
    if _pressed(made.mechanism):
        return {"force of the push": np.array([_load(made)])}
    if _swings(made.mechanism):
        return {"place": _pendulum(made)}
    coarse, fine = (_reference(made, k) for k in (0, 1))
    if coarse is None or fine is None:
        return None
    until = len(SAMPLES)
    if clearances(made.mechanism):
        joints = [
            replace(each, gap=(1 + KNOWN) * each.gap) if isinstance(each, Clearance) else each for each in made.mechanism.joints
        ]
        other = _reference(made._replace(mechanism=replace(made.mechanism, joints=joints)), 0)
        if other is None:
            return None
        apart = np.abs(other["journal"] - fine["journal"]).max(axis=0) > KINDS["journal"].allowed * scales["journal"]
        until = int(np.argmax(apart)) if apart.any() else until
    found = dict(_agreed(coarse, fine, scales, until))
    return found or None


def _agreed(coarse: Measures, fine: Measures, scales: Mapping[str, float], until: int) -> Iterator[tuple[str, Array]]:
    """Measures in which the references agree; forces only where the motion is one trajectory throughout."""
    biggest = max((largest(v) for name, v in fine.items() if name.startswith("force")), default=0.0)
    for name, value in fine.items():
        kind, motion = KINDS[name.partition(" ")[0].rstrip(",")], name in ("place", "path", "journal")
        if not motion and (until < len(SAMPLES) or (name.startswith("force") and largest(value) < SMALL * biggest)):
            continue
        first, second = (coarse[name][..., :until], value[..., :until]) if motion else (coarse[name], value)
        if second.shape[-1] == 0:
            continue
        scale = scales.get(name) or max(largest(second), 1e-12)
        if kind.norm(first - second) / scale <= AGREED * kind.allowed:
            yield name, second


def reference_solver(made: Draw, finer: int) -> Spectral:
    """Of a reference run, its steps and strips finer the second time."""
    longest = made.duration / 800
    if any(link.body.massless for link in made.mechanism.links):  # they ring in places far smaller than a tolerance
        longest = min(longest, axial_period(made.mechanism) / RINGING)
    steps = Controlled(tolerance=1e-9 * 10.0 ** (1 - finer), max_step=longest / 2**finer)
    return Spectral(steps, degree=9 + 3 * finer, contact_tolerance=1e-3 / 2**finer)


def _reference(made: Draw, finer: int) -> Measures | None:
    """One run of the compiled solver."""
    solver = reference_solver(made, finer)
    try:
        simulate(made.mechanism, 1e-6 * made.duration, solver=solver)  # what is not compiled yet is compiled now
        result = simulate(made.mechanism, made.duration, solver=solver, timeout=PATIENCE)
    except (ValueError, NotImplementedError):
        return None
    return _read(made, result) if result.status in (Status.OK, Status.SUSPECT) else None


def _pressed(mechanism: Mechanism) -> bool:
    """Whether it is a straight link pressed in line by a drive: the elastica's load is known."""
    return mechanism.links[0].name == "strip" and bool(mechanism.drives)


def _load(made: Draw) -> float:
    """Of the elastica at the end of a push, N."""
    (strip,), motion = made.mechanism.links, made.mechanism.drives[0].motion
    section, length = strip.body.section, made.mechanism.length("strip")
    critical = section.euler_load(length)
    share = motion.position(made.duration) / length
    return critical / np.pi**2 * float(pinned.load(share - critical / section.axial_stiffness))


def _swings(mechanism: Mechanism) -> bool:
    """Whether it is one rigid bar that swings about its start."""
    return len(mechanism.links) == 1 and not (mechanism.loads or mechanism.guides or mechanism.stops)


def _pendulum(made: Draw) -> Array:
    """Places of the two points of a bar that swings about the first: its equation to 1e-12."""
    (bar,), (x, y) = made.mechanism.links, made.mechanism.points["A"]
    length, angle = float(np.hypot(x, y)), float(np.arctan2(x, -y))
    mass, inertia, _ = bar.body.inertia(length)
    times, pull = SAMPLES * made.duration, mass * GRAVITY * length / 2 / (inertia + mass * length**2 / 4)
    found = solve_ivp(
        lambda _t, y: (y[1], -pull * np.sin(y[0])),
        (0, made.duration), (angle, 0.0), method="DOP853", t_eval=times, rtol=1e-12, atol=1e-12,
    )  # fmt: skip
    still = np.zeros_like(times)
    return np.stack([still, still, length * np.sin(found.y[0]), -length * np.cos(found.y[0])])
