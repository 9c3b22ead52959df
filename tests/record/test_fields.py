"""Strains, energies and masses of flexible links in numpy against the engine's own forces and mass matrix."""

from dataclasses import replace

import exudyn as exu
import numpy as np
import pytest
from scipy.integrate import quad

from buckler.elastica import pinned
from buckler.mbs import STEEL, Beam, Cable, Link, Mechanism, Section, build
from buckler.mbs.engine.placed import EngineStates

MATERIAL = replace(STEEL, bending_damping=1e-3, axial_damping=2e-6)
STRIP = Section(width=0.030, thickness=0.0003, material=MATERIAL)
STRAIGHT = {
    "linear beam": Beam(STRIP, elements=3, nodes=2),
    "quadratic beam": Beam(STRIP, elements=3, nodes=3),
    "cable": Cable(STRIP, elements=3),
}
BOWED = {name: replace(body, imperfection=5e-3) for name, body in STRAIGHT.items()}
LENGTH = 0.31


EACH = [
    *(pytest.param(body, id=f"straight {name}") for name, body in STRAIGHT.items()),
    *(pytest.param(body, id=f"bowed {name}") for name, body in BOWED.items()),
]


class Lone:
    """One flexible link in the engine, free and turned by some angle."""

    def __init__(self, body, length=LENGTH, angle=0.7):
        end = (0.1 + length * np.cos(angle), -0.2 + length * np.sin(angle))
        self.scene = build(Mechanism({"A": (0.1, -0.2), "B": end}, [Link("strip", "A", "B", body)]))
        self.placed = self.scene.placed["strip"]
        self.columns = self.placed.columns()
        self.data = self.scene.system.systemData
        self.size = self.data.ODE2Size()

    def strip(self, q, q_t=None):
        """The link at displacements q, shape (..., coordinates)."""
        q = np.atleast_2d(q)
        q_t = np.zeros_like(q) if q_t is None else np.atleast_2d(q_t)
        return self.placed.motion(EngineStates(q, q_t, np.zeros_like(q)))

    def engine(self, q, q_t):
        """Generalised forces and mass matrix from the engine."""
        self.data.SetODE2Coordinates(q, configuration=exu.ConfigurationType.Initial)
        self.data.SetODE2Coordinates_t(q_t, configuration=exu.ConfigurationType.Initial)
        solver, settings = exu.MainSolverImplicitSecondOrder(), exu.SimulationSettings()
        settings.solution.file.write = False
        assert solver.InitializeSolver(self.scene.system, settings)
        solver.ComputeODE2RHS(self.scene.system)
        solver.ComputeMassMatrix(self.scene.system)
        return solver.GetSystemResidual()[: self.size].copy(), solver.GetSystemMassMatrix().copy()

    def turned(self, angle, shift=(0.0, 0.0)):
        """Displacements of a rigid motion, shape (coordinates,)."""
        return self.moved(self.placed.reference, angle, shift)

    def moved(self, total, angle, shift=(0.0, 0.0)):
        """Displacements of total coordinates that are moved rigidly, shape (coordinates,)."""
        c, s = np.cos(angle), np.sin(angle)
        turn, total = np.array([[c, -s], [s, c]]), total.copy()
        total[:, :2] = total[:, :2] @ turn.T + shift
        if isinstance(self.placed.body, Cable):
            total[:, 2:] = total[:, 2:] @ turn.T
        else:
            total[:, 2] += angle
        return self.flat(total - self.placed.reference)

    def spin(self, total, velocity, omega):
        """Rates of a rigid motion at total coordinates."""
        rate = np.zeros_like(total)
        rate[:, :2] = velocity + omega * np.column_stack([-total[:, 1], total[:, 0]])
        if isinstance(self.placed.body, Cable):
            rate[:, 2:] = omega * np.column_stack([-total[:, 3], total[:, 2]])
        else:
            rate[:, 2] = omega
        return self.flat(rate)

    def flat(self, nodal):
        vector = np.zeros(self.size)
        vector[self.columns] = nodal
        return vector


def energy(strip):
    return sum(strain.energy for strain in strip.strains())


def power(strip):
    return sum(strain.power for strain in strip.strains())


