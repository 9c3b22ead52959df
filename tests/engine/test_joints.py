"""Welds, sliders and slots in the engine: closed forms, what they keep, what they must not make."""

import math
from dataclasses import replace

import exudyn as exu
import numpy as np
import pytest
from simulations import fine

from buckler.mbs import (
    Beam,
    Cable,
    Closure,
    Controlled,
    Drive,
    Equal,
    Exudyn,
    Guide,
    Link,
    Mechanism,
    Modal,
    Motion,
    Revolute,
    Rigid,
    Section,
    Slider,
    Slot,
    Strut,
    Weld,
    build,
    simulate,
)
from buckler.mbs.kinematics.linkage import Linkage

exu.config.printToConsole = False
G = 9.81
BAR = Section(0.020, 0.004)
LENGTH = 0.5
EQUAL = Exudyn(Equal(4000), spectral_radius=0.6)
"""Constraint forces ring where steps change their size."""


def turned(angle, *points):
    c, s = math.cos(angle), math.sin(angle)
    return [(c * x - s * y, s * x + c * y) for x, y in points]


def hanging(body, angle=0.0, swapped=False, pull=G):
    """A strip clamped to the ground at its start, gravity square to it."""
    a, b = turned(angle, (0, 0), (LENGTH, 0))
    names = ("strip", "ground") if swapped else ("ground", "strip")
    return Mechanism(
        points={"A": a, "B": b},
        links=[Link("strip", "A", "B", body)],
        joints=[Weld("A", *names)],
        gravity=turned(angle, (0, -pull))[0],
    )


def at_rest(mechanism):
    """Scene in static equilibrium, and readers of a point's displacement and of a constraint's effort on its second body."""
    scene = build(mechanism)
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    settings.staticSolver.verboseMode = 0
    settings.staticSolver.newton.absoluteTolerance = 1e-8
    scene.system.SolveStatic(settings)
    data = scene.system.systemData
    q, forces = data.GetODE2Coordinates(), data.GetAECoordinates()

    def effort(name):
        return forces[scene.multipliers(name)]  # the engine's static solver gives them the other sign

    return scene, q, effort


@pytest.mark.parametrize("body", [Beam(BAR, 8), Beam(BAR, 4, nodes=2), Cable(BAR, 8)], ids=["beam", "two nodes", "cable"])
@pytest.mark.parametrize("swapped", [False, True], ids=["ground first", "strip first"])
def test_clamp_carries_weight_and_moment_of_a_cantilever(body, swapped):
    scene, q, effort = at_rest(hanging(body, 0.4, swapped))
    weight, sign = BAR.mass_per_length * LENGTH * G, -1 if swapped else 1
    name = "A.strip-ground" if swapped else "A.ground-strip"
    tip = scene.placed["strip"].columns(scene.system)[-1]
    _, down = turned(-0.4, tuple(q[tip[:2]]))[0]
    assert effort(name) == pytest.approx(sign * np.array(turned(0.4, (0, weight))[0]), rel=1e-9)
    assert effort(f"{name}: turn")[0] == pytest.approx(sign * weight * LENGTH / 2, rel=2e-4)
    if body != Beam(BAR, 4, nodes=2):
        shear = 0.0 if isinstance(body, Cable) else weight * LENGTH / (2 * BAR.shear_stiffness)
        assert down == pytest.approx(-weight * LENGTH**3 / (8 * BAR.bending_stiffness) - shear, rel=3e-4)


