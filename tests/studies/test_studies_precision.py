"""The two studies of error against run time, of strips in equilibrium and of the slider-crank."""

import itertools
import re
from pathlib import Path

import numpy as np
import pytest
from drawing import drawn

from buckler.mbs import Cable
from buckler.studies.kit.labels import Label, write_labels
from buckler.studies.kit.style import subplots
from buckler.studies.striking import slider_crank_precision
from buckler.studies.strips import static_precision

ROOT = Path(__file__).resolve().parents[2]

# --- static-precision -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def statics():
    return static_precision.run(static_precision.Parameters(finest=32, repeats=3))


def test_errors_rates_and_the_front(statics):
    """Orders of the load in the element size: twice the strain's own."""
    metrics = {name: metric.value for name, metric in statics.metrics.items()}
    assert statics.status == "OK" and metrics["on_branch"] == 1, statics.message
    assert metrics["beam_error"] < 1e-5 and metrics["beam_error_to_elastica"] < 1e-5 and metrics["plain_error"] < 5e-6
    for name, order, finest in (("beam3", 4, 1.5e-6), ("beam2", 2, 3e-3), ("cable", 4, 5e-5)):
        assert metrics[f"rate_{name}"] == pytest.approx(order, abs=0.2) and statics.metrics[f"rate_{name}"].exact == order
        assert statics.signals[f"{name}.error"][-1] < finest
    (ax,) = drawn(static_precision, statics).axes
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")
    assert "Pareto front" in [text.get_text() for text in ax.get_legend().get_texts()]
    assert sum(int(statics.signals[f"{name}.front"].sum()) for name in static_precision.SERIES) >= 2


def test_beam_takes_less_than_half_of_the_plain_time():
    found = []
    for _ in range(3):
        result = static_precision.run(static_precision.Parameters(finest=16, repeats=5))
        found.append(result.metrics["time_ratio"].value)
        if found[-1] < 0.5:
            break
    assert 0.01 < min(found) < 0.5


def test_static_table_carries_verdict_and_machine(statics):
    notes = statics.tables[0].notes
    assert statics.message in notes
    assert "Beam, 3 nodes x 20 has an error of 7.8e-06" in notes
    assert "plain ANCF x 64" in notes
    assert "Medians of 3 runs taken in turn" in notes and "exudyn 1.13" in notes
    assert [row[:2] for row in statics.tables[0].rows if row[0] == "Cable"] == [["Cable", n] for n in (4, 8, 16, 32)]


def test_value_off_the_branch_is_suspect(monkeypatch):
    monkeypatch.setattr(static_precision, "OFF_BRANCH", 1e-3)
    result = static_precision.run(static_precision.Parameters(finest=16, plain_elements=16, repeats=1))
    assert result.status == "SUSPECT"
    assert "Cable x 8: off the buckled branch" in result.message
    assert "Cable x 4: MESH: at u = 0.95 the force is" in result.message  # too coarse whatever the branch
    assert result.metrics["on_branch"].value < 1


# --- slider-crank-precision -------------------------------------------------------------------------------------------


def test_reading_of_a_made_up_force():
    """A half-sine knock of 20 ms at 121 degrees, then 1.5 N from 140 to 230 degrees."""
    speed = slider_crank_precision.JOB.speed
    time = np.linspace(0, slider_crank_precision.TURN, 200_001)
    angle, start = np.degrees(speed * time), np.radians(121) / speed
    knock = np.where((time > start) & (time < start + 0.02), 30 * np.sin(np.pi * (time - start) / 0.02), 0.0)
    force = knock + 1.5 * ((angle > 140) & (angle < 230))
    found = slider_crank_precision.read(time, force)
    assert found.peak == pytest.approx(30, rel=1e-5)
    assert found.impulse == pytest.approx(30 * 0.02 * 2 / np.pi, rel=1e-5)
    assert (found.settled, found.mean) == (pytest.approx(1.5), pytest.approx(1.5))
    assert found.plateau_error() == pytest.approx(np.abs(1.5 / slider_crank_precision.EXACT - 1).max())
    assert found.release == pytest.approx(230, abs=2e-3)


def test_readings_without_contact_with_contact_to_the_end_and_how_far_two_are_apart():
    time = np.linspace(0, slider_crank_precision.TURN, 1001)
    assert np.isnan(slider_crank_precision.read(time, np.zeros_like(time))[:-1]).all()
    pressed = slider_crank_precision.read(time, np.ones_like(time))
    assert pressed.impulse == pytest.approx(slider_crank_precision.TURN)
    one = slider_crank_precision.PrecisionReading(100.0, 1.0, 1.7, 1.6, 239.0)
    other = slider_crank_precision.PrecisionReading(101.0, 1.0, 1.7, 1.6, 230.0)
    assert other.off(one) == pytest.approx({"peak": 0.01, "impulse": 0, "settled": 0, "mean": 0})


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"tolerance": 3e-5}, "tolerance = 3e-05: must be one of 0.0001, 1e-05, 1e-06"),
        ({"plain_steps": 3000}, "plain_steps = 3000: must be one of 2000"),
        ({"steps": (5000, 10_000, 12_000.5)}, r"steps\[2\] = 12000.5: must be a whole number"),
        ({"resolutions": (20.5,)}, r"resolutions\[0\] = 20.5: must be a whole number"),
    ],
)
def test_wrong_runs_are_refused(given, message):
    with pytest.raises(ValueError, match=message):
        slider_crank_precision.Parameters(**given)


