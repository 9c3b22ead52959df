"""The kernel's derivatives against differences, its forces against balance and energy."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("numba")

import numba
from spectral_scenes import apart, energy, play, scenes, slope, state

from buckler.mbs.elements import Clearance, Modal, Rigid, Section
from buckler.mbs.laws import AdamsFriction, Ambrosio, Coulomb, ExactRestitution, Impact, KelvinVoigt, LuGre, Stribeck, Threlfall
from buckler.mbs.library import RATTLING, crank_rocker
from buckler.mbs.modal import BarModes
from buckler.mbs.spectral import kernel, start
from buckler.mbs.spectral.dense import at_times
from buckler.mbs.spectral.lawtable import friction, normal_force
from buckler.mbs.spectral.output import Output
from buckler.mbs.spectral.scene import CompiledScene

SCENES = scenes()
TIME, SINCE = 0.1, 1e-4


@pytest.mark.parametrize("name", SCENES)
def test_tangents(name: str) -> None:
    scene = SCENES[name]
    q, v, lam = state(scene, 1)
    memory = scene.memory()

    def force(q, v, lam=lam):
        a = scene.assemble(q, v, TIME, lam, memory, since=SINCE, tangents=False)
        return a.force - a.jacobian.T @ lam

    a = scene.assemble(q, v, TIME, lam, memory, since=SINCE)
    assert apart(a.stiffness, -slope(lambda q: force(q, v), q, 2e-7)) < 1e-6
    damping = -slope(lambda v: force(q, v), v, 1e-4)
    assert np.abs(a.damping - damping).max() <= 1e-6 * max(np.abs(damping).max(), 1e-3)
    residual = slope(lambda q: scene.assemble(q, v, TIME, lam, tangents=False).residual, q, 1e-6)
    assert apart(a.jacobian, residual) < 1e-8


@pytest.mark.parametrize("name", SCENES)
def test_constraints_at_acceleration_level(name: str) -> None:
    """G a = change says that the second derivative of g vanishes: along q + v s the speed of G v is -change + drive's part."""
    scene = SCENES[name]
    q, v, _ = state(scene, 2)
    a = scene.assemble(q, v, TIME, tangents=False)
    h = 1e-5

    def speed(s):
        return scene.assemble(q + s * v, v, TIME, tangents=False).jacobian @ v

    convective = (8 * (speed(h) - speed(-h)) - (speed(2 * h) - speed(-2 * h))) / (12 * h)
    assert np.allclose(a.change, -convective, rtol=1e-6, atol=1e-7)


def test_modal_mass_and_its_slope() -> None:
    scene = SCENES["modal"]
    q, _, _ = state(scene, 3, 1e-2)
    a = np.random.default_rng(4).standard_normal(scene.size)
    values = np.zeros_like(scene.tables.mass)
    _mass_slope(scene.tables, scene.work, q, a, values)
    out = scene.build_matrix(values)[: scene.size, : scene.size]
    assert np.abs(out - slope(lambda q: scene.mass_at(q) @ a, q, 1e-4)).max() < 1e-9 * np.abs(scene.mass_at(q)).max()


@pytest.mark.parametrize("name", ["beam", "cable"])
def test_elastic_force_is_the_slope_of_the_energy(name: str) -> None:
    scene = SCENES[name]
    q, _, _ = state(scene, 5)
    zero = np.zeros(scene.size)
    scene.tables.factors[:-1] = 0.0
    try:
        force = scene.assemble(q, zero, tangents=False).force
    finally:
        scene.tables.factors[:-1] = 1.0
    assert apart(force, -slope(lambda q: np.array([energy(scene, q, zero)["strain"]]), q, 1e-7)[0]) < 1e-7


@pytest.mark.parametrize("name", ["beam", "cable", "lugre", "impact"])
def test_inner_forces_do_no_work_in_a_rigid_motion(name: str) -> None:
    """Strips' and journals' forces, moments included, cancel in a motion of the whole mechanism: virtual work to rounding."""
    scene = SCENES[name]
    q, v, _ = state(scene, 6, 2e-4, 10.0)
    scene.tables.factors[-1] = 0.0
    a = scene.assemble(q, v, TIME, since=SINCE, tangents=False)
    if name in ("lugre", "impact"):
        # only journals between links: those on the ground exert forces from outside
        inner = [i for i, n in enumerate(scene.force_names) if "ground" not in n]
        scene.tables.factors[:] = 0.0
        scene.tables.factors[inner] = 1.0
        a = scene.assemble(q, v, TIME, since=SINCE, tangents=False)
    scene.tables.factors[:] = 1.0
    assert np.abs(a.force).max() > 1.0
    motion = _rigid(scene, q)
    assert np.abs(motion.T @ a.force).max() < 1e-12 * (np.abs(motion).T @ np.abs(a.force)).max()


