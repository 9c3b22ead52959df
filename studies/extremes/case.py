"""One case of the study `extremes`: a run, its reference, and the verdict.

Measures are the numbers of a run that are compared, such as places and force peaks. Their reference is a closed form, or two runs
of the compiled solver with different steps. In the second case only measures in which the two runs agree are compared. With
clearance a third run, whose clearance is larger by a thousandth, shows until when the motion is predictable.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from enum import StrEnum
from math import nan
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from buckler.elastica import pinned
from buckler.mbs import Controlled, Mechanism, Result, Spectral, Status, simulate
from buckler.mbs.elements.clearance import Clearance
from buckler.mbs.elements.signal import Kind as SignalKind
from buckler.mbs.geometry import Array
from buckler.mbs.record.errors import Norm
from buckler.mbs.scene.scene import Scene

from ..kit.drawn import Draw
from ..kit.published import GRAVITY

Measures = Mapping[str, Any]
"""Measures by name, each an array whose last axis may be that of `SAMPLES`."""
SAMPLES = np.linspace(0.02, 0.98, 49)
"""Times over the duration of the run at which places are compared."""
TRIAL = 1e-6
"""Part of the duration that is run to compile the solver: times and time limits then do not include the compilation."""
PATIENCE = 30.0
"""Time limit of a reference run [s]."""
ENDED = (Status.OK, Status.SUSPECT)
"""Status of runs whose numbers are compared."""


class Verdict(StrEnum):
    """Verdict on a run by its status and its comparison with a reference.

    RIGHT: the status is OK, and no error is above the allowed one. SILENT: the status is OK, but an error is too large.
    NO_REFERENCE: the status is OK, and nothing could be compared. FALSE_ALARM: the status is SUSPECT by a check other than
    PENETRATION and LINEAR, though all errors are allowed. NAMED: any other run that is refused, fails, is late or suspect.
    """

    RIGHT = "right"
    NAMED = "named"
    FALSE_ALARM = "false alarm"
    SILENT = "silent"
    NO_REFERENCE = "no reference"


def decide(status: str, message: str, error: float | None) -> Verdict:
    """Decide on a run by its status, its message, and its error over the allowed one, None without a reference."""
    is_allowed = error is not None and error <= 1.0
    if status == Status.OK:
        return Verdict.NO_REFERENCE if error is None else Verdict.RIGHT if is_allowed else Verdict.SILENT
    checks = set(re.findall(r"(?:^|; )([A-Z]+): ", message))  # a message is "CHECK: text; CHECK: text"
    # These two find a law used beyond its range, which a reference with the same law cannot refute.
    is_beyond_model = checks and checks <= {"PENETRATION", "LINEAR"}
    return Verdict.FALSE_ALARM if status == Status.SUSPECT and is_allowed and not is_beyond_model else Verdict.NAMED


ALLOWED = {"force": 0.05, "impulse": 0.05, "place": 1e-3, "path": 5e-3, "journal": 0.1}
"""Largest allowed errors of measures over their scales, by the kind: the first word of a name, as in `force peak of B`.

Contact laws give forces and impulses to 5 % at best. A `place` is relative to the longest link: 1e-3 is visible in a drawing. A
`path` has the places in a motion with impacts: a restitution wrong by 5 % moves them by 5e-3 of the longest link. A `journal` is
a place relative to the clearance: at a root mean square of 0.1 its side in the bush is right.
"""


def find_largest(values: Array) -> float:
    """Find the largest magnitude."""
    return float(np.abs(values).max())


def compute_norm(kind: str, error: Array) -> float:
    """Compute the norm of an error: for a journal the largest root mean square over time, else the largest magnitude."""
    return float(np.sqrt((error**2).mean(axis=-1)).max()) if kind == "journal" else find_largest(error)


def compare(found: Measures, right: Measures, scales: Mapping[str, float], reported: Mapping[str, float]) -> tuple[float, str]:
    """Find the largest error of all measures over the allowed one, and the name of its measure.

    The default scale of a measure is the largest value of the reference. An error is also allowed up to the one that the run
    reports in `reported`, relative to the largest value of the run: a run that reports an infinite error claims nothing.
    """
    errors = {}
    for name, value in right.items():
        kind, ours = name.split()[0], np.asarray(found[name])
        allowed = ALLOWED[kind] * max(scales.get(name, find_largest(value)), 1e-12)  # positive where the reference is 0
        allowed = max(allowed, reported.get(name, 0.0) * find_largest(ours))
        error = compute_norm(kind, ours[..., : np.shape(value)[-1]] - value)  # a reference may end where predictability does
        errors[name] = float(np.nan_to_num(error / allowed, nan=np.inf))
    worst = max(errors, key=lambda name: errors[name])
    return errors[worst], worst


class Finding(NamedTuple):
    """Verdict on a case; numbers that are not known are nan."""

    family: str
    name: str
    verdict: Verdict
    error: float  # largest error over the allowed one
    worst: str  # measure with this error
    message: str  # of the run
    wall_s: float  # time of the run and its references [s]
    price: float  # time of the run over that of one run of the compiled solver


def judge(family: str, draw: Draw, accuracy: float | None, timeout: float) -> Finding:
    """Run a mechanism, with an accuracy or without, and compare the run with its reference."""
    begin = perf_counter()
    name = draw.name + (f", accuracy {accuracy:g}" if accuracy else "")
    try:
        simulate(draw.mechanism, TRIAL * draw.duration, solver=Spectral())  # compiles the solver
        start = perf_counter()
        result = simulate(draw.mechanism, draw.duration, accuracy, timeout=timeout)  # with the solver chosen by default
        spent = perf_counter() - start
    except ValueError as refusal:  # KinematicsError among them
        message = "refused: " + " ".join(str(refusal).split())
        return Finding(family, name, Verdict.NAMED, nan, "", message, perf_counter() - begin, nan)
    error, worst, price = None, "", nan  # None: nothing is compared
    if result.status in ENDED:
        start = perf_counter()
        simulate(draw.mechanism, draw.duration, solver=Spectral(), timeout=PATIENCE)
        price = spent / (perf_counter() - start)
        longest_link = max(draw.mechanism.length(link.name) for link in draw.mechanism.links)
        # The allowed error of a place is `ALLOWED` times its scale: the accuracy times the longest link, if that is more.
        scales = {kind: longest_link * max(1.0, (accuracy or 0.0) / ALLOWED[kind]) for kind in ("place", "path")}
        if joints := Scene.of(draw.mechanism).clearances:
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
        # The drive at the end A accelerates the mass in the guide and presses the strip.
        inertia = mechanism.guide("A").mass * np.gradient(result.signals["A.vx"], result.time)  # mass times acceleration [N]
        return {"force of the push": np.array([np.mean((result.signals["drive.force"] - inertia)[late])])}
    kind = "journal" if Scene.of(mechanism).clearances else "path" if mechanism.stops else "place"
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

    A force X that vibrates also has a moving average, the signal `X.mean` with the `source` X. Then only the average is compared.
    """
    kinds = (SignalKind.REACTION, SignalKind.CONTACT, SignalKind.INTERNAL)
    averaged = {trait.source for trait in result.traits.values()}
    return {
        name: (trait.group or name).removesuffix(".mean")
        for name, trait in result.traits.items()
        if trait.kind in kinds and result.units[name] in ("N", "N m") and name not in averaged
    }


