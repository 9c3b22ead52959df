"""How far two runs are apart: made-up functions of time whose norms are known in closed form."""

import numpy as np
import pytest

from buckler.mbs.accuracy.compare import RESTING, SMALL, Functions, _missed, compare, relative
from buckler.mbs.accuracy.goal import Usual
from buckler.mbs.elements.signal import Kind, Signal
from buckler.mbs.geometry import onsets

END = 2.0


def made(time, size=1.0, kinks=(), **signals):
    """Functions of signals (values, kind, unit, and what else a signal has)."""
    found = {name.replace("_", "."): Signal(name.replace("_", "."), *rest) for name, rest in signals.items()}
    return Functions(np.asarray(time), found, size, 0.0, kinks)


def wave(time, amplitude=1.0, kind=Kind.INTERNAL, unit="N"):
    return np.asarray(amplitude) * np.sin(np.pi * np.asarray(time)), unit, kind


def test_a_difference_is_its_mean_square_over_that_of_the_signal():
    time = np.linspace(0, END, 4001)
    found = relative(compare(made(time, a=wave(time, 1.01)), made(time, a=wave(time))))
    assert found["a"] == pytest.approx(0.01, rel=1e-4)
    assert found["a.peak"] == pytest.approx(0.01, rel=1e-4)
    assert found["a.impulse"] == pytest.approx(0.01 * (2 / np.pi) / (4 / np.pi), rel=1e-3)


def test_a_place_is_measured_by_its_range_and_by_no_less_than_rest():
    time = np.linspace(0, END, 401)
    off, still = np.full_like(time, 3e-5), np.zeros_like(time)
    moving = compare(made(time, x=(np.cos(time) + off, "m", Kind.PLACE)), made(time, x=(np.cos(time), "m", Kind.PLACE)))
    assert moving["x"].relative == pytest.approx(3e-5 / np.ptp(np.cos(time)), rel=1e-6)
    resting = compare(made(time, x=(off, "m", Kind.PLACE)), made(time, x=(still, "m", Kind.PLACE)))
    assert resting["x"].relative == pytest.approx(3e-5 / RESTING, rel=1e-6)


def test_a_component_is_measured_by_the_largest_of_its_vector_and_of_its_unit():
    time = np.linspace(0, END, 401)
    one, none, off = np.ones_like(time), np.zeros_like(time), np.full_like(time, 1e-3)
    a = made(time, f_x=(one, "N", Kind.REACTION, "f"), f_y=(off, "N", Kind.REACTION, "f"), g=(off, "N", Kind.REACTION))
    b = made(time, f_x=(one, "N", Kind.REACTION, "f"), f_y=(none, "N", Kind.REACTION, "f"), g=(none, "N", Kind.REACTION))
    found = relative(compare(a, b))
    assert found["f.y"] == pytest.approx(1e-3)
    assert found["g"] == pytest.approx(1e-3 / SMALL)


@pytest.mark.parametrize(("kind", "unit"), [(Kind.REACTION, "N"), (Kind.PLACE, "m")])
def test_what_is_seen_beside_the_largest_is_measured_by_itself_and_what_is_not_rests(kind, unit):
    """A weight of a thirtieth of a blow is to be right; that of a three hundredth is not. Of ways the same at a twentieth."""
    time = np.linspace(0, END, 401)
    share = 1.0 if kind is Kind.REACTION else 0.05
    right = {name: size * np.sin(np.pi * time) for name, size in (("blow", 1.0), ("weight", share / 30), ("dust", share / 300))}
    whole = {name: (values, unit, kind) for name, values in right.items()}
    less = {name: (0.9 * values, unit, kind) for name, values in right.items()}
    found = relative(compare(made(time, **less), made(time, **whole)))
    assert found["weight"] == pytest.approx(found["blow"], rel=0.3)
    assert found["dust"] < found["blow"] / 2


def test_what_lies_between_samples_counts():
    """Two runs agree at the samples of one; between them the other has another value."""
    coarse, fine = np.linspace(0, END, 5), np.linspace(0, END, 401)
    a = made(coarse, a=wave(2 * coarse))  # zero at all its samples
    assert compare(a, made(fine, a=wave(2 * fine)))["a"].relative == pytest.approx(1.0, rel=1e-3)


def test_readings_that_agree_by_chance_hide_nothing():
    """The same largest value half a run later is no agreement."""
    time = np.linspace(0, END, 801)
    early, late = np.exp(-((time - 0.5) ** 2) / 1e-3), np.exp(-((time - 1.5) ** 2) / 1e-3)
    found = compare(made(time, a=(early, "N", Kind.INTERNAL)), made(time, a=(late, "N", Kind.INTERNAL)))
    assert early.max() == pytest.approx(late.max())
    assert found["a.peak"].relative > 0.9