def somewhere(lone, seed=1):
    """Small random displacements about a turned place, and rates that are not small."""
    random = np.random.default_rng(seed)
    return lone.turned(0.4) + 1e-3 * random.standard_normal(lone.size), random.standard_normal(lone.size)


# --- against the engine -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("body", EACH)
def test_gradient_of_the_strain_energy_is_the_engines_force(body):
    lone, h = Lone(body), 1e-7
    q, v = somewhere(lone)
    steps = h * np.eye(lone.size)
    gradient = (energy(lone.strip(q + steps)) - energy(lone.strip(q - steps))) / (2 * h)
    force, _ = lone.engine(q, 0 * v)
    assert np.abs(gradient + force).max() < 1e-8 * np.abs(force).max()


@pytest.mark.parametrize("body", EACH)
def test_damping_power_is_that_of_the_engines_damping_force(body):
    lone = Lone(body)
    q, v = somewhere(lone)
    with_damping, without = lone.engine(q, v)[0], lone.engine(q, 0 * v)[0]
    assert power(lone.strip(q, v))[0] == pytest.approx(-v @ (with_damping - without), rel=1e-10)
    assert power(lone.strip(q, v))[0] > 0


@pytest.mark.parametrize("body", EACH)
def test_kinetic_energy_is_that_of_the_engines_mass_matrix(body):
    lone = Lone(body)
    q, v = somewhere(lone)
    assert lone.strip(q, v).kinetic()[0] == pytest.approx(0.5 * v @ lone.engine(q, v)[1] @ v, rel=1e-13)


@pytest.mark.parametrize("body", EACH)
def test_the_reference_is_free_of_stress(body):
    lone = Lone(body)
    at_rest = np.zeros(lone.size)
    force, _ = lone.engine(at_rest, at_rest)
    assert np.abs(force).max() < 1e-6 * STRIP.euler_load(LENGTH)
    assert energy(lone.strip(at_rest))[0] < 1e-12 * STRIP.bending_stiffness / LENGTH


# --- objectivity ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("body", EACH)
def test_strains_do_not_see_a_rigid_motion(body):
    lone = Lone(body)
    bent, _ = somewhere(lone)
    after = lone.moved(lone.placed.reference + bent[lone.columns], 1.1, (0.2, -0.5))
    for one, two in zip(lone.strip(bent).strains(), lone.strip(after).strains(), strict=True):
        assert two.value == pytest.approx(one.value, abs=1e-11)


@pytest.mark.parametrize("body", EACH)
def test_strain_rates_are_derivatives_of_strains(body):
    lone, h = Lone(body), 1e-6
    q, v = somewhere(lone)
    ahead, behind = lone.strip(q + h * v).strains(), lone.strip(q - h * v).strains()
    for now, one, two in zip(lone.strip(q, v).strains(), ahead, behind, strict=True):
        difference = (one.value - two.value) / (2 * h)
        assert now.rate == pytest.approx(difference, abs=1e-6 * np.abs(difference).max())


# --- closed forms -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("body", STRAIGHT.values(), ids=STRAIGHT)
def test_energy_and_power_of_a_uniform_stretch(body):
    """E A L eps^2/2, and tau E A L eps_t^2."""
    lone, stretch, rate = Lone(body), 1e-4, 0.3
    away = lone.placed.reference[:, :2] - lone.placed.reference[0, :2]
    along = away[-1] / LENGTH
    change = np.zeros_like(lone.placed.reference)
    change[:, :2] = away
    if isinstance(body, Cable):
        change[:, 2:] = along
    strip = lone.strip(lone.flat(stretch * change), lone.flat(rate * change))
    assert energy(strip)[0] == pytest.approx(0.5 * STRIP.axial_stiffness * LENGTH * stretch**2, rel=1e-9)
    lost = MATERIAL.axial_damping * STRIP.axial_stiffness * LENGTH * rate**2
    assert power(strip)[0] == pytest.approx(lost, rel=1e-9)
    assert np.linalg.norm(strip.line()[0, -1] - strip.line()[0, 0]) == pytest.approx(LENGTH * (1 + stretch), rel=1e-12)


RATES = {"linear beam": 2, "quadratic beam": 4, "cable": 4}


