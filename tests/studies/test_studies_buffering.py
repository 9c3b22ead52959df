"""Does a flexible rocker buffer: measures against plain sums, judgement against made-up chance, samples, the study on both."""

import numpy as np
import pytest

pytest.importorskip("numba")
pytest.importorskip("skfem")

from clearance_pair import beam_modes
from fourbar import FourBar, run

from buckler.mbs.library import CLOSED, RATTLING
from buckler.mbs.modal import BarModes
from buckler.studies.kit.statistics import Mean
from buckler.studies.rattling import buffering
from buckler.studies.rattling.bars import LENGTH, make_modal_rocker
from buckler.studies.rattling.buffering import FAILS, HOLDS, UNDECIDED, Parameters, judge, overall
from buckler.studies.rattling.claims import CLAIMS, PLACES, READINGS, ideal_motion, ratio
from buckler.studies.rattling.turns import Turns, run_turns

TURN = 0.2
"""Of the crank [s]."""
ONE = {
    "gravity": 0.0, "pin_on": "O.ground", "pin": 5e-3, "friction_thresholds": 1.0, "modal_damping": "constant",
    "gravity_angle": 0.0, "clearance": 2.5e-4,
    "rocker_damping": 0.01, "modes_of": "free", "bending": 3, "axial": 1, "frequency_factor": 1.0, "in_plane_depth": 20e-3,
}  # fmt: skip
"""One sample: the assumptions that the other studies have by default."""
PLACE = {claim.name: k for k, claim in enumerate(CLAIMS)}


def test_ideal_motion_is_that_of_the_closed_form():
    times = np.linspace(0, TURN, 777, endpoint=False)
    motion, exact = ideal_motion(10 * np.pi), FourBar().ideal(times)
    for k, link in enumerate(("coupler", "rocker"), 1):
        np.testing.assert_allclose(motion[f"ideal.{link}_vx"](times), exact.velocity[:, k, 0], atol=1e-7)
        np.testing.assert_allclose(motion[f"ideal.{link}_ax"](times + TURN), exact.acceleration[:, k, 0], atol=1e-4)


def test_ratio_has_the_scatter_of_ratios():
    draw = np.random.default_rng(2)
    over = draw.normal(0.7, 0.02, 100_000) / draw.normal(1.0, 0.05, 100_000)
    found = ratio(Mean(0.7, 0.02, 8), Mean(1.0, 0.05, 8))
    assert found.value == pytest.approx(0.7) and found.error == pytest.approx(over.std(), rel=0.02)
    assert ratio(Mean(1.0, 0.1, 8), Mean(1.0, 0.1, 8)).freedom == pytest.approx(14)
    assert ratio(Mean(1.0, 1e-9, 8), Mean(1.0, 0.1, 8)).freedom == pytest.approx(7)
    assert found._replace(freedom=1e9).half_width(0.02275) == pytest.approx(2 * found.error, rel=1e-3)


def test_sampling_and_model_errors_are_told_apart():
    draw, n = np.random.default_rng(0), 4000
    for model, sampling in ((0.2, 0.05), (0.05, 0.2), (0.0, 0.1)):
        values = draw.normal(0.9, model, n) + draw.normal(0, sampling, n)
        found = judge(values, np.full(n, sampling), np.full(n, 2 * sampling), 0.05, 0.05)
        assert found.sampling == pytest.approx(sampling) and found.ratio == pytest.approx(0.9, abs=0.01)
        assert found.model == pytest.approx(model, abs=0.06)


@pytest.mark.parametrize(("hits", "of"), [(0, 10), (3, 10), (128, 256), (256, 256)])
def test_interval_without_sampling_error_is_wilsons(hits, of):
    """Where the score (share - p)/sqrt(p (1 - p)/n) is the normal's 2.5 %."""
    found = judge(np.where(np.arange(of) < hits, 0.5, 1.5), np.zeros(of), np.zeros(of), 0.05, 0.05)
    for p, side in zip((found.low, found.high), (1, -1), strict=True):
        inside = 0 < p < 1
        assert not inside or (hits / of - p) / np.sqrt(p * (1 - p) / of) == pytest.approx(side * 1.959964, rel=1e-6)
        assert inside or p == hits / of