@pytest.mark.parametrize("late", [1e-3, -1e-3])
def test_a_contact_that_closes_later_is_told_by_its_onset_alone(late):
    """The same push, shifted: its time is off, its force is not."""

    def push(time, onset):
        depth = time - onset
        closed = onsets(time, depth, np.ones_like(time))
        return np.where(depth > 0, 5.0 * np.exp(-depth), 0.0), "N", Kind.CONTACT, "", "", 0.0, 0.0, closed

    time = np.linspace(0, END, 1001)
    found = relative(compare(made(time, c=push(time, 0.7003 + late)), made(time, c=push(time, 0.7003))))
    assert found["c.onset"] == pytest.approx(abs(late) / END, rel=1e-6)
    assert found["c"] < 1e-3  # 3e-2 in time as it is
    assert found["c.impulse"] > 1e-3  # in time as it is, the impulse of the shift counts


def test_nothing_is_compared_between_the_samples_about_a_kink():
    coarse, fine = np.linspace(0, END, 21), np.linspace(0, END, 401)

    def step(time):
        return np.where(time < 0.75, 0.0, 1.0), "N", Kind.REACTION

    assert compare(made(coarse, kinks=(0.75,), a=step(coarse)), made(fine, kinks=(0.75,), a=step(fine)))["a"].off < 1e-12
    assert compare(made(coarse, a=step(coarse)), made(fine, a=step(fine)))["a"].off > 0.05


def test_only_so_far_as_asked():
    time = np.linspace(0, END, 401)
    parted = np.where(time > 1.0, 0.5, 0.0)
    a, b = made(time, x=(np.cos(time) + parted, "m", Kind.PLACE)), made(time, x=(np.cos(time), "m", Kind.PLACE))
    assert compare(a, b, 0.99)["x"].off < 1e-12
    assert compare(a, b)["x"].off > 0.3


def test_onsets_lie_where_the_cubic_passes_zero():
    time = np.linspace(0, 4, 17)
    found = onsets(time, np.sin(time + 1e-3), np.cos(time + 1e-3))
    assert found == pytest.approx([np.pi - 1e-3], abs=2e-5)


def test_what_lies_after_an_onset_that_is_a_sample_counts():
    """The step after it was left out with the onset itself; in the first milliseconds of a joint the force there was 1 % off."""
    time = np.linspace(0, END, 201)

    def run(samples):
        push = np.maximum(samples - 1.0, 0.0) ** 1.5
        return Functions(samples, {"c": Signal("c", push, "N", Kind.CONTACT, onsets=np.array([1.0 + 1e-9]))}, 1.0)

    found = relative(compare(run(np.append(time[time <= 1.0], np.linspace(1.25, END, 4))), run(time)))
    between = np.linspace(1.0, 1.25, 1001)
    off = np.abs(run(np.append(time[time <= 1.0], np.linspace(1.25, END, 4))).at(between)["c"] - (between - 1.0) ** 1.5).max()
    assert found["c.peak"] == pytest.approx(off, rel=0.05) and off > 2e-3


def test_a_ringing_is_resolved_where_no_whole_period_of_it_has_long_steps():
    """Many short steps elsewhere do not make up for a stretch in which a ringing is damped away."""
    fine, period = np.arange(0, END, 1e-3), 1e-2
    for gone, unresolved in ((0.5 * period, []), (2 * period, ["f"])):
        time = fine[(fine < 1) | (fine >= 1 + gone)]
        mean = Signal("f.mean", np.sin(time), "N", Kind.REACTION, period=period)
        assert Functions(time, {"f.mean": mean}, 1.0).unresolved == unresolved


def test_a_touch_that_one_of_two_runs_nearly_has_counts_as_deep_as_they_are_apart():
    """0.5 mm and 2 mm apart at the closest: a third run could be 1 mm deep. The force of that; none of a touch both have."""
    time = np.linspace(0, END, 2001)

    def run(gap):
        depth = np.where(time < 1.0, 1e-2 * np.sin(2 * np.pi * time) - 9e-3 - gap, -1.0) + 1e-3 * (time >= 1.0)
        return made(time, c=(np.zeros_like(time), "N", Kind.CONTACT, "", "", 0.0, 0.0, np.empty(0), depth, lambda d: 1e4 * d))

    near, far = run(1.5e-3), run(3e-3)
    deepest = max(near.signals["c"].depth) + np.ptp([max(each.signals["c"].depth) for each in (near, far)])
    assert deepest == pytest.approx(1e-3)
    missed = _missed(near, far, "c", time)
    assert missed.max() == pytest.approx(10.0) and missed[0] == missed[-1] == 0.0
    assert not _missed(run(0.5e-3), run(0.4e-3), "c", time).any()


def test_a_run_without_settings_may_err_by_a_thousandth_of_places_and_by_half_a_per_cent_where_something_strikes():
    time = np.linspace(0, END, 401)
    places, force = wave(time, 0.5, Kind.PLACE, "m"), (np.zeros_like(time), "N", Kind.CONTACT)
    assert Usual().limits(made(time, x=places)) == {"x.peak": pytest.approx(1e-3)}
    assert Usual().limits(made(time, x=places, c=force))["x"] == pytest.approx(5e-3)
