"""Rows are judged where the mechanism is: redundant ones, ones that depend on others in one pose only, and their forces."""

from math import cos, pi, sin

import numpy as np
import pytest

from buckler import mbs
from buckler.mbs.elements.signal import Kind
from buckler.mbs.scene.scene import Scene

DRAWN = np.random.default_rng(7)
ANGLES = [0.0, pi / 2, *DRAWN.uniform(-pi, pi, 3).tolist()]


def at(length, angle, start=(0.0, 0.0)):
    return (start[0] + length * cos(angle), start[1] + length * sin(angle))


def bar(name, start, end, **more):
    return mbs.Link(name, start, end, mbs.Rigid(mbs.Section(0.02, 0.005)), **more)


def two_bars(angle, joints):
    """Two bars, held together at A and B, that hang on O."""
    points = {name: at(d, angle) for name, d in {"O": 0.0, "A": 0.2, "B": 0.33, "C": 0.5}.items()}
    links = [bar("one", "O", "B", carries=("A",)), bar("two", "A", "C", carries=("B",))]
    return mbs.Mechanism(points, links, [mbs.Revolute("O", "ground", "one"), *joints], gravity=(0.0, -9.81))


def pinned_twice(angle):
    return two_bars(angle, [mbs.Revolute("A", "one", "two"), mbs.Revolute("B", "one", "two")])


@pytest.mark.parametrize("angle", ANGLES)
def test_two_pins_weld_two_bars_in_every_pose(angle):
    assert Scene.of(pinned_twice(angle)).redundant == ["B.one-two"]
    assert Scene.of(pinned_twice(angle)).undetermined == ["A.one-two", "B.one-two"]
    welded = mbs.frequencies(two_bars(angle, [mbs.Weld("A", "one", "two")]))
    assert mbs.frequencies(pinned_twice(angle)).hertz == pytest.approx(welded.hertz, rel=1e-7)


@pytest.mark.parametrize("solver", [mbs.Spectral(), mbs.Exudyn()], ids=["Spectral", "Exudyn"])
def test_two_pins_hold_through_a_swing(solver):
    """From level over the lowest pose, where other rows depend on the rest than where it is drawn."""
    run, welded = (mbs.simulate(m, 0.9, solver=solver) for m in (pinned_twice(0.0), two_bars(0.0, [mbs.Weld("A", "one", "two")])))
    assert run.ok
    exact = isinstance(solver, mbs.Spectral)  # the better one of two rows is kept in every pose, as a weld would be
    assert run["C.x"][-1] == pytest.approx(welded["C.x"][-1], abs=1e-9 if exact else 2e-4)
    kinds = {name: trait.kind for name, trait in run.traits.items()}
    assert kinds["A.one-two.fx"] is kinds["B.one-two.fy"] is Kind.UNDETERMINED
    assert kinds["O.ground-one.fx"] is Kind.REACTION


def cranks(angle, radius, places, driven):
    """A bar on several parallel cranks, one more than it needs."""
    points, links, joints = {}, [], []
    for k, x in enumerate(places):
        points |= {f"O{k}": (x, 0.0), f"A{k}": at(radius, angle, (x, 0.0))}
        links.append(bar(f"crank{k}", f"O{k}", f"A{k}"))
        joints += [mbs.Revolute(f"O{k}", "ground", f"crank{k}"), mbs.Revolute(f"A{k}", f"crank{k}", "bar")]
    last = len(places) - 1
    links.append(bar("bar", "A0", f"A{last}", carries=tuple(f"A{k}" for k in range(1, last))))
    drives = [mbs.Drive("crank0", speed=driven)] if driven else []
    return mbs.Mechanism(
        points, links, joints, drives=drives, velocities={} if driven else {f"crank{k}": 8.0 for k in range(len(places))}
    )


