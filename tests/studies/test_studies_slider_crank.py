"""The slider-crank studies: published values, exact values, trends, and a name for everything that goes wrong."""

import math
from dataclasses import replace

import numpy as np
import pytest
from drawing import drawn, value

from buckler.mbs.library import PAPER, PAPER_STOP
from buckler.studies.kit.report import worst
from buckler.studies.striking import impact, slider_crank
from buckler.studies.striking.impact import ModelRun, exact_force, findings, read

NAMES = {
    "contact_force_180", "contact_force_error", "impact_peak", "impact_impulse", "impact_time", "rebound_ratio",
    "impact_push", "early_shortening", "rebounds", "settling_time", "contact_angle", "release_angle",
    "bending_stress", "buckles_before_stop", "energy_balance",
}  # fmt: skip


SPEED = 1.25 * abs(float(PAPER.slider_rate(PAPER.contact_angle(PAPER_STOP))))


@pytest.fixture(scope="module")
def turn():
    return slider_crank.run(slider_crank.Parameters())


READ = {
    "stitched": {
        "contact_angle": (120, 1e-9), "release_angle": (240, 1e-9), "impact_peak": (27, 0.01), "rebound_ratio": (0.8, 1e-9),
        "impact_impulse": (0.54 * SPEED, 1e-9), "energy_balance": (0.0253, 1e-3),  # the jump at release
    },
    "strut": {
        "contact_angle": (120, 0.01), "release_angle": (240, 0.1), "impact_peak": (27, 0.135), "energy_balance": (0, 1e-2),
        "impact_impulse": (0.54 * SPEED, 0.054 * SPEED), "rebound_ratio": (0.75, 0.05),  # the coupler pushes on in the impact
    },
    "beam": {  # it buckles late, and strikes far harder
        "contact_angle": (120, 0.01), "release_angle": (240, 1.0), "impact_peak": (158, 4.7), "energy_balance": (0, 5e-3),
        "impact_impulse": (1.10, 0.033), "rebound_ratio": (1.7, 0.6),
    },
}  # fmt: skip
ELASTICA = {"stitched": (6e-4, 6e-4), "strut": (3e-4, 2e-3), "beam": (1e-3, 5e-3)}
"""How far the force may be from the elastica's at 180 degrees, and over the plateau."""


@pytest.mark.parametrize("model", impact.MODELS)
def test_each_model_has_every_number(turn, model):
    assert turn.status == "OK" and turn.message == "", turn.message
    found = {name.partition(".")[2] for name in turn.metrics if name.startswith(f"{model}.")}
    assert found == NAMES and all(math.isfinite(value(turn, f"{model}.{name}")) for name in NAMES)
    assert turn.work[f"{model}.wall_s"] > 0 and turn.work[f"{model}.steps"] > 100
    assert value(turn, f"{model}.buckles_before_stop") == 0 and turn.metrics[f"{model}.bending_stress"].error < 1e-3
    for name, (expected, within) in READ[model].items():
        assert value(turn, f"{model}.{name}") == pytest.approx(expected, abs=within), name
    force, (at_180, plateau) = turn.metrics[f"{model}.contact_force_180"], ELASTICA[model]
    assert (force.exact, force.published) == (pytest.approx(1.72465, abs=5e-6), 1.7684)
    assert force.error < at_180 and value(turn, f"{model}.contact_force_error") < plateau
    assert turn.metrics[f"{model}.release_angle"].published == 240 and turn.metrics[f"{model}.impact_peak"].published == 27


def test_table_shows_published_and_exact_values(turn):
    text = str(turn)
    for word in ("published", "exact", "stitched", "strut", "beam", "1.7684", "1.72465"):
        assert word in text
    assert set(turn.signals) >= {"exact.angle", "exact.force", "strut.time", "beam.force", "stitched.angle"}
    drawn(slider_crank, turn)


