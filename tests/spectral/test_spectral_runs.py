"""Integrators of the compiled solver: rates, energy, constraints; known errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("numba")

from simulations import exact_swing, pendulum
from spectral_scenes import energy

from buckler.mbs import Drive, Guide, Modal, Strut
from buckler.mbs.elements import Beam, Cable, Clearance, Force, Link, Ramp, Revolute, Rigid, Section, Stop, TorsionSpring, Weld
from buckler.mbs.functions import Table
from buckler.mbs.laws import CarvalhoMartins, HuntCrossley, Impact, KelvinVoigt
from buckler.mbs.laws.rebound import restitution
from buckler.mbs.library import PAPER, SliderCrank, crank_rocker, slider_crank
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.modal import BarModes
from buckler.mbs.simulation import simulate
from buckler.mbs.solvers import Closure, Controlled, Equal, Spectral
from buckler.mbs.spectral.output import Output
from buckler.mbs.spectral.run import find_contradiction, integrate, is_explicit, once
from buckler.mbs.spectral.scene import CompiledScene

BAR = Section(0.02, 0.005)
LEVEL = np.pi / 2
PENDULUM = pendulum(LEVEL)


@pytest.mark.parametrize(
    "motion", [Table((0.0, 0.2, 0.35, 0.6), (4.0, 4.0, 1.0, 6.0)), Ramp(0.0, 5.0, 0.3)], ids=["table", "ramp"]
)
def test_forces_on_both_sides_of_a_kink_are_those_of_loop_closure(motion) -> None:
    """Where the drive's acceleration jumps, the step before ends with the old one and the step after begins with the new one."""
    mechanism = crank_rocker(Rigid(BAR), speed=motion)
    exact = simulate(mechanism, 0.5, solver=Closure(Controlled(max_step=1e-4)))
    for tolerance in (1e-6, 1e-9):
        found = simulate(mechanism, 0.5, solver=Spectral(Controlled(tolerance=tolerance)))
        for name in ("O.ground-crank.fx", "drive.torque"):
            largest = np.abs(exact[name]).max()
            assert np.abs(found[name]).max() == pytest.approx(largest, rel=2e-3)
            away = np.abs(found.time[:, None] - np.array([0.2, 0.3, 0.35])).min(axis=1) > 1e-9
            off = (found[name] - np.interp(found.time, exact.time, exact[name]))[away]
            assert np.abs(off).max() < 5e-3 * largest


def test_explicit_steps_do_not_shrink_towards_a_kink() -> None:
    """The last stages of the step to it have the drive's acceleration before the kink, so they agree with the others."""
    scene = CompiledScene.of(crank_rocker(Rigid(BAR), speed=Ramp(0.0, 5.0, 0.3)))
    out, _, _ = integrate(scene, 0.5, Spectral(Controlled(tolerance=1e-8), method="explicit"))
    before = out.time[out.time <= 0.3]
    assert before[-1] == 0.3 and before[-3] < 0.29


def test_equal_explicit_steps_after_an_onset_end_at_the_end_of_the_run() -> None:
    """The step before the end is stretched by a ten thousandth, so that none of this length follows."""
    drop, count, after = 0.1, 100, 10.00005  # [m]; steps of the run; steps after the onset
    block = Link("block", "A", "B", Rigid.of(mass=0.5, inertia=1e-3))
    guides = [Guide(point, "block", along=(0, 1)) for point in "AB"]
    stop = Stop("A", at=0.0, law=Impact(1e3, 1.0, 1e-4, 1.0))
    mechanism = Mechanism({"A": (0, drop), "B": (0, 0.2)}, [block], guides=guides, stops=[stop], gravity=(0, -9.81))
    duration = np.sqrt(2 * drop / 9.81) / (1 - after / count)
    out, _, counts = integrate(CompiledScene.of(mechanism), duration, Spectral(Equal(count), method="explicit"))
    assert counts.onsets == 1
    assert np.diff(out.time).min() > 0.99 * duration / count


@pytest.mark.parametrize(("damping", "explicit", "balance"), [(253.0, True, 1e-2), (253e3, False, 5e-3)])
def test_stiffly_damped_clearance_runs_implicitly(damping, explicit, balance) -> None:
    """Its explicit steps are held by stability: they are 15 times as many."""

    def loose(point, first, second):
        return Clearance(point, first, second, 5e-3, 2.5e-4, Impact(8e9, damping, 1e-5))

    mechanism = crank_rocker(Rigid(BAR), speed=30.0, play=loose, with_play="OABC")
    assert is_explicit(CompiledScene.of(mechanism), Spectral()) is explicit
    assert is_explicit(CompiledScene.of(mechanism), Spectral(method="explicit"))
    found = simulate(mechanism, 0.02, solver=Spectral(), ledger=True)
    assert found.energy_balance < balance, found.message


