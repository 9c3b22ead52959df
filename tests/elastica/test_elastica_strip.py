"""The strip between any ends: closed forms, Euler loads with shear, convergence, and the sense of every load."""

import numpy as np
import pytest
from exact import shapes
from exact.strip_paths import follow
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

from buckler.elastica import pinned
from buckler.elastica.collocation import NewtonDivergedError
from buckler.elastica.strip import Load, Strip


@pytest.mark.parametrize("force", [0.1, 1.0, 5.0, 10.0, 40.0])
def test_cantilever_under_a_tip_force_is_the_elliptic_elastica(force):
    """Bisshopp and Drucker: sqrt(P L^2/(E I)) = K - F(phi1), sin(phi1) = 1/(k sqrt 2), 2 k^2 = 1 + sin(tip angle)."""
    solution = Strip().equilibrium(Load(end=(0.0, -force)))
    x, y, theta = solution.end
    m = (1.0 + np.sin(-theta)) / 2.0
    phi = np.arcsin(1.0 / np.sqrt(2.0 * m))
    assert ellipk(m) - ellipkinc(phi, m) == pytest.approx(np.sqrt(force), rel=1e-13)
    assert x == pytest.approx(np.sqrt(2.0 * np.sin(-theta) / force), rel=1e-13)
    assert -y == pytest.approx(1.0 - 2.0 * (ellipe(m) - ellipeinc(phi, m)) / np.sqrt(force), rel=1e-12)
    assert solution.residual < 1e-12


@pytest.mark.parametrize("moment", [-2.0, 1.0, 2.0 * np.pi])
def test_cantilever_under_a_moment_is_a_circle(moment):
    x, y, theta = Strip().equilibrium(Load(moment=moment)).end
    assert (x, y, theta) == pytest.approx((np.sin(moment) / moment, (1.0 - np.cos(moment)) / moment, moment), abs=1e-13)


def test_linear_deflections_of_shear_and_stretching():
    """A small force bends by F/3 and shears by F/shear; along the strip it stretches by F/axial; halfway it bends by 5/48 F."""
    f, strip = 1e-5, Strip(axial=40.0, shear=7.0)
    assert strip.equilibrium(Load(end=(0.0, f))).end[1] / f == pytest.approx(1.0 / 3.0 + 1.0 / 7.0, rel=1e-8)
    assert (strip.equilibrium(Load(end=(f, 0.0))).end[0] - 1.0) / f == pytest.approx(1.0 / 40.0, rel=1e-8)
    assert strip.equilibrium(Load(inner=(0.0, f))).end[1] / f == pytest.approx(5.0 / 48.0 + 0.5 / 7.0, rel=1e-8)
    beam = Strip("clamped", "pinned", axial=1e4)
    assert beam.equilibrium(Load(inner=(0.0, f))).inner[1] / f == pytest.approx(7.0 / 768.0, rel=1e-6)
    assert beam.equilibrium(Load(move=(0.0, f, 0.0))).force[-1, 1] / f == pytest.approx(3.0, rel=1e-6)
    both = Strip("clamped", "clamped", axial=1e4)
    assert both.equilibrium(Load(inner=(0.0, f))).inner[1] / f == pytest.approx(1.0 / 192.0, rel=1e-6)
    assert both.equilibrium(Load(move=(0.0, 0.0, f))).moment[-1] / f == pytest.approx(4.0, rel=1e-6)


def test_a_curved_cantilever_bends_as_castigliano_says():
    """Quarter circle of radius R, a small force F on its tip, back along the start: M = F R cos, the tip moves F R^3 pi/4."""
    strip, f = Strip(angle=lambda s: np.pi / 2.0 * s), 1e-6
    x, y, _ = strip.equilibrium(Load(end=(-f, 0.0))).end
    radius = 2.0 / np.pi
    assert (strip.rest[0] - x) / f == pytest.approx(radius**3 * np.pi / 4.0, rel=1e-5)
    assert (y - strip.rest[1]) / f == pytest.approx(radius**3 / 2.0, rel=1e-5)  # M times the lever of a force across, R (1 - sin)