def test_published_values_stand_only_where_they_were_published():
    slow = slider_crank.run(slider_crank.Parameters(models="stitched", speed=1.0))
    assert {name.partition(".")[0] for name in slow.metrics} == {"stitched"} and "strut.time" not in slow.signals
    drawn(slider_crank, slow)
    assert slow.metrics["stitched.impact_peak"].published is None
    assert slow.metrics["stitched.contact_force_180"].published == 1.7684
    thick = slider_crank.run(slider_crank.Parameters(models="stitched", thickness="0.4mm"))
    assert thick.metrics["stitched.impact_peak"].published is None
    assert thick.metrics["stitched.contact_force_180"].published is None
    assert thick.metrics["stitched.contact_force_180"].exact == pytest.approx(1.72465 * (4 / 3) ** 3, rel=1e-5)


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({"thickness": 1e-4}, {"strut: BUCKLES_BEFORE_STOP", "strut: NO_CONTACT", "stitched: HELD_OFF"}),
        ({"speed": 6.5}, {"stitched: BUCKLES_BEFORE_STOP", "strut: BUCKLES_BEFORE_STOP", "strut: NOT_SETTLED"}),
        ({"restitution": 1, "friction": 0}, {"stitched: NOT_SETTLED", "strut: NOT_SETTLED"}),
        ({"speed": 0.1, "thickness": 1e-3}, {"strut: NO_REBOUND"}),
    ],
)
def test_findings_are_named_and_do_not_fail_the_run(changes, names):
    result = slider_crank.run(slider_crank.Parameters(models="stitched,strut", **changes))
    assert result.status == "OK"
    assert names <= {": ".join(note.split(": ")[:2]) for note in result.message.split("; ")}
    assert all(name in str(result) for name in names)
    assert value(result, "strut.buckles_before_stop") == ("strut: BUCKLES_BEFORE_STOP" in names)
    drawn(slider_crank, result)


def test_run_out_of_time_is_named():
    result = slider_crank.run(slider_crank.Parameters(models="strut", timeout=0.01, tolerance=1e-9))
    assert result.status == "TIMED_OUT"
    assert "strut: " in result.message
    assert math.isnan(value(result, "strut.contact_force_180"))


def made_up(pulses, turns=1):
    """A run at 1 rad/s with half-sine pulses (start, duration, peak); the slider's speed is 0.2, then -0.1 m/s."""
    time = np.linspace(0, 2 * np.pi * turns, 200_001)
    force, speed = np.zeros_like(time), np.full_like(time, 0.2)
    for start, duration, peak in pulses:
        inside = (time > start) & (time < start + duration)
        force[inside] = peak * np.sin(np.pi * (time[inside] - start) / duration)
        speed[time >= start + duration] = -0.1
    zero = np.zeros_like(time)
    return ModelRun("made up", "OK", "", time, time, force, speed, zero, zero, zero, 0.0, {})


def test_reading_of_a_pulse_is_exact():
    reading = read(made_up([(2.1, 0.05, 30.0), (2.3, 0.02, 10.0), (2.5, 1.5, 2.0)]))
    assert reading.impact_peak == pytest.approx(30, rel=1e-5)
    assert reading.impact_impulse == pytest.approx(30 * 0.05 * 2 / np.pi, rel=1e-5)
    assert reading.impact_time == pytest.approx(0.05, abs=1e-4)
    assert reading.impact_speed == pytest.approx(0.2)
    assert reading.rebound_ratio == pytest.approx(0.5)
    assert (reading.contact_angle, reading.release_angle) == pytest.approx((2.1, 4.0), abs=1e-4)
    assert reading.settling_time == pytest.approx(0.4, abs=1e-4)
    assert reading.rebounds == 2
    assert reading.force_180 == pytest.approx(2 * np.sin(np.pi * (np.pi - 2.5) / 1.5), rel=1e-5)
    assert reading.contact_max == pytest.approx(2, rel=1e-5)


def test_verdict_is_that_of_the_worst_run():
    runs = [made_up([]), replace(made_up([]), status="SUSPECT", message="why"), made_up([])]
    assert worst([(run.model, run) for run in runs], ["note"]) == {"status": "SUSPECT", "message": "made up: why; note"}
    runs.append(replace(made_up([]), status="NEWTON_DIVERGED", message="there"))
    assert worst([(run.model, run) for run in runs])["status"] == "NEWTON_DIVERGED"
    assert findings(runs[-1], [read(runs[-1])]) == []


def test_exact_force_is_cubic_in_the_thickness():
    thin, thick = (slider_crank.Parameters(thickness=h) for h in (1e-4, 5e-4))
    assert exact_force(thick, np.pi) / exact_force(thin, np.pi) == pytest.approx(125, rel=1e-12)
