"""Scenes of the accuracy study: drawn at random, each with a reference that does not come from an accuracy asked for.

The slider-cranks are held against the compiled solver (flexible), loop closure (rigid) and an equation of motion (strut), the
crank-rockers with clearance against the compiled solver. Where these are not enough, a run of far more steps and
elements must do: of couplers that buckle, of beams with clearance, and of flexible couplers beyond `AXIAL_WAVES`. Mechanisms of
the whole grammar are held against the compiled solver, where two of its runs, one finer than the other, agree.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import ceil, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from buckler.mbs import (
    Beam,
    Cable,
    Controlled,
    Equal,
    Exudyn,
    Mechanism,
    Modal,
    Ramp,
    Result,
    Rigid,
    Section,
    Spectral,
    Status,
    Strut,
    simulate,
    slider_crank,
)
from buckler.mbs.accuracy.aim import MOTION, Aim
from buckler.mbs.accuracy.band import banded
from buckler.mbs.accuracy.difference import difference
from buckler.mbs.accuracy.predictable import PREDICTABLE
from buckler.mbs.kinematics.slidercrank import SliderCrank
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.library import PAPER, PAPER_STOP
from buckler.studies.kit.published import STRIP_WIDTH
from buckler.studies.trust.two_solvers_scenes import FAMILIES

Array = np.ndarray[Any, Any]
Draw = np.random.Generator
STOP_STIFFNESS = 1e5
"""Of the stops, N/m, with critical damping."""
SAMPLES = 2001
SPECTRAL = 1e-8
"""Tolerance of the compiled solver's runs: they err by 1e-4."""
TIGHT_STEP = 0.3
"""Steps of a reference of second order, times the first bending frequency, rad, for an accuracy of 1: errs by its tenth."""
AXIAL_WAVES, AXIAL_STEP = 5e-4, 0.04
"""Accuracy below which the compiled solver at `SPECTRAL` is not enough of a reference, but a run of steps that resolve
axial vibration, these times its frequency, rad, on 16 elements."""
FINE = 1e-5
"""Tolerance of the finer of two reference runs, of the accuracy asked for; within 1e-10 and 1e-8."""
AGREED = 0.3
"""Difference of two reference runs, of the accuracy asked for, up to which they are one truth."""
PATIENCE = 60.0
"""Longest time, s, of a reference run."""


class DrawnCase(NamedTuple):
    """A mechanism, how long it is run, s, the error of a result, nan without a reference, and what an accuracy is asked of."""

    mechanism: Mechanism
    duration: float
    error: Callable[[Result], float]
    aim: Aim = MOTION


def _against(time: Array, **signals: Array) -> Callable[[Result], float]:
    """Error against signals known otherwise, in the measure of `mbs.accuracy.difference`; names with `__` for their dot."""
    named = {name.replace("__", "."): values for name, values in signals.items()}
    reference = Result(Status.OK, "", time, named, {}, {})
    return lambda result: difference(result, reference)


def _slider(x: Array) -> dict[str, Array]:
    """Signals of the slider that tell its place."""
    return {"B__x": x, "B__y": 0 * x, "B__vx": 0 * x, "B__vy": 0 * x}


# --- without clearance -----------------------------------------------------------------------------------------------------


def _bending(draw: Draw) -> tuple[Section, float, float]:
    """Section, mass and speed: the slider's inertia takes 2 to 30 % of the load at which the coupler buckles.

    Damping, 0.3 to 3 % in the first mode, keeps axial vibration, which nobody resolves, from exciting high modes.
    """
    section = Section(STRIP_WIDTH, draw.uniform(1.5e-3, 3e-3)).damped(10 ** draw.uniform(-2.5, -1.5), PAPER.coupler)
    mass, share = draw.uniform(0.1, 0.5), draw.uniform(0.02, 0.3)
    return section, mass, sqrt(share * section.euler_load(PAPER.coupler) / (mass * PAPER.crank))


def smooth(draw: Draw, asked: float) -> DrawnCase:
    """Slider-crank with a bending coupler, no stop, a third of a turn to a turn."""
    section, mass, speed = _bending(draw)
    return _smooth(section, mass, speed, draw.uniform(0.33, 1.0) * 2 * pi / speed, asked)


def ramp(draw: Draw, asked: float) -> DrawnCase:
    """The same from rest, its speed rising over half the run."""
    section, mass, speed = _bending(draw)
    duration = draw.uniform(0.5, 1.2) * 2 * pi / speed
    return _smooth(section, mass, Ramp(0.0, speed, duration / 2), duration, asked)


