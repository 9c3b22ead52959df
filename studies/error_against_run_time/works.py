"""Works of the study, see `work`: mechanisms, settings of each series, and references.

A reference shares no code with the runs that are compared with it. For loads of the buckled strip it is the boundary value
problem of the element's theory, for a chain of bars the solution of Lagrange's equations. Other motions have no exact solution:
runs of the compiled solver are compared with a fine run of the engine, and vice versa. Whether these are fine enough is part of
the result, as the difference of the two.

The series are `engine` (set by hand), `once` (one run of the compiled solver; statics of Buckler's beams for the buckled strip)
and `known` (runs that report an error estimate and are asked for an accuracy, given to `accurate_runs`).
`hand` and `once` list the settings of these series from coarse to fine, `fine` has those of the two references. Settings and
accuracies are chosen for each work. `tuned` is the setting of `engine` with whose time other times are compared.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from math import pi, sqrt

import numpy as np
from scipy.integrate import solve_ivp

from buckler import mbs
from buckler.elastica.rod import Rod
from buckler.mbs import engine
from buckler.mbs.elements.element import Body
from buckler.mbs.geometry import Array
from buckler.mbs.laws import AdamsFriction, KelvinVoigt
from buckler.mbs.library import BAR, PAPER, RATTLING, STEEL_CRANK_ROCKER
from buckler.mbs.modal import BarModes

from ..kit.published import GRAVITY, STRIP_WIDTH
from . import work
from .work import ENGINE, KNOWN, ONCE, AdaptiveSetting, ComparedMotion, HandSetting, Runs, Work

SHORTENINGS = np.concatenate([[1e-3], np.linspace(0.05, 0.95, 19)])
"""End shortenings over length at which loads of the strip are compared."""
STRIP = mbs.Section(STRIP_WIDTH, 3e-4)
"""Section of the strip that buckles."""
MASS = 0.3
"""Mass of the slider [kg]."""


def strip() -> Work:
    """Define the work of static loads of the buckled strip. Beams and cables extend; only the beams, Buckler's, shear."""
    unit = STRIP.bending_stiffness / PAPER.coupler**2

    def exact(shear: float) -> Array:
        """Compute the loads P L^2/(E I) of a rod with this shear stiffness over E I/L^2."""
        return np.array([Rod(STRIP.axial_stiffness / unit, shear).at_shortening(u).load for u in SHORTENINGS])

    def run_cable(elements: int) -> Array:
        """Compute the loads P L^2/(E I) of hand-written cables."""
        from . import plain  # loads Exudyn

        return plain.buckled_strip(STRIP, PAPER.coupler, SHORTENINGS, elements) / unit

    runs: Runs = {(ENGINE, f"{n}"): partial(run_cable, n) for n in (16, 32, 64)}
    beams = {f"{n}": mbs.Beam(STRIP, n) for n in (8, 16, 32, 64)}  # on Exudyn; loads are P L^2/(E I)
    runs |= {(ONCE, n): partial(engine.pinned_strip, beam, PAPER.coupler, SHORTENINGS) for n, beam in beams.items()}
    references = {ENGINE: cache(partial(exact, np.inf)), ONCE: cache(partial(exact, STRIP.shear_stiffness / unit))}
    about, measure = "buckled strip, 20 end shortenings", "largest error of the load [1]"
    return Work(about, measure, runs, tuned="64", references=references, largest=True)  # error: the largest relative one


