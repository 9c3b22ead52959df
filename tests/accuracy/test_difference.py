"""Difference of two runs: made-up functions of time whose norms are known in closed form."""

import pickle

import numpy as np
import pytest

from buckler.mbs.accuracy.difference import Difference
from buckler.mbs.accuracy.impacts import Impacts, compare_impacts
from buckler.mbs.accuracy.trajectory import RESTING, SMALL, Trajectory
from buckler.mbs.elements.signal import Kind, Signal
from buckler.mbs.geometry import find_sign_changes
from buckler.mbs.record.errors import Deferred, Norm

END = 2.0
NONE = np.empty(0)


def made(time, size=1.0, kinks=(), **signals):
    """A trajectory of signals (values, unit, kind, and what else a signal has)."""
    found = {name.replace("_", "."): Signal(name.replace("_", "."), *rest) for name, rest in signals.items()}
    return Trajectory(np.asarray(time), found, size, kinks)


def norms(a, b, until=np.inf):
    return Difference(a, b, until).norms()[0]


def wave(time, amplitude=1.0, kind=Kind.INTERNAL, unit="N"):
    return np.asarray(amplitude) * np.sin(np.pi * np.asarray(time)), unit, kind


def test_a_difference_is_its_mean_square_over_that_of_the_signal():
    time = np.linspace(0, END, 4001)
    found = norms(made(time, a=wave(time, 1.01)), made(time, a=wave(time)))
    assert found["a", Norm.RMS] == pytest.approx(0.01, rel=1e-4)
    assert found["a", Norm.PEAK] == pytest.approx(0.01, rel=1e-4)
    assert found["a", Norm.IMPULSE] == pytest.approx(0.01 * (2 / np.pi) / (4 / np.pi), rel=1e-3)


def test_a_place_is_measured_by_its_range_and_by_no_less_than_rest():
    time = np.linspace(0, END, 401)
    off, still = np.full_like(time, 3e-5), np.zeros_like(time)
    moving = norms(made(time, x=(np.cos(time) + off, "m", Kind.PLACE)), made(time, x=(np.cos(time), "m", Kind.PLACE)))
    assert moving["x", Norm.RMS] == pytest.approx(3e-5 / np.ptp(np.cos(time)), rel=1e-6)
    resting = norms(made(time, x=(off, "m", Kind.PLACE)), made(time, x=(still, "m", Kind.PLACE)))
    assert resting["x", Norm.RMS] == pytest.approx(3e-5 / RESTING, rel=1e-6)


def test_a_component_is_measured_by_the_largest_of_its_vector_and_of_its_unit():
    time = np.linspace(0, END, 401)
    one, none, off = np.ones_like(time), np.zeros_like(time), np.full_like(time, 1e-3)
    a = made(time, f_x=(one, "N", Kind.REACTION, "f"), f_y=(off, "N", Kind.REACTION, "f"), g=(off, "N", Kind.REACTION))
    b = made(time, f_x=(one, "N", Kind.REACTION, "f"), f_y=(none, "N", Kind.REACTION, "f"), g=(none, "N", Kind.REACTION))
    found = norms(a, b)
    assert found["f.y", Norm.RMS] == pytest.approx(1e-3)
    assert found["g", Norm.RMS] == pytest.approx(1e-3 / SMALL)


def test_samples_of_both_runs_count():
    """Two runs agree at the samples of one; at those of the other they do not."""
    coarse, fine = np.linspace(0, END, 5), np.linspace(0, END, 401)
    a = made(coarse, a=wave(2 * coarse))  # zero at all its samples
    assert norms(a, made(fine, a=wave(2 * fine)))["a", Norm.RMS] == pytest.approx(1.0, rel=1e-3)


def test_readings_that_agree_by_chance_hide_nothing():
    """The same largest value half a run later is no agreement."""
    time = np.linspace(0, END, 801)
    early, late = np.exp(-((time - 0.5) ** 2) / 1e-3), np.exp(-((time - 1.5) ** 2) / 1e-3)
    found = norms(made(time, a=(early, "N", Kind.INTERNAL)), made(time, a=(late, "N", Kind.INTERNAL)))
    assert early.max() == pytest.approx(late.max()) and found["a", Norm.PEAK] > 0.9


