"""Modal links in the engine: momentum and energy of a link that is thrown, spins and rings."""

import numpy as np
import pytest

pytest.importorskip("skfem")

import exudyn as exu

from buckler.mbs import Link, Mechanism
from buckler.mbs.engine.build import BODIES
from buckler.mbs.engine.placed import EngineStates
from buckler.mbs.engine.scene import EngineScene
from buckler.mbs.library import BAR
from buckler.mbs.modal import CraigBampton, FreeModes, Modal

exu.config.printToConsole = False
LENGTH, TILT = 0.175, 0.7
POINTS = {"A": (0.1, 0.2), "B": (0.1 + LENGTH * np.cos(TILT), 0.2 + LENGTH * np.sin(TILT))}
RATES = np.array([1.0, 2.0, 300.0])


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
        return placed.motion(EngineStates(self.q, self.q_t, self.q_tt))

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
        size = 3e-4 / placed.scales[0, 3:] / (1 + np.arange(len(model))) ** 3
        columns = placed.columns()[0, 3:]
        data, start = self.system.systemData, exu.ConfigurationType.Initial
        q, q_t = data.GetODE2Coordinates(start), data.GetODE2Coordinates_t(start)
        q[columns] = size * rng.standard_normal(len(model))
        q_t[columns] = size * model.frequency * rng.standard_normal(len(model))
        data.SetODE2Coordinates(q, start)
        data.SetODE2Coordinates_t(q_t, start)


MODES = [FreeModes((1, 2, 3), "in-plane"), CraigBampton(fixed=4)]
NAMES = ["free", "Craig-Bampton"]


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
        q, kinetic = history.q, lambda rates, history=history: history.model.kinetic(history.q, rates)
        # momenta are the derivatives of the kinetic energy, which is quadratic in the rates
        px, py, spin = ((kinetic(history.q_t + unit) - kinetic(history.q_t - unit)) / 2 for unit in np.eye(3, q.shape[1]))
        linear, angular = np.stack([px, py]).T, q[:, 0] * py - q[:, 1] * px + spin
        assert history.strains()[0].energy[0] > 1e-4
        np.testing.assert_allclose(linear - linear[0], 0.0, atol=1e-10)
        errors.append([np.abs(energy / energy[0] - 1).max(), np.abs(angular / angular[0] - 1).max()])
    errors = np.array(errors)
    assert (errors[1] < 1e-7).all(), errors
    np.testing.assert_allclose(np.log2(errors[0] / errors[1]), 2.0, atol=0.4)
