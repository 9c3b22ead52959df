"""The study of extreme cases: its verdicts on made-up runs, what it covers, and that nothing is silently wrong."""

import time
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from drawing import drawn

from buckler.elastica import pinned
from buckler.mbs import Beam, Section, Status
from buckler.studies.kit.drawn import Draw, draw
from buckler.studies.kit.report import to_json
from buckler.studies.trust import extreme, extremes, extremes_truth
from buckler.studies.trust.extremes_case import KINDS, VERDICTS, Case, CaseOutcome, Verdict, compare, judge
from buckler.studies.trust.extremes_listed import loose, pressed


def ended(status, force=1.0, right=1.0, reference=True, said="why"):
    """A made-up case with a force, where `right` is right."""
    return Case(
        "made up",
        "case",
        lambda _timeout: CaseOutcome(str(status), said, {"force": np.array([force])}),
        (lambda: None if right is None else {"force": np.array([right])}) if reference else None,
    )


@pytest.mark.parametrize(
    ("case", "verdict"),
    [
        (ended(Status.OK, 1.04), Verdict.WITHIN),
        (ended(Status.OK, 1.06), Verdict.WRONG),
        (ended(Status.OK, np.nan), Verdict.WRONG),
        (ended(Status.OK, reference=False), Verdict.WRONG),
        (ended(Status.OK, right=None), Verdict.OPEN),
        (ended(Status.SUSPECT, 1.06), Verdict.SUSPECT),
        (ended(Status.SUSPECT, 1.04), Verdict.FALSE_ALARM),
        (ended(Status.SUSPECT, 1.04, said="LINEAR: bends; PENETRATION: deep"), Verdict.SUSPECT),
        (ended(Status.SUSPECT, 1.04, said="LINEAR: bends; STEPS: long"), Verdict.FALSE_ALARM),
        (ended(Status.SUSPECT, right=None), Verdict.SUSPECT),
        (ended(Status.NEWTON_DIVERGED), Verdict.FAILED),
        (ended(Status.TIMED_OUT), Verdict.UNFINISHED),
    ],
)
def test_verdicts(case, verdict):
    assert judge(case, 1.0).verdict == verdict


def test_a_refused_case_keeps_the_reason():
    def refuse(_timeout):
        raise ValueError("thickness = 0 m:\n must be positive")

    found = judge(Case("made up", "case", refuse), 1.0)
    assert (found.verdict, found.message) == (Verdict.REFUSED, "thickness = 0 m: must be positive")


def test_comparison_takes_the_worst_measure_over_what_is_allowed():
    right = {"force": np.array([10.0]), "place of B": np.array([0.0, 2.0])}
    off, worst = compare({"force": np.array([10.1]), "place of B": np.array([0.0, 2.01])}, right, {"place of B": 1.0})
    assert worst == "place of B" and off == pytest.approx(0.01 / KINDS["place"].allowed)
    told = {"force": 0.8}  # of its own 50: 40 of 10 are no silent error, though 0.8 of 10 would be one
    assert compare({"force": np.array([50.0])}, {"force": np.array([10.0])}, {}, told)[0] == pytest.approx(1.0)
    shorter, _ = compare({"journal": np.array([[1.0, 2.0, 9.0]])}, {"journal": np.array([[1.0, 2.0]])}, {"journal": 1.0})
    assert shorter == 0


def test_a_clearance_a_thousandth_larger_decides_how_long_a_motion_is_compared(monkeypatch):
    """A made-up reference whose perturbed motion leaves it by a tenth of the clearance after half the run."""

    def reference(made, _finer):
        gap = made.mechanism.joints[0].gap
        journal = np.tile(np.linspace(0, 2, 49), (4, 1)) * (0 if gap == 2.5e-4 else 0.1 * 2.5e-4)
        return {"journal": journal, "force, peak of a": np.ones(1)}

    monkeypatch.setattr(extremes_truth, "_reference", reference)
    case = extremes_truth.case_of("made up", Draw("case", loose(), 0.01), None)
    right = case.reference()
    assert set(right) == {"journal"} and right["journal"].shape[1] == 25


