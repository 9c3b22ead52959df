"""Modal links in the engine: conservation, markers, natural frequencies, and the same linkage with a beam."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

pytest.importorskip("skfem")

import exudyn as exu
import exudyn.itemInterface as eii
from exact.columns import member
from exact.vibration import beam_frequencies
from simulations import closed

from buckler.mbs import Beam, Guide, Link, Mechanism
from buckler.mbs.engine import guide as guides
from buckler.mbs.engine.build import BODIES
from buckler.mbs.engine.loads import add_drive
from buckler.mbs.engine.modal import CROSS, ENDS, add_anchor
from buckler.mbs.engine.placed import States
from buckler.mbs.engine.scene import EngineScene
from buckler.mbs.library import BAR, crank_rocker
from buckler.mbs.modal import CraigBampton, FreeModes, Modal

exu.config.printToConsole = False
LENGTH, TILT = 0.175, 0.7
POINTS = {"A": (0.1, 0.2), "B": (0.1 + LENGTH * np.cos(TILT), 0.2 + LENGTH * np.sin(TILT))}
RATES = np.array([1.0, 2.0, 300.0])
PLACE, SPEED, SPIN = (exu.OutputVariableType.Position, exu.OutputVariableType.Velocity, exu.OutputVariableType.AngularVelocity)


class Run:
    """A system, and what it recorded when it was solved."""

    def __init__(self):
        self.container = exu.SystemContainer()
        self.system = self.container.AddSystem()
        self.watched = []

    def add(self, body, rates=RATES):
        mechanism = Mechanism(points=POINTS, links=[Link("bar", "A", "B", body)])
        return BODIES[Modal](self.scene(mechanism), mechanism.links[0], rates)

    def scene(self, mechanism):
        return EngineScene(mechanism, self.system, self.container)

    def motion(self, placed):
        """What a link did."""
        return placed.motion(States(self.q, self.q_t, self.q_tt))

    def pin(self, marker, place):
        ground = self.system.AddNode(eii.NodePointGround(referenceCoordinates=[*place, 0.0]))
        to = self.system.AddMarker(eii.MarkerNodePosition(nodeNumber=ground))
        return self.system.AddObject(eii.ObjectJointRevolute2D(markerNumbers=[to, marker]))

    def solve(self, duration, steps, radius=1.0, residual=1e-8):
        def record(system, t):
            data = system.systemData
            self.rows.append((t, data.GetODE2Coordinates(), data.GetODE2Coordinates_t(), data.GetODE2Coordinates_tt()))
            self.forces.append(data.GetAECoordinates())
            self.outputs.append([np.hstack([system.GetMarkerOutput(m, kind) for kind in kinds]) for m, *kinds in self.watched])
            return True

        self.rows, self.outputs, self.forces = [], [], []
        self.system.SetPostStepUserFunction(record)
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        time = settings.timeIntegration
        time.endTime, time.numberOfSteps, time.verboseMode = duration, steps, 0
        time.generalizedAlpha.spectralRadius = radius
        time.newton.useModifiedNewton = time.newton.modifiedNewtonJacUpdatePerStep = True
        time.newton.absoluteTolerance, time.newton.relativeTolerance = residual, 1e-12
        self.system.SolveDynamic(settings)
        self.time, self.q, self.q_t, self.q_tt = (np.array(column) for column in zip(*self.rows, strict=True))

    def deform(self, placed, seed=1):
        """Initial modal amplitudes of some tenths of a millimetre, with rates to match."""
        rng, model = np.random.default_rng(seed), placed.model
        size = 3e-4 / placed.weights()[0, 3:] / (1 + np.arange(len(model))) ** 3
        columns = placed.columns()[0, 3:]
        data, start = self.system.systemData, exu.ConfigurationType.Initial
        q, q_t = data.GetODE2Coordinates(start), data.GetODE2Coordinates_t(start)
        q[columns] = size * rng.standard_normal(len(model))
        q_t[columns] = size * model.frequency * rng.standard_normal(len(model))
        data.SetODE2Coordinates(q, start)
        data.SetODE2Coordinates_t(q_t, start)


MODES = [FreeModes((1, 2, 3), "in-plane"), CraigBampton(fixed=4)]
NAMES = ["free", "Craig-Bampton"]


def rigid_marker(system, placed, point):
    """Marker with position and rotation of an end's cross-section."""
    station, body = placed.stations[point], placed.objects[0]
    if not len(placed.model):
        local = [*placed.model.place(station), 0.0]
        return int(system.AddMarker(eii.MarkerBodyRigid(bodyNumber=body, localPosition=local)))
    first = len(CROSS) * ENDS.index(station)
    around = list(range(first + 1, first + len(CROSS)))
    weights = [1 / len(around)] * len(around)
    item = eii.MarkerSuperElementRigid(bodyNumber=body, meshNodeNumbers=around, weightingFactors=weights)
    return int(system.AddMarker(item))


