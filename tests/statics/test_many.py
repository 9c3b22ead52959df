"""Statics of many strips: sparse factors and Lanczos's method against dense matrices of all of it."""

from math import isqrt

import numpy as np
import pytest
from scipy.sparse import csr_array

from buckler.mbs import Cable, Link, Mechanism, Modal, Revolute, Rigid, Section, Weld, equilibrium, frequencies
from buckler.mbs.modal import BarModes
from buckler.mbs.spectral.scene import CompiledScene
from buckler.mbs.statics import problem as problems
from buckler.mbs.statics import spectrum as spectra
from buckler.mbs.statics.algebra import least_squares, solve
from buckler.mbs.statics.answer import Ending
from buckler.mbs.statics.problem import Problem, loads_of

STRIP = Cable(Section(0.010, 0.0005), elements=4)
NEVER = 10**9


def lattice(links, body):
    """Sides of a net's meshes, row by row, hung up along its upper edge: strips downward, and across between their ends."""
    wide = max(1, isqrt(links // 2))
    sides = []
    row = 0
    while len(sides) < links:
        sides += [((i, row), (i, row + 1)) for i in range(wide)]
        row += 1
        sides += [((i, row), (i + 1, row)) for i in range(wide - 1)]
    points, holders = {}, {}
    made, joints = [], []
    for k, ends in enumerate(sides[:links]):
        names = [f"P{i}_{j}" for i, j in ends]
        made.append(Link(f"link{k}", names[0], names[1], body))
        for name, (i, j) in zip(names, ends, strict=True):
            points[name] = (0.1 * i, -0.1 * j)
            if j == 0 or name in holders:
                joints.append(Revolute(name, "ground" if j == 0 else holders[name], f"link{k}"))
            holders.setdefault(name, f"link{k}")
    return Mechanism(points, made, joints, gravity=(6.94, -6.94))


@pytest.fixture(scope="module")
def hanging():
    """A net of sixteen strips that hangs."""
    found = equilibrium(lattice(16, STRIP), degree=8)
    assert found.status is Ending.OK and found.stable
    return found


def both(monkeypatch, scene, rest):
    """The spectrum by Lanczos's method and that of dense matrices."""
    problem, found = Problem(scene, loads_of(scene)), []
    for many in (0, NEVER):
        monkeypatch.setattr(spectra, "SPARSE_COORDINATES", many)
        found.append(problem.spectrum(rest))
    return found


def test_lowest_values_are_those_of_dense_matrices(monkeypatch, hanging):
    rest = problems.Rest(hanging.q, hanging.multipliers, 1.0)
    few, all_ = both(monkeypatch, hanging.scene, rest)
    count = len(few.values)
    assert 20 <= count < len(all_.values)
    assert np.abs(few.values - all_.values[:count]).max() < 1e-8 * np.abs(few.values).max()
    assert np.all(np.abs(few.values - all_.values[:count]) <= few.rounding + all_.rounding[:count])


def test_free_motions_of_a_net_without_load_are_all_found_though_their_values_are_equal(monkeypatch, hanging):
    """Stress-free, the net shears: dense matrices say in how many ways."""
    drawn = Problem(hanging.scene).start(0.0)
    few, all_ = both(monkeypatch, hanging.scene, drawn)
    assert few.neutral.sum() == all_.neutral.sum() > 2
    assert few.stable and all_.stable


def test_a_singular_net_is_solved_by_least_squares_of_least_size(hanging):
    drawn = Problem(hanging.scene)
    matrix = drawn.scale_matrix(drawn.assemble(drawn.start(0.0)))[0]
    sparse, dense = csr_array(matrix), matrix if isinstance(matrix, np.ndarray) else matrix.toarray()
    right = dense @ np.random.default_rng(1).standard_normal(len(dense))
    assert np.linalg.matrix_rank(dense, rtol=1e-12) < len(dense)
    truth = np.linalg.lstsq(dense, right, rcond=1e-12)[0]
    for found in (least_squares(sparse, right, 1e-12), solve(sparse, right)):
        assert np.abs(dense @ found - right).max() < 1e-9 * np.abs(right).max()
    assert least_squares(sparse, right, 1e-12) == pytest.approx(truth, abs=1e-4 * np.abs(truth).max())


@pytest.mark.parametrize("length", [1.0, 2.0])
def test_the_extent_of_two_bars_in_line_is_twice_their_length(length):
    """Also if the bars are 1 m long, so that their length is the number that is the unit of angles."""
    points = {"O": (0, 0), "A": (length, 0), "B": (2 * length, 0)}
    bars = [Link("a", "O", "A", Rigid(Section(0.02, 0.002))), Link("b", "A", "B", Rigid(Section(0.02, 0.002)))]
    mechanism = Mechanism(points, bars, [Revolute("O", "ground", "a"), Revolute("A", "a", "b")])
    extents = Problem(CompiledScene.of(mechanism)).extents
    assert sorted(extents) == [1.0, 1.0, *4 * [2 * length]]


def test_coordinates_of_modes_have_the_extents_of_their_units_and_are_no_angles():
    body = Modal(Section(0.02, 0.002), BarModes(bending=2, axial=1), damping=0.01)
    scene = CompiledScene.of(Mechanism({"A": (0, 0), "B": (0.5, 0)}, [Link("s", "A", "B", body)], [Weld("A", "s", "ground")]))
    modes = slice(3, scene.size)
    assert np.array_equal(Problem(scene).extents[modes], scene.units[modes])
    assert np.flatnonzero(scene.is_angle).tolist() == [2]


@pytest.mark.slow
def test_a_hundred_strips_hang_as_their_weight_says():
    """What the ground carries is the weight of all strips; no small motion grows, and twenty frequencies are known to 1e-6."""
    mechanism = lattice(100, STRIP)
    found = equilibrium(mechanism)
    assert found.status is Ending.OK and found.stable and not found.neutral
    joints = {name: each for name, each in mechanism.elements().items() if isinstance(each, Revolute)}
    held = sum(found.reaction(name) for name, joint in joints.items() if joint.first == "ground")
    mass = sum(link.body.section.mass_per_length * mechanism.length(link.name) for link in mechanism.links)
    assert np.hypot(*held) == pytest.approx(mass * np.hypot(*mechanism.gravity), rel=1e-9)
    tones = frequencies(mechanism, found, count=20)
    assert tones.status is Ending.OK and len(tones.hertz) == 20 and (tones.errors < 2e-6 * tones.hertz[0]).all()