@pytest.mark.parametrize("name", RATES)
def test_bending_energy_of_the_exact_elastica(name):
    """Nodes on the closed form; the bending part tends to its energy at the element's own rate."""
    u, errors = 0.3, []
    for elements in (8, 16, 32):
        lone = Lone(replace(STRAIGHT[name], elements=elements), angle=0.0)
        s = np.linspace(0, 1, len(lone.placed.nodes))
        x, y, theta = pinned.shape(u, s)
        rotation = [np.cos(theta), np.sin(theta)] if name == "cable" else [theta]
        total = np.stack([0.1 + x * LENGTH, -0.2 + y * LENGTH, *rotation], axis=-1)
        bending = lone.strip(lone.flat(total - lone.placed.reference)).strains()[-1]
        errors.append(abs(bending.energy[0] * LENGTH / STRIP.bending_stiffness / pinned.energy(u) - 1))
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    assert rates == pytest.approx(RATES[name], abs=0.2)
    assert errors[-1] < (1e-2 if RATES[name] == 2 else 1e-4)


def test_each_strain_is_of_its_own_kind():
    """Axial, shear, bending: a pure stretch, a pure shear and a pure curvature of one beam element."""
    lone = Lone(Beam(STRIP, elements=1, nodes=2), angle=0.0)
    for coordinate, expected in {
        (1, 0): (1.0, 0.0, 0.0),  # the far end moves along the strip
        (1, 1): (0.0, 1.0, 0.0),  # or across it
        (1, 2): (0.0, -LENGTH / 2, 1.0),  # or turns: half of the turn is shear at mid-element
    }.items():
        change = np.zeros_like(lone.placed.reference)
        change[coordinate] = 1e-6
        axial, shear, bending = (s.value[0, 0, 0] for s in lone.strip(lone.flat(change)).strains())
        assert np.array([axial, shear, bending]) * LENGTH / 1e-6 == pytest.approx(expected, abs=1e-5)


# --- the line and its bow ---------------------------------------------------------------------------------------------


def arc(length, bow, stations):
    """Places and directions of a bow, and its arc length."""
    curve = Beam(STRIP, imperfection=bow).curve(length)
    return *curve.places(stations).T, curve.direction(stations), curve.length


@pytest.mark.parametrize("bow", [1e-5, 3e-3, -3e-3, 0.03])
@pytest.mark.parametrize("count", [2, 3, 17, 300])
def test_bow_has_the_given_chord_and_unit_slope(bow, count):
    stations = np.linspace(0, 1, count)
    x, y, theta, length = arc(LENGTH, bow, stations)
    assert x[0] == y[0] == 0 and x[-1] == pytest.approx(LENGTH, rel=1e-15)
    assert y[-1] == pytest.approx(0.0, abs=1e-9 * abs(bow))
    amplitude = np.pi * bow / LENGTH
    assert theta == pytest.approx(amplitude * np.cos(np.pi * stations), abs=1e-15)
    assert length * quad(lambda s: np.cos(amplitude * np.cos(np.pi * s)), 0, 1, epsabs=1e-14)[0] == pytest.approx(LENGTH)
    for part, at in ((np.cos, x), (np.sin, y)):
        for k in (count // 3, count - 1):
            integral = quad(lambda s, part=part: part(amplitude * np.cos(np.pi * s)), 0, stations[k], epsabs=1e-14)[0]
            assert at[k] == pytest.approx(length * integral, abs=1e-12)


@pytest.mark.parametrize("bow", [4e-3, -4e-3])
@pytest.mark.parametrize("body", BOWED.values(), ids=BOWED)
def test_bow_is_positive_to_the_left(body, bow):
    """From start to end; both ends stay where the points are."""
    lone = Lone(replace(body, imperfection=bow, elements=4))
    line = lone.strip(np.zeros(lone.size)).line()[0]
    chord, middle = line[-1] - line[0], line[len(line) // 2] - line[0]
    assert np.hypot(*chord) == pytest.approx(LENGTH, rel=1e-13)
    assert (chord[0] * middle[1] - chord[1] * middle[0]) / LENGTH == pytest.approx(bow, rel=0.01)
