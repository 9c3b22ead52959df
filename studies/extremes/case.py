"""One case of the study `extremes`: a run, its reference, and the verdict.

Measures are the numbers of a run that are compared, such as places and force peaks. Their reference is a closed form, or two runs
of the compiled solver with different steps; then only measures in which the two agree are compared. With clearance a third run,
whose clearance is larger by a thousandth, shows until when the motion is predictable.
"""

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from enum import StrEnum
from time import perf_counter
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from buckler.elastica import pinned
from buckler.mbs import Controlled, Mechanism, Result, Spectral, Status, simulate
from buckler.mbs.elements.clearance import Clearance, clearances
from buckler.mbs.elements.signal import Kind as SignalKind
from buckler.mbs.geometry import Array
from buckler.mbs.record.errors import Norm
from buckler.mbs.scene.scene import Scene

from ..kit.drawn import Draw
from ..kit.published import GRAVITY

Measures = Mapping[str, Any]
"""Measures by name, each an array whose last axis may be that of `SAMPLES`."""
MODEL_CHECKS = frozenset(("PENETRATION", "LINEAR"))
"""Checks that find a law used beyond its range, which a reference with the same law cannot refute."""
SAMPLES = np.linspace(0.02, 0.98, 49)
"""Times over the duration of the run at which places are compared."""
AGREEMENT = 0.3
"""Largest difference of the two reference runs over the allowed error, in a measure that is compared; by convention."""
CHANGE = 1e-3
"""Relative change of the clearance that must not change a predictable motion."""
SMALL = 0.02
"""Size over the largest force of the mechanism below which a force is not compared, by convention."""
RINGING = 12
"""Smallest number of steps of the coarser reference run in a period of a strut's axial vibration."""
TRIAL = 1e-6
"""Part of the duration that is run to compile the solver: times and time limits then do not include the compilation."""
PATIENCE = 30.0
"""Time limit of a reference run [s]."""
ENDED = (Status.OK, Status.SUSPECT)
"""Status of runs whose numbers are compared."""
FORCES = (SignalKind.REACTION, SignalKind.CONTACT, SignalKind.INTERNAL)
"""Kinds of signals that are compared as forces."""


class Verdict(StrEnum):
    """Verdict on a run by its status and its comparison with a reference.

    RIGHT: the status is OK, and no error is above the allowed one. SILENT: the status is OK, but an error is too large.
    NO_REFERENCE: the status is OK, and nothing could be compared. NAMED: the program names a fault itself. It refuses the
    mechanism, or the run fails, runs out of time or is suspect: with too large an error, without a reference, or by
    `MODEL_CHECKS` alone. FALSE_ALARM: the run is suspect by another check, though its errors are allowed.
    """

    RIGHT = "right"
    NAMED = "named"
    FALSE_ALARM = "false alarm"
    SILENT = "silent"
    NO_REFERENCE = "no reference"


def decide(status: str, message: str, error: float | None) -> Verdict:
    """Decide on a run by its status, its message, and its error over the allowed one, None without a reference."""
    if status not in ENDED:
        return Verdict.NAMED
    if error is None:
        return Verdict.NO_REFERENCE if status == Status.OK else Verdict.NAMED
    if not error <= 1.0:
        return Verdict.SILENT if status == Status.OK else Verdict.NAMED
    if status == Status.OK:
        return Verdict.RIGHT
    checks = set(re.findall(r"(?:^|; )([A-Z]+): ", message))  # a message is "CHECK: text; CHECK: text"
    return Verdict.NAMED if checks and checks <= MODEL_CHECKS else Verdict.FALSE_ALARM


def find_largest(values: Array) -> float:
    """Find the largest magnitude."""
    return float(np.abs(values).max())


class AllowedError(NamedTuple):
    """Largest allowed error of a measure over its scale, and the norm of the error."""

    allowed: float
    norm: Callable[[Array], float] = find_largest


