"""Equilibrium paths of arches: limit loads against shallow theory in closed form and published ones, branchings, convergence."""

from math import cos, pi, sin

import numpy as np
import pytest
from exact import shapes
from exact.published import PUBLISHED
from exact.strip_paths import follow
from scipy.optimize import minimize_scalar

from buckler.elastica.strip import Load, Strip

DOWN = Load(inner=(0.0, -1.0))
GAUSS = np.polynomial.legendre.leggauss(40)


def arch(ends, half_angle, axial, **kw):
    return Strip(ends, ends, shapes.circle(half_angle), axial=axial, **kw)


def shallow_loads(ends, curvature, axial, mu):
    """Both central loads at which a shallow parabolic arch of unit span has the thrust mu^2.

    v'''' + mu^2 v'' = -P delta about mid-span, so v' = B - C mu sin(mu x) + D mu cos(mu x) with D = P/(2 mu^3), B = -P/(2 mu^2),
    C from the support; mu^2 = axial times the integral of (y0'^2 - v'^2)/2 along the span is quadratic in P.
    """
    x, w = (GAUSS[0] + 1.0) / 4.0, GAUSS[1] / 4.0

    def slope(load):
        B, D = -load / (2.0 * mu**2), load / (2.0 * mu**3)
        if ends == "pinned":
            C = (curvature / mu**2 - D * sin(mu / 2.0)) / cos(mu / 2.0)
        else:
            C = (curvature / 2.0 + B + D * mu * cos(mu / 2.0)) / (mu * sin(mu / 2.0))
        return B - C * mu * np.sin(mu * x) + D * mu * np.cos(mu * x)

    free, each = slope(0.0), slope(1.0) - slope(0.0)
    a, b, c = each @ (w * each), 2.0 * (free @ (w * each)), free @ (w * free) + mu**2 / axial - curvature**2 / 24.0
    root = b**2 - 4.0 * a * c
    return ((-b + np.sqrt(root)) / (2.0 * a), (-b - np.sqrt(root)) / (2.0 * a)) if root >= 0.0 else (np.nan, np.nan)


def shallow_limits(ends, curvature, axial):
    """Largest and smallest load of the shallow arch between first loading and snapping through."""
    mu = np.linspace(*((2.0 * pi + 0.05, 4.0 * pi - 0.05) if ends == "clamped" else (pi + 0.05, 3.0 * pi - 0.05)), 4000)
    limits = []
    for k, sense in ((0, 1.0), (1, -1.0)):
        loads = np.array([sense * shallow_loads(ends, curvature, axial, m)[k] for m in mu])
        inside = [i for i in range(1, mu.size - 1) if loads[i] > loads[i - 1] and loads[i] > loads[i + 1]]
        for i in inside[:1]:
            best = minimize_scalar(
                lambda m, k=k, s=sense: -s * shallow_loads(ends, curvature, axial, m)[k],
                bounds=(mu[i - 1], mu[i + 1]),
                method="bounded",
                options={"xatol": 1e-12},
            )
            limits.append(-sense * best.fun)
    return limits


@pytest.mark.parametrize(("ends", "stretch"), [("pinned", 1600.0), ("clamped", 1e4)])
def test_limit_loads_approach_those_of_the_shallow_arch_with_the_square_of_the_rise(ends, stretch):
    curvatures, errors = np.array((0.4, 0.2, 0.1)), []
    for curvature in curvatures:
        axial = stretch / curvature**2
        exact = [
            p.factor for p in follow(arch(ends, curvature / 2.0, axial), DOWN, 60.0 * curvature, step=0.1 * curvature).limits
        ]
        shallow = shallow_limits(ends, curvature, axial)
        assert len(exact) == len(shallow) == 2
        errors.append(max(abs(np.subtract(exact, shallow))) / max(map(abs, shallow)))
    rates = np.diff(np.log(errors)) / np.diff(np.log(curvatures))
    assert rates == pytest.approx([2.0, 2.0], abs=0.1)
    assert errors[-1] < 2e-3


def test_deep_arch_snaps_at_the_published_load():
    """215 degrees, clamped and hinged, inextensible; P R^2/(E I) with R = 1/215 degrees."""
    angle = np.radians(215.0)
    strip = Strip("clamped", "pinned", shapes.circle(angle / 2.0), nodes=44)
    first = follow(strip, DOWN, 200.0, step=0.1).limits[0]
    number = PUBLISHED["deep_arch"]
    assert first.factor / angle**2 == pytest.approx(number.value, abs=number.within)
    assert first.residual < 1e-12


def test_work_of_the_load_is_the_energy_gained():
    """The load's f dy at the load, against bending, stretching and shearing of the strip, past both limit points."""
    strip = arch("clamped", 0.3, 1e4, shear=900.0, nodes=24)
    passed = follow(strip, DOWN, 20.0, step=0.01)
    weights = strip.grid.J[-1]

    def energy(p):
        n_along = p.force[:, 0] * np.cos(p.theta) + p.force[:, 1] * np.sin(p.theta)
        n_across = -p.force[:, 0] * np.sin(p.theta) + p.force[:, 1] * np.cos(p.theta)
        return weights @ (p.moment**2 + n_along**2 / strip.axial + n_across**2 / strip.shear) / 2.0

    gained = np.array([energy(p) for p in passed.points])
    work = -np.concatenate(([0.0], np.cumsum((passed.factor[1:] + passed.factor[:-1]) / 2.0 * np.diff(passed.inner[:, 1]))))
    assert len(passed.limits) == 2
    np.testing.assert_allclose(gained, work, atol=2e-4 * gained.max())


def test_symmetric_arch_sways_below_its_limit_and_a_bow_follows_the_sway():
    """The perfect arch passes the branching; one with an unsymmetric bow turns near it, the nearer the smaller the bow."""
    perfect = follow(arch("pinned", 0.3, 1e4), DOWN, 14.0, step=0.05)
    sway = perfect.branchings[0].factor
    assert sway < perfect.limits[0].factor
    turns = []
    for bow in (1e-3, 1e-4):
        strip = Strip("pinned", "pinned", lambda s, b=bow: 0.3 * (1.0 - 2.0 * s) + b * np.cos(2.0 * pi * s), axial=1e4)
        turns.append(follow(strip, DOWN, 14.0, step=0.05).limits[0].factor)
    drops = sway - np.array(turns)
    assert np.all(drops > 0.0)
    assert drops[0] / drops[1] == pytest.approx(10.0 ** (2.0 / 3.0), rel=0.15)  # Koiter's two-thirds power