def test_the_load_of_a_pressed_strip_is_the_elastica_s():
    """Shortened by a third: its load goes by what is beyond the compression."""
    strip, length = Section(0.03, 3e-4), 0.31
    made = Draw("pressed", pressed(Beam(strip), 1 / 3, 10.0), 10.0)
    critical = strip.euler_load(length)
    expected = critical / np.pi**2 * float(pinned.load(1 / 3 - critical / strip.axial_stiffness))
    assert extremes_truth._right(made, {})["force of the push"] == pytest.approx(expected, rel=1e-9)


def test_a_price_is_that_of_the_run_over_a_plain_one():
    case = Case("made up", "case", lambda _t: CaseOutcome("OK", "", {}, 3.0), lambda: None, plain=lambda: time.sleep(0.01))
    assert 30 < judge(case, 1.0).price < 301
    assert np.isnan(judge(ended(Status.OK), 1.0).price)


def test_families_take_turns_and_a_list_ends():
    listed = Counter(case.family for case in extreme.everything())["slider-crank, mesh"]
    chosen = extremes.Parameters(cases=50, families=("slider-crank-mesh", "free")).all
    assert [case.family for case in chosen[:3]] == ["slider-crank-mesh", "free", "slider-crank-mesh"]
    assert Counter(case.family for case in chosen) == {"slider-crank-mesh": listed, "free": 50 - listed}
    assert len({(case.family, case.number) for case in chosen}) == 50
    assert len(extremes.Parameters(cases=50, families=("slider-crank-mesh",)).all) == listed
    families = [extreme.slug(name) for name in extreme.FAMILIES]
    turns = extremes.Parameters(cases=2 * len(families) + 6, seed=7).all
    assert [p.family for p in turns[: len(families)]] == families and {p.seed for p in turns} == {7}
    assert [p.number for p in turns[:: len(families)]] == [0, 1, 2]


def test_over_two_hundred_listed_cases_cover_every_scene_and_every_kind_of_extreme():
    cases = extreme.everything()
    count = Counter(case.family for case in cases)
    assert len(cases) - count["wrong input"] >= 200
    assert set(count) == set(extreme.FIXED) and min(count.values()) >= 10
    assert len({(case.family, case.name) for case in cases}) == len(cases)
    names = " | ".join(case.name for case in cases)
    for extreme_of_all in (
        "clearance 0.001 mm", "clearance 2 mm", "0.01 times as stiff", "100 times as stiff", "30 r/min", "3000 r/min",
        "no friction", "much friction from 1e-4 m/s", "undamped", "dead centre", "straight", "elements",
        "equal steps", "tolerance", "thinnest",
    ):  # fmt: skip
        assert extreme_of_all in names


# --- what is drawn ----------------------------------------------------------------------------------------------------


def test_a_list_is_shuffled_by_the_seed():
    def names(seed, count):
        return [extreme.Parameters(family="static-strip", seed=seed, number=k).case.name for k in range(count)]

    whole = sum(case.family == "static strip" for case in extreme.everything())
    once = names(1, whole)
    assert len(set(once)) == whole
    assert names(2, whole) != once and sorted(names(2, whole)) == sorted(once)
    with pytest.raises(ValueError, match=f"number = {whole}: .* 0 to {whole - 1}"):
        names(1, whole + 1)


def test_a_pendulum_is_known_in_closed_form():
    """Period of 2 rad of amplitude: 4 K(sin 1) / w0, of a bar 0.4 m long and 10 mm thick."""
    from scipy.special import ellipk

    length = 0.4
    period = 4 * ellipk(np.sin(1.0) ** 2) * np.sqrt((length**2 / 3 + 0.01**2 / 12) / (9.81 * length / 2))
    made = draw(1, 0, ("free",))
    points = {"O": (0, 0), "A": (length * np.sin(2.0), -length * np.cos(2.0))}
    made = made._replace(mechanism=replace(made.mechanism, points=points), duration=period / 0.98)
    end = extremes_truth._pendulum(made)[2:, -1]
    assert end == pytest.approx([length * np.sin(2.0), -length * np.cos(2.0)], abs=1e-9)


def test_measures_on_which_the_references_differ_do_not_count():
    one = {"place": np.zeros((2, 49)), "force, peak of a": np.array([1.0]), "force, peak of b": np.array([1.0])}
    one["force, peak of c"] = np.array([1e-3])
    other = one | {"force, peak of b": np.array([1.02]), "place": np.full((2, 49), 1e-4)}
    kept = dict(extremes_truth._agreed(one, other, {"place": 1.0}, 49))
    assert set(kept) == {"place", "force, peak of a"}
    assert dict(extremes_truth._agreed(one, other, {"place": 1.0}, 10))["place"].shape == (2, 10)
    assert not dict(extremes_truth._agreed(one, other, {"place": 0.1}, 10))


