"""Accumulated statistics against closed forms, and signals as columns of the compiled solver against those of a record."""

from math import pi, sqrt

import numpy as np
import pytest

from buckler import mbs
from buckler.mbs.ensembles.readings import StatisticReading, columns, formulas_of
from buckler.mbs.laws import AdamsFriction, Impact
from buckler.mbs.library import crank_rocker
from buckler.mbs.modal import BarModes
from buckler.mbs.record.run import collect
from buckler.mbs.spectral import run as solver_run
from buckler.mbs.spectral.channels import Channels
from buckler.mbs.spectral.recording import record_of
from buckler.mbs.spectral.run import integrate
from buckler.mbs.spectral.scene import CompiledScene
from buckler.mbs.spectral.statistics import Accumulator, Statistic, add_rows


def rattling(speed=10 * pi, rocker=None, law=Impact(2.53e5 * 1e3**1.5, 253.0, 1e-5)):  # noqa: B008
    friction = AdamsFriction(0.3, 0.1)
    return crank_rocker(
        rocker or mbs.Rigid(mbs.Section(0.02, 0.005)), speed=speed,
        play=lambda point, a, b: mbs.Clearance(point, a, b, pin=5e-3, gap=2.5e-4, law=law, friction=friction),
    )  # fmt: skip


@pytest.fixture(scope="module")
def accumulated():
    """sin(t) and a straight line over windows of two turns, in stretches, on uneven rows."""
    time = np.unique(np.concatenate([np.linspace(0.0, 4 * pi, 1999), np.linspace(3.0, 3.2, 400)]))
    values = np.column_stack([np.sin(time), time - 3.0])
    found = Accumulator.over(np.array([0.0, 2 * pi, 4 * pi]), 2)
    for part in np.array_split(np.arange(len(time)), 7):
        add_rows(time[part], values[part], found)
    return found


def reading(accumulated, text):
    return StatisticReading.of(text).value(accumulated.found, ("a.sine", "a.line"), np.diff(accumulated.edges))


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        ("rms(a.sine)", [sqrt(0.5)] * 2), ("max(a.sine)", [1.0] * 2), ("min(a.sine)", [-1.0] * 2), ("share(a.sine)", [0.5] * 2),
        ("onsets(a.sine)", [1.0] * 2), ("mean(a.line)", [pi - 3.0, 3 * pi - 3.0]), ("end(a.line)", [2 * pi - 3, 4 * pi - 3]),
        ("impulse(a.line)", [2 * pi * (pi - 3), 2 * pi * (3 * pi - 3)]), ("onsets(a.line)", [1.0, 0.0]),
        ("variation(a.sine)", [4.0] * 2),
        ("max(a.line) - 2*abs(min(a.sine))", [2 * pi - 5, 4 * pi - 5]), ("share(a.line)", [(2 * pi - 3) / (2 * pi), 1.0]),
    ],
)  # fmt: skip
def test_statistics_of_a_sine_and_a_line(accumulated, text, exact):
    half = 4 * pi / 1998 / 2 / (2 * pi)  # a stretch on which it changes sign counts half
    assert reading(accumulated, text) == pytest.approx(exact, abs=half + 1e-6 if "share" in text else 2e-5)


def test_a_peak_between_rows_is_found():
    """Of cos(t) sampled every 0.2 rad, off its peak: to the fourth power of the step."""
    time = np.arange(-1.07, 1.0, 0.2)
    found = Accumulator.over(np.array([time[0], time[-1]]), 1)
    add_rows(time, np.cos(time)[:, None], found)
    assert float(found.found[0, 0, 3]) == pytest.approx(1.0, abs=1e-3) and np.cos(time).max() < 0.998


def test_an_interval_across_the_first_edge_counts_from_the_edge_on():
    """Of y = t with rows at 0, 2 and 3: a window that begins between two rows has its part of the interval between them."""
    found = Accumulator.over(np.array([1.0, 3.0]), 1)
    add_rows(np.array([0.0, 2.0, 3.0]), np.array([[0.0], [2.0], [3.0]]), found)
    assert found.found[0, 0, Statistic.INTEGRAL] == pytest.approx(4.0) and found.found[0, 0, Statistic.SMALLEST] == 1.0
    inside = Accumulator.over(np.array([1.0, 1.5, 3.0]), 1)  # one interval has all of the first window
    add_rows(np.array([0.0, 2.0, 3.0]), np.array([[0.0], [2.0], [3.0]]), inside)
    assert inside.found[:, 0, Statistic.INTEGRAL] == pytest.approx([0.625, 3.375])


def test_a_jump_beside_a_long_step_makes_no_peak():
    """Half a picosecond from 0 to 1, then a millisecond: the parabola through them is a million times as high."""
    found = Accumulator.over(np.array([0.0, 1.0]), 1)
    add_rows(np.array([0.0, 0.5, 0.5 + 5e-13, 0.501, 1.0]), np.array([0.0, 0.1, 1.0, 0.9, 0.8])[:, None], found)
    assert 1.0 <= found.found[0, 0, 3] < 1.2


@pytest.mark.parametrize(
    "text", ["B.normal_force", "max(rms(B.x))", "median(B.x)", "rms()", "max(B.x", "max(pi)", "B.x - max(B.x)"]
)
def test_what_is_no_reading_is_refused(text):
    with pytest.raises(ValueError, match=r"statistics are max, min, mean"):
        StatisticReading.of(text)