def test_cantilever_tip_follows_the_exact_large_deflection():
    """A weight twenty times as large: tip and moment against the elastica under its own weight, integrated on its own."""
    from scipy.integrate import solve_bvp

    pull = 60 * G
    load, bending = BAR.mass_per_length * pull, BAR.bending_stiffness

    def slopes(s, y):
        return [y[1], load * (LENGTH - s) * np.cos(y[0]) / bending, np.cos(y[0]), np.sin(y[0])]

    def ends(a, b):
        return [a[0], b[1], a[2], a[3]]

    s = np.linspace(0, LENGTH, 101)
    exact = solve_bvp(slopes, ends, s, np.array([0 * s, 0 * s, s, 0 * s]), tol=1e-10, max_nodes=10**5)
    found = []
    for count in (4, 8, 16):
        scene, q, effort = at_rest(hanging(Cable(BAR, count), pull=pull))
        tip = scene.placed["strip"].columns(scene.system)[-1]
        found.append([*q[tip[:2]] + [LENGTH, 0], effort("A.ground-strip: turn")[0]])
    right = [exact.y[2, -1], exact.y[3, -1], -bending * exact.y[1, 0]]
    errors = np.abs(np.array(found) / right - 1).max(axis=1)
    assert exact.y[3, -1] < -0.1 * LENGTH
    assert errors[-1] < 3e-5 and errors[0] / errors[-1] > 100


def frequencies(mechanism, count=1):
    """Lowest angular frequencies, rad/s."""
    values = build(mechanism).system.ComputeODE2Eigenvalues()[0]
    return np.sqrt(values[:count])


@pytest.mark.parametrize(("kind", "rate"), [(Beam, 3.5), (Cable, 3.5)], ids=["beam", "cable"])
def test_clamped_clamped_frequency_with_its_rate(kind, rate):
    thin = Section(0.020, 0.001)
    exact = 4.730040744862704**2 * math.sqrt(thin.bending_stiffness / thin.mass_per_length) / LENGTH**2
    found = []
    for count in (4, 8, 16):
        mechanism = replace(
            hanging(kind(thin, count), pull=0.0), joints=[Weld("A", "ground", "strip"), Weld("B", "strip", "ground")]
        )
        found.append(frequencies(mechanism)[0])
    errors = np.abs(np.array(found) / exact - 1)
    assert errors[-1] < 1e-4, errors  # what shear and rotary inertia take is of that order
    assert np.log2(errors[0] / errors[1]) > rate, errors


def halves(bodies, angle=0.3):
    """A cantilever of two links welded in the middle."""
    a, m, b = turned(angle, (0, 0), (LENGTH / 2, 0), (LENGTH, 0))
    return Mechanism(
        points={"A": a, "M": m, "B": b},
        links=[Link("one", "A", "M", bodies[0]), Link("two", "M", "B", bodies[1])],
        joints=[Weld("A", "ground", "one"), Weld("M", "one", "two")],
        gravity=turned(angle, (0, -G))[0],
    )


@pytest.mark.parametrize("kind", [Beam, Cable])
def test_two_halves_welded_are_the_whole(kind):
    whole = hanging(kind(BAR, 8), 0.3)
    pair = halves([kind(BAR, 4)] * 2)
    assert frequencies(pair, 3) == pytest.approx(frequencies(whole, 3), rel=1e-6)
    tips = []
    for mechanism, name in ((whole, "strip"), (pair, "two")):
        scene, q, effort = at_rest(mechanism)
        tips.append(q[scene.placed[name].columns(scene.system)[-1, :2]])
    assert tips[1] == pytest.approx(tips[0], rel=3e-6)  # Newton's tolerance, N
    half = BAR.mass_per_length * LENGTH / 2 * G
    assert effort("M.one-two") == pytest.approx(turned(0.3, (0, half))[0], rel=1e-8)
    assert effort("M.one-two: turn")[0] == pytest.approx(half * LENGTH / 4, rel=1e-4)


def test_beam_welded_to_a_cable_or_a_rigid_bar_is_as_stiff():
    bent = [
        frequencies(halves(pair))[0]
        for pair in ([Beam(BAR, 4)] * 2, (Beam(BAR, 4), Cable(BAR, 4)), (Cable(BAR, 4), Beam(BAR, 4)))
    ]
    assert bent[1:] == pytest.approx([bent[0]] * 2, rel=1e-4)
    stiff = Section(0.020, 0.004, replace(BAR.material, modulus=1e4 * BAR.material.modulus))
    for kind in (Beam, Cable):
        assert frequencies(halves([kind(BAR, 4), Rigid(BAR)]))[0] == pytest.approx(
            frequencies(halves([kind(BAR, 4), Beam(stiff, 2)]))[0], rel=1e-3
        )