@pytest.mark.parametrize("modes", MODES, ids=NAMES)
def test_free_flight_conserves_momentum_and_energy(modes):
    """A link thrown, spinning and ringing: energy and angular momentum err by h^2, linear momentum by rounding."""
    errors = []
    for steps in (500, 1000):
        run = Run()
        placed = run.add(Modal(BAR, modes, damping=0.0))
        run.system.Assemble()
        run.deform(placed)
        run.solve(2e-3, steps)
        history = run.motion(placed)
        energy = history.kinetic() + history.strains()[0].energy
        linear, angular = placed.model.momentum(history.q, history.q_t)
        assert history.strains()[0].energy[0] > 1e-4
        np.testing.assert_allclose(linear - linear[0], 0.0, atol=1e-10)
        errors.append([np.abs(energy / energy[0] - 1).max(), np.abs(angular / angular[0] - 1).max()])
    errors = np.array(errors)
    assert (errors[1] < 1e-7).all(), errors
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), 2.0, atol=0.4)


@pytest.mark.parametrize("modes", MODES, ids=NAMES)
def test_markers_move_as_the_planar_model_says(modes):
    run = Run()
    placed = run.add(Modal(BAR, modes))
    run.watched = [(rigid_marker(run.system, placed, p), PLACE, SPEED, SPIN) for p in "AB"]
    run.watched += [(placed.ends[p], PLACE, SPEED) for p in "AB"]
    run.system.Assemble()
    run.deform(placed)
    run.solve(2e-4, 40)
    history = run.motion(placed)
    for k, point in enumerate("ABAB"):
        motion, output = history.motion(point), np.array([row[k] for row in run.outputs])
        np.testing.assert_allclose(output[:, :2], motion.position, atol=1e-14)
        np.testing.assert_allclose(output[:, 3:5], motion.velocity, rtol=1e-11, atol=1e-11)
        if k < 2:
            np.testing.assert_allclose(output[:, 8], motion.spin, rtol=1e-11)
    assert np.ptp(history.motion("B").spin) > 1.0  # it does ring
    out_of_plane = [c for c in range(run.q.shape[1]) if c not in placed.columns()]
    assert len(out_of_plane) == 3 and not run.q[:, out_of_plane].any()


def test_initial_velocity_is_that_of_the_rigid_link():
    run = Run()
    placed = run.add(Modal(BAR))
    run.system.Assemble()
    run.solve(1e-9, 1)
    history = run.motion(placed)
    arm = np.subtract(POINTS["B"], POINTS["A"])
    np.testing.assert_allclose(history.motion("A").position[0], POINTS["A"], atol=1e-6)
    np.testing.assert_allclose(history.motion("A").velocity[0], RATES[:2], rtol=1e-4)
    np.testing.assert_allclose(history.motion("B").velocity[0], RATES[:2] + RATES[2] * np.array([-arm[1], arm[0]]), rtol=1e-4)


def test_a_link_without_modes_in_the_plane_is_a_rigid_body():
    run = Run()
    placed = run.add(Modal(BAR, FreeModes((4, 5, 6), counting="free")))
    node = add_anchor(placed, "B")
    run.watched = [(placed.ends["B"], PLACE), (rigid_marker(run.system, placed, "B"), PLACE, SPIN)]
    run.system.Assemble()
    assert run.system.systemData.ODE2Size() == 6 and placed.columns().shape == (1, 3)
    run.solve(1e-3, 50)
    history = run.motion(placed)
    energy = history.kinetic()
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)
    assert not history.strains()[0].energy.any()
    position = history.motion("B").position
    np.testing.assert_allclose([row[0][:2] for row in run.outputs], position, atol=1e-14)
    np.testing.assert_allclose([row[1][:2] for row in run.outputs], position, atol=1e-14)
    first = run.system.GetNodeODE2Index(node)
    np.testing.assert_allclose(run.q[:, first : first + 2] + POINTS["B"], position, atol=1e-9)