def test_clamped_strip_is_four_quarters_of_the_pinned_one():
    """Between its inflection points a clamped strip is a pinned one of half the length: four times the load."""
    strip = Strip("clamped", "clamped")
    for u in (0.05, 0.3, 0.6):
        turn, p = 2.0 * np.sqrt(u), 4.0 * pinned.load(u)
        guess = np.concatenate((turn * np.sin(2.0 * np.pi * strip.grid.s), (2.0 * np.pi * turn, -p, 0.0)))
        ours = strip.equilibrium(Load(move=(-u, 0.0, 0.0)), guess=guess)
        assert -ours.force[0, 0] == pytest.approx(p, rel=1e-13)
        assert ours.inner[1] == pytest.approx(pinned.shape(u, np.array([0.5]))[1][0], rel=1e-12)


@pytest.mark.parametrize("shear", [np.inf, 300.0])
@pytest.mark.parametrize(
    ("start", "end", "wave"), [("pinned", "roller", np.pi), ("clamped", "free", np.pi / 2.0), ("clamped", "guided", 2.0 * np.pi)]
)
def test_euler_loads_with_shear_are_haringx(start, end, wave, shear):
    """Haringx: p (1 + p (1/shear - 1/axial)) = wave^2: shear lowers the load, compression raises it."""
    strip = Strip(start, end, axial=1e4, shear=shear)
    first = follow(strip, Load(end=(-1.0, 0.0)), 1.2 * wave**2, step=0.1).branchings[0].factor
    assert first * (1.0 + first * (1.0 / shear - 1e-4)) == pytest.approx(wave**2, rel=1e-12)


def test_clamped_pinned_column_buckles_where_tan_x_is_x():
    """With c = 1/shear - 1/axial = 0 the load is that of the plain column, 20.19."""
    root = brentq(lambda x: np.sin(x) - x * np.cos(x), 4.0, 5.0, xtol=1e-15)
    path = follow(Strip("clamped", "roller", axial=1e9), Load(end=(-1.0, 0.0)), 25.0, step=0.1)
    assert path.branchings[0].factor == pytest.approx(root**2, rel=1e-7)


def test_solution_converges_geometrically_and_tells_its_error():
    exact = Strip("clamped", "clamped", shapes.circle(0.6), axial=1e4, nodes=40).equilibrium(Load(inner=(0.3, -12.0)))
    errors, nodes = [], np.array((8, 10, 12, 14, 16))
    for n in nodes:
        ours = Strip("clamped", "clamped", shapes.circle(0.6), axial=1e4, nodes=int(n)).equilibrium(Load(inner=(0.3, -12.0)))
        errors.append(abs(ours.inner[1] - exact.inner[1]))
        assert errors[-1] < 10.0 * ours.residual
    assert np.polyfit(nodes, np.log(errors), 1)[0] < -1.0  # a decimal digit with every two and a half points
    assert errors[-1] < 1e-9