def test_samples_that_are_unsure_widen_the_interval_and_unsound_ones_do_not_count():
    values, none = np.array([0.5] * 30 + [0.9] * 10 + [np.nan] * 5), np.zeros(45)
    sure, unsure = (judge(values, none, none + reach, 0.05, 0.05) for reach in (0.0, 0.1))
    assert sure.share == unsure.share == 1 and sure.verdict == unsure.verdict == HOLDS
    assert sure.high == unsure.high == pytest.approx(1)
    assert unsure.low < sure.low
    assert unsure.low == judge(np.array([0.5] * 30 + [1.5] * 10), none[:40], none[:40], 0.05, 0.05).low
    assert judge(values + 1, none, none, 0.05, 0.05).verdict == FAILS
    for nothing in (judge(values * np.nan, none, none, 0.05, 0.05), judge(values, none, none + 1, 0.05, 0.05)):
        assert nothing.verdict == UNDECIDED


def test_wrong_verdicts_come_no_more_often_than_promised():
    """At the worst truth, a share of one half, with ratios on both sides of the bound and errors of few skew members."""
    draw, count, samples, members = np.random.default_rng(1), 400, 16, 4
    decided = 0
    for _ in range(count):
        truth = np.where(draw.random(samples) < 0.5, 0.85, 1.05)
        drawn = draw.gumbel(1.0, 0.1, (2, samples, members)) * np.stack([truth, np.ones(samples)])[..., None]
        pairs = [[Mean(x.mean(), x.std(ddof=1) / members**0.5, members) for x in pair] for pair in drawn.swapaxes(0, 1)]
        found = [ratio(*pair) for pair in pairs]
        values, errors, reach = (np.array(x) for x in zip(*((r.value, r.error, r.half_width(0.025)) for r in found), strict=True))
        decided += judge(values, errors, reach, 0.05, 0.05).verdict != UNDECIDED
    assert decided / count < 0.05


def test_overall_words():
    assert overall([HOLDS, HOLDS]) == "holds" and overall([FAILS, FAILS]) == "does not hold"
    assert overall([HOLDS, UNDECIDED]) == "holds where decided" and overall([FAILS, HOLDS, UNDECIDED]) == "holds in part"
    assert overall([FAILS, UNDECIDED]) == "does not hold where decided" and overall([UNDECIDED]) == "undecided"


def test_every_assumption_takes_all_its_values_alike_and_alone():
    p = Parameters(samples=256, seed=3)
    cases = p.cases()
    columns = []
    for name, among in p.axes().items():
        joint = "OABC".find(name[-1]) if " " in name else None
        values = [getattr(each, name) if joint is None else each.pin_on[joint] for each in cases]
        if name in buffering.RANGES:
            column = np.log(np.array(values) / among[0]) / np.log(among[1] / among[0])
            assert column.min() >= 0 and column.max() <= 1 and abs(column.mean() - 0.5) < 0.01
        else:
            column = np.array([among.index(value) for value in values], dtype=float)
            assert np.bincount(column.astype(int), minlength=len(among)).min() > 0.9 * 256 / len(among) - 2
        columns.append(column)
    assert abs(np.corrcoef(columns) - np.eye(len(columns))).max() < 0.15
    assert Parameters(samples=10, seed=3).cases() == cases[:10] != Parameters(samples=10, seed=4).cases()
    assert len({str(each) for each in Parameters(**ONE, samples=8).cases()}) == 1


def test_values_reach_the_mechanism():
    for case in Parameters(samples=8).cases():
        rocker = make_modal_rocker(case)
        made = case.bars(rocker=rocker)
        joint = {each.point: each for each in made.joints}["A"]
        assert joint.pin == case.pin and joint.gap == case.clearance and joint.law.damping == 253.0
        assert joint.friction.v_s == pytest.approx(0.1 * case.friction_thresholds)
        assert made.link("crank").body.section.thickness == case.in_plane_depth
        assert (joint.first == "coupler") == ("A.coupler" in case.pin_on)
        assert isinstance(rocker.modes, BarModes) == (case.modes_of != "Craig-Bampton")
        if case.modal_damping == "constant":
            np.testing.assert_allclose(rocker.damping, case.rocker_damping)
    plain, raised, few, euler = (
        make_modal_rocker(Parameters(**ONE | given).cases()[0]).frequencies(LENGTH)
        for given in ({}, {"frequency_factor": 1.1}, {"bending": 2}, {"modes_of": "Euler-Bernoulli"})
    )
    assert raised == pytest.approx(1.1 * plain, rel=1e-9) and len(few) == len(plain) - 1
    assert euler[0] / plain[0] > 1.02 and euler[-1] == pytest.approx(plain[-1], rel=1e-9)  # bending by shear; axial alike


