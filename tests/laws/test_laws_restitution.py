"""Restitution asked and restitution delivered: exact relation, published laws, equation of motion, documentation."""

import math
import re
from pathlib import Path

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from buckler.mbs import laws

DOCS = Path(__file__).parents[2] / "docs"
ASKED = (0.1, 0.3, 0.5, 0.7, 0.9)
TABLE = {  # restitution delivered, as printed in docs/theory-contact.md
    laws.HuntCrossley: (0.5158, 0.5813, 0.6630, 0.7680, 0.9090),
    laws.LankaraniNikravesh: (0.6653, 0.6842, 0.7252, 0.7960, 0.9132),
    laws.HerbertMcWhannell: (0.4907, 0.5200, 0.5936, 0.7227, 0.9009),
    laws.LeeWang: (0.6867, 0.7390, 0.7992, 0.8693, 0.9524),
    laws.Gonthier: (0.1010, 0.3042, 0.4877, 0.6696, 0.8764),
    laws.ZhiyingQishao: (0.2175, 0.3267, 0.4826, 0.6796, 0.8959),
    laws.Flores: (0.0694, 0.2562, 0.4704, 0.6832, 0.8939),
    laws.HuGuo: (0.0741, 0.2707, 0.4877, 0.6973, 0.8999),
    laws.CarvalhoMartins: (0.1289, 0.3040, 0.5002, 0.7000, 0.9000),
    laws.ExactRestitution: ASKED,
}
LAWS = tuple(TABLE)


def free_impact(law, mass, speed):
    """Restitution, and work done against the law; by Runge-Kutta in SI units, with no formula of the package."""
    span = (speed * math.sqrt(mass) / math.sqrt(law.stiffness)) ** (2.0 / (law.exponent + 1.0))

    def motion(_, state):
        depth, rate, _ = state.tolist()
        force = float(law.force(depth, rate, speed))
        return rate, -force / mass, force * rate

    def out(_, state):
        return state[0]

    out.terminal, out.direction = True, -1
    run = solve_ivp(
        motion,
        (0.0, 1e4 * span / speed),
        (1e-13 * span, speed, 0.0),
        method="DOP853",
        events=out,
        rtol=1e-10,
        atol=(1e-13 * span, 1e-13 * speed, 1e-13 * mass * speed**2),
    )
    assert run.status == 1, "the body never came out"
    _, rate, work = run.y_events[0][0]
    return -rate / speed, work


# --- the exact relation --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("chi", [1e-12, 3e-7, 9.99e-7, 1.01e-6, 5e-5, 2e-3, 0.1, 0.49, 0.51, 1.0, 3.0, 9.998159, 36.0, 1e3, 1e6])
def test_restitution_is_the_exact_root(chi):
    with mpmath.workdps(60):  # y = chi e solves (1 - y) exp(y - 1) = (1 + chi) exp(-1 - chi): a Lambert function
        x = mpmath.mpf(chi)
        exact = (1 + mpmath.lambertw(-(1 + x) * mpmath.exp(-1 - x)).real) / x
        assert abs(laws.restitution(chi) - exact) <= 1e-14 * exact


def test_no_hysteresis_returns_everything():
    assert laws.restitution(0.0) == 1.0
    assert laws.chi_exact(1.0) == 0.0
    assert laws.ExactRestitution(1e9, 1).chi == 0.0


def test_published_exact_factor():
    published = (9.998159, 3.087082, 1.432751, 0.634828, 0.166482)
    np.testing.assert_allclose([laws.chi_exact(e) for e in ASKED], published, rtol=0.0, atol=5.1e-7)


def test_exact_factor_inverts_and_satisfies_its_equation():
    for e in (*np.logspace(-10, -1, 200).tolist(), 0.25, 0.5, 0.75, 0.9, 0.99, 0.9999, 1.0 - 1e-9):
        assert laws.restitution(laws.chi_exact(e)) == pytest.approx(e, rel=1e-14)
    for e in (0.1, 0.3, 0.5, 0.9, 0.99):
        chi = laws.chi_exact(e)
        assert math.log((1 + chi) / (1 - chi * e)) == pytest.approx(chi * (1 + e), rel=1e-10)


