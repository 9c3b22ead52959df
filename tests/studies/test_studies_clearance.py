"""The studies of joints with clearance: against closed forms, against dynamics by hand, and what they promise in words."""

import re
from math import pi
from pathlib import Path

import numpy as np
import pytest
from fourbar import FourBar
from ideal_linkage import inverse_dynamics

from buckler.studies.rattling import crank_rocker

HOW_TO = (Path(__file__).parents[2] / "docs" / "how-to-add-a-clearance-joint.md").read_text(encoding="utf-8")
SHORT = {"duration": 0.02, "settle": 0.005}
NUMBERS = {
    "peak_force_coupler_rocker": "N", "peak_force_rocker_frame": "N", "peak_ax_coupler": "m/s^2", "peak_ax_rocker": "m/s^2",
    "rms_ax_coupler": "m/s^2", "rms_ax_rocker": "m/s^2", "rms_vx_error_coupler": "m/s", "rms_vx_error_rocker": "m/s",
    "penetration": "m", "contacts": "1", "energy_balance": "1",
}  # fmt: skip


def ran(**parameters):
    return crank_rocker.run(crank_rocker.Parameters(**{"members": 1, **parameters}))


@pytest.fixture(scope="module")
def short():
    return ran(**SHORT)


def test_ideal_mechanism_is_that_of_loop_closure_and_newton():
    result = crank_rocker.run(crank_rocker.Parameters(rocker="rigid", clearance_joints=0, settle=0, duration=0.2))
    assert result.status == "OK", result.message
    force, *moved = inverse_dynamics(FourBar(), 10 * pi)
    for variant in ("ideal", "rigid"):
        value = {name: result.metrics[f"{variant}.{name}"].value for name in NUMBERS}
        for link, a in zip(("coupler", "rocker"), moved, strict=True):
            assert value[f"rms_ax_{link}"] == pytest.approx(np.sqrt(np.mean(a**2)), rel=1e-3)
            assert value[f"peak_ax_{link}"] == pytest.approx(np.abs(a).max(), rel=1e-3)
        assert value["peak_force_coupler_rocker"] == pytest.approx(force.max(), rel=1e-3)
        assert value["energy_balance"] < 1e-3
        assert value["contacts"] == value["penetration"] == value["rms_vx_error_coupler"] == 0
    assert "orbits" not in crank_rocker.figure(result)


def test_default_variants_and_all_their_numbers(short):
    assert short.status == "OK", short.message
    expected = {f"{variant}.{name}": unit for variant in ("ideal", "rigid", "flexible") for name, unit in NUMBERS.items()}
    assert {name: metric.unit for name, metric in short.metrics.items()} == expected
    for variant in ("rigid", "flexible"):
        assert short.metrics[f"{variant}.energy_balance"].value < 1e-3
        assert short.metrics[f"{variant}.contacts"].value > 10
        assert 0 < short.metrics[f"{variant}.penetration"].value < short.parameters.clearance
    ideal, rigid = (short.metrics[f"{v}.peak_force_coupler_rocker"].value for v in ("ideal", "rigid"))
    assert rigid > 2 * ideal
    assert str(short).startswith("4 joints with 0.25 mm clearance, c_max = 253 N.s/m\n")


def test_metrics_follow_from_the_signals(short):
    for variant in ("rigid", "flexible"):
        s = {name.removeprefix(f"{variant}."): v for name, v in short.signals.items() if name.startswith(variant)}
        kept = s["time"] >= SHORT["settle"]
        value = {name: short.metrics[f"{variant}.{name}"].value for name in NUMBERS}
        even = np.linspace(s["time"][kept][0], s["time"][-1], 400_001)
        ax = np.interp(even, s["time"], s["rocker.ax"])
        assert value["rms_ax_rocker"] == pytest.approx(np.sqrt(np.mean(ax**2)), rel=0.01)
        force = np.hypot(s["C.ground-rocker.fx"], s["C.ground-rocker.fy"])[kept]
        assert value["peak_force_rocker_frame"] == force.max()


