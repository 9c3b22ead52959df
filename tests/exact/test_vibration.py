"""Natural frequencies against characteristic equations, published values, closed forms, and counts."""

from math import pi, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq

from exact.published import PUBLISHED
from exact.vibration import ENDS, Member, beam, beam_frequencies, portal

THIN = Member(1.0, 1.0, 1.0)
THICK = Member.rectangle(0.1)
"""Thickness a tenth of the length, k = 5/6, nu = 0.3."""
EULER = {
    "cantilever": (lambda x: np.cos(x) + 1.0 / np.cosh(x), (1.87510406871196, 4.69409113297417, 7.85475743823761)),
    "clamped-pinned": (lambda x: np.sin(x) - np.cos(x) * np.tanh(x), (3.92660231204792, 7.06858274562873, 10.2101761228130)),
    "clamped-clamped": (lambda x: np.cos(x) - 1.0 / np.cosh(x), (4.73004074486270, 7.85320462409584, 10.9956078380017)),
    "pinned-pinned": (np.sin, (pi, 2.0 * pi, 3.0 * pi)),
    "free-free": (lambda x: np.cos(x) - 1.0 / np.cosh(x), (4.73004074486270, 7.85320462409584, 10.9956078380017)),
}


@pytest.mark.parametrize("ends", ENDS)
def test_slender_member_has_the_roots_of_euler_and_bernoulli(ends):
    equation, first = EULER[ends]
    roots = np.sqrt(beam_frequencies(THIN, ends, 10))
    np.testing.assert_allclose(roots[:3], first, rtol=1e-13)
    exact = [brentq(equation, root - 0.5, root + 0.5, xtol=1e-15, rtol=1e-15) for root in roots]
    np.testing.assert_allclose(roots, exact, rtol=1e-13)


def huang(ends, b, r2, s2):
    """Huang's frequency equations, b^2 = rho A L^4 omega^2/(E I), r^2 = I/(A L^2), s^2 = E I/(k G A L^2), below b r s = 1."""
    root = sqrt((r2 - s2) ** 2 + 4.0 / b**2)
    alpha, beta = sqrt((-(r2 + s2) + root) / 2.0), sqrt((r2 + s2 + root) / 2.0)
    ca, sa, cb, sb = np.cosh(b * alpha), np.sinh(b * alpha), np.cos(b * beta), np.sin(b * beta)
    if ends == "cantilever":
        return 2.0 + (b**2 * (r2 - s2) ** 2 + 2.0) * ca * cb - b * (r2 + s2) / sqrt(1.0 - b**2 * r2 * s2) * sa * sb
    if ends == "clamped-clamped":
        free = b / sqrt(1.0 - b**2 * r2 * s2) * (b**2 * s2 * (r2 - s2) ** 2 + (3.0 * s2 - r2))
        return 2.0 - 2.0 * ca * cb + free * sa * sb
    if ends == "free-free":
        free = b / sqrt(1.0 - b**2 * r2 * s2) * (b**2 * r2 * (r2 - s2) ** 2 + (3.0 * r2 - s2))
        return 2.0 - 2.0 * ca * cb + free * sa * sb
    zeta = (alpha**2 + r2) / (alpha**2 + s2)
    return alpha / beta * zeta * sa * cb / ca - sb  # clamped-pinned: lambda zeta tanh(b alpha) = tan(b beta)


@pytest.mark.parametrize("ends", ["cantilever", "clamped-clamped", "free-free", "clamped-pinned"])
@pytest.mark.parametrize("thickness", [0.01, 0.05, 0.1])
def test_thick_member_has_the_roots_of_huangs_equations(ends, thickness):
    member = Member.rectangle(thickness)
    r2 = thickness**2 / 12.0
    s2 = r2 * 2.6 / (5.0 / 6.0)
    for found in beam_frequencies(member, ends, 5) / member.unit:
        exact = brentq(lambda b: huang(ends, b, r2, s2), 0.999 * found, 1.001 * found, xtol=1e-15, rtol=1e-15)
        assert found == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize(
    ("ends", "published"),
    [
        ("pinned-pinned", (3.11568, 6.09066, 8.84052, 11.3431, 13.6132)),
        ("clamped-clamped", (4.57955, 7.33122, 9.85611, 12.1454, 14.2324)),
    ],
)
def test_published_values_of_lee_and_schultz(ends, published):
    """Thickness L/10, k = 5/6, nu = 0.3: J. Sound Vib. 269 (2004), 609-621; sqrt of omega in sqrt(E I/(rho A L^4))."""
    np.testing.assert_allclose(np.sqrt(beam_frequencies(THICK, ends, 5) / THICK.unit), published, rtol=5e-6)


def test_pinned_closed_form_with_both_spectra():
    """The first eighteen of a stocky member hold its second spectrum and the mode in which all sections turn alike."""
    k = np.arange(1, 19) * pi / THICK.length
    a = THICK.mass * THICK.rotary
    b = THICK.mass * (THICK.bending * k**2 + THICK.shear) + THICK.rotary * THICK.shear * k**2
    root = np.sqrt(b**2 - 4.0 * a * THICK.shear * THICK.bending * k**4)  # two frequencies for each half wave, and the turning
    squares = np.concatenate((2.0 * THICK.shear * THICK.bending * k**4 / (b + root), (b + root) / (2.0 * a)))
    closed = np.sqrt(np.sort([*squares, THICK.shear / THICK.rotary])[:18])
    np.testing.assert_allclose(beam_frequencies(THICK, "pinned-pinned", 18), closed, rtol=1e-12)
    assert np.min(abs(closed / sqrt(THICK.shear / THICK.rotary) - 1.0)) < 1e-12


@pytest.mark.parametrize("ends", ENDS)
def test_each_frequency_is_counted_once(ends):
    found = beam_frequencies(THICK, ends, 12)
    rigid = 2 if ends == "free-free" else 0
    counts = [(beam(THICK, ends).count_below(f * (1 - 1e-9)), beam(THICK, ends).count_below(f * (1 + 1e-9))) for f in found]
    assert counts == [(rigid + n, rigid + n + 1) for n in range(12)]


def test_portal_frame_of_slender_members():
    """Sway, slope and deflection of equal inextensible members, by hand: stiffness 24, mass and the exact first sway 3.2046."""
    member = Member(1.0, 1.0, 1.0, axial=1e9)
    first = portal(member, member).frequencies(2)
    number = PUBLISHED["portal.sway"]
    assert first[0] == pytest.approx(number.value, abs=number.within)

    def symmetric(x):
        """Corner moment of a clamped-pinned column and of a beam turned alike at both ends, over the corner's turn."""
        sn, c, sh, ch = np.sin(x), np.cos(x), np.sinh(x), np.cosh(x)
        column = (sn * ch - c * sh) / (1.0 - c * ch)
        return column + (sn * ch - c * sh - (sh - sn)) / (1.0 - c * ch)

    exact = brentq(symmetric, 3.2, 3.9, xtol=1e-15) ** 2
    assert first[1] == pytest.approx(exact, rel=1e-6)


def test_portal_with_a_heavy_stiff_beam_sways_like_a_storey():
    """Two massless columns clamped at both ends under a mass M: omega^2 = 24 E I/(H^3 M)."""
    column = Member(1.0, 1.0, 1e-6, axial=1e8)
    girder = Member(1.0, 1e7, 10.0, axial=1e8)
    assert portal(column, girder).frequencies(1)[0] == pytest.approx(sqrt(24.0 / 10.0), rel=1e-5)