@pytest.mark.parametrize(("start", "end"), [("clamped", "clamped"), ("pinned", "pinned"), ("clamped", "pinned")])
def test_shooting_from_the_solved_start_reaches_the_end(start, end):
    """The differential equations by steps, without collocation: same place, angle and moment at s = 1."""
    a, g, force = 1.0 / 900.0, 1.0 / 150.0, np.array((1.5, -9.0))
    ours = Strip(start, end, shapes.circle(0.5), 900.0, 150.0, at=0.35).equilibrium(Load(inner=tuple(force)))

    def rates(s, state):
        theta, m = state[2:]
        n = ours.force[0] - force * (s > 0.35)
        tangent, normal = np.array((np.cos(theta), np.sin(theta))), np.array((-np.sin(theta), np.cos(theta)))
        slope = (1.0 + a * n @ tangent) * tangent + g * (n @ normal) * normal
        return (*slope, m - 1.0, n[0] * slope[1] - n[1] * slope[0])  # theta0' = -2 (0.5)

    state = np.array((0.0, 0.0, ours.theta[0], ours.moment[0]))
    for piece in ((0.0, 0.35), (0.35 + 1e-15, 1.0)):
        state = solve_ivp(rates, piece, state, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    np.testing.assert_allclose(state, (*ours.end, ours.moment[-1]), atol=1e-11)
    assert ours.end[:2] == pytest.approx((np.sin(0.5) / 0.5, 0.0), abs=1e-13)


def test_forces_and_moments_balance():
    """What the start gets, the loads and what the end gets add up to nothing, about any point."""
    load = Load(inner=(1.5, -9.0))
    ours = Strip("clamped", "clamped", shapes.circle(0.5), axial=900.0, shear=200.0, at=0.35).equilibrium(load)
    start, end, inner = ours.force[0], ours.force[-1], np.array(load.inner)
    np.testing.assert_allclose(end + inner - start, 0.0, atol=1e-12)
    about = ours.moment[-1] - ours.moment[0] + ours.end[0] * end[1] - ours.end[1] * end[0]
    assert about + ours.inner[0] * inner[1] - ours.inner[1] * inner[0] == pytest.approx(0.0, abs=1e-11)


def test_beyond_a_limit_point_there_is_no_equilibrium_in_reach():
    with pytest.raises(NewtonDivergedError, match="a limit point, or a branching"):
        Strip("pinned", "pinned", shapes.circle(0.25), axial=1e4, at=0.47).equilibrium(Load(inner=(0.0, -9.0)))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Strip("free"), "start = free must be clamped or pinned"),
        (lambda: Strip(end="hinged"), "end = hinged must be one of free, rail, roller"),
        (lambda: Strip("pinned", "free"), "end = free must be fixed in y"),
        (lambda: Strip(axial=0.0), r"axial = 0\.0 must be above 0 \(E A L\^2/\(E I\)\)"),
        (lambda: Strip(shear=np.nan), "shear = nan must be above 0"),
        (lambda: Strip(at=0.0), r"at = 0\.0 must be 0\.01 to 0\.99 \(arc length over L\)"),
        (lambda: Strip(nodes=3), "nodes = 3 must be a whole number from 4 to 200"),
        (
            lambda: Strip(angle=lambda s: s / 0.0 if False else s * np.nan),
            "angle = .* must be a function that gives one finite angle",
        ),
        (lambda: Load(end=(np.nan, 0.0)), r"end = \(nan, 0\.0\) must be 2 numbers from -1e6 to 1e6 \(F L\^2/\(E I\)\)"),
        (lambda: Load(moment=np.inf), r"moment = inf must be -1e6 to 1e6 \(M L/\(E I\)\)"),
        (lambda: Strip().equilibrium(Load(), np.nan), "factor = nan must be"),
    ],
)
def test_wrong_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


def test_curves_are_followed_by_arc_length():
    s = np.linspace(0.0, 1.0, 9)
    angle, length = shapes.along(lambda u: (np.sin(6.0 * u - 3.0), np.cos(6.0 * u - 3.0)))
    assert length == pytest.approx(6.0, rel=1e-14)
    np.testing.assert_allclose(angle(s), shapes.circle(3.0)(s), atol=1e-11)
    k = (0.2 * np.pi) ** 2
    angle, length = shapes.half_sine(0.2)
    assert length == pytest.approx(2.0 / np.pi * np.sqrt(1.0 + k) * ellipe(k / (1.0 + k)), rel=1e-14)
    x, y, tangent = Strip("pinned", "pinned", angle).rest
    assert (x, y, tangent) == pytest.approx((1.0 / length, 0.0, -np.arctan(0.2 * np.pi)), abs=1e-12)