# --- the study --------------------------------------------------------------------------------------------------------


def few(count, *families, **given):
    return extremes.run(extremes.Parameters(families=families, cases=count, workers=0, **given))


@pytest.fixture(scope="module")
def found():
    return few(15, "four-bar-ideal-joints", "static-strip", "grazing", "wrong-input", "free")


def test_every_case_is_counted_once(found):
    metrics = {name: metric.value for name, metric in found.metrics.items()}
    assert metrics["cases"] == 15 and metrics["no_reference"] == 0, found.message
    counted = ("within_tolerance", "refused", "failed_by_name", "silent_wrong", "false_alarms", "unfinished", "no_reference")
    assert metrics["cases"] == sum(metrics[name] for name in counted)
    assert metrics["within_tolerance"] >= 5 and metrics["refused"] >= 2 and metrics["price"] > 0
    assert 0 < metrics["largest_error_reported_fine"] <= 1
    assert found.tables[0].rows[-1][:3] == ["all", metrics["cases"], metrics["within_tolerance"]]


def test_a_sweep_of_cases_goes_on_where_it_ended(tmp_path, monkeypatch):
    store = str(tmp_path / "cases.sqlite")
    first = few(4, "static-strip", "wrong-input", store=store)
    monkeypatch.setattr(extreme, "judge", lambda *_: pytest.fail("a stored case was run again"))
    again = few(4, "static-strip", "wrong-input", store=store)
    for name in ("verdict", "off", "worst", "message"):
        assert list(first.signals[name]) == pytest.approx(list(again.signals[name]), nan_ok=True)


def test_a_case_that_breaks_the_study_is_told(monkeypatch):
    monkeypatch.setattr(extreme, "judge", lambda *_: 1 / 0)
    result = few(2, "static-strip")
    assert result.status == "SUSPECT" and result.message.count("ZeroDivisionError") == 2
    assert result.metrics["cases"].value == 0


def test_a_run_that_lies_is_found(monkeypatch):
    """The checks are silenced: what they caught is silently wrong now."""
    monkeypatch.setattr("buckler.mbs.simulation.suspicions", lambda *_: iter(()))
    result = few(12, "strip-pressed-in-line")
    assert result.status == "SUSPECT" and "straight, 0.3 L: silently wrong" in result.message
    assert result.metrics["silent_wrong"].value >= 1


def test_figure_has_a_dot_a_case(found):
    (ax,) = drawn(extremes, found).axes
    dots = sum(len(line.get_xdata()) for line in ax.lines if line.get_linestyle() == "None")
    assert dots == found.metrics["cases"].value
    assert len(ax.get_yticklabels()) == 5
    assert '"silent_wrong"' in to_json({name: metric.value for name, metric in found.metrics.items()})
    assert set(found.signals["verdict"]) <= set(VERDICTS)


@pytest.mark.parametrize("number", [3, 4, 9, 13])
def test_corners_of_the_slider_crank_are_not_silently_wrong(number):
    """Struts and beams, 0.06 to 0.31 mm thick, 0.13 to 13 rad/s, on soft and stiff stops; the others are slow."""
    case = [case for case in extreme.everything() if case.family == "slider-crank, range"][number]
    assert judge(case, 60.0).verdict in (Verdict.WITHIN, Verdict.FALSE_ALARM)


@pytest.mark.slow
@pytest.mark.xfail(reason="the default tolerance is too loose for a slow crank with clearance, by chance; see tests/truths")
def test_no_listed_case_is_silently_wrong():
    listed = tuple(map(extreme.slug, extreme.FIXED))
    result = few(len(listed) * 60, *listed)
    assert result.metrics["cases"].value >= 500 and result.metrics["silent_wrong"].value == 0, result.message


@pytest.mark.slow
def test_a_hundred_cases_end_and_are_known():
    """What they end as is in docs/validation.md; here: none is lost, none hangs, nearly all have a reference."""
    result = few(108, *map(extreme.slug, extreme.FAMILIES), seed=4)
    metrics = {name: metric.value for name, metric in result.metrics.items()}
    assert metrics["cases"] == 108 and metrics["unfinished"] <= 1 and metrics["no_reference"] <= 8
