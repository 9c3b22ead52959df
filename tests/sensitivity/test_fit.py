"""Fits to made data of known noise, to what sensors bound, and what data cannot tell."""

from pathlib import Path

import numpy as np
import pytest
from simulations import pushed
from stopping import stop_at

from buckler.mbs import fit
from buckler.mbs.sensitivity.data import Experiment, Read, read_csv

MASS = 0.5


def block(**more):
    return pushed(**{"damping": 2.0} | more)


def exact(time, stiffness=200.0, damping=2.0, push=3.0):
    """Place of the block, in closed form."""
    decay = damping / (2 * MASS)
    w = np.sqrt(stiffness / MASS - decay**2)
    return push / stiffness * (1 - np.exp(-decay * time) * (np.cos(w * time) + decay / w * np.sin(w * time)))


K, C, F = "loads[0].stiffness", "loads[0].damping", "loads[1].value[0]"
FREE = {K: (100.0, 400.0), C: (0.0, 10.0)}


def made(seed=0, noise=2e-4):
    time, rng = np.linspace(0, 0.5, 101), np.random.default_rng(seed)
    x = exact(time) + noise * rng.standard_normal(time.size)
    return Experiment(time, {"O.x": x})


def test_made_data_give_their_numbers_back_within_their_intervals():
    found = fit(block(), made(), free=FREE, starts=2)
    for name, true in ((K, 200.0), (C, 2.0)):
        low, high = found.intervals[name]
        assert low < true < high and high - low < 0.1 * true
    assert found.rms["O.x"] == pytest.approx(2e-4, rel=0.2) and not found.unidentified
    # linear theory: the interval of K by the closed form's derivatives
    time, h = np.linspace(0, 0.5, 101), 1e-6
    j = np.column_stack([(exact(time, 200 * (1 + h)) - exact(time)) / (200 * h), (exact(time, 200, 2 + h) - exact(time)) / h])
    deviation = found.rms["O.x"] * np.sqrt(np.linalg.inv(j.T @ j)[0, 0])
    assert found.intervals[K].high - found.values[K] == pytest.approx(1.984 * deviation, rel=0.05)


def test_a_profile_gives_the_interval_where_it_is_asked_for():
    found = fit(block(), made(), free=FREE, starts=1, profiles=[C])
    profile, (low, high) = found.profiles[C], found.intervals[C]
    assert low < 2.0 < high
    assert np.interp([low, high], profile.at, profile.cost) == pytest.approx([profile.level, profile.level], rel=3e-3)


def test_profiles_with_known_errors_are_as_wide_as_these_say():
    """Without noise the least cost is zero, and the interval of a number still has the width of the known errors."""
    time, h = np.linspace(0, 0.5, 101), 1e-6
    data = Experiment(time, {"O.x": exact(time)}, errors={"O.x": 2e-4})
    low, high = fit(block(), data, free={K: (100.0, 400.0)}, starts=1, profiles=[K]).intervals[K]
    slope = (exact(time, 200 * (1 + h)) - exact(time)) / (200 * h)
    assert high - low == pytest.approx(2 * 1.96 * 2e-4 / np.linalg.norm(slope), rel=0.05)


def limited(stiffness, damping=2.0):
    """No mechanism can be made above the true stiffness."""
    if stiffness > 200.0:
        raise ValueError("too stiff")
    return block(stiffness=stiffness, damping=damping)


def test_a_run_that_fails_beside_the_best_point_does_not_end_the_fit():
    """The difference is that to the other side."""
    found = fit(limited, made(noise=1e-6), free={"stiffness": (100.0, 300.0)}, starts=3)
    assert found.values["stiffness"] == pytest.approx(200.0, rel=1e-3)
    assert found.intervals["stiffness"].high - found.values["stiffness"] < 0.5


@pytest.mark.parametrize("order", [1, -1])
def test_each_experiment_has_its_own_error(order):
    """Of two experiments that contradict each other the more accurate one decides."""
    time = np.linspace(0, 0.5, 101)
    accurate = Experiment(time, {"O.x": exact(time)}, errors={"O.x": 1e-5})
    inaccurate = Experiment(time, {"O.x": exact(time, stiffness=220.0)}, errors={"O.x": 1e-2})
    found = fit(block(), [accurate, inaccurate][::order], free={K: (100.0, 400.0)}, starts=1)
    assert found.values[K] == pytest.approx(200.0, rel=1e-4)


@pytest.mark.parametrize("free", [{"stiffness": (100.0, 300.0)}, {"stiffness": (100.0, 300.0), "damping": (0.0, 10.0)}])
def test_a_profile_ends_where_runs_fail(free):
    """The interval has no upper end."""
    interval = fit(limited, made(), free=free, starts=3, profiles=["stiffness"]).intervals["stiffness"]
    assert 195.0 < interval.low < 200.0 and interval.high == np.inf