# --- asked and delivered -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS)
def test_table_of_restitution_delivered(law):
    got = [laws.delivered(law(8e9, e)) for e in ASKED]
    np.testing.assert_allclose(got, TABLE[law], rtol=0.0, atol=0.5e-4 + 1e-12)


@pytest.mark.parametrize(
    ("law", "order", "leading"),
    [
        (laws.LeeWang, 1, 1 / 2),
        (laws.Gonthier, 1, -1 / 3),
        (laws.Flores, 1, -1 / 15),
        (laws.HuntCrossley, 2, 1.0),
        (laws.LankaraniNikravesh, 2, 3 / 2),
        (laws.ZhiyingQishao, 2, -1 / 2),
        (laws.HerbertMcWhannell, 3, 9 / 10),
        (laws.HuGuo, 3, -1 / 10),
        (laws.CarvalhoMartins, 4, -1 / 100),
    ],
)
def test_order_at_which_each_law_becomes_exact(law, order, leading):
    """With x = 1 - e the exact chi is 1.5 x (1 + x + 0.9 x^2 + ...); a law is off by the first term it misses.

    Fits that rate, and holds the finest error against the leading term.
    """
    lost = np.array([0.02, 0.01, 0.005])
    error = np.array([laws.delivered(law(1.0, 1.0 - x)) - (1.0 - x) for x in lost.tolist()])
    slope = np.polyfit(np.log(lost), np.log(np.abs(error)), 1)[0]
    assert slope == pytest.approx(order, abs=0.06)
    assert error[-1] / lost[-1] ** order == pytest.approx(leading, rel=0.05)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("law", LAWS)
def test_delivered_against_the_equation_of_motion(law, exponent):
    for e, mass, speed in ((0.1, 1.0, 0.3), (0.3, 0.2, 2.0), (0.5, 1.0, 1.0), (0.7, 5.0, 0.01), (0.9, 0.2, 2.0)):
        contact = law(1e6, e, exponent)
        rebound, work = free_impact(contact, mass, speed)
        assert rebound == pytest.approx(laws.delivered(contact), abs=1e-6)
        lost = 0.5 * mass * speed**2 * (1.0 - laws.delivered(contact) ** 2)
        assert work == pytest.approx(lost, rel=1e-6)


@pytest.mark.parametrize("zeta", [0.01, 0.3, 0.7, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.5, 4.0])
def test_kelvin_voigt_without_pulling(zeta):
    stiffness, mass = 1e5, 0.3
    law = laws.KelvinVoigt(stiffness, 2.0 * zeta * math.sqrt(stiffness * mass))
    rebound, work = free_impact(law, mass, 0.7)
    assert rebound == pytest.approx(laws.delivered(law, mass), abs=1e-6)
    assert work == pytest.approx(0.5 * mass * 0.7**2 * (1.0 - laws.delivered(law, mass) ** 2), rel=1e-6)
    assert laws.damping_ratio(laws.restitution_linear(zeta)) == pytest.approx(zeta, rel=1e-12, abs=1e-14)


@pytest.mark.parametrize("e", [1.0, 0.9, 0.5, 0.05, 1e-4])
def test_kelvin_voigt_from_restitution(e):
    law = laws.KelvinVoigt.from_restitution(stiffness=2e5, restitution=e, mass=0.4)
    assert laws.delivered(law, mass=0.4) == pytest.approx(e, rel=1e-12)
    if e > 0.01:
        assert free_impact(law, 0.4, 1.3)[0] == pytest.approx(e, abs=1e-6)