def reported_errors(result: Result, measures: Measures) -> dict[str, float]:
    """Collect the relative errors of places and forces that a run reports; infinite where it does not resolve vibrations."""
    found: dict[str, float] = {}
    places = [name for name, trait in result.traits.items() if trait.kind is SignalKind.PLACE and result.units[name] == "m"]
    for kind in {"place", "path"} & set(measures):
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
    coarse, fine = (read_reference(draw, finer) for finer in (False, True))
    if coarse is None or fine is None:
        return None
    until = len(SAMPLES)
    if Scene.of(mechanism).clearances:
        joints = [replace(x, gap=1.001 * x.gap) if isinstance(x, Clearance) else x for x in mechanism.joints]
        changed = read_reference(draw._replace(mechanism=replace(mechanism, joints=joints)), False)
        if changed is None:
            return None
        # The changed run has the steps of the coarse one, so it parts from the fine run by steps and clearance together.
        has_parted = np.abs(changed["journal"] - fine["journal"]).max(axis=0) > ALLOWED["journal"] * scales["journal"]
        until = int(np.argmax(has_parted)) if has_parted.any() else until
    return dict(find_agreed(coarse, fine, scales, until)) or None


def find_agreed(coarse: Measures, fine: Measures, scales: Mapping[str, float], until: int) -> Iterator[tuple[str, Array]]:
    """Find the measures in which two reference runs agree: motions in the first `until` samples, forces if these are all."""
    largest_force = max((find_largest(value) for name, value in fine.items() if name.startswith("force")), default=0.0)
    for name, value in fine.items():
        is_motion = name in ("place", "path", "journal")
        is_small = name.startswith("force") and find_largest(value) < 0.02 * largest_force  # by convention
        if not is_motion and (until < len(SAMPLES) or is_small):
            continue
        part = slice(until) if is_motion else slice(None)
        first, second, kind = coarse[name][..., part], value[..., part], name.split()[0]
        scale = scales.get(name, max(find_largest(value), 1e-12))
        if second.shape[-1] and compute_norm(kind, first - second) / scale <= 0.3 * ALLOWED[kind]:  # by convention
            yield name, second


def read_reference(draw: Draw, finer: bool) -> Measures | None:
    """Read the measures of a reference run; None if it fails."""
    result = run_reference(draw, finer)
    return None if result is None else read(draw, result)


def run_reference(draw: Draw, finer: bool) -> Result | None:
    """Run the compiled solver, on request with finer steps and strips; return None if it fails."""
    longest_step = draw.duration / 800  # 16 steps at least between two of `SAMPLES`
    if any(link.body.massless for link in draw.mechanism.links):  # the tolerance of places does not resolve axial vibration
        longest_step = min(longest_step, Scene.of(draw.mechanism).axial_period / 12)  # twelve steps, chosen
    if finer:  # all settings are chosen
        solver = Spectral(Controlled(tolerance=1e-9, max_step=longest_step / 2), degree=12, contact_tolerance=5e-4)
    else:
        solver = Spectral(Controlled(tolerance=1e-8, max_step=longest_step), degree=9, contact_tolerance=1e-3)
    try:
        simulate(draw.mechanism, TRIAL * draw.duration, solver=solver)  # compiles the solver
        result = simulate(draw.mechanism, draw.duration, solver=solver, timeout=PATIENCE)
    except (ValueError, NotImplementedError):
        return None
    return result if result.status in ENDED else None


def is_pressed(mechanism: Mechanism) -> bool:
    """Check if the mechanism is a straight column pressed by a drive, whose load is that of the elastica."""
    # A mechanism from a file has no family. Of all families only "pressed straight" has a first link `strip` and a drive.
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
    angle = solve_ivp(lambda _t, y: (y[1], -squared * np.sin(y[0])), (0, draw.duration), (start, 0.0), **settings).y[0]
    return np.stack([0 * angle, 0 * angle, length * np.sin(angle), -length * np.cos(angle)])