def test_a_number_beside_which_all_runs_fail_is_named():
    mass = 0.5

    def only(stiffness, weight):
        if abs(weight - mass) > 1e-9:
            raise ValueError("no such weight")
        return block(stiffness=stiffness, mass=weight)

    found = fit(only, made(), free={"stiffness": (100.0, 400.0), "weight": (0.4, 0.6)}, starts=1)
    assert found.values["stiffness"] == pytest.approx(200.0, rel=0.02)
    assert "weight is not identified: runs beside it fail (no such weight)." in found.unidentified


def test_when_the_run_began_may_be_a_number():
    time = np.linspace(0.0, 0.5, 101)
    late = Experiment(time + 7.25, {"O.x": exact(time) + 1e-5 * np.random.default_rng(3).standard_normal(time.size)})
    found = fit(block(), late, free={K: (150.0, 250.0), "time_zero": (7.2, 7.3)}, starts=2)
    low, high = found.intervals["time_zero"]
    assert low < 7.25 < high < low + 1e-3 and found.units["time_zero"] == "s"
    assert found.values[K] == pytest.approx(200.0, rel=1e-3)


@pytest.mark.slow
def test_intervals_hold_the_truth_as_often_as_they_say():
    held = np.zeros(2)
    for seed in range(200):
        found = fit(block(), made(seed), free=FREE, starts=1)
        held += [found.intervals[name].low < true < found.intervals[name].high for name, true in ((K, 200.0), (C, 2.0))]
    assert np.all(np.abs(held / 200 - 0.95) <= 0.03), held / 200


def test_what_the_data_cannot_tell_is_said():
    """At rest F/k alone can be seen."""
    time = np.linspace(4.0, 5.0, 21)
    still = Experiment(time, {"O.x": np.full(21, 0.015)}, errors={"O.x": 1e-5})
    found = fit(block(damping=20.0), still, free={K: (100.0, 400.0), F: (1.5, 6.0)}, starts=1)
    assert {each.partition(" ")[0] for each in found.unidentified} == {K, F}
    assert all("only together with" in each for each in found.unidentified)
    assert found.values[F] / found.values[K] == pytest.approx(0.015, rel=1e-3)


def test_a_bound_is_no_reading():
    """Peaks of two pushes, the second beyond the sensor's range."""
    peak = float(exact(np.linspace(0, 0.5, 5001)).max())
    short = Experiment(readings={"max(O.x)": Read(peak, 1e-5)}, settings={F: 3.0}, duration=0.4)
    beyond = Experiment(readings={"max(O.x)": Read(1.5 * peak, 1e-5, "at least")}, settings={F: 6.0}, duration=0.4)
    found = fit(block(), [short, beyond], free={K: (100.0, 400.0)}, starts=1)
    assert found.values[K] == pytest.approx(200, rel=1e-3) and found.cost < 1e-3
    against = Experiment(readings={"max(O.x)": Read(1.5 * peak, 1e-5, "at most")}, settings={F: 6.0}, duration=0.4)
    assert fit(block(), [short, against], free={K: (100.0, 400.0)}, starts=1).cost > 1e3


def test_csv_with_units_and_settings_on_the_command_line(tmp_path, monkeypatch, capsys):
    from buckler.studies.kit.cli import main

    monkeypatch.chdir(tmp_path)
    lines, time = ["t [ms],place [mm],loads[1].value[0]"], np.linspace(0, 0.5, 51)
    for push in (3.0, 4.0):
        lines += [f"{1e3 * t:.6f},{1e3 * x:.9f},{push}" for t, x in zip(time, exact(time, push=push), strict=True)]
    Path("data.csv").write_text("\ufeff" + "\n".join(lines), encoding="utf-8")
    _, second = read_csv("data.csv", ["place=O.x"], [F])
    assert second.settings == {F: 4.0} and second.time[-1] == pytest.approx(0.5)
    block(damping=1.0).save("block.toml")
    words = ["fit", "block.toml", "data.csv", "--signal", "place=O.x", "--setting", F, "--starts", "1"]
    assert main(argv=[*words, "--free", f"{K}=1e2N/m:4e2N/m", "--free", f"{C}=0:10"]) == 0
    said = capsys.readouterr().out
    assert f"{K}  200 " in said.replace("199.999", "200") and "fit.png" in said
    assert Path("results/block-fit/fit.png").stat().st_size > 10_000
    stop_at(monkeypatch, 3)
    assert main(argv=[*words, "--free", f"{K}=1e2:4e2"]) == 1
    assert "timeout = 1 s is over" in "".join(capsys.readouterr())
    assert main(argv=[*words, "--free", "loads[0].stifness=1:2"]) == 2
    assert main(argv=["fit", "block.toml", "data.csv", "--signal", "plac=O.x", "--free", f"{K}=1e2:4e2"]) == 2
    assert main(argv=["fit", "block.toml", "data.csv", "--signal", "place=O.w", "--setting", F, "--free", f"{K}=1e2:4e2"]) == 2
    assert "no signal 'O.w'" in capsys.readouterr().err
