"""Gears, racks, belts and ropes: closed forms of motion and of all forces, in every solver."""

from dataclasses import replace

import numpy as np
import pytest

from buckler import mbs

STEPS = mbs.Controlled(1e-7)
EQUAL = mbs.Exudyn(mbs.Equal(4000), spectral_radius=0.6)
"""Constraint forces ring where steps change their size; springs are damped by few steps."""
SOLVERS = pytest.mark.parametrize("solver", [mbs.Exudyn(STEPS), mbs.Spectral(STEPS)], ids=["Exudyn", "Spectral"])
G = 9.81


def disc(name, at, beside, mass, inertia):
    """A link that turns about its start, its centre of mass there."""
    return mbs.Link(name, at, beside, mbs.Rigid.of(mass=mass, inertia=inertia, centre=(0.0, 0.0)))


# --- gears ----------------------------------------------------------------------------------------------------------------

RING, MASS, SPEED, AHEAD = 0.2, 0.7, 3.0, 0.4
"""Radius of a ring gear, m; mass at the rim of a gear half as large inside it; speed of the arm, rad/s, its angle at t = 0."""


def cardan():
    """A gear that rolls inside a ring twice as large, on an arm: each point of its rim moves on a straight line."""
    c, s = np.cos(AHEAD), np.sin(AHEAD)
    half = RING / 2
    return mbs.Mechanism(
        {"O": (0, 0), "A": (half * c, half * s), "Q": (RING * c, 0.0)},
        [
            mbs.Link("arm", "O", "A", mbs.Rigid.of(mass=0.1, inertia=1e-4, centre=(0.0, 0.0))),
            mbs.Link("planet", "A", "Q", mbs.Rigid.of(mass=MASS, inertia=2e-3, centre=(half, 0.0))),
        ],
        [mbs.Revolute("O", "ground", "arm"), mbs.Revolute("A", "arm", "planet")],
        drives=[mbs.Drive("arm", SPEED)],
        couplings=[mbs.Gear("ground:O", "planet:A", ratio=2.0, carrier="arm")],
    )


@pytest.mark.parametrize("solver", [EQUAL, mbs.Spectral(STEPS), mbs.Closure()], ids=["Exudyn", "Spectral", "Closure"])
def test_cardan_circles_draw_a_straight_line_and_push_as_newton_says(solver):
    """Rim at (R cos, 0) : torque of the arm m R^2 w^2 sin cos; axle and teeth by force and moment balance of the gear."""
    found = mbs.simulate(cardan(), 2.0, solver=solver)
    assert found.ok, found.message
    angle = AHEAD + SPEED * found.time
    c, s = np.cos(angle), np.sin(angle)
    size = RING * SPEED**2 * MASS
    np.testing.assert_allclose(found.signals["Q.x"], RING * c, atol=2e-6 * RING)
    np.testing.assert_allclose(found.signals["Q.y"], 0.0, atol=2e-6 * RING)
    np.testing.assert_allclose(found.signals["drive.torque"], MASS * (RING * SPEED) ** 2 * s * c, atol=2e-3 * size * RING)
    teeth, axle = [], []
    for cos, sin in zip(c, s, strict=True):
        # unknown: axle's force (fx, fy) on the gear at A, teeth's force F along (-sin, cos) at the pitch point R (cos, sin)
        (ax, ay), (px, py) = RING * np.array([-cos / 2, sin / 2]), RING * np.array([0.0, sin])  # from Q
        rows = [[1, 0, -sin], [0, 1, cos], [-ay, ax, px * cos + py * sin]]
        fx, fy, force = np.linalg.solve(rows, [-MASS * RING * SPEED**2 * cos, 0.0, 0.0])
        axle.append((fx, fy))
        teeth.append(force)
    for letter, expected in zip("xy", np.transpose(axle), strict=True):
        np.testing.assert_allclose(found.signals[f"A.arm-planet.f{letter}"], expected, atol=2e-3 * size)
    np.testing.assert_allclose(found.signals["gear.ground-planet.torque"], np.array(teeth) * RING / 2, atol=2e-3 * size * RING)


