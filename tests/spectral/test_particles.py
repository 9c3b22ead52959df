"""The compiled solver's right-hand side against particles, virtual power and differences, in plain numpy."""

import numpy as np
import pytest
from fourbar import FourBar, ideal_state, run

pytest.importorskip("numba")

from particles import ONSET, G, Particles, bias, by_virtual_power, compiled, slope, state_in_contact, velocity

from buckler.mbs.laws import AdamsFriction, ExactRestitution, Impact, NoFriction, PowerLaw

LAW = Impact(1e8, 3e3, 1e-4)
FRICTION = AdamsFriction(0.3, 0.1, 0.1, 1.0)


@pytest.mark.parametrize("m", [0, 1, 3])
@pytest.mark.parametrize("seed", range(4))
def test_accelerations_forces_and_powers(m, seed):
    rng = np.random.default_rng(100 * m + seed)
    model = Particles(m, rng, start=rng.uniform(0, 6), gap=(1e-3, 2e-3, 1.5e-3, 1e-3), law=LAW, friction=FRICTION)
    q, v = state_in_contact(model.bar, rng)
    t = 0.013
    expected, forces, lost = by_virtual_power(model, q, v, t)
    rate, acceleration, ledger, joints, rush = compiled(model.bar, q, v, t)
    assert np.count_nonzero(forces) >= 2
    np.testing.assert_allclose(joints.force[0], forces, rtol=1e-9, atol=1e-8)
    np.testing.assert_allclose(acceleration, expected, rtol=1e-7, atol=1e-6 * abs(expected).max())
    np.testing.assert_allclose(rate, v, rtol=0)
    np.testing.assert_allclose(ledger[1:9].reshape(2, 4), lost, rtol=1e-9, atol=1e-9)

    def middle(z, s):
        return model.point(3, (0.0, 0.0), z, s, model.sections[2, :2])

    expected = slope(lambda z: middle(z, t), q) @ acceleration + bias(middle, q, v, t)
    watched = np.concatenate([acceleration[[2, 3, 5, 6]], expected])
    np.testing.assert_allclose(rush, watched, rtol=1e-7, atol=1e-6 * abs(acceleration).max())


@pytest.mark.parametrize("m", [0, 2])
def test_power_of_the_drive_closes_the_balance(m):
    """d(kinetic + strain + weight)/dt = drive - what goes into the joints and the modes; kinetic energy of the particles."""
    rng = np.random.default_rng(5 + m)
    model = Particles(m, rng, start=1.0, gap=1e-3, law=LAW, friction=FRICTION)
    q, v = state_in_contact(model.bar, rng)
    t, h = 0.2, 1e-7
    _, a, ledger, *_ = compiled(model.bar, q, v, t)

    def energy(q, v, t):
        found = 0.5 * model.frequency**2 @ q[8:] ** 2 if m else 0.0
        for weight, place in model.masses():
            found += weight * (0.5 * (velocity(place, q, v, t) ** 2).sum() - place(q, t) @ model.bar.gravity)
        return found

    change = (energy(q + h * v, v + h * a, t + h) - energy(q - h * v, v - h * a, t - h)) / (2 * h)
    expected = ledger[0] - ledger[1:9].sum() - ledger[9]
    assert abs(expected) > 1 and change == pytest.approx(expected, rel=1e-5)


def test_energies_of_a_run_are_those_of_the_particles():
    model = Particles(2, np.random.default_rng(11), start=1.0, gap=1e-3, law=LAW, friction=FRICTION)
    q, v = state_in_contact(model.bar, np.random.default_rng(12))
    found = run(model.bar, 3e-3, state=np.concatenate([q, v]), samples=31, tolerance=1e-9)
    assert found.energy_balance < 1e-6
    for i in (0, 17, 30):
        q, v, t = found.q[i], found.q_t[i], found.time[i]
        kinetic = sum(0.5 * weight * (velocity(place, q, v, t) ** 2).sum() for weight, place in model.masses())
        weight = -sum(weight * place(q, t) @ model.bar.gravity for weight, place in model.masses())
        assert found.kinetic[i] == pytest.approx(kinetic, rel=1e-10)
        assert found.weight[i] == pytest.approx(weight, rel=1e-10)
        assert found.strain[i] == pytest.approx(0.5 * model.frequency**2 @ q[8:] ** 2, rel=1e-10)


@pytest.mark.parametrize("gaps", [(0, 0, 0, 0), (1e-3, 0, 0, 0), (0, 1e-3, 0, 1e-3), (1e-3, 1e-3, 0, 1e-3)])
@pytest.mark.parametrize("m", [0, 2])
def test_ideal_joints_hold_and_their_forces_do_the_accelerating(gaps, m):
    """Joint by joint: centres keep together; and the same accelerations follow by virtual power from the forces reported."""
    rng = np.random.default_rng(8)
    model = Particles(m, rng, start=2.0, gap=gaps, law=LAW, friction=NoFriction())
    state = ideal_state(model.bar)
    n, t = state.size // 2, 0.0
    q, v = state[:n], state[n:]
    ideal = [(j, k) for j in range(4) for k in range(2) if gaps[j] == 0]

    def apart(z, s):
        return np.array([(model.centre(j, 0, z, s) - model.centre(j, 1, z, s))[k] for j, k in ideal])

    v[8:] = rng.normal(0, 1.0, m)  # and what the joints then ask of the rest
    v -= np.linalg.lstsq(slope(lambda z: apart(z, t), q), velocity(apart, q, v, t), rcond=None)[0]
    _, a, _, joints, _ = compiled(model.bar, q, v, t)
    drift = slope(lambda z: apart(z, t), q) @ a + bias(apart, q, v, t)
    assert abs(drift).max() < 1e-6 * abs(a).max()
    mass, load = np.zeros((n, n)), np.zeros(n)
    for weight, place in model.masses():
        jacobian = slope(lambda z, place=place: place(z, t), q)
        mass += weight * jacobian.T @ jacobian
        load += weight * jacobian.T @ (np.array(G) - bias(place, q, v, t))
    for j in range(4):
        jacobian = slope(lambda z, j=j: model.centre(j, 0, z, t) - model.centre(j, 1, z, t), q)
        load += jacobian.T @ joints.force[0, j]
        assert gaps[j] == 0 or abs(joints.force[0, j]).max() == 0
    if m:
        load[8:] -= 2 * model.damping * model.frequency * v[8:]
    np.testing.assert_allclose(mass @ a, load, rtol=1e-6, atol=1e-6 * abs(load).max())


class Cubic(PowerLaw):
    """A law of a user's own, with a method that calls another and a parameter in mm."""

    stiffness, exponent = 1e14, 3.0

    def __init__(self, damping):
        self.damping = damping

    def force(self, depth, rate, onset):
        return self.elastic(depth) * max(0.0, 1.0 + self.damping * rate / onset)


@pytest.mark.parametrize("law", [Cubic(0.2), ExactRestitution(1e9, 0.6)])
def test_any_law_that_is_plain_arithmetic(law):
    rng = np.random.default_rng(1)
    bar = FourBar(gap=1e-3, law=law, friction=NoFriction(), start=1.0)
    q, v = state_in_contact(bar, rng)
    joints = compiled(bar, q, v, 0.0)[3]
    assert (joints.depth > 0).sum() >= 2 and (joints.normal > 0).any()
    for depth, rate, force, onset in zip(joints.depth[0], joints.rate[0], joints.normal[0], ONSET, strict=True):
        assert force == pytest.approx(law.force(depth, rate, onset) if depth > 0 else 0.0, rel=1e-12)