def _smooth(section: Section, mass: float, speed: float | Ramp, duration: float, asked: float) -> DrawnCase:
    mechanism = slider_crank(Cable(section), law=None, mass=mass, speed=speed)
    if asked < AXIAL_WAVES:
        fine = slider_crank(Cable(section, 16), law=None, mass=mass, speed=speed)
        steps = ceil(duration * sqrt(section.axial_stiffness / (PAPER.coupler * mass)) / AXIAL_STEP)
        tight = simulate(fine, duration, solver=Exudyn(Equal(steps, record_every=8), spectral_radius=0.95))
        return DrawnCase(mechanism, duration, lambda result: difference(result, tight))
    strip = simulate(mechanism, duration, solver=Spectral(Controlled(SPECTRAL), degree=11), timeout=300)
    return DrawnCase(mechanism, duration, lambda result: difference(result, strip))


def rigid(draw: Draw, asked: float) -> DrawnCase:
    """Slider-crank of rigid links, of any lengths, one or two turns."""
    lengths = SliderCrank(draw.uniform(0.05, 0.2), draw.uniform(0.25, 0.6))
    speed, body = draw.uniform(1.0, 100.0), Rigid(Section(STRIP_WIDTH, 5e-3))
    mechanism = slider_crank(body, law=None, mass=draw.uniform(0.1, 1.0), speed=speed, lengths=lengths)
    time = np.linspace(0.0, draw.uniform(1.0, 2.0) * 2 * pi / speed, SAMPLES)
    return DrawnCase(mechanism, float(time[-1]), _against(time, **_slider(lengths.slider(speed * time))))


def _striking(draw: Draw) -> tuple[Section, float, float, KelvinVoigt]:
    """Section, mass, speed and stop of a slider-crank that buckles."""
    section, mass = Section(STRIP_WIDTH, draw.uniform(2e-4, 5e-4)), draw.uniform(0.2, 0.5)
    return section, mass, draw.uniform(2.0, 6.0), KelvinVoigt(STOP_STIFFNESS, 2 * sqrt(STOP_STIFFNESS * mass))


def buckling(draw: Draw, asked: float) -> DrawnCase:
    """Slider-crank whose damped, bowed coupler buckles while its slider is on the stop; it ends pressed, or after release.

    The reference has other elements, twice as many, and many more steps, none of them extrapolated.
    """
    section, mass, speed, law = _striking(draw)
    section, bow = section.damped(0.02, PAPER.coupler), PAPER.coupler / draw.uniform(200.0, 1000.0)
    duration = draw.uniform(0.4, 0.75) * 2 * pi / speed
    mechanism, reference = (
        slider_crank(body, law=law, mass=mass, speed=speed)
        for body in (Cable(section, imperfection=bow), Beam(section, 16, imperfection=bow))
    )
    steps = section.first_frequency(PAPER.coupler) * duration / (TIGHT_STEP * sqrt(asked))
    solver = Exudyn(Controlled(tolerance=1e-7, max_step=duration / steps, contact_resolution=1000), spectral_radius=0.9)
    tight = simulate(reference, duration, solver=solver)
    return DrawnCase(mechanism, duration, lambda result: difference(result, tight))


def strut(draw: Draw, asked: float) -> DrawnCase:
    """The same with a massless strut for its coupler, against the equation of motion of its slider."""
    section, mass, speed, law = _striking(draw)
    body = Strut(section)
    mechanism = slider_crank(body, law=law, mass=mass, speed=speed)
    time, length = np.linspace(0.0, draw.uniform(0.4, 0.75) * 2 * pi / speed, SAMPLES), PAPER.coupler
    unit, rigidity = section.bending_stiffness / length**2, section.axial_stiffness / length
    euler = section.euler_load(length)

    def rates(t: float, y: Array) -> Array:
        x, v = y
        span = np.hypot(PAPER.crank * np.cos(speed * t) - x, PAPER.crank * np.sin(speed * t))
        short = length - span
        push = (
            rigidity * short
            if rigidity * short < euler
            else unit * float(body.load(short / length - euler / section.axial_stiffness))
        )
        depth = PAPER_STOP - x
        stop = float(law.force(depth, -v, 1.0)) if depth > 0 else 0.0
        return np.array([v, (push * (x - PAPER.crank * np.cos(speed * t)) / span + stop) / mass])

    start = np.array([float(PAPER.slider(0.0)), 0.0])
    found = solve_ivp(rates, (0.0, time[-1]), start, method="DOP853", t_eval=time, rtol=1e-9, atol=1e-12, max_step=time[-1] / 500)
    return DrawnCase(mechanism, float(time[-1]), _against(time, **_slider(found.y[0])))


# --- with clearance --------------------------------------------------------------------------------------------------------


