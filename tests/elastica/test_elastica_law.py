"""The published quartic and the fast law: their errors against 40-digit integrals, their ranges."""

import numpy as np
import pytest
from mpmath import mp, mpf

from buckler.elastica import law, pinned

U = np.linspace(0.0, 1.0, 20001)


def exact_load(u):
    """p(u) in the working precision of mpmath, by root finding in -ln(1 - m)."""

    def excess(w):
        m = -mp.expm1(-w)
        return 1 / (2 - u) - mp.ellipk(m) / (2 * mp.ellipe(m))

    return 4 * mp.ellipk(-mp.expm1(-mp.findroot(excess, (2 * u / (2 - u), u), solver="secant"))) ** 2


def fitted_coefficients(degree=5, count=60, sweeps=4):
    """The fit behind `law.fast`: least squares of N - p D over p D at Chebyshev nodes, D of the previous sweep."""
    nodes = [(1 - mp.cos(mp.pi * (2 * j + 1) / (2 * count))) / 2 for j in range(count)]
    loads = [exact_load(u) for u in nodes]
    x = [u - mpf("0.5") for u in nodes]
    weights = [mpf(1)] * count
    for _ in range(sweeps):
        rows = [
            [xi ** (degree - k) / p / w for k in range(degree + 1)] + [-(xi ** (degree - 1 - k)) / w for k in range(degree)]
            for xi, p, w in zip(x, loads, weights, strict=True)
        ]
        right = [xi**degree / w for xi, w in zip(x, weights, strict=True)]
        solution = list(mp.lu_solve(mp.matrix(rows), mp.matrix(right)))
        numerator, denominator = solution[: degree + 1], [mpf(1), *solution[degree + 1 :]]
        weights = [mp.polyval(denominator[::-1], xi, asc=True) for xi in x]
    return [float(c) for c in numerator], [float(c) for c in denominator]


def test_stored_coefficients_are_the_fit():
    with mp.workdps(40):
        numerator, denominator = fitted_coefficients()
    np.testing.assert_allclose(law._NUMERATOR, numerator, rtol=1e-15)
    np.testing.assert_allclose(law._DENOMINATOR, denominator, rtol=1e-15)


def test_fast_law_is_within_its_stated_error():
    error = law.fast(U) / pinned.load(U) - 1.0
    assert np.max(np.abs(error)) < 2e-13
    with mp.workdps(40):
        for u in (1e-9, 0.03, 0.5, 0.8124, 1.0):
            assert abs(law.fast(u) / exact_load(mpf(u)) - 1) < 2e-13


def test_quartic_is_worst_at_the_onset_of_buckling():
    error = law.quartic(U) / pinned.load(U) - 1.0
    assert law.quartic(0.0) == 9.8879488 and law.quartic(1.0) == pytest.approx(21.5200579, rel=1e-15)
    assert np.argmax(np.abs(error)) == 0
    assert error[0] == pytest.approx(9.8879488 / np.pi**2 - 1.0, rel=1e-12) == pytest.approx(0.0019, abs=1e-4)
    assert error[-1] == pytest.approx(-0.0013, abs=1e-4) and error.min() == error[-1]


def test_scalars_give_floats_and_arrays_keep_their_shape():
    for function in (law.quartic, law.fast):
        for scalar in (0.5, np.float64(0.5), np.float32(0.5), np.array(0.5), 1):
            assert type(function(scalar)) is float
        assert function([[0.1, 0.2, 0.3]]).shape == (1, 3) and function(np.empty((0, 2))).shape == (0, 2)
        before = np.array([0.1, 0.9])
        function(before)
        assert before.tolist() == [0.1, 0.9]


@pytest.mark.parametrize("wrong", [-1e-12, 1.0 + 1e-12, np.nan, np.inf, 2])
@pytest.mark.parametrize("function", [law.quartic, law.fast])
def test_shortening_out_of_range_is_named(function, wrong):
    for shortening in (wrong, np.append(U, wrong), np.array(wrong)):
        with pytest.raises(ValueError, match=r"shortening = .* is outside 0 to 1 \(end shortening/L\)"):
            function(shortening)
