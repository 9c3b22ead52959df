"""Normal contact laws: what they deliver, that they never pull, that their energy adds up."""

import dataclasses
import math
import pickle
import re
from pathlib import Path

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from mbs.laws import (
    CarvalhoMartins,
    ExactRestitution,
    Flores,
    Gonthier,
    HerbertMcWhannell,
    Hertz,
    HuGuo,
    HuntCrossley,
    HysteresisLaw,
    Impact,
    KelvinVoigt,
    LankaraniNikravesh,
    LeeWang,
    NormalLaw,
    ZhiyingQishao,
    chi_exact,
    contact_time,
    damping_ratio,
    delivered,
    elastic_depth,
    restitution,
    restitution_integrated,
    restitution_linear,
    step,
)

DOCS = Path(__file__).parents[1] / "docs"
ASKED = (0.1, 0.3, 0.5, 0.7, 0.9)
TABLE = {  # restitution delivered, as printed in docs/theory-contact.md
    HuntCrossley: (0.5158, 0.5813, 0.6630, 0.7680, 0.9090),
    LankaraniNikravesh: (0.6653, 0.6842, 0.7252, 0.7960, 0.9132),
    HerbertMcWhannell: (0.4907, 0.5200, 0.5936, 0.7227, 0.9009),
    LeeWang: (0.6867, 0.7390, 0.7992, 0.8693, 0.9524),
    Gonthier: (0.1010, 0.3042, 0.4877, 0.6696, 0.8764),
    ZhiyingQishao: (0.2175, 0.3267, 0.4826, 0.6796, 0.8959),
    Flores: (0.0694, 0.2562, 0.4704, 0.6832, 0.8939),
    HuGuo: (0.0741, 0.2707, 0.4877, 0.6973, 0.8999),
    CarvalhoMartins: (0.1289, 0.3040, 0.5002, 0.7000, 0.9000),
    ExactRestitution: ASKED,
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


@pytest.mark.parametrize(
    "chi", [1e-12, 3e-7, 9.99e-7, 1.01e-6, 5e-5, 2e-3, 0.1, 0.49, 0.51, 1.0, 3.0, 9.998159, 36.0, 1e3, 1e6]
)
def test_restitution_is_the_exact_root(chi):
    with mpmath.workdps(60):  # y = chi e solves (1 - y) exp(y - 1) = (1 + chi) exp(-1 - chi): a Lambert function
        x = mpmath.mpf(chi)
        exact = (1 + mpmath.lambertw(-(1 + x) * mpmath.exp(-1 - x)).real) / x
        assert abs(restitution(chi) - exact) <= 1e-14 * exact


def test_no_hysteresis_returns_everything():
    assert restitution(0.0) == 1.0
    assert chi_exact(1.0) == 0.0
    assert ExactRestitution(1e9, 1).chi == 0.0


def test_published_exact_factor():
    published = (9.998159, 3.087082, 1.432751, 0.634828, 0.166482)
    np.testing.assert_allclose([chi_exact(e) for e in ASKED], published, rtol=0.0, atol=5.1e-7)


def test_exact_factor_inverts_and_satisfies_its_equation():
    for e in (*np.logspace(-10, -1, 200).tolist(), 0.25, 0.5, 0.75, 0.9, 0.99, 0.9999, 1.0 - 1e-9):
        assert restitution(chi_exact(e)) == pytest.approx(e, rel=1e-14)
    for e in (0.1, 0.3, 0.5, 0.9, 0.99):
        chi = chi_exact(e)
        assert math.log((1 + chi) / (1 - chi * e)) == pytest.approx(chi * (1 + e), rel=1e-10)


def test_restitution_falls_as_hysteresis_grows():
    values = [restitution(float(chi)) for chi in np.logspace(-8, 6, 300)]
    assert np.all(np.diff(values) < 0.0)


# --- asked and delivered -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS)
def test_table_of_restitution_delivered(law):
    got = [delivered(law(8e9, e)) for e in ASKED]
    np.testing.assert_allclose(got, TABLE[law], rtol=0.0, atol=0.5e-4 + 1e-12)


@pytest.mark.parametrize(
    ("law", "order", "leading"),
    [
        (LeeWang, 1, 1 / 2),
        (Gonthier, 1, -1 / 3),
        (Flores, 1, -1 / 15),
        (HuntCrossley, 2, 1.0),
        (LankaraniNikravesh, 2, 3 / 2),
        (ZhiyingQishao, 2, -1 / 2),
        (HerbertMcWhannell, 3, 9 / 10),
        (HuGuo, 3, -1 / 10),
        (CarvalhoMartins, 4, -1 / 100),
    ],
)
def test_order_at_which_each_law_becomes_exact(law, order, leading):
    """With x = 1 - e the exact chi is 1.5 x (1 + x + 0.9 x^2 + ...); a law is off by the first term it misses.

    Fits that rate, and holds the finest error against the leading term.
    """
    lost = np.array([0.02, 0.01, 0.005])
    error = np.array([delivered(law(1.0, 1.0 - x)) - (1.0 - x) for x in lost.tolist()])
    slope = np.polyfit(np.log(lost), np.log(np.abs(error)), 1)[0]
    assert slope == pytest.approx(order, abs=0.06)
    assert error[-1] / lost[-1] ** order == pytest.approx(leading, rel=0.05)


@pytest.mark.parametrize("exponent", [1.0, 1.5])
@pytest.mark.parametrize("law", LAWS)
def test_delivered_against_the_equation_of_motion(law, exponent):
    for e, mass, speed in ((0.1, 1.0, 0.3), (0.3, 0.2, 2.0), (0.5, 1.0, 1.0), (0.7, 5.0, 0.01), (0.9, 0.2, 2.0)):
        contact = law(1e6, e, exponent)
        rebound, work = free_impact(contact, mass, speed)
        assert rebound == pytest.approx(delivered(contact), abs=1e-6)
        lost = 0.5 * mass * speed**2 * (1.0 - delivered(contact) ** 2)
        assert work == pytest.approx(lost, rel=1e-6)


@pytest.mark.parametrize("zeta", [0.01, 0.3, 0.7, 1.0 - 1e-9, 1.0, 1.0 + 1e-9, 1.5, 4.0])
def test_kelvin_voigt_without_pulling(zeta):
    stiffness, mass = 1e5, 0.3
    law = KelvinVoigt(stiffness, 2.0 * zeta * math.sqrt(stiffness * mass))
    rebound, work = free_impact(law, mass, 0.7)
    assert rebound == pytest.approx(delivered(law, mass), abs=1e-6)
    assert work == pytest.approx(0.5 * mass * 0.7**2 * (1.0 - delivered(law, mass) ** 2), rel=1e-6)
    assert damping_ratio(restitution_linear(zeta)) == pytest.approx(zeta, rel=1e-12, abs=1e-14)


def test_kelvin_voigt_limits():
    assert restitution_linear(0.0) == 1.0
    assert restitution_linear(1.0) == math.exp(-2.0)
    small = 1e-5  # 1 - pi zeta, whether or not the dashpot may pull
    assert (1.0 - restitution_linear(small)) / small == pytest.approx(math.pi, rel=1e-4)
    assert restitution_linear(1e5) * 4e10 == pytest.approx(1.0, rel=1e-8)
    pulled = math.exp(-math.pi * 0.3 / math.sqrt(1.0 - 0.09))
    assert restitution_linear(0.3) > pulled + 0.05


@pytest.mark.parametrize("e", [1.0, 0.9, 0.5, 0.05, 1e-4])
def test_kelvin_voigt_from_restitution(e):
    law = KelvinVoigt.from_restitution(stiffness=2e5, restitution=e, mass=0.4)
    assert delivered(law, mass=0.4) == pytest.approx(e, rel=1e-12)
    if e > 0.01:
        assert free_impact(law, 0.4, 1.3)[0] == pytest.approx(e, abs=1e-6)


def test_hertz_gives_back_all_it_takes():
    law = Hertz(8e9)
    rebound, work = free_impact(law, 0.1, 0.5)
    assert rebound == pytest.approx(1.0, abs=1e-8) and delivered(law) == 1.0
    assert abs(work) < 1e-8


@pytest.mark.parametrize("damping", [253.0, 253e3])
def test_impact_function_by_two_integrators(damping):
    """The two readings of c_max in the crank-rocker paper: N s/m rattles, N s/mm closes the joint."""
    law = Impact(8.0e9, damping, 1e-5)
    for mass, speed in ((0.02, 0.02), (0.1, 0.1), (0.2, 0.5)):
        rebound, work = free_impact(law, mass, speed)
        assert delivered(law, mass, speed) == pytest.approx(rebound, abs=1e-6)
        assert work == pytest.approx(0.5 * mass * speed**2 * (1.0 - rebound**2), rel=1e-6)
        assert rebound > 0.7 if damping < 1e3 else rebound < 0.15


def test_impact_function_closed_forms():
    """Without damping it is the spring; with damping full from the first nanometre it is spring and dashpot."""
    assert delivered(Impact(1e6, 0.0, 1e-5), 0.1, 0.3) == pytest.approx(1.0, abs=1e-8)
    dashpot = restitution_linear(40.0 / (2.0 * math.sqrt(1e5 * 0.2)))
    errors = [abs(delivered(Impact(1e5, 40.0, d, exponent=1), 0.2, 1.0) - dashpot) for d in (4e-5, 2e-5, 1e-5)]
    assert np.all(np.diff(np.log2(errors)) < -0.9) and errors[-1] < 1e-3


def test_integrated_restitution_is_the_closed_form():
    for law in (HuGuo(1e8, 0.4), ExactRestitution(1e8, 0.05, 1.0), KelvinVoigt(1e5, 300.0), Hertz(1e9)):
        assert restitution_integrated(law, 0.2, 0.4) == pytest.approx(delivered(law, 0.2, 0.4), abs=2e-8)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_elastic_depth_and_contact_time(exponent):
    law, mass, speed = ExactRestitution(3e8, 1.0, exponent), 0.2, 0.4
    deepest = elastic_depth(law, mass, speed)
    assert law.potential(deepest) == pytest.approx(0.5 * mass * speed**2, rel=1e-13)

    def slowness(
        angle,
    ):  # dt = dd/v with v from the energy; d = deepest sin^2 leaves no singularity at the turning point
        return deepest * math.sin(2 * angle) / math.sqrt(1.0 - math.sin(angle) ** (2 * exponent + 2))

    time = contact_time(law, mass, speed)
    assert time == pytest.approx(2.0 / speed * quad(slowness, 0.0, math.pi / 2)[0], rel=1e-7)
    slope = math.log(contact_time(law, mass, 32 * speed) / time) / math.log(32)
    assert slope == pytest.approx(-(exponent - 1) / (exponent + 1), abs=1e-12)
    assert contact_time(KelvinVoigt(2e5, 0.0), 0.3, 9.0) == pytest.approx(math.pi * math.sqrt(0.3 / 2e5), rel=1e-14)


# --- the force -----------------------------------------------------------------------------------------------------


def any_laws(random):
    for law in LAWS:
        yield law(10.0 ** random.uniform(3, 10), random.uniform(0.01, 1.0), random.uniform(1.0, 3.0))
    yield KelvinVoigt(10.0 ** random.uniform(3, 8), 10.0 ** random.uniform(-1, 5))
    yield Impact(10.0 ** random.uniform(3, 10), 10.0 ** random.uniform(0, 6), 1e-5, random.uniform(1.0, 3.0))
    yield Hertz(10.0 ** random.uniform(3, 10))


def test_no_law_pulls_or_reaches_out():
    random = np.random.default_rng(7)
    pushed = released = 0
    for _ in range(20):
        for law in any_laws(random):
            depth = random.choice((-1.0, 1.0), 400) * 10.0 ** random.uniform(-9, -2, 400)
            rate = random.choice((-1.0, 1.0), 400) * 10.0 ** random.uniform(-6, 2, 400)
            onset = 10.0 ** random.uniform(-4, 1, 400)
            force = law.force(depth, rate, onset)
            assert np.all(np.isfinite(force)) and np.all(force >= 0.0)
            assert np.all(force[depth <= 0.0] == 0.0)
            assert np.all(force[(depth > 0.0) & (rate > 0.0)] > 0.0)
            assert np.all(law.force(0.0 * depth, rate, onset) == 0.0)
            pushed += np.count_nonzero(force)
            released += np.count_nonzero((depth > 0.0) & (force == 0.0))
    assert pushed > 10_000 and released > 10_000  # both branches were visited


def test_floats_and_arrays_agree():
    depth = np.linspace(-1e-5, 3e-5, 9)
    rate = np.linspace(0.4, -0.6, 9)
    for law in any_laws(np.random.default_rng(3)):
        single = [law.force(d, v, 0.5) for d, v in zip(depth.tolist(), rate.tolist(), strict=True)]
        assert all(type(value) is float for value in single)
        np.testing.assert_allclose(law.force(depth, rate, 0.5), single, rtol=1e-14)
        grid = np.broadcast_to(law.force(depth[:, None], rate, 0.5), (9, 9))
        assert grid[6, 2] == pytest.approx(law.force(depth[6], rate[2], 0.5), rel=1e-14)


@pytest.mark.parametrize("law", LAWS)
def test_the_force_is_its_equation(law):
    contact = law(2e7, 0.6, 1.5)
    chi = contact.hysteresis(0.6)
    assert contact.force(2e-5, 0.12, 0.5) == pytest.approx(2e7 * 2e-5**1.5 * (1.0 + chi * 0.12 / 0.5), rel=1e-14)
    assert contact.force(2e-5, -0.12, 0.5) == pytest.approx(2e7 * 2e-5**1.5 * (1.0 - chi * 0.12 / 0.5), rel=1e-13)
    assert contact.force(2e-5, -1.01 * 0.5 / chi, 0.5) == 0.0


def test_the_impact_force_is_its_equation():
    law = Impact(8e9, 253.0, 1e-5, 1.5)
    assert law.force(4e-6, 0.1, 1.0) == pytest.approx(8e9 * 4e-6**1.5 + 253.0 * 0.4**2 * (3.0 - 0.8) * 0.1, rel=1e-14)
    assert law.force(5e-5, -0.1, 1.0) == pytest.approx(8e9 * 5e-5**1.5 - 25.3, rel=1e-14)
    assert law.force(1e-6, -10.0, 1.0) == 0.0
    assert KelvinVoigt(1e5, 20.0).force(1e-4, -0.2, 1.0) == pytest.approx(10.0 - 4.0, rel=1e-14)


def test_potential_is_the_integral_of_the_elastic_force():
    for law in any_laws(np.random.default_rng(5)):
        assert isinstance(law, NormalLaw)
        integral = quad(law.elastic, 0.0, 1e-3, epsabs=0.0, epsrel=1e-11)[0]
        assert law.potential(1e-3) == pytest.approx(integral, rel=1e-9)
        assert law.elastic(1e-3) == pytest.approx(law.stiffness * 1e-3**law.exponent, rel=1e-14)
        assert law.elastic(-1e-3) == 0.0 and law.potential(-1e-3) == 0.0
        assert law.force(1e-3, 0.0, 1.0) == pytest.approx(law.elastic(1e-3), rel=1e-14)


def test_step():
    assert step(-1.0, 0.0, 2.0, 4.0, 10.0) == 2.0
    assert step(1.0, 0.0, 2.0, 4.0, 10.0) == pytest.approx(2.0 + 8.0 * 0.0625 * 2.5, rel=1e-15)
    assert step(2.0, 0.0, 2.0, 4.0, 10.0) == 6.0
    assert step(123.456, 0.0, 2.0, 4.0, 10.0) == pytest.approx(10.0, rel=1e-15)
    np.testing.assert_allclose(step(np.array([-1.0, 2.0, 9.0]), 0.0, 2.0, 4.0, 10.0), [2.0, 6.0, 10.0])


# --- making laws ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HuntCrossley(-1.0, 0.5), r"stiffness = -1\.0 N/m\^n: must lie in \(0, inf\] N/m\^n"),
        (lambda: HuntCrossley(0.0, 0.5), r"stiffness = 0\.0 N/m\^n"),
        (lambda: HuntCrossley(math.inf, 0.5), r"stiffness = inf"),
        (lambda: HuntCrossley("stiff", 0.5), r"stiffness = 'stiff'"),
        (lambda: LeeWang(1e9, 1.2), r"restitution = 1\.2.*\[0, 1\]"),
        (lambda: LeeWang(1e9, math.nan), r"restitution = nan"),
        (lambda: HuGuo(1e9, 0.0), r"restitution = 0\.0.*\(0, 1\]"),
        (lambda: Gonthier(1e9, 0.0), r"restitution = 0\.0.*\(0, 1\]"),
        (lambda: Flores(1e9, 0.0), r"restitution = 0\.0.*\(0, 1\]"),
        (lambda: ExactRestitution(1e9, 0.0), r"restitution = 0\.0.*\(0, 1\]"),
        (lambda: HuGuo(1e9, 0.5, 0.5), r"exponent = 0\.5.*\[1, 3\]"),
        (lambda: KelvinVoigt(0.0, 1.0), r"stiffness = 0\.0 N/m:"),
        (lambda: KelvinVoigt(1e5, -1.0), r"damping = -1\.0 N s/m: must lie in \[0, inf\]"),
        (lambda: KelvinVoigt.from_restitution(1e5, 0.0, 1.0), r"restitution = 0\.0.*\(0, 1\]"),
        (lambda: KelvinVoigt.from_restitution(1e5, 0.5, 0.0), r"mass = 0\.0 kg: must lie in \(0, inf\]"),
        (lambda: KelvinVoigt.from_restitution(-1e5, 0.5, 1.0), r"stiffness = -100000\.0 N/m"),
        (lambda: Impact(0.0, 1.0, 1e-5), r"stiffness = 0\.0 N/m\^n"),
        (lambda: Impact(1e9, 1.0, 0.0), r"damping_depth = 0\.0 m: must lie in \(0, inf\]"),
        (lambda: Impact(1e9, -1.0, 1e-5), r"damping = -1\.0 N s/m"),
        (lambda: Impact(1e9, 1.0, 1e-5, 0.9), r"exponent = 0\.9.*\[1, 3\]"),
        (lambda: Hertz(-2.0), r"stiffness = -2\.0 N/m\^1\.5"),
        (lambda: restitution(-0.1), r"chi = -0\.1.*\[0, inf\]"),
        (lambda: chi_exact(1.5), r"restitution = 1\.5"),
        (lambda: contact_time(Hertz(1e9), 0.0, 1.0), r"mass = 0\.0 kg"),
        (lambda: delivered(KelvinVoigt(1e5, 1.0)), r"mass = None: the restitution of KelvinVoigt depends on it"),
        (lambda: delivered(Impact(1e9, 1.0, 1e-5), 1.0), r"speed = None: .* in \(0, inf\] m/s"),
        (lambda: delivered(Impact(1e9, 1.0, 1e-5), 1.0, -1.0), r"speed = -1\.0 m/s"),
    ],
)
def test_bad_input_is_named(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_laws_that_allow_a_dead_stop_accept_zero():
    for law in (HuntCrossley, LankaraniNikravesh, HerbertMcWhannell, LeeWang, ZhiyingQishao, CarvalhoMartins):
        assert delivered(law(1e9, 0.0)) > 0.0  # none of them delivers it


def test_a_law_that_makes_energy_is_refused():
    class Backwards(HysteresisLaw):
        @staticmethod
        def hysteresis(e):
            return e - 1.0

    with pytest.raises(ValueError, match=r"chi = -0\.5"):
        Backwards(1e9, 0.5)


def test_laws_are_values():
    law = ExactRestitution(10**9, np.float64(0.5))
    assert law == ExactRestitution(1e9, 0.5) and hash(law) == hash(ExactRestitution(1e9, 0.5))
    assert law != HuGuo(1e9, 0.5)
    assert Hertz(1e9).exponent == 1.5 and KelvinVoigt(1e5, 1.0).exponent == 1.0
    assert pickle.loads(pickle.dumps(law)) == law
    assert dataclasses.asdict(law) == {"stiffness": 1e9, "restitution": 0.5, "exponent": 1.5}
    assert repr(law) == "ExactRestitution(stiffness=1000000000.0, restitution=0.5, exponent=1.5)"
    with pytest.raises(dataclasses.FrozenInstanceError):
        law.stiffness = 2.0


# --- the documentation ---------------------------------------------------------------------------------------------


def test_the_theory_page_prints_the_table():
    page = (DOCS / "theory-contact.md").read_text(encoding="utf-8")
    for law, row in TABLE.items():
        line = next(line for line in page.splitlines() if line.startswith(f"| `{law.__name__}` |"))
        assert " | ".join(f"{e:.4f}" for e in row) in line
    for damping in (253.0, 253e3):
        law = Impact(2.53e5 * 1e3**1.5, damping, 1e-5)
        row = " | ".join(f"{delivered(law, 0.1, speed):.4f}" for speed in (0.005, 0.02, 0.1, 0.5))
        assert row in page


def test_the_law_in_the_how_to_works():
    page = (DOCS / "how-to-add-a-law.md").read_text(encoding="utf-8")
    example, use, _ = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    names = {}
    exec(example + use, names)  # its own assertions: it is a NormalLaw and delivers what was asked for
    law = names["law"]
    assert law.potential(3e-4) == pytest.approx(quad(law.elastic, 0.0, 3e-4)[0], rel=1e-12)
    assert free_impact(law, 0.3, 0.2)[0] == pytest.approx(0.6, abs=1e-6)
    assert np.all(law.force(np.array([-1e-4, 1e-4, 1e-4]), np.array([1.0, -9.0, 1.0]), 0.5)[:2] == 0.0)