@pytest.mark.parametrize("kind", [Beam, Cable])
def test_a_strip_that_turns_several_times_winds_up_its_spring(kind) -> None:
    """A stiff one swings as a bar, angle = spin/w sin(w t) with w^2 = 3 k/(m L^2), nearly two turns; so does one from within."""
    length, spin, stiffness, section = 0.2, 40.0, 0.05, Section(0.02, 0.01)
    inertia = section.mass_per_length * length * (length**2 / 3 + section.thickness**2 / 12 * (kind is Beam))
    w = np.sqrt(stiffness / inertia)
    mechanism = Mechanism(
        {"O": (0.0, 0.0), "A": (-length, 0.0)},
        [Link("strip", "O", "A", kind(section))],
        [Revolute("O", "ground", "strip")],
        loads=[TorsionSpring("ground", "strip", stiffness=stiffness)],
        velocities={"strip": spin},
    )
    result = simulate(mechanism, np.pi / w, solver=Spectral(degree=5), ledger=True)
    assert result.ok, result.message
    angle = spin / w * np.sin(w * result.time)
    assert angle.max() > 3.5 * np.pi and result.energy_balance < 1e-3
    off = np.hypot(result["A.x"] + length * np.cos(angle), result["A.y"] + length * np.sin(angle))
    assert off.max() < 5e-3 * angle.max() * length


@pytest.mark.parametrize("kind", [Beam, Cable])
def test_bending_damping_takes_from_each_swing_what_kelvin_and_voigt_say(kind) -> None:
    """A cantilever under a sudden load swings with w = 1.8751^2 sqrt(E I/(m L^4)) and loses exp(-pi tau w/2) in half a period."""
    length, lag = 0.5, 0.2
    bare = Section(0.02, 0.002)
    w = 1.8751**2 * np.sqrt(bare.bending_stiffness / bare.mass_per_length) / length**2
    strip = Section(0.02, 0.002, replace(bare.material, bending_damping=lag / w))
    load = 1e-3 * bare.bending_stiffness / length**2
    cantilever = Mechanism(
        {"A": (0.0, 0.0), "B": (length, 0.0)},
        [Link("strip", "A", "B", kind(strip))],
        [Weld("A", "ground", "strip")],
        loads=[Force("B", (0.0, load))],
    )
    result = simulate(cantilever, 3 * np.pi / w, solver=Spectral(degree=8))
    rest = load * length**3 / (3 * bare.bending_stiffness)
    first, second, third = (abs(result.at("B.y", k * np.pi / w) / rest - 1) for k in (1, 2, 3))
    assert [second / first, third / second] == pytest.approx([np.exp(-np.pi * lag / 2)] * 2, rel=0.02)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5, 1e-7])
def test_reactions_of_a_determined_linkage_are_solved_for_too(tolerance) -> None:
    """Places are right at once, by the constraints, and Newton's method ends; reactions must be right then, too."""
    m = slider_crank(Rigid(Section(0.030, 2e-3)), law=None, mass=0.3, speed=7.0)
    found, exact = (simulate(m, 0.4, solver=solver) for solver in (Spectral(Controlled(tolerance)), Closure()))
    for name in ("drive.torque", "B.guide_force"):
        truth = np.interp(found.time, exact.time, exact.signals[name])
        np.testing.assert_allclose(found.signals[name], truth, atol=1e-3 * np.abs(truth).max())


def test_the_work_of_a_drive_is_integrated_to_more_than_the_second_order() -> None:
    """Energies are held against each other: what is given, and what masses hold by their speeds and heights."""
    m = slider_crank(Rigid(Section(0.030, 2e-3)), law=None, mass=0.3, speed=7.0)
    assert simulate(replace(m, gravity=(0, -9.81)), 0.4, solver=Spectral(Controlled(1e-5)), ledger=True).energy_balance < 1e-4