@SOLVERS
@pytest.mark.parametrize("ratio", [-2.0, 0.4])
def test_gears_on_fixed_axles_share_a_torque_and_push_their_axles(solver, ratio):
    """Angular acceleration T / (I1 + ratio^2 I2); torque on the second I2 times its own; axles bear the teeth's force."""
    one, two, torque, apart = 2e-3, 5e-3, 0.3, 0.15
    mechanism = mbs.Mechanism(
        {"A": (0, 0), "a": (0.05, 0), "B": (0, apart), "b": (0.05, apart)},
        [disc("one", "A", "a", 1.0, one), disc("two", "B", "b", 1.0, two)],
        [mbs.Revolute("A", "ground", "one"), mbs.Revolute("B", "ground", "two")],
        loads=[mbs.Torque("one", torque)],
        couplings=[mbs.Gear("one:A", "two:B", ratio)],
    )
    found = mbs.simulate(mechanism, 0.3, solver=solver)
    assert found.ok, found.message
    acceleration = torque / (one + ratio**2 * two)
    turned = np.unwrap(np.arctan2(found.signals["a.y"], found.signals["a.x"]))
    np.testing.assert_allclose(turned, acceleration * found.time**2 / 2, atol=1e-5)
    on_second = two * ratio * acceleration
    np.testing.assert_allclose(found.signals["gear.one-two.torque"], on_second, rtol=1e-3)
    force = on_second / (apart - ratio * apart / (ratio - 1))  # torque over the second's radius
    np.testing.assert_allclose(np.abs(found.signals["B.ground-two.fx"]), abs(force), rtol=1e-3)
    np.testing.assert_allclose(found.signals["A.ground-one.fx"], -found.signals["B.ground-two.fx"], rtol=1e-3)


# --- racks ----------------------------------------------------------------------------------------------------------------


@SOLVERS
def test_rack_and_pinion(solver):
    """Acceleration T r / (I + m r^2); the teeth's force m a acts at the pitch line, so that the guide bears its moment."""
    radius, mass, inertia, torque, low = 0.04, 0.6, 3e-4, 0.2, 0.1
    mechanism = mbs.Mechanism(
        {"O": (0, 0), "o": (0, 0.02), "R": (-0.1, -low), "S": (0.1, -low)},
        [
            disc("pinion", "O", "o", 0.3, inertia),
            mbs.Link("rack", "R", "S", mbs.Rigid.of(mass=mass, inertia=1e-3, centre=(0.1, 0.0))),
        ],
        [mbs.Revolute("O", "ground", "pinion"), mbs.Slider("R", "rack", "ground", along=(1, 0))],
        loads=[mbs.Torque("pinion", torque)],
        couplings=[mbs.Rack("pinion:O", "rack:R", radius)],
    )
    found = mbs.simulate(mechanism, 0.2, solver=solver)
    assert found.ok, found.message
    acceleration = torque * radius / (inertia + mass * radius**2)
    np.testing.assert_allclose(found.signals["rack.x"], acceleration * found.time**2 / 2, atol=1e-6)
    force = mass * acceleration
    np.testing.assert_allclose(found.signals["rack.pinion-rack.force"], force, rtol=1e-3)
    np.testing.assert_allclose(found.signals["O.ground-pinion.fx"], force, rtol=1e-3)
    # about the rack's own centre: the teeth above it by low - radius, the guide's moment; on the ground the opposite
    np.testing.assert_allclose(found.signals["R.rack-ground.moment"], -force * (low - radius), rtol=1e-3)


# --- ropes ----------------------------------------------------------------------------------------------------------------


def atwood(one=1.5, two=1.0, wheel=0.0, radius=0.05):
    """Two weights on vertical guides: a rope over a point, or over a wheel with inertia."""
    points = {"P": (0, 0), "A": (-radius, -0.6), "a": (-radius, -0.7), "B": (radius, -0.5), "b": (radius, -0.6)}
    links = [
        mbs.Link("left", "A", "a", mbs.Rigid.of(mass=one, inertia=1e-3, centre=(0.0, 0.0))),
        mbs.Link("right", "B", "b", mbs.Rigid.of(mass=two, inertia=1e-3, centre=(0.0, 0.0))),
    ]
    guides = [mbs.Slider("A", "left", "ground", along=(0, 1)), mbs.Slider("B", "right", "ground", along=(0, 1))]
    if not wheel:
        at = {**points, "P": (-radius, 0.0), "R": (radius, 0.0)}
        return mbs.Mechanism(at, links, guides, couplings=[mbs.Rope("A", "B", over=("P", "R"))], gravity=(0, -G))
    up, down = mbs.Rack("wheel:P", "left:A", radius, (0, -1)), mbs.Rack("wheel:P", "right:B", radius, (0, 1))
    joints = [*guides, mbs.Revolute("P", "ground", "wheel")]
    return mbs.Mechanism(
        {**points, "p": (0, 0.02)}, [*links, disc("wheel", "P", "p", 0.2, wheel)], joints, couplings=[up, down], gravity=(0, -G)
    )


@SOLVERS
@pytest.mark.parametrize("wheel", [0.0, 2e-3])
def test_atwood_machine(solver, wheel):
    """Acceleration (m1 - m2) g / (m1 + m2 + I / r^2), tension 2 m1 m2 g / (m1 + m2)."""
    found = mbs.simulate(atwood(wheel=wheel), 0.4, solver=solver)
    assert found.ok, found.message
    acceleration = 0.5 * G / (2.5 + wheel / 0.05**2)
    np.testing.assert_allclose(found.signals["B.y"], -0.5 + acceleration * found.time**2 / 2, atol=2e-6)
    if wheel:
        np.testing.assert_allclose(found.signals["rack.wheel-right.force"], G + acceleration, rtol=1e-3)
    else:
        np.testing.assert_allclose(found.signals["rope.A-B.tension"], 2 * 1.5 * G / 2.5, rtol=1e-3)