@pytest.mark.parametrize("late", [1e-3, -1e-3])
def test_a_contact_that_closes_later_is_off_by_its_onset(late):
    """The same push, shifted: its time is off, its force is not."""

    def push(time, onset):
        depth = time - onset
        closed = find_sign_changes(time, depth, np.ones_like(time))
        return np.where(depth > 0, 5.0 * np.exp(-depth), 0.0), "N", Kind.CONTACT, "", "", 0.0, 0.0, "", closed

    time = np.linspace(0, END, 1001)
    found = norms(made(time, c=push(time, 0.7003 + late)), made(time, c=push(time, 0.7003)))
    assert found["c", Norm.ONSET] == pytest.approx(abs(late) / END, abs=END / 1000 / END)
    assert found["c", Norm.RMS] < 1e-3  # 3e-2 in time as it is


@pytest.mark.parametrize("late", [1e-2, -1e-2])
def test_a_kink_of_a_drive_is_not_moved_with_the_onset_before_it(late):
    """The drive's force jumps at the same time in both runs, however late the contact closes in one of them."""

    def run(onset):
        time = np.unique([*np.linspace(0, END, 1001), 1.2 - 1e-9, 1.2])
        depth = time - onset
        closed = find_sign_changes(time, depth, np.ones_like(time))
        push = np.where(depth > 0, 5.0, 0.0), "N", Kind.CONTACT, "", "", 0.0, 0.0, "", closed
        return made(time, kinks=(1.2,), c=push, f=(np.where(time < 1.2, 0.0, 1.0), "N", Kind.REACTION))

    found = norms(run(0.7003 + late), run(0.7003))
    assert found["f", Norm.RMS] == found["f", Norm.PEAK] == 0.0
    assert found["c", Norm.RMS] < 1e-12


def test_nothing_is_compared_between_the_samples_about_a_kink():
    coarse, fine = np.linspace(0, END, 21), np.linspace(0, END, 401)

    def step(time):
        return np.where(time < 0.75, 0.0, 1.0), "N", Kind.REACTION

    assert norms(made(coarse, kinks=(0.75,), a=step(coarse)), made(fine, kinks=(0.75,), a=step(fine)))["a", Norm.RMS] < 1e-12
    assert norms(made(coarse, a=step(coarse)), made(fine, a=step(fine)))["a", Norm.RMS] > 0.05


def test_a_comparison_ends_where_it_is_told_to():
    time = np.linspace(0, END, 401)
    parted = np.where(time > 1.0, 0.5, 0.0)
    a, b = made(time, x=(np.cos(time) + parted, "m", Kind.PLACE)), made(time, x=(np.cos(time), "m", Kind.PLACE))
    assert norms(a, b, 0.99)["x", Norm.RMS] < 1e-12 and norms(a, b)["x", Norm.RMS] > 0.2


def test_onsets_lie_where_the_cubic_passes_zero():
    time = np.linspace(0, 4, 17)
    found = find_sign_changes(time, np.sin(time + 1e-3), np.cos(time + 1e-3))
    assert found == pytest.approx([np.pi - 1e-3], abs=2e-5)
    fine = np.linspace(0, 4, 401)
    many = find_sign_changes(fine, np.cos(9 * fine), -9 * np.sin(9 * fine))
    assert many == pytest.approx(np.pi / 9 * (np.arange(len(many)) + 0.5), abs=1e-8) and len(many) == 11


def test_a_ringing_is_resolved_where_no_whole_period_of_it_has_long_steps():
    """Many short steps elsewhere do not make up for a stretch in which a ringing is damped away."""
    fine, period = np.arange(0, END, 1e-3), 1e-2
    for gone, unresolved in ((0.5 * period, []), (2 * period, ["f"])):
        time = fine[(fine < 1) | (fine >= 1 + gone)]
        mean = Signal("f.mean", np.sin(time), "N", Kind.REACTION, period=period, source="f")
        assert Trajectory(time, {"f.mean": mean}, 1.0).unresolved == unresolved


# --- trains of blows --------------------------------------------------------------------------------------------------


def train(count=17, peak=1.0, late=0.0, extra=(), split=None):
    """A train of half-sines of 10 ms on 20,001 samples, with more blows (time, peak) and one blow in two parts."""
    time = np.linspace(0, END, 20_001)
    force = np.zeros_like(time)
    blows = [(0.1 * (k + 1) + late, peak * (1 + 0.1 * (k % 3))) for k in range(count)]
    for start, size in (*blows, *extra):
        inside = (time >= start) & (time < start + 0.01)
        force[inside] += size * np.sin(np.pi * (time[inside] - start) / 0.01)
    if split is not None:
        force[(time > split) & (time < split + 5e-4)] = 0.0
    return time, force