@pytest.mark.parametrize("modes", MODES, ids=NAMES)
def test_anchor_follows_the_cross_section_and_hands_on_forces(modes):
    """Force and moment on the anchor's node move the link as on its own end; the node stays with the cross-section."""
    runs = {}
    for way in ("own", "anchor"):
        run = runs[way] = Run()
        run.placed = run.add(Modal(BAR, modes))
        if way == "own":
            marker = rigid_marker(run.system, run.placed, "B")
        else:
            run.node = add_anchor(run.placed, "B")
            assert add_anchor(run.placed, "B") == run.node
            marker = run.system.AddMarker(eii.MarkerNodeRigid(nodeNumber=run.node))
        run.system.AddLoad(eii.LoadForceVector(markerNumber=marker, loadVector=[500.0, -300.0, 0.0]))
        run.system.AddLoad(eii.LoadTorqueVector(markerNumber=marker, loadVector=[0.0, 0.0, 7.0]))
        run.system.Assemble()
        run.solve(5e-4, 500)
    own, other = (run.motion(run.placed) for run in runs.values())
    assert np.abs(own.q[:, 3:]).max() > 0
    np.testing.assert_allclose(other.q, own.q, atol=1e-6 * np.abs(own.q[:, 3:]).max())
    run, motion = runs["anchor"], other.motion("B")
    first = run.system.GetNodeODE2Index(run.node)
    np.testing.assert_allclose(run.q[:, first : first + 2] + POINTS["B"], motion.position, atol=1e-9)
    np.testing.assert_allclose(run.q[:, first + 2] + TILT, motion.angle, atol=1e-12)
    np.testing.assert_allclose(run.q_t[5:, first + 2], motion.spin[5:], rtol=1e-4)


def test_weight_acts_at_the_centre_of_mass():
    run = Run()
    placed = run.add(Modal(BAR), rates=np.zeros(3))
    marker = run.system.AddMarker(eii.MarkerBodyMass(bodyNumber=placed.objects[0]))
    run.system.AddLoad(eii.LoadMassProportional(markerNumber=marker, loadVector=[0.0, -9.81, 0.0]))
    run.system.Assemble()
    run.solve(0.01, 20)
    history = run.motion(placed)
    np.testing.assert_allclose(history.centre()[2][1:], [[0.0, -9.81]] * (len(run.time) - 1), atol=1e-8)
    assert np.abs(history.q[:, 2:] - placed.reference[0, 2:]).max() < 1e-10
    drop = history.mass * (history.centre()[0][:, 1] - history.centre()[0][0, 1])
    assert drop[-1] == pytest.approx(-placed.model.mass * 9.81 * (run.time[-1] ** 2 - run.time[0] ** 2) / 2, rel=1e-6)


@pytest.mark.parametrize(("modes", "error"), [(MODES[0], 4e-3), (MODES[1], 1.1e-3)], ids=NAMES)
def test_natural_frequency_of_the_pinned_link(modes, error):
    """Pinned at A, its end B led along its axis: two of the three free modes are symmetric and do well."""
    run = Run()
    placed = run.add(Modal(BAR, modes), rates=np.zeros(3))
    run.pin(placed.ends["A"], POINTS["A"])
    guide = Guide("B", "bar", along=(np.cos(TILT), np.sin(TILT)), mass=1e-6)
    mechanism = Mechanism(points=POINTS, links=[Link("bar", "A", "B", placed.body)], guides=[guide])
    slider = guides.place(run.scene(mechanism), guide, 0.0)
    run.system.AddObject(eii.ObjectJointRevolute2D(markerNumbers=[slider.ends["B"], placed.ends["B"]]))
    run.system.Assemble()
    squares, _ = run.system.ComputeODE2Eigenvalues()
    found = np.sqrt(np.abs(squares))
    assert found[found > 1].min() == pytest.approx(beam_frequencies(member(BAR, LENGTH), "pinned-pinned", 1)[0], rel=error)


