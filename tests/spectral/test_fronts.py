"""The order of elimination, factors and solutions, against dense matrices and counts of work."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("numba")

import numba
from spectral_scenes import apart, scenes, state

from buckler.mbs import Cable, Link, Mechanism, Revolute, Rigid, Section
from buckler.mbs.spectral import fronts
from buckler.mbs.spectral.elimination import fronts_of
from buckler.mbs.spectral.linear import Factors, SingularError
from buckler.mbs.spectral.scene import CompiledScene

SCENES = scenes()


@numba.njit
def _renew(e, a, lu, swaps, amount, x, part):
    fronts.factor(e, a, lu, swaps, amount)
    fronts.solve(e, lu, swaps, x, part)


def solved(e, a, right):
    x = np.array(right, dtype=a.dtype)
    lu, part = np.zeros(e.size, a.dtype), np.zeros(len(x), a.dtype)
    _renew(e, a, lu, np.zeros(len(e.unknowns), np.int64), np.zeros(len(x)), x, part)
    return x


def saddle(scene: CompiledScene, mass, terms, shift: complex):
    """Return the matrix [M + shift C + shift^2 K, (G - X)^T; G, 0]."""
    inner, r = mass + shift * terms.damping + shift**2 * terms.stiffness, len(scene.row_names)
    return np.block([[inner, (terms.jacobian - terms.cross).T], [terms.jacobian, np.zeros((r, r))]])


def chain(links: int, body) -> Mechanism:
    points = {f"P{i}": (0.1 * i, 0.0) for i in range(links + 1)}
    made = [Link(f"{i}", f"P{i}", f"P{i + 1}", body) for i in range(links)]
    joints = [Revolute(f"P{i}", f"{i - 1}" if i else "ground", f"{i}") for i in range(links)]
    return Mechanism(points=points, links=made, joints=joints, gravity=(0, -9.81))


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("shift", [0.0, 1e-3, 1e-3 + 2e-3j])
def test_solutions_are_those_of_the_dense_matrix(name: str, shift: complex) -> None:
    scene = SCENES[name]
    q, v, lam = state(scene, 1)
    matrix = saddle(scene, scene.mass_at(q), scene.assemble(q, v, 0.1, lam), shift)
    e, s = scene.fronts, scene.tables
    right = np.random.default_rng(2).standard_normal(len(matrix))
    found = solved(e, np.append(matrix[s.row, s.col], 0.0), right)
    assert apart(matrix @ found, right) < 1e-9
    assert apart(found, np.linalg.solve(matrix, right)) < 1e-7
    assert apart(Factors(matrix).solve(right), found) < 1e-7


def test_a_row_that_says_what_another_does_has_no_multiplier() -> None:
    """Two bars of 1 kg that one row of three holds together: the last two say the same."""
    gradient = np.array([[1.0, -1.0], [2.0, -2.0]])
    matrix = np.block([[np.eye(2), gradient.T], [gradient, np.zeros((2, 2))]])
    row, col = np.nonzero(matrix)
    e = fronts_of(row, col, 2, 4, np.ones(len(row), dtype=bool))
    found = solved(e, np.append(matrix[row, col], 0.0), [1.0, 0.0, 0.0, 0.0])
    assert found[:2] == pytest.approx([0.5, 0.5], abs=1e-15)
    assert np.count_nonzero(found[2:]) == 1


@pytest.mark.parametrize("body", [Rigid(Section(0.02, 0.005)), Cable(Section(0.02, 5e-4))], ids=["rigid", "strip"])
def test_work_grows_with_the_chain(body) -> None:
    """Entries of all fronts and the cubes of their sizes: twice as many links, twice as many."""

    def work(links: int) -> tuple[int, int]:
        sizes = CompiledScene.of(chain(links, body)).fronts.fronts[:, 1]
        return int((sizes**2).sum()), int((sizes**3).sum())

    for few, many in zip(work(20), work(40), strict=True):
        assert many < 2.1 * few


def test_a_matrix_without_inverse_says_so() -> None:
    scene = CompiledScene.of(chain(2, Rigid(Section(0.02, 0.005))))
    with pytest.raises(SingularError):
        Factors(saddle(scene, 0.0, scene.assemble(scene.q0), 1.0)).solve(np.ones(scene.size + 4))