def slider_work(
    about: str, build: Callable[[Body], mbs.Mechanism], beam: mbs.Beam, *, hand: Sequence[HandSetting],
    once: Sequence[AdaptiveSetting], fine: tuple[HandSetting, AdaptiveSetting], tuned: str,
) -> Work:  # fmt: skip
    """Define a work of the deflection of the coupler's middle from its chord over a turn; only Buckler's beam shears."""
    mechanism = build(beam)
    speed = mechanism.drives[0].speed
    assert isinstance(speed, int | float)
    motion = ComparedMotion(mechanism, 2 * pi / speed, ("coupler.deflection",))

    def run_engine(setting: HandSetting) -> Array:
        """Compute the deflection [m], (times, 1)."""
        from . import plain  # loads Exudyn

        cable = mbs.Cable(beam.section, setting.elements, imperfection=beam.imperfection)
        return plain.slider_crank(build(cable), motion.times, setting.steps, setting.relative, setting.absolute)[:, None]

    runs = work.engine_runs(run_engine, hand) | motion.compiled_runs(*once) | motion.accurate_runs(1e-3, 1e-4)
    references = work.cross_references(partial(run_engine, fine[0]), partial(motion.run_compiled, *fine[1]))
    return Work(about, "error of the deflection [1]", runs, tuned, references, motion=motion)


def smooth() -> Work:
    """Define the work of a slider-crank at 600 r/min without a stop: its coupler bends by its inertia, and vibrates."""
    return slider_work(
        "slider-crank, coupler of 2 mm, 62.8 rad/s", partial(mbs.slider_crank, law=None, mass=MASS, speed=62.8),
        mbs.Beam(mbs.Section(STRIP_WIDTH, 2e-3), imperfection=0.0),
        hand=[HandSetting(4, 400, 1e-5, 1e-8), HandSetting(4, 800, 1e-5, 1e-8), HandSetting(8, 3200, 1e-6, 1e-9)],
        once=[AdaptiveSetting(1e-3, 5), AdaptiveSetting(1e-4, 5), AdaptiveSetting(1e-5, 6)],
        fine=(HandSetting(16, 25_600, 1e-8, 1e-10), AdaptiveSetting(1e-10, 12)), tuned="4 x 800",
    )  # fmt: skip


def stop() -> Work:
    """Define the work of a slider-crank that strikes its stop, buckles its coupler, and leaves the stop."""
    stiffness = 1e5  # [N/m]; with the slider the stop is damped critically
    law = KelvinVoigt(stiffness, 2 * sqrt(stiffness * MASS))
    return slider_work(
        "slider-crank on its stop, coupler of 0.3 mm, 1.25 rad/s", partial(mbs.slider_crank, law=law, mass=MASS, speed=1.25),
        mbs.Beam(STRIP.damped(ratio=0.01, length=PAPER.coupler), imperfection=PAPER.coupler / 1000),
        hand=[HandSetting(8, steps, 1e-6, 1e-6) for steps in (5000, 10_000, 40_000)],
        once=[AdaptiveSetting(1e-4, 8), AdaptiveSetting(1e-5, 8), AdaptiveSetting(3e-6, 9)],
        fine=(HandSetting(16, 80_000, 1e-7, 1e-7), AdaptiveSetting(1e-8, 12)), tuned="8 x 10000",
    )  # fmt: skip


def chain_work(
    kind: str, *, hand: Sequence[HandSetting], once: Sequence[AdaptiveSetting],
    fine: tuple[HandSetting, AdaptiveSetting] | None, tuned: str,
) -> Work:  # fmt: skip
    """Define the work of a chain released from the horizontal: path of the last bar's centre, or of the last strip's end."""
    bars, count = kind == "bars", 16

    def build(elements: int | None = None) -> mbs.Mechanism:
        """Make the chain; only strips have elements."""
        body = mbs.Rigid(mbs.Section(0.020, 0.005)) if bars else mbs.Cable(mbs.Section(0.010, 0.0005), elements=elements)
        points = {f"P{k}": (0.1 * k, 0.0) for k in range(count + 1)}  # links of 0.1 m
        links = [mbs.Link(f"link{k}", f"P{k}", f"P{k + 1}", body) for k in range(count)]
        joints = [mbs.Revolute(f"P{k}", f"link{k - 1}" if k else "ground", f"link{k}") for k in range(count)]
        return mbs.Mechanism(points, links, joints, gravity=(0.0, -GRAVITY))

    point = f"link{count - 1}" if bars else f"P{count}"
    motion = ComparedMotion(build(), duration=0.2, signals=(f"{point}.x", f"{point}.y"))

    def run_engine(setting: HandSetting) -> Array:
        """Compute the path [m], (times, 2)."""
        from . import plain  # loads Exudyn

        return plain.chain(build(setting.elements), motion.times, setting.steps, setting.relative, setting.absolute)

    runs = work.engine_runs(run_engine, hand) | motion.compiled_runs(*once) | motion.accurate_runs(1e-3, 1e-5)
    if fine:
        references = work.cross_references(partial(run_engine, fine[0]), partial(motion.run_compiled, *fine[1]))
    else:  # by Lagrange's equations
        references = dict.fromkeys((ENGINE, ONCE, KNOWN), cache(partial(pendulum, motion.mechanism, motion.times)))
    return Work(f"chain of {count} {kind}", "error of its end's path [1]", runs, tuned, references, motion=motion)