def made_up(p, mechanisms, of, batch, curves):
    """Gumbel peaks, 2 % wide; flexible rockers halve forces at B, and at C without gravity; all velocities double."""
    found = []
    for k, made in enumerate(mechanisms):
        draw, means, soft = np.random.default_rng([batch, k]), {}, made.link("rocker").body.flexible
        for reading in of:
            factor = 2.0 if soft and ".vx" in reading else 1.0
            factor = 0.5 if soft and ("B." in reading or ("C." in reading and made.gravity == (0, 0))) else factor
            x = factor * draw.gumbel(1.0, 0.02, p.members)
            means[reading] = Mean(x.mean(), x.std(ddof=1) / p.members**0.5, p.members)
        found.append(Turns(means, 0.5, ("PENETRATION",) if k in (3, 36) else ()))
    return found


def test_planted_differences_and_a_flip_are_found_and_nothing_else(monkeypatch):
    monkeypatch.setattr(buffering, "run_turns", made_up)
    result = buffering.run(Parameters(samples=32, members=8))
    assert result.status == "OK" and result.metrics["unsound"].value == 2 * 4
    verdicts = dict(result.tables[-1].rows)
    assert verdicts.pop("contact force peaks are lower: coupler–rocker") == "holds"
    assert verdicts.pop("contact force peaks are lower: rocker–frame") == "holds in part"
    assert [verdicts.pop(name) for name in list(verdicts) if name.startswith("velocity fluct")] == ["does not hold"] * len(PLACES)
    assert not any(verdict == "holds" for verdict in verdicts.values())
    flips = {claim.name: result.metrics[f"c_max[N.s/m].{claim.name}.flips"].value for claim in CLAIMS}
    assert flips["force.rocker_frame"] == 1 and flips["force.coupler_rocker"] == 0
    median = result.metrics["c_max[N.s/mm].g9.81.force.coupler_rocker.ratio"].value
    assert median == pytest.approx(np.nanmedian(result.signals["ratio"][3, :, PLACE["force.coupler_rocker"]]))
    assert median == pytest.approx(0.5, abs=0.03)
    assert len(buffering.figure(result).axes) == 4 and "32 samples in 4 cells, 8 left out" in result.tables[-1].notes


@pytest.mark.slow
def test_closed_joints_buffer_forces_not_velocities():
    """One sample; and peaks against one run without ensembles, 1 µs apart: 2 µs apart misses 5 % of the force."""
    p = Parameters(**ONE, damping_unit="N.s/mm", samples=1, members=3, cycles=1)
    result = buffering.run(p)
    assert result.status == "OK", result.message
    values = result.signals["ratio"][0, 0]
    assert values[PLACE["force.coupler_rocker"]] == pytest.approx(0.54, abs=0.03)
    assert values[PLACE["force.rocker_frame"]] == pytest.approx(0.54, abs=0.03)
    assert values[PLACE["velocity.coupler"]] > 0.97
    size, (case,) = {"thickness": 0.020, "width": 0.005}, p.cases()
    case = type(case)(**case.plain() | {"damping_unit": "N.s/mm"})
    soft = make_modal_rocker(case)
    for rocker, modes in ((None, None), (soft, beam_modes(**size, bending=3, axial=1))):
        (found,) = run_turns(p, [case.bars(rocker=rocker)], READINGS, 7, ideal_motion(case.speed))
        bar = FourBar(law=CLOSED, modes=modes, **size)
        first = run(bar, 0.2, samples=2)
        exact = run(bar, 0.2, samples=200_001, state=np.concatenate([first.q[-1], first.q_t[-1]]))
        force, velocity = (found.means[READINGS[PLACE[name]]].value for name in ("force.coupler_rocker", "velocity.coupler"))
        assert force == pytest.approx(np.hypot(*exact.force[:, 2].T).max(), rel=0.03)
        off = exact.q_t[:, 2] - bar.ideal(exact.time).velocity[:, 1, 0]
        assert velocity == pytest.approx(np.sqrt(np.mean(off**2)), rel=0.05)


@pytest.mark.slow
def test_rocker_stiffened_without_end_is_the_rigid_one():
    """Forces of the first impacts: of ever stiffer rockers they tend to the rigid one's, and the real one's are not there."""

    def apart(law, *stiffer):
        beams = [beam_modes(bending=1, axial=1, modulus=207e9 * factor) for factor in stiffer]
        rigid, *forces = (
            run(FourBar(law=law, modes=modes), 0.02, samples=11).peak_force[:, 2:].max(axis=0) for modes in (None, *beams)
        )
        return [abs(force / rigid - 1).max() for force in forces]

    closed = apart(CLOSED, 1, 1e4)
    assert closed[0] > 0.3 and closed[1] < 0.02
    rattling = apart(RATTLING, 1, 100, 1e4)
    assert rattling[0] > 0.03 and rattling[1] < 5e-3 and rattling[2] < 5e-4