def test_contacts_count_from_the_time_of_settling():
    p = crank_rocker.Parameters(**SHORT)
    ideal, rigid = crank_rocker.simulate(p, "rigid", ""), crank_rocker.simulate(p, "rigid", p.with_play)
    deep = np.stack([rigid.signals[f"{joint}.penetration"] for joint in "OABC"])[:, rigid.time >= p.settle] > 0
    begun = int((deep[:, 1:] & ~deep[:, :-1]).sum())
    assert begun > 10
    assert crank_rocker.read(rigid, ideal, p.settle)["contacts"].value == pytest.approx(begun, abs=4)  # a start at settling


def test_figures_show_what_figures_5_to_10_show(short):
    figures = crank_rocker.figure(short)
    shape = {name: len(figure.axes) for name, figure in figures.items()}
    assert shape == {"velocity": 4, "acceleration": 4, "contact_force": 4, "orbits": 8}
    assert [ax.get_title() for ax in figures["orbits"].axes[:4]][2] == "B: coupler–rocker"


@pytest.mark.parametrize("count", [1, 3])
def test_play_in_as_many_joints_as_asked_for(count):
    result = ran(**SHORT, rocker="rigid", clearance_joints=count)
    joints = {name.split(".")[1] for name in result.signals if name.endswith("journal_x")}
    assert result.status == "OK" and joints == set("BCAO"[:count])
    assert result.metrics["rigid.energy_balance"].value < 1e-3
    assert {name.partition(".")[0] for name in result.metrics} == {"ideal", "rigid"}


def test_modal_rocker_is_a_flexible_one():
    result = ran(**SHORT, rocker="modal")
    assert result.status == "OK" and result.metrics["flexible.energy_balance"].value < 1e-3
    assert {name.partition(".")[0] for name in result.metrics} == {"ideal", "flexible"}


def test_unit_of_the_damping_decides_whether_joints_rattle(short):
    closed = ran(**SHORT, damping_unit="N.s/mm")
    assert closed.status == "OK" and closed.metrics["rigid.energy_balance"].value < 1e-3
    assert 5 * closed.metrics["rigid.contacts"].value < short.metrics["rigid.contacts"].value


def test_seed_moves_the_start_by_next_to_nothing_and_the_end_by_more():
    one, again, other = (ran(**SHORT, rocker="rigid", seed=seed) for seed in (0, 0, 1))
    for name, values in one.signals.items():
        assert np.array_equal(values, again.signals[name])
    points = [result.parameters.mechanism("rigid", "B").points["A"] for result in (one, other)]
    assert 0 < np.abs(np.subtract(*points)).max() < 1e-9
    assert one.metrics["rigid.rms_ax_coupler"].value != other.metrics["rigid.rms_ax_coupler"].value


@pytest.mark.parametrize("depth", ["5mm", "20mm"])
def test_depth_in_the_plane_keeps_the_mass(depth):
    p = crank_rocker.Parameters(in_plane_depth=depth)
    bar = p.body("rigid").section
    assert bar.area == pytest.approx(1e-4) and bar.thickness == float(depth[:-2]) * 1e-3
    assert p.speed == 10 * pi and p.pin == 5e-3 and p.stiffness == pytest.approx(8.0006e9, rel=1e-4)


def test_pin_deeper_in_than_it_has_play_is_told_and_no_suspicion():
    """Its law is followed; a depth beyond the clearance is a remark about the law."""
    result = ran(**SHORT, rocker="rigid", clearance="5um")
    assert result.status == "OK" and result.metrics["rigid.penetration"].value > 5e-6


def test_run_that_fails_at_once_leaves_its_name_and_no_numbers(monkeypatch):
    run = crank_rocker.mbs.simulate
    monkeypatch.setattr(crank_rocker.mbs, "simulate", lambda *given, **options: run(*given, **options | {"timeout": 1e-9}))
    result = ran(**SHORT, rocker="rigid")
    assert result.status == "TIMED_OUT" and "rigid: out of time" in result.message
    names = ("peak_force_coupler_rocker", "rms_ax_rocker")
    assert all(np.isnan(result.metrics[f"rigid.{name}"].value) for name in names)


def test_blocks_of_the_how_to_run_and_end_well():
    names = {}
    for block in re.findall(r"^```python\n(.*?)^```$", HOW_TO, re.MULTILINE | re.DOTALL):
        exec(block, names)
    assert names["result"].ok, names["result"].message
    assert names["result"].energy_balance < 1e-3 and names["result"].signals["B.contacts"][-1] == 3