def test_a_drive_that_what_is_held_does_not_let_go_is_named() -> None:
    """Modes of bending alone cannot give way along the link: it does not move, and once it was said to be fine."""
    body = Modal(Section(0.02, 0.001), BarModes(2, 0), 0.02)
    mechanism = Mechanism(
        {"A": (0, 0), "B": (0.3, 0)}, [Link("bar", "A", "B", body)], [Revolute("B", "ground", "bar")],
        guides=[Guide("A", "bar", mass=0.1)], drives=[Drive("A", Ramp(0.0, 1e-3, 1.0))],
    )  # fmt: skip
    for how in ({"solver": Spectral()}, {"accuracy": 1e-2}):
        result = simulate(mechanism, 1.0, **how)
        assert result.status == "SINGULAR" and "is off by 0.0005 m" in result.message  # the drive or the pin, which is one


@pytest.mark.parametrize("length", [1e-3, 1e3])
def test_a_drive_is_violated_from_the_same_angle_on_at_any_length_of_its_link(length) -> None:
    """Ten millionths of a radian are too much on a long link, and a tenth of a millionth is little on a short one."""
    mechanism = Mechanism(
        {"O": (0.0, 0.0), "A": (length, 0.0)}, [Link("bar", "O", "A", Rigid(Section(length / 10, length / 50)))],
        [Revolute("O", "ground", "bar")], drives=[Drive("bar", 1.0)],
    )  # fmt: skip
    scene = CompiledScene.of(mechanism)
    for angle, is_too_much in ((1e-5, True), (1e-7, False)):
        q = np.array([[length / 2 * np.cos(angle), length / 2 * np.sin(angle), angle]])  # the pin stays where it is
        out = Output(np.zeros(1), q, 0 * q, 0 * q, np.zeros((1, 3)), np.zeros((1, 0, 4)))
        failure = find_contradiction(scene, out)
        assert ("'drive' is off by 1e-05" in failure.message) if is_too_much else failure is None


def test_order_on_a_pendulum() -> None:
    """The error falls as the fifth power of equal steps."""
    exact, errors = exact_swing(LEVEL, [0.85])[:, -1] - [LEVEL, 0.0], []
    for steps in (16, 32, 64):
        record = once(PENDULUM, 0.85, Spectral(Equal(steps))).record
        errors.append([abs(record.turn("bar:A")[i][-1] - exact[i]) for i in range(2)])
    for one, _, last in zip(*errors, strict=True):
        assert np.log2(one / last) / 2 == pytest.approx(5.0, abs=0.4)
        assert last < 1e-7


@pytest.mark.parametrize("method", ["implicit", "explicit"])
def test_pendulum_keeps_its_energy_and_constraints(method: str) -> None:
    scene = CompiledScene.of(PENDULUM)
    out, failure, _ = integrate(scene, 5.0, Spectral(Controlled(tolerance=1e-7), method=method))
    assert failure is None
    first = sum(energy(scene, out.q[0], out.v[0]).values())
    drift = max(abs(sum(energy(scene, q, v).values()) - first) for q, v in zip(out.q[::20], out.v[::20], strict=True))
    assert drift < 1e-3 * max(energy(scene, out.q[i], out.v[i])["kinetic"] for i in range(0, len(out.q), 20))
    last = scene.assemble(out.q[-1], out.v[-1], out.time[-1], tangents=False)
    assert np.abs(last.residual).max() < 1e-9
    assert np.abs(last.jacobian @ out.v[-1] - last.speed).max() < 1e-7


@pytest.mark.parametrize(("method", "bound"), [("explicit", 1e-3), ("implicit", 1e-3)])
def test_a_stop_gives_back_what_its_law_says(method: str, bound: float) -> None:
    """A free bar flies endwise against a wall, in steps before it that are as long as the contact."""
    law = HuntCrossley(1e5, 0.3)
    wall = Stop("A", at=0.21, law=law, along=(1.0, 0.0), link="rod")
    points, rod = {"O": (0.0, 0.0), "A": (0.2, 0.0)}, Link("rod", "O", "A", Rigid(BAR))
    mechanism = Mechanism(points, [rod], [], stops=[wall], velocities={"rod": 0.0, "A": (1.0, 0.0)})
    for tolerance in (1e-5, 1e-6):
        record = once(mechanism, 0.1, Spectral(Controlled(tolerance=tolerance), method=method)).record
        speed = record.point("rod:A")[1][-1]
        assert -speed[0] == pytest.approx(restitution(law.chi), rel=bound)
        assert speed[1] == 0.0


