"""Welds, sliders and slots in the engine: closed forms, what they keep, what they must not make."""

import math
from dataclasses import replace

import exudyn as exu
import numpy as np
import pytest
from jointed import BAR, G, turned
from simulations import fine

from buckler.mbs import Beam, Cable, Controlled, Exudyn, Link, Mechanism, Revolute, Rigid, Section, Weld, build, simulate

exu.config.printToConsole = False


LENGTH = 0.5


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
        return -forces[scene.multiplier_indices(name)]  # rows are those of the first body

    return scene, q, effort


@pytest.mark.parametrize("body", [Beam(BAR, 8), Beam(BAR, 4, nodes=2), Cable(BAR, 8)], ids=["beam", "two nodes", "cable"])
@pytest.mark.parametrize("swapped", [False, True], ids=["ground first", "strip first"])
def test_clamp_carries_weight_and_moment_of_a_cantilever(body, swapped):
    scene, q, effort = at_rest(hanging(body, 0.4, swapped))
    weight, sign = BAR.mass_per_length * LENGTH * G, -1 if swapped else 1
    name = "A.strip-ground" if swapped else "A.ground-strip"
    tip = scene.placed["strip"].columns()[-1]
    _, down = turned(-0.4, tuple(q[tip[:2]]))[0]
    assert effort(name) == pytest.approx(sign * np.array(turned(0.4, (0, weight))[0]), rel=1e-9)
    assert effort(f"{name}: 1")[0] == pytest.approx(sign * weight * LENGTH / 2, rel=2e-4)
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
        tip = scene.placed["strip"].columns()[-1]
        found.append([*q[tip[:2]] + [LENGTH, 0], effort("A.ground-strip: 1")[0]])
    right = [exact.y[2, -1], exact.y[3, -1], -bending * exact.y[1, 0]]
    errors = np.abs(np.array(found) / right - 1).max(axis=1)
    assert exact.y[3, -1] < -0.1 * LENGTH
    assert errors[-1] < 3e-5 and errors[0] / errors[-1] > 100


@pytest.mark.parametrize(("kind", "rate"), [(Beam, 3.5), (Cable, 3.5)], ids=["beam", "cable"])
def test_clamped_clamped_frequency_with_its_rate(kind, rate):
    thin = Section(0.020, 0.001)
    exact = 4.730040744862704**2 * math.sqrt(thin.bending_stiffness / thin.mass_per_length) / LENGTH**2
    found = []
    for count in (4, 8, 16):
        mechanism = replace(
            hanging(kind(thin, count), pull=0.0), joints=[Weld("A", "ground", "strip"), Weld("B", "strip", "ground")]
        )
        found.append(math.sqrt(build(mechanism).system.ComputeODE2Eigenvalues()[0][0]))
    errors = np.abs(np.array(found) / exact - 1)
    assert errors[-1] < 1e-4, errors  # what shear and rotary inertia take is of that order
    assert np.log2(errors[0] / errors[1]) > rate, errors


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
    mass, inertia, _ = body.body.mass_properties(mechanism.length(link))
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