def test_modal_link_clamped_swings_as_a_beam():
    pytest.importorskip("skfem")
    from buckler.mbs.modal import CraigBampton

    modal = frequencies(hanging(Modal(BAR, CraigBampton(tuple(range(1, 16)))), pull=0.0))[0]
    assert modal == pytest.approx(frequencies(hanging(Beam(BAR, 8), pull=0.0))[0], rel=0.06)


@pytest.mark.parametrize("bodies", [
    (Rigid(BAR), Rigid(BAR)), (Beam(BAR, 2), Rigid(BAR)), (Cable(BAR, 3), Cable(BAR, 3)), (Rigid(BAR), Cable(BAR, 3)),
], ids=["rigid", "beam and rigid", "cables", "rigid and cable"])  # fmt: skip
def test_angle_stays_and_energy_balances_as_two_bars_fall(bodies):
    mechanism = Mechanism(
        points={"A": (0, 0), "M": (0.2, 0.1), "B": (0.3, -0.1)},
        links=[Link("one", "A", "M", bodies[0]), Link("two", "M", "B", bodies[1])],
        joints=[Revolute("A", "ground", "one"), Weld("M", "one", "two")],
        gravity=(0, -G),
    )
    result = fine(simulate(mechanism, 0.1, solver=Exudyn(Controlled(tolerance=2e-9)), ledger=True))
    run = result.signals
    assert result.energy_balance < 1e-6
    assert run["B.y"].min() < -0.12
    if all(isinstance(body, Rigid) for body in bodies):
        apart = np.hypot(run["B.x"], run["B.y"])
        assert apart == pytest.approx(math.hypot(0.3, 0.1), rel=1e-9)
        assert newton_euler(result, mechanism, "two", [("M", "M.one-two", 1.0)]) < 1e-8
        assert newton_euler(result, mechanism, "one", [("M", "M.one-two", -1.0), ("A", "A.ground-one", 1.0)]) < 1e-8


def newton_euler(result, mechanism, link, joints):
    """Largest part of a rigid link's force and moment balance that its joints' signals leave over, relative to the largest."""
    run, body = result.signals, mechanism.link(link)
    mass, inertia, _ = body.body.inertia(mechanism.length(link))
    place = np.column_stack([run[f"{link}.x"], run[f"{link}.y"]])
    force = mass * (np.column_stack([run[f"{link}.ax"], run[f"{link}.ay"]]) - mechanism.gravity)
    start, end = (np.column_stack([run[f"{p}.{a}"] for a in "xy"]) for p in (body.start, body.end))
    chord, rate = end - start, np.column_stack([run[f"{body.end}.v{a}"] - run[f"{body.start}.v{a}"] for a in "xy"])
    spin = (chord[:, 0] * rate[:, 1] - chord[:, 1] * rate[:, 0]) / (chord**2).sum(axis=1)
    moment = inertia * np.gradient(spin, result.time, edge_order=2)
    scale = np.abs(force).max()
    for point, name, sign in joints:
        exerted = sign * np.column_stack([run[f"{name}.fx"], run[f"{name}.fy"]])
        arm = np.column_stack([run[f"{point}.x"], run[f"{point}.y"]]) - place
        force = force - exerted
        moment = moment - (arm[:, 0] * exerted[:, 1] - arm[:, 1] * exerted[:, 0]) - sign * run.get(f"{name}.moment", 0.0)
    assert np.abs(moment[2:-2]).max() < 1e-3 * scale * mechanism.length(link)  # the turning is differentiated
    return np.abs(force[1:]).max() / scale


# --- sliders and slots ------------------------------------------------------------------------------------------------