def test_columns_are_the_signals_of_a_record():
    names = [
        "B.normal_force", "B.friction_force", "B.penetration", "O.sliding_speed", "rocker.ax", "coupler.y", "A.x", "B.vy",
        "drive.torque", "B.journal_x",
    ]  # fmt: skip
    scene = CompiledScene.of(rattling())
    channels = Channels.of(scene, names)
    out, failure, _ = integrate(scene, 0.03, mbs.Spectral())
    assert failure is None and len(channels.columns) == len(names) - 1  # the journal's place is made from the record
    values, signals = channels.values(scene, out), collect(record_of(scene, out))
    for k, name in enumerate(channels.names):
        exact = signals[name].values
        assert values[:, k] == pytest.approx(exact, abs=1e-9 * np.abs(exact).max())


def test_columns_of_a_stop_are_the_signals_of_a_record():
    law = Impact(1e6, 1e2, 1e-5)
    scene = CompiledScene.of(mbs.slider_crank(mbs.Rigid(mbs.Section(0.030, 2e-3)), law=law, mass=0.3, speed=1.25))
    channels = Channels.of(scene, ["B.contact_force", "B.penetration"])
    out, failure, _ = integrate(scene, 2.0, mbs.Spectral())
    values, signals = channels.values(scene, out), collect(record_of(scene, out))
    assert failure is None and len(channels.columns) == 2
    for k, name in enumerate(channels.names):
        exact = signals[name].values
        assert exact.max() > 0.0
        assert values[:, k] == pytest.approx(exact, abs=1e-9 * exact.max())


def test_places_of_a_modal_link_are_those_of_its_motion():
    modal = mbs.Modal(mbs.Section(0.02, 0.005), BarModes(3, 1))
    scene = CompiledScene.of(rattling(rocker=modal))
    channels = Channels.of(scene, [f"rocker.{place}{what}" for place in ("", "middle.") for what in ("x", "vy", "ax")])
    out, failure, _ = integrate(scene, 0.02, mbs.Spectral())
    values, link = channels.values(scene, out), record_of(scene, out).links["rocker"]
    assert failure is None and len(channels.columns) == 6
    motion = link.motion("middle")
    exact = [*link.centre(), motion.position, motion.velocity, motion.acceleration]
    for k, (found, axis) in enumerate(zip(exact, (0, 1, 0, 0, 1, 0), strict=True)):
        assert values[:, k] == pytest.approx(found[:, axis], abs=1e-8 * np.abs(found[:, axis]).max())
    assert np.ptp(values[:, 5] - values[:, 2]) > 0.01 * np.ptp(values[:, 2])


def test_statistics_of_formulas_are_those_of_a_column_made_by_hand():
    given = StatisticReading.of("max(sqrt(B.x**2 + B.y**2)) - mean(abs(B.x - a.curve))")
    angle = np.linspace(0.0, pi, 500)
    signals = {"B.x": 3 * np.cos(angle), "B.y": 3 * np.sin(angle), "a.curve": np.ones(500)}
    found = Accumulator.over(np.array([0.0, pi]), 2)
    formulas = formulas_of([given])
    add_rows(angle, columns(formulas, signals), found)
    exact = 3.0 - np.trapezoid(np.abs(3 * np.cos(angle) - 1), angle) / pi
    assert set(given.signals) == set(signals)
    assert given.value(found.found, list(formulas), np.array([pi])) == pytest.approx(exact, rel=1e-5)


def test_loose_implicit_steps_of_closed_joints_are_looked_into():
    """Root mean squares of accelerations and peaks as with steps a hundred times as tight; of rows alone 1.3 % are missing."""
    given = {"of": ["rms(rocker.ax)", "max(B.normal_force)"], "each": 0.1, "progress": False}
    closed = rattling(law=Impact(2.53e5 * 1e3**1.5, 253.0e3, 1e-5))
    solvers = (mbs.Spectral(mbs.Controlled(1e-6)), mbs.Spectral(mbs.Controlled(1e-8), method="explicit"))
    loose, tight = (mbs.ensemble(closed, 0.2, 1, solver=solver, **given) for solver in solvers)
    assert loose.mean("rms(rocker.ax)") == pytest.approx(tight.mean("rms(rocker.ax)"), rel=4e-3)
    assert loose.mean("max(B.normal_force)") == pytest.approx(tight.mean("max(B.normal_force)"), rel=0.02)


def test_each_step_counts_once_however_the_output_is_cut_into_parts(monkeypatch):
    """Parts of one step and of all rows: interpolation in the step between two parts needs the last row of the one before."""
    closed = rattling(law=Impact(2.53e5 * 1e3**1.5, 253.0e3, 1e-5))
    given = {"of": ["impulse(B.normal_force)", "mean(rocker.ax)"], "each": 0.02, "progress": False}
    found = []
    for steps in (solver_run.STEPS_PER_CALL, 1):
        monkeypatch.setattr(solver_run, "STEPS_PER_CALL", steps)
        found.append(mbs.ensemble(closed, 0.02, 1, skip=0, solver=mbs.Spectral(mbs.Controlled(1e-6)), **given).values)
    assert found[1] == pytest.approx(found[0], rel=1e-9)
