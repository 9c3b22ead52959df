"""The kernel of a joint with clearance: balance, virtual work, geometry, and its compiled form against plain Python."""

import numpy as np
import pytest

from buckler.mbs import Clearance, laws
from buckler.mbs.engine.clearance import tabulate
from buckler.mbs.laws import contact
from buckler.mbs.laws.contact import kernel_of as kernel
from buckler.mbs.laws.journal import BRISTLE, COLUMNS, MEMORY, ONSET, SINCE, SLIDING, End

GAP, PIN = 1e-4, 5e-3
RATTLING, FRICTION = laws.Impact(8e9, 253.0, 1e-5), laws.AdamsFriction(0.3, 0.1)


ENDS = [
    (End(-1, (0.1, 0.2), (0.0, 0.0)), End(0, (0.3, 0.2), (-0.2, 0.0))),
    (End(0, (0.3, 0.2), (0.2, 0.1)), End(3, (0.6, 0.4), (-0.1, -0.1))),
    (End(3, (0.6, 0.4), (0.3, 0.0)), End(0, (0.3, 0.2), (0.6, 0.2))),
]
"""Pins and bushes of ground and two bodies: node and arm place both centres of a joint at one point."""
FRICTIONS = [
    laws.NoFriction(), laws.Coulomb(0.1, 1e-3, 0.01), FRICTION, laws.Ambrosio(0.1, 0.01, 0.02), laws.Threlfall(0.1, 0.01),
    laws.Stribeck(0.3, 0.1, 0.1), laws.LuGre(0.3, 0.1, 0.1, 1e5, 10.0, 0.01),
]  # fmt: skip
NORMALS = [laws.ExactRestitution(8e9, 0.5), RATTLING, laws.KelvinVoigt(1e6, 50.0), laws.Hertz(8e9)]


class Bodies:
    """Joints between ground and two bodies in states drawn by chance, some of them in contact."""

    def __init__(self, law, friction, joints=(0, 1, 2), count=40):
        names = [("ground", "a"), ("a", "b"), ("b", "a")]
        gaps = (1e-4, 1e-5, 2e-3)
        made = [Clearance("P", *names[j], PIN, gaps[j], law, friction) for j in joints]
        self.joints = tabulate(made, [ENDS[j] for j in joints])
        self.law, self.friction, self.size = law, friction, len(joints)
        chance = np.random.default_rng(7)
        self.q = chance.normal(size=(count, 6)) * ([3e-4, 3e-4, 3e-3] * 2)
        self.q_t = chance.normal(size=(count, 6)) * ([0.3, 0.3, 3.0] * 2)
        self.t = chance.uniform(1.0, 1.001, count)
        self.memory = np.empty((count, self.size, len(MEMORY)))
        self.memory[:, :, ONSET] = chance.uniform(0.01, 1.0, (count, self.size))
        self.memory[:, :, BRISTLE] = chance.normal(size=(count, self.size)) * 1e-6
        self.memory[:, :, SLIDING] = chance.normal(size=(count, self.size)) * 0.1
        self.memory[:, :, SINCE] = 1.0

    def forces(self):
        """Generalised forces, shape (states, 6)."""
        made, out = kernel(self.law, self.friction), np.zeros_like(self.q)
        for row, *state in zip(out, self.t, self.q, self.q_t, self.memory, strict=True):
            made.forces(*state, self.joints, row)
        return out

    def report(self, q=None):
        """What COLUMNS names, each of shape (states, joints)."""
        q, out = self.q if q is None else q, np.zeros((len(self.q), self.size, len(COLUMNS)))
        made = kernel(self.law, self.friction)
        for row, *state in zip(out, self.t, q, self.q_t, self.memory, strict=True):
            made.report(*state, self.joints, row)
        return {name: out[:, :, k] for k, name in enumerate(COLUMNS)}


def test_forces_and_moments_of_two_bodies_cancel(plain):
    """About any point, friction and all; only the second joint, which holds both bodies, acts."""
    pair = Bodies(RATTLING, FRICTION, joints=(1, 2))
    f = pair.forces()
    assert (f != 0).any(axis=1).sum() > 20
    place = pair.q + np.array([0.3, 0.2, 0, 0.6, 0.4, 0])
    for x, y in ((0, 0), (3, -7), (-100, 20)):
        moment = sum((place[:, k] - x) * f[:, k + 1] - (place[:, k + 1] - y) * f[:, k] + f[:, k + 2] for k in (0, 3))
        scale = np.abs(f[:, :2]).max() * max(1, abs(x), abs(y))
        assert np.abs(moment).max() < 1e-12 * scale
    assert np.abs(f[:, :2] + f[:, 3:5]).max() < 1e-12 * np.abs(f).max()