KINDS = {"force": AllowedError(0.05), "impulse": AllowedError(0.05), "place": AllowedError(1e-3), "path": AllowedError(5e-3)}
KINDS["journal"] = AllowedError(0.1, lambda error: float(np.sqrt((error**2).mean(axis=-1)).max()))
"""Allowed errors by the kind of a measure; the name of a measure begins with its kind, as in `force peak of B.contact_force`.

Contact laws give forces and impulses to 5 % at best. A `place` is relative to the longest link, and so is a `path`, the places in
a motion with impacts: 1e-3 is visible in a drawing; a restitution wrong by 5 % moves a path by 5e-3. A `journal` is a place
relative to the clearance, with the root mean square as norm: at 0.1 its side in the bush is right.
"""


def compare(
    found: Measures, right: Measures, scales: Mapping[str, float] = MappingProxyType({}),
    reported: Mapping[str, float] = MappingProxyType({}),
) -> tuple[float, str]:  # fmt: skip
    """Find the largest error of all measures over the allowed one, and the name of its measure.

    The default scale of a measure is the largest value of the reference. An error is also allowed up to the one that the run
    reports in `reported`, relative to the largest value of the run: a run that reports an infinite error claims nothing.
    """
    errors = {}
    for name, value in right.items():
        kind, ours = KINDS[name.split()[0]], np.asarray(found[name])
        allowed = kind.allowed * max(scales.get(name, find_largest(value)), 1e-12)  # positive where the reference is 0
        allowed = max(allowed, reported.get(name, 0.0) * find_largest(ours))
        error = kind.norm(ours[..., : np.shape(value)[-1]] - value)  # a reference may end where predictability does
        errors[name] = float(np.nan_to_num(error / allowed, nan=np.inf))
    worst = max(errors, key=lambda name: errors[name])
    return errors[worst], worst


class Finding(NamedTuple):
    """Verdict on a case, its largest error over the allowed one, the name of that measure, and the message of the run.

    `wall_s` is the time of the run and its references [s], `price` the time of the run over that of one run of the compiled
    solver. `error` is nan without a reference. For a run that failed both `error` and `price` are nan.
    """

    family: str
    name: str
    verdict: Verdict
    error: float
    worst: str
    message: str
    wall_s: float
    price: float


def judge(family: str, draw: Draw, accuracy: float | None = None, timeout: float = 60.0) -> Finding:
    """Run a mechanism, with an accuracy or without, and compare the run with its reference."""
    begin, nan = perf_counter(), float("nan")
    name = draw.name + (f", accuracy {accuracy:g}" if accuracy else "")
    try:
        simulate(draw.mechanism, TRIAL * draw.duration, solver=Spectral())  # compiles the solver
        start = perf_counter()
        result = simulate(draw.mechanism, draw.duration, accuracy, timeout=timeout)  # with the solver chosen by default
        spent = perf_counter() - start
    except ValueError as refusal:  # KinematicsError among them
        message = "refused: " + " ".join(str(refusal).split())
        return Finding(family, name, Verdict.NAMED, nan, "", message, perf_counter() - begin, nan)
    error, worst, price = None, "", nan
    if result.status in ENDED:
        start = perf_counter()
        simulate(draw.mechanism, draw.duration, solver=Spectral(), timeout=PATIENCE)
        price = spent / (perf_counter() - start)
        longest_link = max(draw.mechanism.length(link.name) for link in draw.mechanism.links)
        # The allowed error of a place is `allowed` times its scale, but at least the accuracy times the longest link.
        scales = {kind: longest_link * max(1.0, (accuracy or 0.0) / KINDS[kind].allowed) for kind in ("place", "path")}
        if joints := clearances(draw.mechanism):
            scales["journal"] = min(joint.gap for joint in joints)
        if right := find_reference(draw, scales):
            measures = read(draw, result)
            error, worst = compare(measures, right, scales, reported_errors(result, measures))
    message = "" if result.status == Status.OK else f"{result.status}: {result.message}"
    verdict = decide(result.status, result.message, error)
    return Finding(family, name, verdict, nan if error is None else error, worst, message, perf_counter() - begin, price)