def _play(draw: Draw, rocker: str) -> tuple[Mechanism, Any]:
    """Crank-rocker with four rattling joints, and its parameters."""
    from buckler.studies.rattling.clearance import CrankRockerParameters

    p = CrankRockerParameters(
        clearance=10 ** draw.uniform(-4.0, -3.3), start_angle=draw.uniform(-pi, pi), speed=draw.uniform(15.0, 45.0)
    )
    return p.mechanism(rocker), p


def _compiled(p: Any, mechanism: Mechanism, modes: Any) -> Callable[[Result], float]:
    """Distance of the bars' centres from those of the compiled solver, over the clearance, L2 over the compared time."""
    from buckler.studies.rattling.linkage import FourBar
    from buckler.studies.rattling.turns import simulate as compiled

    start = p.start_angle + _offset(mechanism, p)
    bar = FourBar(modes=modes, law=p.law, friction=p.friction, gap=p.clearance, pin=p.pin, speed=p.speed, start=start)
    run = compiled(bar, PREDICTABLE, tolerance=1e-11, samples=SAMPLES)
    centres = {"coupler": 2, "rocker": 5}

    def error(result: Result) -> float:
        off = [
            result.at(f"{name}.{axis}", run.time, outside=np.nan) - run.q[:, k + i]
            for name, k in centres.items()
            for i, axis in enumerate("xy")
        ]
        squares = np.mean(np.square(off), axis=1).reshape(2, 2).sum(axis=1)
        return float(np.sqrt(squares.max())) / p.clearance

    return error


def _offset(mechanism: Mechanism, p: Any) -> float:
    """Chance offset of a crank-rocker's start, rad."""
    x, y = mechanism.points["A"]
    return float((np.arctan2(y, x) - p.start_angle + pi) % (2 * pi) - pi)


def rigid_play(draw: Draw, asked: float) -> DrawnCase:
    """Crank-rocker with clearance, of rigid bars."""
    mechanism, p = _play(draw, "rigid")
    return DrawnCase(mechanism, PREDICTABLE, _compiled(p, mechanism, None))


def modal_play(draw: Draw, asked: float) -> DrawnCase:
    """Crank-rocker with clearance, its rocker of modes; the reference takes the same."""
    mechanism, p = _play(draw, "modal")
    body = mechanism.link("rocker").body
    assert isinstance(body, Modal)
    return DrawnCase(mechanism, PREDICTABLE, _compiled(p, mechanism, body))


def beam_play(draw: Draw, asked: float) -> DrawnCase:
    """Crank-rocker with clearance, its rocker a beam: against a run of a far smaller tolerance."""
    mechanism, _ = _play(draw, "beam")
    tight = simulate(
        mechanism, PREDICTABLE, solver=Exudyn(Controlled(tolerance=1e-5 * asked, max_step=1e-5), spectral_radius=0.95)
    )
    return DrawnCase(mechanism, PREDICTABLE, lambda result: difference(result, tight))


# --- anything --------------------------------------------------------------------------------------------------------------


def grammar(draw: Draw, asked: float) -> DrawnCase:
    """A mechanism of any family of the study of two solvers."""
    return _anything(draw, asked, Aim("places"))


def forces(draw: Draw, asked: float) -> DrawnCase:
    """The same, its forces asked for."""
    return _anything(draw, asked, Aim("forces"))


def _anything(draw: Draw, asked: float, aim: Aim) -> DrawnCase:
    family = list(FAMILIES.values())[int(draw.integers(len(FAMILIES)))]
    mechanism, duration = family(draw)
    tolerance = float(np.clip(FINE * asked, 1e-10, 1e-8))
    coarse, fine = (
        simulate(mechanism, duration, solver=Spectral(Controlled(times * tolerance, max_step=longest), degree), timeout=PATIENCE)
        for times, longest, degree in ((10.0, duration / 400, 9), (1.0, duration / 800, 12))
    )
    coarse, fine = (  # as an accuracy gives them
        replace(each, signals=each.signals | banded(mechanism, each.time, each.signals, each.units)) for each in (coarse, fine)
    )
    known = aim.apart(coarse, fine) <= AGREED * asked
    return DrawnCase(mechanism, duration, lambda result: aim.apart(result, fine) if known else float("nan"), aim)


SCENES: dict[str, Callable[[Draw, float], DrawnCase]] = {
    "smooth": smooth,
    "ramp": ramp,
    "rigid": rigid,
    "buckling": buckling,
    "strut": strut,
    "rigid clearance": rigid_play,
    "modal clearance": modal_play,
    "beam clearance": beam_play,
    "grammar": grammar,
    "forces": forces,
}
"""How the case of each scene is drawn."""