def contact_norms(a, b):
    return compare_impacts(Impacts.of(*a, END), Impacts.of(*b, END))


@pytest.mark.parametrize("when", [0.02, 0.55, 1.95])
def test_one_graze_more_is_off_by_a_ten_millionth(when):
    """Pairing onsets by their number made the error 0.7 to 1.0."""
    found = contact_norms(train(extra=[(when, 1.2e-6)]), train())
    assert found[Norm.IMPULSE] < 2e-7 and found[Norm.PEAK] == found[Norm.ONSET] == 0.0


@pytest.mark.parametrize(
    ("changed", "impulse", "peak", "onset"),
    [
        ({"extra": [(0.55, 0.12)]}, 0.12 / 18.6, 0.0, 0.0),
        ({"late": 2e-4}, 1e-3, 0.0, 1e-4),
        ({"peak": 1.03}, 0.03, 0.03, 0.0),
        ({"split": 0.3055}, 4.5e-3, 0.0, 0.0),
        ({"split": 0.3005}, 7e-4, 0.0, 0.0),
    ],
    ids=["one blow more", "later", "harder", "one in two parts", "a short part and a long one"],
)
def test_trains_of_blows(changed, impulse, peak, onset):
    found = contact_norms(train(**changed), train())
    assert found[Norm.IMPULSE] == pytest.approx(impulse, rel=0.7)
    assert found[Norm.PEAK] == pytest.approx(peak, rel=1e-3, abs=1e-9)
    assert found[Norm.ONSET] == pytest.approx(onset, rel=0.5, abs=1e-9)


@pytest.mark.parametrize(("extra", "off"), [([(0.55, 1.5)], 0.3 / 1.2), ([(0.75, 0.9)], 0.0)])
def test_a_blow_of_one_run_alone_changes_the_peak_as_far_as_it_is_the_highest(extra, off):
    assert contact_norms(train(extra=extra), train())[Norm.PEAK] == pytest.approx(off, abs=1e-6)
    assert contact_norms(train(), train(extra=extra))[Norm.PEAK] == pytest.approx(0.3 / 1.5 if off else 0.0, abs=1e-6)


def test_low_blows_that_scatter_leave_the_error_of_the_highest_peak():
    """Half as high and off by a fifth: they weigh a sixteenth, where by their squares they would a quarter."""
    high = [(0.05 + 0.1 * k, 4.0) for k in range(18)]
    a, b = train(peak=1.2, extra=high), train(extra=high)
    assert 1e-3 < contact_norms(a, b)[Norm.PEAK] < 2e-2
    assert contact_norms(train(peak=1.2), train())[Norm.PEAK] == pytest.approx(0.2, rel=1e-3)


def test_a_blow_that_only_one_run_has_is_wholly_off():
    time, force = train(1)
    none = contact_norms((time, force), (time, 0 * force))
    assert set(none.values()) == {1.0}


def test_errors_without_a_limit_are_computed_when_they_are_read_and_then_released():
    """Comparing all signals of a run with many blows costs more than the run; pickles hold plain numbers."""
    known, rest, calls = {("x", Norm.RMS): 1.0}, {("x", Norm.RMS): 1.0, ("y", Norm.RMS): 2.0}, []
    numbers = Deferred(known, lambda: calls.append(1) or rest)
    assert numbers["x", Norm.RMS] == 1.0 and not calls
    assert numbers["y", Norm.RMS] == 2.0 and dict(numbers) == rest == pickle.loads(pickle.dumps(numbers)) and len(calls) == 1
    with pytest.raises(KeyError):
        numbers["z", Norm.RMS]


def test_norms_are_those_of_the_keys_asked_for_and_no_others():
    time = np.linspace(0, END, 401)
    push = (np.maximum(0.0, np.sin(20 * time)), "N", Kind.CONTACT)
    a, b = (made(time, x=(size * np.cos(time), "m", Kind.PLACE), f=wave(time, size), c=push) for size in (1.01, 1.0))
    whole = Difference(a, b).norms()
    for key in whole[0]:
        found = Difference(a, b).norms([key, ("none", Norm.RMS)])
        assert found == (pytest.approx({key: whole[0][key]}), pytest.approx({key: whole[1][key]}))