BEAD = Rigid.of(mass=0.3, inertia=2e-4, centre=(0.0, 0.0))


def bead_on_a_rod(kind, speed, angle=0.5, start=0.1):
    """A bead on a rod that turns about its end; no gravity."""
    o, p, q, e = turned(angle, (0, 0), (start, 0), (start, 0.02), (1.0, 0))
    return Mechanism(
        points={"O": o, "P": p, "Q": q, "E": e},
        links=[Link("rod", "O", "E", Rigid(BAR)), Link("bead", "P", "Q", BEAD)],
        joints=[Revolute("O", "ground", "rod"), kind("P", "bead", "rod", along=turned(angle, (1, 0))[0])],
        drives=[Drive("rod", speed)],
    )


@pytest.mark.parametrize("kind", [Slider, Slot])
def test_bead_flies_out_along_a_turning_rod(kind):
    """Its distance grows by r'' = w^2 r: r = r_0 cosh w t, with 2 m w r' across the rod."""
    speed = 8.0
    result = fine(simulate(bead_on_a_rod(kind, speed), 0.2, solver=EQUAL, ledger=True))
    run, t = result.signals, result.time
    out = 0.1 * (np.cosh(speed * t) - 1)
    assert run["P.bead-rod.travel"] == pytest.approx(out, abs=2e-6)
    pushed = -2 * 0.3 * speed**2 * 0.1 * np.sinh(speed * t)  # of the bead on the rod: to its right
    later = t > 0.02  # the first steps ring
    assert run["P.bead-rod.normal_force"][later] == pytest.approx(pushed[later], abs=1e-3 * np.abs(pushed).max())
    turned_by = run["Q.x"] - run["P.x"], run["Q.y"] - run["P.y"]
    turn = np.unwrap(np.arctan2(*turned_by[::-1])) - 0.5 - math.pi / 2
    assert turn[-1] == pytest.approx(speed * 0.2 if kind is Slider else 0.0, abs=1e-9)
    assert result.energy_balance < 1e-6


def test_slider_carries_the_moment_that_turns_the_bead_and_a_slot_none():
    spin_up = Motion(lambda t: 20 * t**3, lambda t: 60 * t**2)
    for kind in (Slider, Slot):
        result = fine(simulate(bead_on_a_rod(kind, spin_up), 0.2, solver=EQUAL, ledger=True))
        run, t = result.signals, result.time
        beads = np.arctan2(run["Q.y"] - run["P.y"], run["Q.x"] - run["P.x"]) - 0.5 - math.pi / 2
        if kind is Slider:
            assert run["P.bead-rod.moment"][5:] == pytest.approx(-2e-4 * 120 * t[5:], abs=1e-5)
            assert beads == pytest.approx(20 * t**3, abs=1e-9)
        else:
            assert "P.bead-rod.moment" not in run
            assert np.abs(beads).max() < 1e-12
        assert result.energy_balance < 1e-6


def test_rod_feels_what_the_bead_feels():
    """Rod free to swing under gravity: the drive's absence leaves weight, pin, and the bead's force and moment on it."""
    for kind in (Slider, Slot):
        plain = bead_on_a_rod(kind, 0.0)
        free = replace(plain, drives=[], gravity=(0, -G))
        result = fine(simulate(free, 0.3, solver=EQUAL, ledger=True))
        assert result.energy_balance < 1e-6
        run = result.signals
        angle = np.unwrap(np.arctan2(run["E.y"], run["E.x"]))
        spin = run["E.x"] * run["E.vy"] - run["E.y"] * run["E.vx"]
        mass, inertia, _ = Rigid(BAR).inertia(1.0)
        moment = (inertia + mass / 4) * np.gradient(spin, result.time, edge_order=2) + mass * G * np.cos(angle) / 2
        reach = 0.1 + run["P.bead-rod.travel"]
        exerted = run["P.bead-rod.normal_force"] * reach + run.get("P.bead-rod.moment", 0.0)
        assert exerted[2:-2] == pytest.approx(moment[2:-2], abs=1e-3 * np.abs(moment).max())
        aside = -np.sin(angle) * run["P.x"] + np.cos(angle) * run["P.y"]
        assert np.abs(aside).max() < 1e-9


