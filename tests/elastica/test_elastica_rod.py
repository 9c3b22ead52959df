"""The boundary value problem against the closed form, its convergence, and the sense of every correction."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from buckler.elastica import pinned
from buckler.elastica.rod import Rod


def shape(solution):
    """Arc, place and angle of the half beyond mid-span, over the whole length, as `pinned.shape` counts them."""
    half = solution.half
    return 0.5 + 0.5 * half.s, 0.5 * half.end[0] + 0.5 * half.x, 0.5 * (half.y - half.end[1]), half.theta


SHORTENINGS = (1e-6, 1e-3, 0.01, 0.1, 0.3454, 0.6, 0.95, 1.0, 1.2, 1.5)


@pytest.mark.parametrize("u", SHORTENINGS)
def test_ideal_rod_is_the_closed_form(u):
    solution = Rod().at_shortening(u)
    assert solution.load == pytest.approx(pinned.load(u), rel=2e-14)
    assert 1 - solution.half.end[0] == pytest.approx(u, abs=1e-14)
    assert solution.half.residual < 1e-13
    arc, *found = shape(solution)
    for ours, exact in zip(found, pinned.shape(u, arc), strict=True):
        np.testing.assert_allclose(ours, exact, atol=2e-12)


def test_shape_converges_at_the_rate_of_its_nearest_singularity():
    """theta(s) is singular where Jacobi's sn has its pole, K'/(2 K) off mid-span: the error falls as rho^-nodes of a quarter."""
    u, nodes = 0.8, np.arange(4, 13, 2)
    m = np.sin(pinned.end_angle(u) / 2.0) ** 2
    pole = 1.0 + 4.0j * ellipk(1.0 - m) / ellipk(m)  # of a quarter at mid-span, mapped to [-1, 1]
    rho = abs(pole + np.sqrt(pole**2 - 1.0))
    errors = []
    for n in nodes:
        solution = Rod(nodes=int(n)).at_shortening(u)
        arc, _, _, theta = shape(solution)
        errors.append(np.max(np.abs(theta - pinned.shape(u, arc)[2])))
        assert 0.1 * errors[-1] < solution.half.residual < 10.0 * errors[-1]  # the residual tells the error
    rate = -np.polyfit(nodes, np.log(errors), 1)[0]
    assert rate == pytest.approx(np.log(rho), rel=0.15)
    assert errors[-1] < 1e-10


@pytest.mark.parametrize("rod", [Rod(axial=1e3), Rod(shear=50.0), Rod(axial=200.0, shear=60.0)])
def test_critical_load_is_where_the_buckled_branch_begins(rod):
    p = rod.critical_load
    assert p * (1.0 + p * (1.0 / rod.shear - 1.0 / rod.axial)) == pytest.approx(np.pi**2, rel=1e-14)
    onset = p / rod.axial
    loads = np.array([rod.at_shortening(onset + du).load for du in (1e-4, 2e-4)])
    assert 2.0 * loads[0] - loads[1] == pytest.approx(p, rel=1e-6)  # extrapolated to the onset


@pytest.mark.parametrize("p", [10.0, 13.0, 25.0])
@pytest.mark.parametrize("stiffness", [100.0, 1e4])
def test_equal_axial_and_shear_stiffness_only_add_p_over_ea(p, stiffness):
    """With c = 0 bending is untouched and every section's axial strain along the chord is -p/EA, exactly."""
    solution = Rod(axial=stiffness, shear=stiffness).at_shortening(pinned.shortening(p) + p / stiffness)
    assert solution.load == pytest.approx(p, rel=1e-12)
    arc, _, _, theta = shape(solution)
    np.testing.assert_allclose(theta, pinned.shape(pinned.shortening(p), arc)[2], atol=1e-11)