@pytest.mark.parametrize("angle", [0.4, 2.0])
@pytest.mark.parametrize("solver", [None, mbs.Spectral()], ids=["Closure", "Spectral"])
def test_three_cranks_turn_through_all_poses(angle, solver):
    """Also those in one line, which two cranks alone would not pass decided."""
    made = cranks(angle, 0.1, (0.0, 0.15, 0.35), driven=5.0)
    run = mbs.simulate(made, 1.3, solver=solver)
    assert run.ok, run.message
    for k, x in enumerate((0.0, 0.15, 0.35)):
        assert run[f"A{k}.x"][-1] == pytest.approx(x + 0.1 * cos(angle + 6.5), abs=1e-6)
        assert run[f"A{k}.y"][-1] == pytest.approx(0.1 * sin(angle + 6.5), abs=1e-6)


@pytest.mark.parametrize("radius", [0.1, 0.17])
def test_a_parallelogram_drawn_in_line_keeps_its_lengths(radius):
    """At its change point a row depends on the others there only; whichever way inertia takes it, all pins hold."""
    made = cranks(0.0, radius, (0.0, 0.3), driven=0.0)
    assert not Scene.of(made).redundant and not Scene.of(made).undetermined
    run = mbs.simulate(made, 0.25, solver=mbs.Spectral())
    assert "CONSTRAINTS" not in run.message
    assert np.hypot(run["A1.x"] - run["A0.x"], run["A1.y"] - run["A0.y"]) == pytest.approx(0.3, abs=1e-8)
    assert np.hypot(run["A1.x"] - 0.3, run["A1.y"]) == pytest.approx(radius, abs=1e-8)
    assert abs(run["A0.y"]).max() > 0.5 * radius  # it moves


def test_redundancy_elsewhere_does_not_decide_a_change_point():
    """Two cranks alone, and a bar held twice at one of them: beyond the pose in line nothing tells which way they go."""
    two = cranks(2.0, 0.1, (0.0, 0.3), driven=5.0)
    x, y = two.points["A0"]
    points = {**two.points, "P": (x + 0.05, y), "Q": (x + 0.2, y)}
    links = [*two.links[:-1], bar("bar", "A0", "A1", carries=("P", "Q")), bar("tail", "P", "Q")]
    tail = [mbs.Revolute("P", "bar", "tail"), mbs.Revolute("Q", "bar", "tail")]
    made = mbs.Mechanism(points, links, [*two.joints, *tail], drives=two.drives)
    assert Scene.of(made).redundant == ["Q.bar-tail"]
    run = mbs.simulate(made, 0.5)
    assert not run.ok and ("SINGULAR" in str(run.status) or "BRANCH" in run.message), run.message


def test_no_accuracy_can_be_asked_of_an_undetermined_force():
    made = cranks(0.4, 0.1, (0.0, 0.15, 0.35), driven=0.0)
    run = mbs.simulate(made, 0.1)
    assert run.ok and "A1.crank1-bar.fx" not in run.error
    with pytest.raises(ValueError, match="no equation determines"):
        mbs.simulate(made, 0.1, 1e-2, of=["A1.crank1-bar.fx"])


@pytest.mark.parametrize(("bars", "length"), [(1, 0.21), (2, 0.7), (4, 0.33)])
def test_a_hanging_chain_at_rest_is_no_alarm(bars, length):
    """Energies of what does not move are rounding; nobody asked for them."""
    points = {f"P{k}": (0.0, -k * length) for k in range(bars + 1)}
    links = [bar(f"bar{k}", f"P{k}", f"P{k + 1}") for k in range(bars)]
    pins = [mbs.Revolute(f"P{k}", f"bar{k - 1}" if k else "ground", f"bar{k}") for k in range(bars)]
    run = mbs.simulate(mbs.Mechanism(points, links, pins, gravity=(0.0, -9.81)), 0.5)
    assert run.ok, run.message
    assert abs(run[f"P{bars}.x"]).max() < 1e-9