@SOLVERS
def test_rope_round_a_corner_gives_what_falling_loses(solver):
    """A bead on a level line is drawn below the pulley by a weight: its speed from the energy, the weight's from the geometry."""
    bead, weight = 0.8, 1.2
    mechanism = mbs.Mechanism(
        {"P": (0.5, 0.3), "A": (0, 0), "a": (0.05, 0), "B": (0.5, -0.2), "b": (0.55, -0.2)},
        [
            mbs.Link("bead", "A", "a", mbs.Rigid.of(mass=bead, inertia=1e-3, centre=(0.0, 0.0))),
            mbs.Link("weight", "B", "b", mbs.Rigid.of(mass=weight, inertia=1e-3, centre=(0.0, 0.0))),
        ],
        [mbs.Slider("A", "bead", "ground", along=(1, 0)), mbs.Slider("B", "weight", "ground", along=(0, 1))],
        couplings=[mbs.Rope("A", "B", over=("P",))],
        gravity=(0, -G),
    )
    found = mbs.simulate(mechanism, 0.3, solver=solver)
    assert found.ok, found.message
    x, fallen = found.signals["A.x"], -0.2 - found.signals["B.y"]
    np.testing.assert_allclose(fallen, np.hypot(0.5, 0.3) - np.hypot(0.5 - x, 0.3), atol=1e-7)
    share = (0.5 - x) / np.hypot(0.5 - x, 0.3)  # speed of the weight for one of the bead
    speed = np.sqrt(2 * weight * G * fallen / (bead + weight * share**2))
    np.testing.assert_allclose(found.signals["A.vx"], speed, atol=2e-5)


@SOLVERS
def test_a_rope_that_would_push_is_suspect(solver):
    """The lighter weight is thrown up faster than the heavier one can draw: the rope goes slack."""
    thrown = replace(atwood(), loads=[mbs.Force("B", (0.0, 40.0))])
    found = mbs.simulate(thrown, 0.1, solver=solver)
    assert found.status == "SUSPECT" and "rope.A-B.tension" in found.message and "slack" in found.message


# --- belts ----------------------------------------------------------------------------------------------------------------

FIRST, SECOND, SMALL, LARGE = 1e-3, 6e-3, 0.03, 0.07


def belted(torque=0.0, crossed=False):
    """Two pulleys on fixed axles."""
    loads = [mbs.Torque("one", torque)] if torque else []
    return mbs.Mechanism(
        {"A": (0, 0), "a": (0.02, 0), "B": (0.3, 0), "b": (0.32, 0)},
        [disc("one", "A", "a", 1.0, FIRST), disc("two", "B", "b", 1.0, SECOND)],
        [mbs.Revolute("A", "ground", "one"), mbs.Revolute("B", "ground", "two")],
        loads=loads,
        couplings=[mbs.Belt("one:A", "two:B", SMALL, LARGE, crossed)],
    )


@SOLVERS
@pytest.mark.parametrize("crossed", [False, True])
def test_an_inextensible_belt_shares_the_torque_by_radii(solver, crossed):
    found = mbs.simulate(belted(0.1, crossed=crossed), 0.3, solver=solver)
    assert found.ok, found.message
    acceleration = 0.1 / (FIRST + SECOND * (SMALL / LARGE) ** 2)
    turned = np.unwrap(np.arctan2(found.signals["b.y"], found.signals["b.x"] - 0.3))
    sign = -1 if crossed else 1
    np.testing.assert_allclose(turned, sign * acceleration * SMALL / LARGE * found.time**2 / 2, atol=1e-5)
    pull = SECOND * acceleration * SMALL / LARGE / LARGE
    np.testing.assert_allclose(found.signals["belt.one-two.force"], pull, rtol=1e-3)


def test_statics_and_frequencies_know_couplings():
    """Two pulleys swing on a torsion spring; a weight on a rope over two pulleys rests where a spring holds the rest of it."""
    sprung = replace(belted(), loads=[mbs.TorsionSpring("ground", "two", 0.3)])
    omega = np.sqrt(0.3 / (SECOND + FIRST * (LARGE / SMALL) ** 2))
    assert mbs.frequencies(sprung, count=1).hertz[0] == pytest.approx(omega / (2 * np.pi), rel=1e-9)
    held = replace(atwood(), loads=[mbs.Spring("ground:R", "B", 500.0, free_length=0.6)])
    rest = mbs.equilibrium(held)  # 1.5 g in the rope draws B up, 1 g down, and the pressed spring the rest
    np.testing.assert_allclose(rest.point("right", "B").position, (0.05, -0.6 + 0.5 * G / 500.0), rtol=1e-9)
    np.testing.assert_allclose(rest.reaction("rope.A-B"), 1.5 * G, rtol=1e-9)
