"""What a run gives back survives processes unchanged, and is read as it was meant."""

import math
import pickle
from dataclasses import fields, replace

import numpy as np
import pytest

from buckler.mbs import Beam, Result, Section, Status, simulate, slider_crank
from buckler.mbs.elements.signal import Kind, Trait
from buckler.mbs.laws import ExactRestitution
from buckler.mbs.record.run import Shape

STRIP = Section(width=0.030, thickness=0.0003).damped(0.02, 0.31)


def small(**changed):
    """A result made by hand; its steps are unequal, and the values are awkward on purpose."""
    time = np.array([0.0, 0.1, 0.4, 1.0])
    result = Result(
        status=Status.SUSPECT,
        message="ENERGY: balance 3 %; gap = 1e-5 m, \u03b7 > 2",
        time=time,
        signals={"B.x": np.array([0.0, 1.0, -2.0, 1e-300]), "drive.torque": np.array([np.nan, np.inf, 0.1 + 0.2, -0.0])},
        units={"B.x": "m", "drive.torque": "N m"},
        work={"wall_s": 0.125, "steps": 3.0},
        energy={"error": np.array([0.0, 1e-3, -2e-3, 1e-3]), "throughput": np.array([0.0, 0.1, 0.3, 0.5])},
        shapes={"coupler": Shape(np.array([0.1, 1.0]), np.arange(12.0).reshape(2, 3, 2) / 7, 3e-4)},
        provenance={"exudyn": "1.13.6", "scene": {"Beam": 1, "coordinates": 55}},
    )
    return replace(result, **changed)


@pytest.fixture(scope="module")
def real():
    """A run with everything a result can hold."""
    mechanism = slider_crank(Beam(STRIP, elements=4), law=ExactRestitution(1e5, 0.8), mass=0.3, speed=1.25)
    return simulate(mechanism, 0.2, ledger=True, shapes=[0.0, 0.05, 0.2])


def plain(value):
    """As what can be compared: arrays as bytes, nan as itself."""
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, np.where(np.isnan(value), np.nan, value).tobytes()
    if isinstance(value, dict):
        return [(key, plain(each)) for key, each in value.items()]
    if isinstance(value, Shape):
        return plain(vars(value))
    return repr(value)


def assert_equal(one, two):
    for name in {spec.name for spec in fields(Result)} - {"film"}:
        assert plain(getattr(one, name)) == plain(getattr(two, name)), name
    assert (one.film is None) == (two.film is None)
    if one.film is not None:
        assert one.film.movie().marks == two.film.movie().marks
        assert plain(one.film.movie().time) == plain(two.film.movie().time)


def test_a_result_pickles(real):
    for result in (small(), real):
        assert_equal(result, pickle.loads(pickle.dumps(result)))


# --- reading ----------------------------------------------------------------------------------------------------------


def test_mean_weights_by_time():
    """The trapezium rule by hand over steps 0.1, 0.3, 0.6: 0.05 - 0.15 - 0.6."""
    assert small().mean("B.x") == pytest.approx(-0.7, rel=1e-14)
    clustered = np.concatenate([np.linspace(0, 0.01, 1000), np.linspace(0.02, 1, 50)])
    assert small(time=clustered, signals={"s": clustered}).mean("s") == pytest.approx(0.5, rel=1e-12)


def test_at_is_linear_between_steps_where_nothing_is_known_of_a_signal():
    assert small().at("B.x", [0.1, 0.25, 0.05]) == pytest.approx([1.0, -0.5, 0.5])
    assert small().at("B.x", 0.25) == pytest.approx(-0.5)
    with pytest.raises(KeyError):
        small().at("B.z", 0.1)


def test_places_between_steps_go_by_their_speeds():
    time, times = np.linspace(0, 2 * np.pi, 51), np.linspace(0.1, 6.2, 97)
    kinds = {"B.x": Trait(Kind.PLACE, rate="B.vx"), "B.vx": Trait(Kind.RATE)}
    swing = small(time=time, signals={"B.x": np.cos(time), "B.vx": -np.sin(time)}, traits=kinds)
    fourth_order = (time[1] - time[0]) ** 4 / 384
    assert swing.at("B.x", times) == pytest.approx(np.cos(times), abs=1.01 * fourth_order)
    assert np.abs(swing.at("B.x", times) - np.cos(times)).max() > 0.9 * fourth_order
    assert swing.at("B.x", float(times[3])) == swing.at("B.x", times)[3]
    assert np.abs(swing.at("B.vx", times) + np.sin(times)).max() > 1e-3  # a rate without a rate: a cubic that does not overshoot
    alone = small(time=time, signals={"B.x": np.cos(time)}, traits={"B.x": Trait(Kind.PLACE)})
    assert alone.at("B.x", times[2:-2]) == pytest.approx(np.cos(times[2:-2]), abs=2e-4)  # parabolas' slopes: third order


def test_energy_balance_is_the_largest_error_over_the_throughput():
    assert small().energy_balance == pytest.approx(2e-3 / 0.5)
    assert math.isnan(small(energy={}).energy_balance)


def test_suspicion_is_added_but_hides_no_failure():
    fine = small(status=Status.OK, message="")
    assert fine.ok and not fine.suspect("A").ok
    twice = fine.suspect("A").suspect("B")
    assert twice.status is Status.SUSPECT and twice.message == "A; B"
    failed = small(status=Status.NEWTON_DIVERGED, message="at t = 1 s")
    assert failed.suspect("A") is failed
    assert fine.ok and fine.message == ""  # the original is untouched


# --- a real one -------------------------------------------------------------------------------------------------------


def test_a_real_result_is_complete_and_plain(real):
    assert real.ok, real.message
    assert set(real.units) == set(real.signals)
    assert all(type(values) is np.ndarray and values.shape == real.time.shape for values in real.signals.values())
    assert all(values.shape == real.time.shape for values in real.energy.values())
    assert real.time[0] == 0.0 and real.time[-1] == pytest.approx(0.2, rel=1e-12) and (np.diff(real.time) > 0).all()
    assert real.work["steps"] == len(real.time) - 1 and real.work["newton_iterations"] >= real.work["steps"]
    assert real.provenance["scene"]["Beam"] == 1 and real.provenance["exudyn"]


def test_stored_shapes_end_where_the_pins_are(real):
    shape = real.shapes["coupler"]
    assert shape.times.tolist() == [0.0, 0.05, 0.2] and shape.thickness == STRIP.thickness
    for station, point in ((0, "A"), (-1, "B")):
        for axis, letter in enumerate("xy"):
            assert shape.points[:, station, axis] == pytest.approx(real.at(f"{point}.{letter}", shape.times), abs=1e-6)
    assert np.hypot(*(shape.points[0, -1] - shape.points[0, 0])) == pytest.approx(0.31, rel=1e-12)