@pytest.mark.parametrize("friction", FRICTIONS, ids=lambda law: type(law).__name__)
def test_power_is_that_of_the_forces_reported(plain, friction):
    """Virtual work ties depth rate and sliding speed to the generalised forces: Q q_t = -(N d' + T v)."""
    bodies = Bodies(RATTLING, friction)
    found = bodies.report()
    given = (bodies.forces() * bodies.q_t).sum(axis=1)
    taken = (found["normal"] * found["rate"] + found["tangential"] * found["sliding"]).sum(axis=1)
    assert np.abs(taken).max() > 1 and np.abs(given + taken).max() < 1e-12 * np.abs(taken).max()
    if not isinstance(friction, laws.LuGre):  # a bristle springs back
        assert (found["tangential"] * found["sliding"] >= 0).all()


def test_rate_is_the_derivative_of_the_depth(plain):
    bodies, h = Bodies(RATTLING, FRICTION), 1e-7
    ahead, behind = (bodies.report(bodies.q + s * bodies.q_t)["depth"] for s in (h, -h))
    rate = bodies.report()["rate"]
    assert (ahead - behind) / (2 * h) == pytest.approx(rate, abs=1e-6 * np.abs(rate).max())


def test_depth_normal_and_force_of_a_pin_put_somewhere(plain):
    """Pin of a body held 0.5 mm along (3, 4)/5 from its bush on the ground, turning in place at 2 rad/s."""
    law, friction = laws.Hertz(1e9), laws.Coulomb(0.25, 1e-3)
    joint, made = Clearance("P", "a", "ground", PIN, GAP, law, friction), kernel(law, friction)
    joints = tabulate([joint], [(End(0, (1.0, 1.0), (0.0, 0.0)), End(-1, (1.0, 1.0), (0.0, 0.0)))])
    out, f = np.zeros((1, len(COLUMNS))), np.zeros(3)
    state = 0.0, np.array([3e-4, 4e-4, 0.7]), np.array([0.0, 0.0, 2.0]), np.zeros((1, len(MEMORY)))
    made.report(*state, joints, out), made.forces(*state, joints, f)
    normal = 1e9 * 4e-4**1.5
    n, t = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    expected = [normal, 0.25 * normal, 4e-4, 0.0, 2.0 * PIN, 0.0, *(-normal * n - 0.25 * normal * t), *n]
    assert out[0] == pytest.approx(expected, rel=1e-12, abs=1e-16)
    assert f == pytest.approx([*expected[6:8], -0.25 * normal * PIN], rel=1e-12)


PAIRS = [(NORMALS[0], friction) for friction in FRICTIONS] + [(normal, FRICTION) for normal in NORMALS[1:]]


@pytest.mark.parametrize(("law", "friction"), PAIRS, ids=lambda law: type(law).__name__)
def test_compiled_kernel_equals_plain_python(law, friction, monkeypatch):
    pytest.importorskip("numba")
    made = Bodies(law, friction)
    compiled = made.forces(), made.report()
    with monkeypatch.context() as patch:
        patch.setattr(contact, "has_compiler", lambda: False)
        assert not kernel(law, friction).compiled
        plain = made.forces(), made.report()
    assert np.abs(plain[0]).max() > 1
    assert compiled[0] == pytest.approx(plain[0], rel=1e-13, abs=1e-13 * np.abs(plain[0]).max())  # other order of sums
    for name in COLUMNS:
        assert compiled[1][name] == pytest.approx(plain[1][name], rel=1e-13, abs=1e-300)


def test_law_that_asks_itself_for_its_force_runs_in_python():
    """What the compiler cannot follow is no error."""

    class Halved(laws.Hertz):
        def force(self, depth, rate, onset):
            return 0.5 * laws.Hertz.force(self, depth, rate, onset)

    made = kernel(Halved(8e9), laws.NoFriction())
    assert not made.compiled
    states, out, whole = Bodies(Halved(8e9), laws.NoFriction()), np.zeros(6), np.zeros(6)
    given = states.t[0], states.q[0], states.q_t[0], states.memory[0], states.joints
    made.forces(*given, out)
    kernel(laws.Hertz(8e9), laws.NoFriction()).forces(*given, whole)
    assert np.abs(out).max() > 0 and out == pytest.approx(0.5 * whole, rel=1e-12)