@pytest.mark.parametrize("rod", [Beam(BAR, 4), Cable(BAR, 4)], ids=["beam", "cable"])
def test_line_of_a_flexible_link_turns_with_its_section(rod):
    flexible = bead_on_a_rod(Slider, 0.0, start=0.99)
    mechanism = replace(
        flexible,
        links=[Link("rod", "O", "P", rod), flexible.links[1]],
        drives=[],
        gravity=(0, -G),
    )
    result = fine(simulate(mechanism, 0.2, solver=Exudyn(Controlled(tolerance=2e-8)), ledger=True))
    assert result.energy_balance < 1e-6
    assert np.abs(result.signals["P.bead-rod.travel"]).max() > 1e-3


@pytest.mark.parametrize("kind", [Slider, Slot])
def test_loop_closure_knows_joints_that_slide(kind):
    """A quick-return linkage: velocities and accelerations from closure against differences of its places."""
    mechanism = Mechanism(
        points={"O": (0, 0), "A": (0.05, 0.1), "D": (0.0, -0.2), "E": (0.1, 0.3), "F": (0.07, 0.1)},
        links=[Link("crank", "O", "A", Rigid(BAR)), Link("block", "A", "F", BEAD), Link("arm", "D", "E", Rigid(BAR))],
        joints=[Revolute("O", "ground", "crank"), Revolute("D", "ground", "arm"), Revolute("A", "crank", "block"),
                Slider("A", "block", "arm", along=(0.05, 0.3))] if kind is Slider else
               [Revolute("O", "ground", "crank"), Revolute("D", "ground", "arm"), Weld("A", "crank", "block"),
                Slot("A", "block", "arm", along=(0.05, 0.3))],
        drives=[Drive("crank", Motion(lambda t: 3 * t + t * t, lambda t: 3 + 2 * t))],
    )  # fmt: skip
    closure = Linkage(mechanism)
    assert closure.mobility() == 0
    h = 1e-4
    states = [closure.solve(t) for t in (0.3 - h, 0.3, 0.3 + h)]
    rate = (states[2].q - states[0].q) / (2 * h)
    change = (states[2].q_t - states[0].q_t) / (2 * h)
    assert states[1].q_t == pytest.approx(rate, abs=1e-5)
    assert states[1].q_tt == pytest.approx(change, abs=1e-4)
    result = fine(simulate(mechanism, 0.3, solver=Closure(Equal(400)), ledger=True))
    end = closure.solve(0.3).q
    assert [result.signals[f"{p}.{a}"][-1] for p in "AE" for a in "xy"] == pytest.approx(
        [*closure.position("block", "A", end), *closure.position("arm", "E", end)], abs=1e-8
    )
    assert result.energy_balance < 1e-6
    for name, found in reactions(mechanism, closure).items():
        told = {"force": ("fx", "fy"), "moment": ("moment",), "effort": ("normal_force", "moment")}
        for channel, values in found.items():
            letters = told[channel][: values.shape[1]]
            if name != "drive":
                run = [result.signals[f"{name}.{letter}"][-1] for letter in letters]
                assert run == pytest.approx(values[0], abs=2e-3 * max(1.0, np.abs(values).max())), name


def reactions(mechanism, closure):
    """Channels of the joints at 0.3 s from inverse dynamics: J^T lambda = inertia forces."""
    state = closure.solve(0.3)
    inertial = []
    for i, link in enumerate(mechanism.links):
        mass, inertia, centre = link.body.inertia(mechanism.length(link.name))
        (arm,) = turned(state.q[i, 2], centre)
        (ax, ay, alpha), spin = state.q_tt[i], state.q_t[i, 2]
        fx, fy = mass * (ax - alpha * arm[1] - spin**2 * arm[0]), mass * (ay + alpha * arm[0] - spin**2 * arm[1])
        inertial += [fx, fy, inertia * alpha + arm[0] * fy - arm[1] * fx]
    jacobian = closure.system(state.q, state.q_t)[1]
    multipliers = np.linalg.lstsq(jacobian.T, np.array(inertial))[0]
    names = np.array(closure.names)
    return {name: element.reactions(multipliers[None, names == name])
            for name, element in mechanism.elements().items() if name in closure.names}  # fmt: skip