def read(draw: Draw, result: Result) -> Measures:
    """Read the measures of a run."""
    mechanism, duration = draw.mechanism, draw.duration
    if is_pressed(mechanism):
        late = result.time > 0.999 * result.time[-1]  # 10 ms of such a run of 10 s: many periods of axial vibration
        inertia = mechanism.guide("A").mass * np.gradient(result.signals["A.vx"], result.time)  # force on the guide's mass [N]
        return {"force of the push": np.array([np.mean((result.signals["drive.force"] - inertia)[late])])}
    kind = "journal" if clearances(mechanism) else "path" if mechanism.stops else "place"
    names = [f"{point}.{axis}" for point in mechanism.points for axis in "xy"]
    found: dict[str, Array] = {kind: np.stack([result.at(name, SAMPLES * duration, outside=np.nan) for name in names])}
    vectors: dict[str, list[Array]] = {}
    for name, owner in find_forces(result).items():
        vectors.setdefault(owner, []).append(result.signals[name])
    for owner, rows in vectors.items():
        parts = np.stack(rows)  # (components, times): a vector is one measure, so that its larger component is the scale
        found[f"force rms of {owner}"] = np.sqrt(np.trapezoid(parts**2, result.time) / np.ptp(result.time))
        found[f"force peak of {owner}"] = np.abs(parts).max(axis=1)
        if owner.endswith(("contact_force", "normal_force")):
            found[f"impulse of {owner}"] = np.trapezoid(parts, result.time)
    return found


def find_forces(result: Result) -> dict[str, str]:
    """Find the forces and torques that are compared, each with the vector (`group`) of which it is a component.

    A force X that vibrates has a moving average, the signal `X.mean` with the source X, which is compared in its place.
    """
    averaged = {trait.source for trait in result.traits.values()}
    return {
        name: (trait.group or name).removesuffix(".mean")
        for name, trait in result.traits.items()
        if trait.kind in FORCES and result.units[name] in ("N", "N m") and name not in averaged
    }


def reported_errors(result: Result, measures: Measures) -> dict[str, float]:
    """Collect the relative errors of places and forces that a run reports; infinite where it does not resolve vibrations."""
    found: dict[str, float] = {}
    for kind in {"place", "path"} & set(measures):
        places = [name for name, trait in result.traits.items() if trait.kind is SignalKind.PLACE and result.units[name] == "m"]
        errors = [result.error.absolute(name, Norm.PEAK) for name in places if (name, Norm.PEAK) in result.error]
        largest = np.nanmax(np.abs(measures[kind]))  # places after the end of the run are nan
        found[kind] = max(errors, default=0.0) / largest
    for name, owner in find_forces(result).items():
        is_unresolved = (result.traits[name].source or name) in result.error.unresolved
        for norm, kind in ((Norm.RMS, "force rms of"), (Norm.PEAK, "force peak of"), (Norm.IMPULSE, "impulse of")):
            measure, error = f"{kind} {owner}", np.inf if is_unresolved else result.error.get((name, norm), 0.0)
            found[measure] = max(found.get(measure, 0.0), error)
    return found


def find_reference(draw: Draw, scales: Mapping[str, float]) -> Measures | None:
    """Compute the measures by a closed form or by reference runs; None if no measure is certain."""
    if is_pressed(draw.mechanism):
        return {"force of the push": np.array([find_load(draw)])}
    mechanism = draw.mechanism
    is_pendulum = len(mechanism.links) == 1 and not (mechanism.loads or mechanism.guides or mechanism.stops)
    if is_pendulum:
        return {"place": swing(draw)}
    coarse, fine = (read_reference(draw, finer) for finer in (0, 1))
    if coarse is None or fine is None:
        return None
    until = len(SAMPLES)
    if clearances(draw.mechanism):
        joints = [replace(x, gap=(1 + CHANGE) * x.gap) if isinstance(x, Clearance) else x for x in draw.mechanism.joints]
        if (changed := read_reference(draw._replace(mechanism=replace(draw.mechanism, joints=joints)), 0)) is None:
            return None
        # The changed run has the steps of the coarse one: its difference from the fine run is that of steps and clearance.
        has_parted = np.abs(changed["journal"] - fine["journal"]).max(axis=0) > KINDS["journal"].allowed * scales["journal"]
        until = int(np.argmax(has_parted)) if has_parted.any() else until
    return dict(find_agreed(coarse, fine, scales, until)) or None