@pytest.mark.parametrize("damping", [253.0, 253e3])
def test_impact_function_by_two_integrators(damping):
    """The two readings of c_max in the crank-rocker paper: N s/m rattles, N s/mm closes the joint."""
    law = laws.Impact(8.0e9, damping, 1e-5)
    for mass, speed in ((0.02, 0.02), (0.1, 0.1), (0.2, 0.5)):
        rebound, work = free_impact(law, mass, speed)
        assert laws.delivered(law, mass, speed) == pytest.approx(rebound, abs=1e-6)
        assert work == pytest.approx(0.5 * mass * speed**2 * (1.0 - rebound**2), rel=1e-6)
        assert rebound > 0.7 if damping < 1e3 else rebound < 0.15


def test_impact_function_closed_forms():
    """Without damping it is the spring; with damping full from the first nanometre it is spring and dashpot."""
    assert laws.delivered(laws.Impact(1e6, 0.0, 1e-5), 0.1, 0.3) == pytest.approx(1.0, abs=1e-8)
    dashpot = laws.restitution_linear(40.0 / (2.0 * math.sqrt(1e5 * 0.2)))
    errors = [abs(laws.delivered(laws.Impact(1e5, 40.0, d, exponent=1), 0.2, 1.0) - dashpot) for d in (4e-5, 2e-5, 1e-5)]
    assert np.all(np.diff(np.log2(errors)) < -0.9) and errors[-1] < 1e-3


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_elastic_depth_and_contact_time(exponent):
    law, mass, speed = laws.ExactRestitution(3e8, 1.0, exponent), 0.2, 0.4
    deepest = laws.elastic_depth(law, mass, speed)
    assert law.potential(deepest) == pytest.approx(0.5 * mass * speed**2, rel=1e-13)

    def slowness(angle):  # dt = dd/v with v from the energy; d = deepest sin^2 leaves no singularity at the turning point
        return deepest * math.sin(2 * angle) / math.sqrt(1.0 - math.sin(angle) ** (2 * exponent + 2))

    time = laws.contact_time(law, mass, speed)
    assert time == pytest.approx(2.0 / speed * quad(slowness, 0.0, math.pi / 2)[0], rel=1e-7)
    slope = math.log(laws.contact_time(law, mass, 32 * speed) / time) / math.log(32)
    assert slope == pytest.approx(-(exponent - 1) / (exponent + 1), abs=1e-12)
    assert laws.contact_time(laws.KelvinVoigt(2e5, 0.0), 0.3, 9.0) == pytest.approx(math.pi * math.sqrt(0.3 / 2e5), rel=1e-14)


# --- the documentation ---------------------------------------------------------------------------------------------


def test_the_theory_page_prints_the_table():
    page = (DOCS / "theory-contact.md").read_text(encoding="utf-8")
    for law, row in TABLE.items():
        line = next(line for line in page.splitlines() if line.startswith(f"| `{law.__name__}` |"))
        assert " | ".join(f"{e:.4f}" for e in row) in line
    for damping in (253.0, 253e3):
        law = laws.Impact(2.53e5 * 1e3**1.5, damping, 1e-5)
        row = " | ".join(f"{laws.delivered(law, 0.1, speed):.4f}" for speed in (0.005, 0.02, 0.1, 0.5))
        assert row in page


def test_the_law_in_the_how_to_works():
    page = (DOCS / "how-to-add-a-clearance-joint.md").read_text(encoding="utf-8")
    *_, example, use = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    names = {}
    exec(example + use, names)  # its own assertions: it is a NormalLaw and delivers what was asked for
    law = names["law"]
    assert law.potential(3e-4) == pytest.approx(quad(law.elastic, 0.0, 3e-4)[0], rel=1e-12)
    assert free_impact(law, 0.3, 0.2)[0] == pytest.approx(0.6, abs=1e-6)
    assert np.all(law.force(np.array([-1e-4, 1e-4, 1e-4]), np.array([1.0, -9.0, 1.0]), 0.5)[:2] == 0.0)