def test_modal_damping_decays_at_its_ratio():
    """A mode alone in free flight at rest: amplitude exp(-zeta omega t); all lost energy is the damping power's."""
    ratio = 0.03
    run = Run()
    placed = run.add(Modal(BAR, FreeModes((1,), "in-plane"), damping=ratio), rates=np.zeros(3))
    run.system.Assemble()
    run.deform(placed)
    omega = placed.model.frequency[0]
    run.solve(20 * pi / omega, 4000)
    history = run.motion(placed)
    energy = history.kinetic() + history.strains()[0].energy
    lost = np.concatenate(
        [[0], np.cumsum(np.diff(run.time) * (history.strains()[0].power[1:] + history.strains()[0].power[:-1]) / 2)]
    )
    np.testing.assert_allclose(energy + lost, energy[0], rtol=1e-4)
    assert energy[-1] / energy[0] == pytest.approx(np.exp(-2 * ratio * omega * (run.time[-1] - run.time[0])), rel=0.05)


# --- the crank-rocker with a modal and with a beam rocker -------------------------------------------------------------


def crank_rocker_run(rocker, duration=0.1, steps=2500):
    """Times, position and acceleration of B, deflection of the rocker, forces at its ideal joints B and C."""
    mechanism = crank_rocker(rocker, speed=10 * pi)
    closure, (start,) = closed(mechanism, [0.0])
    rates = start.q_t
    run, placed = Run(), {}
    for link in mechanism.links:
        placed[link.name] = BODIES[type(link.body)](run.scene(mechanism), link, rates[closure.index[link.name]])
    run.pin(placed["crank"].ends["O"], mechanism.points["O"])
    joints = [run.pin(placed["rocker"].ends["C"], mechanism.points["C"])]
    for first, second, point in (("crank", "coupler", "A"), ("coupler", "rocker", "B")):
        markers = [placed[name].ends[point] for name in (first, second)]
        joints.append(run.system.AddObject(eii.ObjectJointRevolute2D(markerNumbers=markers)))
    ground = run.system.AddNode(eii.NodePointGround())
    crank = placed["crank"].nodes[0]
    ends = [eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=k) for node, k in ((crank, 2), (ground, 0))]
    add_drive(run.system, mechanism.drives[0], *map(run.system.AddMarker, ends))
    run.system.Assemble()
    run.solve(duration, steps, radius=0.7, residual=1e-8 if isinstance(rocker, Modal) else 1e-4)
    rows = np.concatenate([run.system.systemData.GetObjectLTGAE(joints[k]) for k in (0, 2)])
    return run.time, *rocker_motion(run, placed["rocker"]), np.array(run.forces)[:, rows]


def rocker_motion(run, placed):
    history = run.motion(placed)
    if isinstance(placed.body, Modal):
        end = history.motion("B")
        return end.position, end.acceleration, history.deflection()
    columns = placed.columns()
    line = history.line(2)
    chord, middle = line[:, -1] - line[:, 0], line[:, line.shape[1] // 2] - line[:, 0]
    deflection = (chord[:, 0] * middle[:, 1] - chord[:, 1] * middle[:, 0]) / np.hypot(*chord.T)
    return line[:, -1], run.q_tt[:, columns[-1, :2]], deflection


def test_crank_rocker_moves_as_with_a_beam():
    """Ringing damped out, a modal and a beam rocker bend alike, and their joints carry the same forces."""
    ratio = 0.3
    bending, axial = 2 * ratio / (2 * pi * 380), 2 * ratio / (2 * pi * 14600)
    section = replace(BAR, material=replace(BAR.material, bending_damping=bending, axial_damping=axial))
    time, *beam = crank_rocker_run(Beam(section, elements=8))
    late = time > 0.06
    assert np.abs(beam[2][late]).max() > 4e-6  # the deflection the comparison is about
    for modes, allowed in ((CraigBampton(), [1e-8, 1e-6, 3e-3, 1e-6]), (MODES[0], [1e-6, 3e-6, 1.2e-2, 3e-6])):
        _, *modal = crank_rocker_run(Modal(BAR, modes, damping=ratio))
        errors = [np.abs((m - b)[late]).max() / np.abs(b[late]).max() for m, b in zip(modal, beam, strict=True)]
        assert (np.array(errors) < allowed).all(), errors