@pytest.mark.parametrize("tolerance", [1e-8, 1e-10])
def test_a_touch_within_a_step_is_seen_and_its_jump_is_on_both_sides_of_its_onset(tolerance) -> None:
    """A slider driven 7 micrometres into a damped stop, whose force jumps as it closes: impulse of the closed form."""
    kin, speed, stiffness, damping = SliderCrank(0.1108, 0.2819), 5.41, 4.6e5, 509.0
    at, end = kin.slider(np.pi) + 7e-6, 1.4
    m = slider_crank(Rigid(BAR), law=KelvinVoigt(stiffness, damping), mass=0.3, speed=speed, stop=float(at), lengths=kin)
    steps = Controlled(tolerance=tolerance)
    run = once(m, end, Spectral(steps, contact_tolerance=1e-3 * tolerance / 1e-8))
    force, t = run.values["B.contact_force"], np.linspace(0.0, end, 4_000_001)
    depth = at - kin.slider(speed * t)
    right = np.where(depth > 0, np.maximum(stiffness * depth + damping * np.gradient(depth, t), 0.0), 0.0)
    assert np.trapezoid(force, run.record.time) == pytest.approx(np.trapezoid(right, t), rel=0.03)
    (first, *_) = np.flatnonzero(force)
    assert force[first] > 0.5 * force.max() and run.record.time[first] - run.record.time[first - 1] < 1e-6


@pytest.mark.parametrize("tolerance", [2e-5, 1.67e-5, 1.47e-5])
def test_a_strip_that_leaves_its_stop_does_so_at_its_time(tolerance) -> None:
    """The stop's force falls from its whole to nothing within a step of many of its time constants; a false moment of leaving
    is amplified a hundredfold as the buckled strip snaps back.
    """
    strip = Beam(Section(0.030, 3e-4).damped(0.01, 0.31), imperfection=0.31e-3)
    mechanism = slider_crank(strip, law=KelvinVoigt(1e5, 2 * (1e5 * 0.3) ** 0.5), mass=0.3, speed=1.25)
    runs = [simulate(mechanism, 1.6 * np.pi, solver=Spectral(Controlled(each), degree=8)) for each in (2e-6, tolerance)]
    exact, deflection = (run.at("coupler.deflection", np.linspace(0.0, 1.6 * np.pi, 401)) for run in runs)
    assert np.linalg.norm(deflection - exact) < 6e-3 * np.linalg.norm(exact)


def test_a_slow_release_from_a_stiff_stop_takes_few_steps() -> None:
    """At a dead centre, at micrometres a second: steps to the release would move the slider by less than the last digit."""
    speed, strut = 2.65, Strut(Section(0.03, 3e-4))
    solver = Spectral(Controlled(tolerance=3e-9, max_steps=20_000), contact_tolerance=8e-6)
    peaks = []
    for stiffness in (1e8, 1e10):
        law = CarvalhoMartins(stiffness, 0.7, exponent=1.0)
        mechanism = slider_crank(strut, law=law, mass=0.3, speed=speed, stop=1.66e-5 - PAPER.crank - PAPER.coupler)
        result = simulate(mechanism, 3.5 / speed, solver=solver)
        assert result.time[-1] == pytest.approx(3.5 / speed) and result.work["steps"] < 3000, result.message
        peaks.append(result["B.contact_force"].max())
    assert peaks[1] == pytest.approx(10 * peaks[0], rel=0.02)  # of an impact at one speed: v sqrt(k m)


@pytest.mark.parametrize("accuracy", [None, 1e-4])
def test_a_point_on_the_rim_of_a_wheel_is_followed_though_the_wheel_turns_evenly(accuracy):
    """A wheel turns 160 times about its centre of mass, which is at rest; its angle alone would allow a step of any length."""
    radius, speed = 0.1, 100.0
    body = Link("wheel", "O", "A", Rigid.of(mass=1.0, inertia=0.01, centre=(0, 0)))
    wheel = Mechanism({"O": (0, 0), "A": (radius, 0)}, [body], [Revolute("O", "ground", "wheel")], velocities={"wheel": speed})
    result = simulate(wheel, 10.0, accuracy)
    assert result.status == "OK" and not result.message and result.work["runs"] == 2
    t = np.linspace(0.0, 10.0, 20001)
    error = np.abs(result.at("A.x", t) - radius * np.cos(speed * t)).max()
    assert error < result.error.absolute("A.x", "peak") < 2 * radius * (accuracy or 1e-3)
