"""The study of extreme cases: its verdicts on made-up runs, what it covers, and that nothing is silently wrong."""

from collections import Counter

import numpy as np
import pytest
from drawing import drawn

from buckler.mbs import Status
from buckler.studies.kit.report import to_json
from buckler.studies.trust import extremes
from buckler.studies.trust.extremes_case import (
    FAILED,
    FALSE_ALARM,
    KINDS,
    OPEN,
    REFUSED,
    SUSPECT,
    WITHIN,
    WRONG,
    Case,
    CaseOutcome,
    compare,
    judge,
)
from buckler.studies.trust.extremes_play import Play


def ended(status, force=1.0, right=1.0, reference=True):
    """A made-up case with a force, where `right` is right."""
    return Case(
        "made up",
        "case",
        lambda _timeout: CaseOutcome(str(status), "why", {"force": np.array([force])}),
        (lambda: None if right is None else {"force": np.array([right])}) if reference else None,
    )


@pytest.mark.parametrize(
    ("case", "verdict"),
    [
        (ended(Status.OK, 1.04), WITHIN),
        (ended(Status.OK, 1.06), WRONG),
        (ended(Status.OK, np.nan), WRONG),
        (ended(Status.OK, reference=False), WRONG),
        (ended(Status.OK, right=None), OPEN),
        (ended(Status.SUSPECT, 1.06), SUSPECT),
        (ended(Status.SUSPECT, 1.04), FALSE_ALARM),
        (ended(Status.SUSPECT, right=None), SUSPECT),
        (ended(Status.NEWTON_DIVERGED), FAILED),
    ],
)
def test_verdicts(case, verdict):
    assert judge(case, 1.0).verdict == verdict


def test_a_refused_case_keeps_the_reason():
    def refuse(_timeout):
        raise ValueError("thickness = 0 m:\n must be positive")

    found = judge(Case("made up", "case", refuse), 1.0)
    assert (found.verdict, found.message) == (REFUSED, "thickness = 0 m: must be positive")


def test_comparison_takes_the_worst_measure_over_what_is_allowed():
    right = {"force": np.array([10.0]), "place of B": np.array([0.0, 2.0])}
    off, worst = compare({"force": np.array([10.1]), "place of B": np.array([0.0, 2.01])}, right, {"place of B": 1.0})
    assert worst == "place of B" and off == pytest.approx(0.01 / KINDS["place"].allowed)
    shorter, _ = compare({"journal": np.array([[1.0, 2.0, 9.0]])}, {"journal": np.array([[1.0, 2.0]])}, {"journal": 1.0})
    assert shorter == 0


def test_a_play_a_thousandth_larger_decides_how_long_a_motion_is_compared(monkeypatch):
    """A made-up reference whose perturbed motion leaves it by a tenth of the play after half the run."""

    def compiled(self, factor):
        journal = np.tile(np.linspace(0, 2, 49), (4, 1)) * (0 if factor == 1 else 0.1 * self.gap)
        return {"journal": journal, "speed": np.zeros((4, 49)), "force": np.ones(1), "impulse": np.ones(1)}

    monkeypatch.setattr(Play, "_compiled", compiled)
    right = Play().reference()
    assert set(right) == {"journal", "speed"} and right["journal"].shape[1] == 25


def test_over_two_hundred_cases_cover_every_scene_and_every_kind_of_extreme():
    cases = list(extremes.everything())
    count = Counter(case.family for case in cases)
    assert len(cases) - count["wrong input"] >= 200
    assert set(count) == set(extremes.FAMILIES) and min(count.values()) >= 10
    assert len({(case.family, case.name) for case in cases}) == len(cases)
    names = " | ".join(case.name for case in cases)
    for extreme in (
        "play 0.001 mm", "play 2 mm", "0.01 times as stiff", "100 times as stiff", "30 r/min", "3000 r/min", "no friction",
        "much friction from 1e-4 m/s", "undamped", "dead centre", "straight", "elements", "equal steps", "tolerance", "thinnest",
    ):  # fmt: skip
        assert extreme in names


def few(*families):
    return extremes.run(extremes.Parameters(families=families, every=12))


@pytest.fixture(scope="module")
def found():
    return few("four-bar-ideal-joints", "static-strip", "strip-pressed-in-line", "wrong-input", "four-bar-with-play")


def test_every_case_is_counted_once_and_none_is_silently_wrong(found):
    metrics = {name: metric.value for name, metric in found.metrics.items()}
    assert found.status == "OK", found.message
    assert metrics["silent_wrong"] == metrics["no_reference"] == 0 and metrics["cases"] >= 12
    assert metrics["cases"] == sum(metrics[name] for name in ("within_tolerance", "refused", "failed_by_name"))
    assert metrics["within_tolerance"] >= 5 and metrics["refused"] >= 2
    assert 0 < metrics["largest_error_reported_fine"] <= 1
    assert found.tables[0].rows[-1][:3] == ["all", metrics["cases"], metrics["within_tolerance"]]


def test_a_run_that_lies_is_found(monkeypatch):
    """The checks are silenced: what they caught is silently wrong now."""
    monkeypatch.setattr("buckler.mbs.simulation.suspicions", lambda *_: iter(()))
    result = few("strip-pressed-in-line")
    assert result.status == "SUSPECT" and "straight, 0.3 L: silently wrong" in result.message
    assert result.metrics["silent_wrong"].value >= 1


def test_figure_has_a_dot_a_case(found):
    (ax,) = drawn(extremes, found).axes
    dots = sum(len(line.get_xdata()) for line in ax.lines if line.get_linestyle() == "None")
    assert dots == found.metrics["cases"].value
    assert len(ax.get_yticklabels()) == 5
    assert '"silent_wrong"' in to_json({name: metric.value for name, metric in found.metrics.items()})


@pytest.mark.slow
def test_no_case_is_silently_wrong():
    result = extremes.run(extremes.Parameters())
    assert result.status == "OK", result.message
    assert result.metrics["cases"].value >= 200 and result.metrics["silent_wrong"].value == 0