def pendulum(mechanism: mbs.Mechanism, times: Array) -> Array:
    """Integrate Lagrange's equations of a chain of n bars in their angles; return the centre of the last bar, (times, 2) [m].

    The bars have angles q_k, mass m, length a and inertia J about their centres. With c_kl = m a^2 min(b_k, b_l) and
    b_k = n - k - 1/2, k from 0:

        sum_l c_kl cos(q_k-q_l) q_l'' + (J - m a^2/4) q_k'' = -sum_l c_kl sin(q_k-q_l) q_l'^2 - m g a b_k cos(q_k).

    The bar k moves its own centre by a/2 and the b_k - 1/2 bars behind it by a. So its inertia is J + m a^2 (b_k - 1/4), of which
    c_kk is m a^2 b_k.
    """
    n, body, a = len(mechanism.links), mechanism.links[0].body, mechanism.length("link0")
    assert isinstance(body, mbs.Rigid)
    m, inertia, _ = body.mass_properties(a)
    b = n - 0.5 - np.arange(n)
    coupling, diagonal = m * a**2 * np.minimum.outer(b, b), (inertia - m * a**2 / 4) * np.eye(n)

    def rates(_t: float, state: Array) -> Array:
        """Compute the rates of angles and angular velocities."""
        angle, rate = state[:n], state[n:]
        difference = np.subtract.outer(angle, angle)
        right = -(coupling * np.sin(difference)) @ rate**2 - GRAVITY * m * a * b * np.cos(angle)
        return np.concatenate([rate, np.linalg.solve(coupling * np.cos(difference) + diagonal, right)])

    found = solve_ivp(rates, (0.0, times[-1]), np.zeros(2 * n), "DOP853", times, rtol=1e-11, atol=1e-11)
    lengths = np.where(np.arange(n) < n - 1, a, a / 2)  # up to the centre of the last bar
    return np.stack([lengths @ np.cos(found.y[:n]), lengths @ np.sin(found.y[:n])], axis=1)