def find_agreed(coarse: Measures, fine: Measures, scales: Mapping[str, float], until: int) -> Iterator[tuple[str, Array]]:
    """Find the measures in which two reference runs agree: motions in the first `until` samples, forces if these are all."""
    largest_force = max((find_largest(value) for name, value in fine.items() if name.startswith("force")), default=0.0)
    for name, value in fine.items():
        is_motion = name in ("place", "path", "journal")
        is_small = name.startswith("force") and find_largest(value) < SMALL * largest_force
        if not is_motion and (until < len(SAMPLES) or is_small):
            continue
        part = slice(until) if is_motion else slice(None)
        first, second, kind = coarse[name][..., part], value[..., part], KINDS[name.split()[0]]
        scale = scales.get(name, max(find_largest(value), 1e-12))
        if second.shape[-1] and kind.norm(first - second) / scale <= AGREEMENT * kind.allowed:
            yield name, second


def read_reference(draw: Draw, finer: int) -> Measures | None:
    """Read the measures of a reference run; None if it fails."""
    result = run_reference(draw, finer)
    return None if result is None else read(draw, result)


def run_reference(draw: Draw, finer: int) -> Result | None:
    """Run the compiled solver, with finer steps and strips for `finer` = 1 than for 0; return None if it fails."""
    longest_step = draw.duration / 800  # 16 steps at least between two of `SAMPLES`
    if any(link.body.massless for link in draw.mechanism.links):  # the tolerance of places does not resolve axial vibration
        longest_step = min(longest_step, Scene.of(draw.mechanism).axial_period / RINGING)
    steps = Controlled(tolerance=1e-9 if finer else 1e-8, max_step=longest_step / 2**finer)
    solver = Spectral(steps, degree=9 + 3 * finer, contact_tolerance=1e-3 / 2**finer)
    try:
        simulate(draw.mechanism, TRIAL * draw.duration, solver=solver)  # compiles the solver
        result = simulate(draw.mechanism, draw.duration, solver=solver, timeout=PATIENCE)
    except (ValueError, NotImplementedError):
        return None
    return result if result.status in ENDED else None


def is_pressed(mechanism: Mechanism) -> bool:
    """Check if the mechanism is a straight column pressed by a drive, whose load is that of the elastica."""
    # Of all generators only that of the family "pressed straight" draws a link "strip" and a drive.
    return mechanism.links[0].name == "strip" and bool(mechanism.drives)


def find_load(draw: Draw) -> float:
    """Compute the load P_cr p(u)/pi^2 of a column at the end of its travel [N].

    u is the travel over the length less the axial strain at buckling, P_cr/(E A) = pi^2 h^2/(12 L^2), some 1e-6. After buckling
    that strain grows with p, as does u; this growth, a relative change of u by about 1e-6, is left out.
    """
    (strip,), pushed, length = draw.mechanism.links, draw.mechanism.drives[0].motion, draw.mechanism.length("strip")
    critical, axial = strip.body.section.euler_load(length), strip.body.section.axial_stiffness
    return critical / np.pi**2 * float(pinned.load(pushed.position(draw.duration) / length - critical / axial))


def swing(draw: Draw) -> Array:
    """Integrate the pendulum's equation with tolerance 1e-12; return x and y of both ends of the bar, (4, samples) [m]."""
    (bar,), (x, y) = draw.mechanism.links, draw.mechanism.points["A"]
    length, start = float(np.hypot(x, y)), float(np.arctan2(x, -y))
    mass, inertia, _ = bar.body.mass_properties(length)
    squared = mass * GRAVITY * length / 2 / (inertia + mass * length**2 / 4)  # square of the frequency of small motions
    settings = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-12, "t_eval": SAMPLES * draw.duration}
    run = solve_ivp(lambda _t, y: (y[1], -squared * np.sin(y[0])), (0, draw.duration), (start, 0.0), **settings)
    times, angle = run.t, run.y[0]
    return np.stack([0 * times, 0 * times, length * np.sin(angle), -length * np.cos(angle)])