def test_a_count_may_be_written_with_a_power_of_ten():
    assert slider_crank_precision.Parameters(steps="5e3,10000", plain_steps=5000).steps == (5000, 10_000)


def test_plain_slider_crank_agrees_with_controlled_steps():
    mechanism = slider_crank_precision.with_coupler(Cable, 8)
    theirs = slider_crank_precision.plainly(mechanism, 20_000, 1e-6)
    ours = slider_crank_precision.simulated(mechanism, 1e-5)
    assert (theirs.status, ours.status) == ("OK", "OK")
    off = ours.reading.off(theirs.reading)
    assert max(off.values()) < 1e-2
    assert max(off["settled"], off["mean"]) < 1e-3
    assert ours.reading.release == pytest.approx(theirs.reading.release, abs=0.1)


def test_plain_run_that_fails_is_an_outcome():
    found = slider_crank_precision.plainly(slider_crank_precision.with_coupler(Cable, 8), 1000, 1e-4)
    assert found.status != "OK"
    assert np.isnan(found.reading.peak)


@pytest.fixture(scope="module")
def dynamics():
    """Coarse: one tolerance, five thousand steps."""
    return slider_crank_precision.run(
        slider_crank_precision.Parameters(
            elements=6, tolerances="1e-4", tolerance=1e-4, resolutions="20", steps="5000,10000", plain_steps=5000, repeats=1
        )
    )


def test_chosen_run_is_near_exact_and_finer_runs_and_times_are_those_shown(dynamics):
    metrics = {name: metric.value for name, metric in dynamics.metrics.items()}
    assert dynamics.metrics["settled"].exact == pytest.approx(1.72465, abs=1e-5)
    within = {"settled_error": 2e-3, "plateau_error": 5e-3, "peak_error": 1e-2, "impulse_error": 1e-2,
              "references_differ": 1e-2, "energy_balance": 1e-2}  # fmt: skip
    assert all(metrics[name] < bound for name, bound in within.items())
    assert metrics["error"] < 0.2 * metrics["plain_error"] and metrics["speedup_at_plain_error"] > 0
    assert metrics["speedup"] == pytest.approx(metrics["plain_time"] / metrics["time"])  # of a single turn
    chosen, plain_run = dynamics.signals["Beam x 6.wall_s"], dynamics.signals["plain ANCF x 6.wall_s"]
    assert (chosen[0], plain_run[0]) == (metrics["time"], metrics["plain_time"])
    (ax,) = drawn(slider_crank_precision, dynamics).axes
    labels = [text.get_text() for text in ax.get_legend().get_texts()]
    assert labels[:2] == ["Beam x 3", "Beam x 6"] and "plain ANCF x 6" in labels


def test_missed_bars_are_suspect_and_named(dynamics):
    bars = slider_crank_precision.BARS
    missed = [name for name, bar in bars.items() if not bar.reached(dynamics.metrics[name].value)]
    assert (dynamics.status == "SUSPECT") == bool(missed)
    assert all(name in dynamics.message for name in missed)
    table = {row[0]: row[-1] for row in dynamics.tables[1].rows}
    for name, bar in bars.items():
        assert table[bar.text] == ("no" if name in missed else "yes")


@pytest.mark.slow
def test_bars_of_the_slider_crank_are_reached():
    """Every bar of accuracy, and four times faster than plain runs of the same accuracy."""
    for _ in range(3):
        result = slider_crank_precision.run(slider_crank_precision.Parameters(repeats=3))
        assert result.status == "OK", result.message
        assert result.metrics["references_differ"].value < 5e-4
        assert result.metrics["references_differ_release"].value < 0.02
        if result.metrics["speedup_at_own_error"].value > 4:
            break
    assert result.metrics["speedup_at_own_error"].value > 3
    assert result.metrics["speedup_at_plain_error"].value > 2


def test_labels_of_points_close_together_keep_apart():
    """Four points within a millimetre or two: no label lies on another."""
    _, ax = subplots(height=60)
    points = np.array([[1.0, 1.0], [1.02, 1.03], [1.04, 1.0], [1.02, 0.97], [3.0, 3.0]])
    ax.loglog(*points.T, "o-")
    write_labels(ax, [Label(x, y, "1e-5", "C0") for x, y in points], [points])
    boxes = [text.get_window_extent() for text in ax.texts]
    assert len(boxes) == 5 and not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))


def test_no_text_of_a_figure_is_below_seven_points():
    """Of sources: studies that run long are not drawn in the tests."""
    small = re.compile(r"(?:fontsize|labelsize|titlesize|font\.size)[\"']?\s*[=:]\s*([\d.]+)")
    sources = [path for room in ("studies", "mbs/view") for path in (ROOT / room).rglob("*.py")]
    found = [(path.name, size) for path in sources for size in small.findall(path.read_text(encoding="utf-8")) if float(size) < 7]
    assert found == []