def rattling(
    rocker: str, *, hand: Sequence[AdaptiveSetting], once: Sequence[AdaptiveSetting],
    fine: tuple[AdaptiveSetting, AdaptiveSetting], tuned: str,
) -> Work:  # fmt: skip
    """Define the work of a crank-rocker with clearance in all joints: paths of the centres of two bars, over the clearance.

    It runs for 10 ms, because the motion is chaotic after that. The series `engine` has Buckler's runs on Exudyn, with elements
    and tolerance set by hand. Clearance, contact law and friction are the published ones.
    """
    gap, friction = 2.5e-4, AdamsFriction(static=0.3, dynamic=0.1)  # the radial clearance in m
    play = partial(mbs.Clearance, pin=5e-3, gap=gap, law=RATTLING, friction=friction)

    def build(elements: int | None = None) -> mbs.Mechanism:
        """Make the crank-rocker, at 300 r/min; only a beam has elements."""
        damped = BAR.damped(ratio=0.01, length=STEEL_CRANK_ROCKER.rocker)
        modal = mbs.Modal(BAR, BarModes(bending=2, axial=1), damping=0.01)
        bodies: dict[str, Body] = {"rigid": mbs.Rigid(BAR), "beam": mbs.Beam(damped, elements=elements), "modal": modal}
        return mbs.crank_rocker(bodies[rocker], speed=10 * pi, play=play, angle=0.0)

    motion = ComparedMotion(build(), 0.01, tuple(f"{link}.{axis}" for link in ("coupler", "rocker") for axis in "xy"))

    def run_engine(tolerance: float, elements: int) -> Array:
        """Compute the paths [m], (times, 4)."""
        solver = mbs.Exudyn(mbs.Controlled(tolerance, max_steps=work.STEPS))  # fine runs take more steps than the default
        return replace(motion, mechanism=build(elements or None)).simulate(solver=solver)

    runs: Runs = {(ENGINE, setting.name): partial(run_engine, *setting) for setting in hand}
    runs |= motion.compiled_runs(*once) | motion.accurate_runs(1e-2, 1e-3)
    references = work.cross_references(partial(run_engine, *fine[0]), partial(motion.run_compiled, *fine[1]))
    about, measure = f"rattling crank-rocker, {rocker} rocker", "error of two bars' paths [clearances]"
    return Work(about, measure, runs, tuned, references, scale=gap, motion=motion)


WORKS: Mapping[str, Callable[[], Work]] = {
    "strip": strip,
    "smooth": smooth,
    "stop": stop,
    "rigid": partial(
        rattling, "rigid", hand=[AdaptiveSetting(tolerance) for tolerance in (1e-2, 1e-3, 1e-4)],
        once=[AdaptiveSetting(tolerance) for tolerance in (1e-5, 1e-6, 1e-7)],
        fine=(AdaptiveSetting(1e-6), AdaptiveSetting(1e-11)), tuned="1e-3",
    ),
    "beam": partial(
        rattling, "beam", hand=[AdaptiveSetting(1e-2, 4), AdaptiveSetting(1e-3, 4), AdaptiveSetting(1e-4, 8)],
        once=[AdaptiveSetting(1e-5, 4), AdaptiveSetting(1e-6, 5), AdaptiveSetting(1e-7, 6)],
        fine=(AdaptiveSetting(1e-6, 16), AdaptiveSetting(1e-11, 12)), tuned="4 x 1e-3",
    ),
    "modal": partial(
        rattling, "modal", hand=[AdaptiveSetting(tolerance) for tolerance in (1e-2, 1e-3, 1e-4)],
        once=[AdaptiveSetting(tolerance) for tolerance in (1e-5, 1e-6, 1e-7)],
        fine=(AdaptiveSetting(1e-7), AdaptiveSetting(1e-11)), tuned="1e-3",
    ),
    "bars": partial(
        chain_work, "bars",
        hand=[HandSetting(1, 100, 1e-5, 1e-8), HandSetting(1, 400, 1e-5, 1e-8), HandSetting(1, 1600, 1e-6, 1e-9)],
        once=[AdaptiveSetting(1e-3), AdaptiveSetting(1e-4), AdaptiveSetting(1e-6)], fine=None, tuned="1 x 400",
    ),
    "strips": partial(
        chain_work, "strips",
        hand=[HandSetting(2, 200, 1e-5, 1e-8), HandSetting(4, 400, 1e-5, 1e-8), HandSetting(8, 1600, 1e-5, 1e-8)],
        once=[AdaptiveSetting(1e-2, 4), AdaptiveSetting(1e-3, 4), AdaptiveSetting(1e-4, 5)],
        fine=(HandSetting(8, 3200, 1e-5, 1e-6), AdaptiveSetting(1e-7, 8)), tuned="4 x 400",
    ),
}  # fmt: skip
"""Functions that define the works, by name."""