def _rigid(scene, q):
    """Rates of all coordinates in translations and a turn of the whole about the origin."""
    out = np.zeros((scene.size, 3))
    for name, body in scene.builder.bodies.items():
        if hasattr(body, "pieces"):
            for piece in body.pieces:
                x, y, *angle = piece.dofs
                out[x[:2], 0] = out[y[:2], 1] = 1.0
                out[x, 2], out[y, 2] = -q[y], q[x]
                for place in angle:
                    out[place[:2], 2] = 1.0
        else:
            o = body.offset
            out[o, 0] = out[o + 1, 1] = out[o + 2, 2] = 1.0
            out[o, 2], out[o + 1, 2] = -q[o + 1], q[o]
        assert name
    return out


@numba.njit(error_model="numpy")
def _mass_slope(s, w, q, a, out):
    kernel.add_inertia_stiffness(s, w, q, a, out)


@numba.njit(error_model="numpy")
def _of_laws(s, depths, rates, bristle):
    """Normal forces of law 0 and friction coefficients of law 1, the rates the speeds of both."""
    normal = [normal_force(s, 0, depths[i], rates[i], 0.1) for i in range(len(depths))]
    return np.array(normal), np.array([friction(s, 1, rate, bristle) for rate in rates])


PAIRS = [
    (KelvinVoigt(1e6, 5e3), Coulomb(0.1, 1e-3, 0.01)),
    (ExactRestitution(8e9, 0.5), AdamsFriction(0.3, 0.2)),
    (Impact(1e8, 1e3, 1e-5), Ambrosio(0.1, 0.01, 0.02)),
    (Impact(1e8, 1e3, 1e-5), Threlfall(0.1, 0.01)),
    (KelvinVoigt(1e6, 5e3), Stribeck(0.3, 0.1, 0.1)),
    (KelvinVoigt(1e6, 5e3), LuGre(0.3, 0.1, 0.1, 1e5, 10.0, 0.01)),
]


@pytest.mark.parametrize(("law", "rubs"), PAIRS, ids=lambda law: type(law).__name__)
def test_laws_of_the_table_are_those_of_python(law, rubs) -> None:
    tables = CompiledScene.of(crank_rocker(Rigid(Section(0.02, 0.005)), speed=30.0, play=play(law, rubs), with_play="A")).tables
    depths, rates, bristle = np.geomspace(1e-7, 1e-4, 13), np.linspace(-0.06, 0.06, 13), 2e-6
    forces, coefficients = _of_laws(tables, depths, rates, bristle)
    plain = [law.force(d, r, 0.1) for d, r in zip(depths, rates, strict=True)]
    assert forces == pytest.approx(np.array(plain, dtype=float), rel=1e-12) and np.abs(forces).max() > 0
    given = (bristle,) if isinstance(rubs, LuGre) else ()
    plain = [rubs.coefficient(rate, *given) for rate in rates]
    assert coefficients == pytest.approx(np.array(plain, dtype=float), rel=1e-12, abs=1e-15) and np.abs(coefficients).max() > 0


def test_modes_that_no_constraint_touches_accelerate_as_by_the_whole_matrix(monkeypatch) -> None:
    """Their part of M(q) is inverted in closed form; amplitudes and speeds are far beyond what a rocker has."""
    rubbing = AdamsFriction(0.3, 0.1, 0.1, 1.0)
    rocker = Modal(Section(20e-3, 5e-3), BarModes(3, 2))
    mechanism = crank_rocker(rocker, speed=31.4, play=lambda *at: Clearance(*at, 5e-3, 2.5e-4, RATTLING, rubbing))
    scene, draw = CompiledScene.of(mechanism), np.random.default_rng(3)
    n, time = scene.size, np.zeros(1)
    q, v = scene.q0 + 1e-2 * draw.normal(size=(1, n)), 3.0 * draw.normal(size=(1, n))
    row = Output(time, q, v, np.zeros((1, n)), np.zeros((1, len(scene.row_names))), scene.memory()[None])
    found = at_times(scene, row, time).a
    monkeypatch.setattr(start, "_are_modal_links_free", lambda tables: False)
    whole = at_times(scene, row, time).a
    assert scene.tables.modal.shape[0] == 1
    np.testing.assert_allclose(found, whole, rtol=1e-9, atol=1e-9 * np.abs(whole).max())