def test_forces_of_a_linkage_that_is_held_are_those_of_statics():
    """Constraints alone decide it: a bar welded to a held crank; a bead on a held rod, its centre of mass 20 mm ahead."""
    bar = Rigid.of(mass=2.0, inertia=0.01, centre=(0.1, 0.0))
    arm = Mechanism(
        points={"O": (0, 0), "A": (0.3, 0), "B": (0.5, 0)},
        links=[Link("crank", "O", "A", Rigid(BAR)), Link("bar", "A", "B", bar)],
        joints=[Revolute("O", "ground", "crank"), Weld("A", "crank", "bar")],
        drives=[Drive("crank", 0.0)],
        gravity=(0, -G),
    )
    run = simulate(arm, 0.1).signals
    assert run["A.crank-bar.fy"] == pytest.approx(2.0 * G, rel=1e-9)
    assert run["A.crank-bar.moment"] == pytest.approx(2.0 * G * 0.1, rel=1e-9)
    bead = Mechanism(
        points={"O": (0, 0), "E": (1, 0), "P": (0.4, 0), "Q": (0.5, 0)},
        links=[Link("rod", "O", "E", Rigid(BAR)), Link("bead", "P", "Q", Rigid.of(mass=0.3, inertia=1e-3, centre=(0.02, 0)))],
        joints=[Revolute("O", "ground", "rod"), Slider("P", "bead", "rod", along=(1, 0))],
        guides=[Guide("P", "bead", along=(0, 1))],
        drives=[Drive("rod", 0.0)],
        gravity=(0, -G),
    )
    run = simulate(bead, 0.1).signals
    assert run["P.bead-rod.normal_force"] == pytest.approx(-0.3 * G, rel=1e-9)
    assert run["P.bead-rod.moment"] == pytest.approx(-0.3 * G * 0.02, rel=1e-9)


# --- what is refused --------------------------------------------------------------------------------------------------

WRONG = {
    "strut clamped": ([Weld("A", "ground", "strut")], "Weld|weld at 'A': link 'strut' is a Strut"),
    "welded to itself": ([Weld("A", "bar", "bar")], "joins 'bar' to itself"),
    "welded twice": ([Weld("A", "bar", "ground"), Revolute("A", "ground", "bar")], "twice"),
    "out of reach": ([Weld("C", "bar", "ground")], "'bar' does not reach it"),
    "ground slides": ([Slider("A", "ground", "bar")], "first = 'ground': the point must be a link's; swap the bodies"),
    "line of a stranger": ([Slider("A", "bar", "arm")], "unknown link 'arm'"),
    "line off a beam": ([Slider("A", "bar", "beam")], "link 'beam' does not reach it"),
    "slot in a strut": ([Slot("A", "bar", "strut")], "'strut' is a Strut"),
}


@pytest.mark.parametrize(("joints", "message"), WRONG.values(), ids=WRONG.keys())
def test_joint_that_cannot_be_is_refused(joints, message):
    points = {"A": (0, 0), "B": (1, 0), "C": (1, 1)}
    links = [Link("bar", "A", "B", Rigid(BAR)), Link("strut", "A", "C", Strut(BAR)), Link("beam", "B", "C", Beam(BAR))]
    with pytest.raises(ValueError, match=message):
        Mechanism(points, links, joints)


def test_slider_needs_a_direction():
    with pytest.raises(ValueError, match=r"Slider at 'A': along"):
        Slider("A", "bar", "ground", along=(0, 0))