@pytest.mark.parametrize("u", [0.05, 0.4, 0.9])
@pytest.mark.parametrize("kind", ["axial", "shear"])
def test_load_correction_is_the_derivative_of_the_relaxed_energy(kind, u):
    """At fixed shortening a small compliance 1/S lowers the energy by p^2 (mean square share)/(2 S); p = dW/du."""
    nodes, weights = np.polynomial.legendre.leggauss(50)
    share = {"axial": np.cos, "shear": np.sin}[kind]

    def relaxed(v):
        theta = pinned.shape(v, (nodes + 1.0) / 2.0)[2]
        return 0.25 * pinned.load(v) ** 2 * (weights @ share(theta) ** 2)

    h, stiffness = 1e-3, 1e6
    first_order = -(8 * (relaxed(u + h) - relaxed(u - h)) - relaxed(u + 2 * h) + relaxed(u - 2 * h)) / (12 * h)
    change = stiffness * (Rod(**{kind: stiffness}).at_shortening(u).load - pinned.load(u))
    assert change == pytest.approx(first_order, rel=1e-3)
    half = stiffness / 2 * (Rod(**{kind: stiffness / 2}).at_shortening(u).load - pinned.load(u))
    assert abs(2 * change - half - first_order) < 1e-2 * abs(half - change)  # what remains is of second order


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Rod(axial=0.0), r"axial, shear = \(0\.0, inf\) must be above 0"),
        (lambda: Rod(axial=30.0).critical_load, r"axial = 30\.0 must be large enough to buckle"),
        (lambda: Rod().at_shortening(0.0), r"shortening = 0\.0 must be above 0, to 1\.5 \(end shortening/L\)"),
        (lambda: Rod(axial=100.0).at_shortening(0.11), r"0\.11 must be above 0\.111.*: the rod buckles at the first of these"),
        (
            lambda: Rod(axial=2.0, shear=0.9).at_shortening(1.5),
            r"axial = 2\.0 must be larger: the rod buckles at the end shortening 1\.64",
        ),
    ],
)
def test_wrong_input_is_named(call, message):
    with pytest.raises(ValueError, match=message):
        call()


@pytest.mark.parametrize("stocky", [Rod(axial=40.0), Rod(axial=50.0, shear=200.0), Rod(shear=2.0)])
def test_even_stocky_rods_find_their_buckled_branch(stocky):
    onset = stocky.critical_load / stocky.axial
    for u in np.linspace(onset + 0.01, 1.5, 12):
        solution = stocky.at_shortening(u)
        assert solution.half.residual < 1e-10 and 1 - solution.half.end[0] == pytest.approx(u, rel=1e-12)


def test_soft_rods_meet_the_equations_integrated_from_the_pin():
    """Axial and shear stiffness at random, also beside the least one at which a rod buckles; one mode, theta > 0 to mid-span."""
    rng = np.random.default_rng(2)
    shears = 10.0 ** rng.uniform(-0.5, 4.0, 24)
    compliances = 1.0 / shears + 1.0 / (2.0 * np.pi) ** 2 - np.where(rng.random(24) < 0.3, 1e-4, 0.01) * rng.uniform(0.1, 2.0, 24)
    for shear, compliance in zip(shears, compliances, strict=True):
        rod = Rod(axial=1.0 / compliance, shear=shear)
        onset = rod.critical_load / rod.axial
        if onset >= 1.5:
            continue
        u = rng.uniform(onset, 1.5)
        load, half = rod.at_shortening(u)

        def slopes(_, state, p=load, rod=rod):
            sin, cos = np.sin(state[0]), np.cos(state[0])
            return state[1], -p * sin * (1.0 + p * rod.softness * cos), cos - p * (cos**2 / rod.axial + sin**2 / rod.shear)

        found = solve_ivp(slopes, (0.0, 0.5), (-half.theta[-1], 0.0, 0.0), method="DOP853", rtol=1e-11, atol=1e-12).y
        assert found[0, -1] == pytest.approx(0.0, abs=1e-7) and np.all(found[0, :-1] > 0.0)
        assert 1.0 - 2.0 * found[2, -1] == pytest.approx(u, abs=1e-8)
