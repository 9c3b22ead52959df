"""What elements answer, against formulas and balances of their own: numbers that a run shows only in a small part."""

import math
from dataclasses import replace

import numpy as np
import pytest
from made import BAR, LENGTH, STRIP, mechanism, steel

from buckler import mbs
from buckler.mbs.checks.growing import Growth
from buckler.mbs.elements.element import Place
from buckler.mbs.elements.rows import Along, Distance, Turn, row
from buckler.mbs.elements.spring import potential
from buckler.mbs.elements.strut import StrutLaw
from buckler.mbs.engine.solve import run_once
from buckler.mbs.geometry import cross
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.scene.forms import Forms


def test_a_gradient_of_a_row_is_that_of_its_measure():
    """By differences of places and angles, of points off both axes."""
    points = {"P": (0.3, -0.7), "Q": (-0.4, 0.2)}
    one, other, d = Place("one", "P"), Place("two", "Q"), (0.6, 0.8)

    def value(measure, moved):
        (x1, y1, a1), (x2, y2, a2) = ((*np.add(points[e.point], moved[e][:2]), moved[e][2]) for e in (one, other))
        if isinstance(measure, Turn):
            return a1 - a2
        if isinstance(measure, Distance):
            return math.hypot(x1 - x2, y1 - y2)
        c, s = (math.cos(a2), math.sin(a2)) if measure.turns else (1.0, 0.0)
        return (c * d[0] - s * d[1]) * (x1 - x2) + (s * d[0] + c * d[1]) * (y1 - y2)

    pose = np.array([(*points[end.point], 0.0) for end in (one, other)])
    origins = {end: (i, complex(*points[end.point])) for i, end in enumerate((one, other))}
    for measure in (Along(one, other, d), Along(one, other, d, turns=True), Turn(one, other), Distance(one, other)):
        _, jacobian = Forms([row(measure)], 2, points, locate=origins.__getitem__).system(pose)
        for end, gradient in zip((one, other), jacobian.reshape(2, 3), strict=True):
            for k in range(3):
                sides = [value(measure, {one: np.zeros(3), other: np.zeros(3)} | {end: h * np.eye(3)[k]}) for h in (1e-6, -1e-6)]
                assert gradient[k] == pytest.approx((sides[0] - sides[1]) / 2e-6, abs=1e-8), (measure, end, k)


def test_damping_of_a_strut_takes_what_its_force_has_beyond_the_elastic_one():
    law = StrutLaw(mbs.Strut(replace(STRIP, material=steel(axial_damping=1e-4))), LENGTH)
    assert law.damping > 0
    for elongation, rate in ((1e-6, 0.3), (1e-6, -1e-4), (1e-6, -50.0), (-1e-6, 0.3), (10 * law.kink, -0.2)):
        beyond = law.force(elongation, rate) - law.elastic(elongation)
        assert float(law.damping_power(elongation, rate)) == pytest.approx(beyond * rate, rel=1e-12), (elongation, rate)


def test_the_potential_of_a_law_is_its_work():
    """Of k x + c x^3: k x^2/2 + c x^4/4, which Gauss's points take without error."""
    values = np.array([-0.3, -1e-3, 0.0, 0.2, 0.7])
    found = potential(lambda x, _rate: 50.0 * x + 8.0 * x**3, values)
    assert found == pytest.approx(25.0 * values**2 + 2.0 * values**4, rel=1e-12, abs=1e-15)


def test_a_motion_is_asked_for_nothing_beyond_the_run():
    """Nor before: a run shorter than the step of the differences has shorter ones, exact for a square."""
    last, asked = 1e-5, []

    def speed(t):
        asked.append(t)
        return 3.0 * t**2 + 2.0 * t + 1.0

    motion = mbs.Motion(lambda t: t**3 + t**2 + t, speed)
    for t in (0.0, 0.4 * last, last):
        assert motion.acceleration(t, last) == pytest.approx(6.0 * t + 2.0, abs=1e-9)
    asked.clear()
    motion.acceleration(0.5 * last, last)
    assert 0.0 <= np.min(np.hstack(asked)) and np.max(np.hstack(asked)) <= last
    assert motion.acceleration(0.0) == pytest.approx(2.0, rel=1e-9) and np.min(np.hstack(asked)) >= 0.0


def test_a_stop_on_a_link_is_as_deep_as_its_force_says_and_pushes_both_alike():
    """The face lies 0.15 m below the point at the start. Forces on both links cancel, and so do moments about any point."""
    made = mbs.Mechanism(
        points={"A": (-0.25, 0), "B": (0.25, 0), "C": (0.1, -0.2), "D": (0.4, -0.1)},
        links=[mbs.Link("rod", "A", "B", mbs.Rigid.of(mass=0.8, inertia=0.02)), mbs.Link("table", "C", "D", mbs.Rigid(BAR))],
        joints=[mbs.Weld("C", "ground", "table")],
        stops=[mbs.Stop("B", at=-0.15, law=KelvinVoigt(1e5, 0.0), along=(0, 1), on="table:D")],
        gravity=(0, -9.81),
    )
    result = mbs.simulate(made, 0.2, solver=mbs.Exudyn())
    force, record = result["B.contact_force"], result.film.record
    assert result.time[np.argmax(force > 0)] == pytest.approx(math.sqrt(2 * 0.15 / 9.81), abs=1e-3)
    assert result["B.penetration"][np.argmax(force)] == pytest.approx(force.max() / 1e5, rel=1e-6)
    pushes = list(made.stops[0].pushes("B", record))
    assert len(pushes) == 2 and np.abs(pushes[0].force).max() > 1.0
    assert sum(push.force for push in pushes) == pytest.approx(0.0, abs=1e-12)
    moments = [cross(record.point(push.at)[0], push.force) + push.torque for push in pushes]
    assert sum(moments) == pytest.approx(0.0, abs=1e-9 * np.abs(moments[0]).max())
    assert (pushes[0].force[:, 1] >= 0).all()  # the face lies below the point


def test_a_pin_hole_takes_the_nodes_on_and_within_its_circle():
    nodes = np.array([[0.1, 0.005, 0.0], [0.1, 0.0, 0.3], [0.1, 0.006, 0.0], [0.09, 0.0, 0.0]])
    assert mbs.modal.PinHole(0.005)(nodes, np.array([0.1, 0.0, 0.0])).tolist() == [True, True, False, False]


def test_the_bending_of_a_pressed_strip_grows_as_its_formula_says_however_it_has_turned():
    """omega_1 sqrt(P/P_E - 1) between the pins of a heavy arm that falls, and turns by 2 rad."""
    arm = mbs.Link("arm", "A", "B", mbs.Rigid.of(mass=50.0, inertia=5.0))
    pins = [mbs.Revolute("A", "ground", "arm"), mbs.Revolute("A", "arm", "strip"), mbs.Revolute("B", "arm", "strip")]
    made = mbs.Mechanism(
        {"A": (0.4, -0.3), "B": (0.4 + LENGTH, -0.3)},
        [arm, mbs.Link("strip", "A", "B", mbs.Beam(STRIP))],
        pins,
        gravity=(0.0, -9.81),
    )
    record = run_once(made, 0.45, mbs.Exudyn(), None, None).record
    assert abs(record.turn("arm:A")[0][-1]) > 1.0
    growth = Growth(record)
    for k, times in ((0, 2.0), (-1, 2.0), (-1, 3.0)):
        found = growth.at(k, {"strip": -times * STRIP.euler_load(LENGTH)})["strip"]
        assert found == pytest.approx(STRIP.first_frequency(LENGTH) * math.sqrt(times - 1.0), rel=2e-2), (k, times)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"masses": [mbs.Mass("G", 1.0)]}, "it lies on the ground"),
        ({"loads": [mbs.Spring("ground:O", "rod:B", stiffness=1.0, free_length=0.1)]}, ""),
        ({"loads": [mbs.Spring("ground:G", "crank:A", stiffness=1.0, free_length=0.1)]}, "its ends coincide"),
        ({"guides": [mbs.Guide("B", "rod", (1, 1), 1.0, through="T")]}, ""),
        ({"guides": [mbs.Guide("B", "rod", (1, 1), 1.0, through="G")]}, "lies 0.707 m beside its line"),
    ],
    ids=["mass", "spring", "coincident spring", "guide", "guide beside its line"],
)
def test_what_does_not_fit_is_refused_and_what_does_is_not(changed, message):
    points = {"O": (0, 1), "A": (1, 1), "B": (2, 1), "T": (3, 2), "G": (1, 1)}
    try:
        mechanism(points=points, **changed)
    except ValueError as error:
        assert message and message in str(error)
    else:
        assert not message


def test_a_rack_travels_along_a_line_that_turns_with_its_carrier():
    """By the radius times what its pinion turns more than the carrier."""
    radius, d, centre, end = 0.05, np.array([0.6, 0.8]), np.array([0.1, 0.2]), np.array([0.4, -0.1])
    points = {"O": centre, "p": (0.15, 0.2), "R": end, "r": (0.5, -0.1), "Q": (-0.3, 0.1)}
    ends = {"arm": ("O", "Q"), "pinion": ("O", "p"), "rack": ("R", "r")}
    made = mbs.Mechanism(
        {name: tuple(map(float, place)) for name, place in points.items()},
        [mbs.Link(name, *pair, mbs.Rigid.of(mass=1.0, inertia=0.01)) for name, pair in ends.items()],
        [mbs.Revolute("O", "ground", "arm"), mbs.Revolute("O", "arm", "pinion"), mbs.Slider("R", "rack", "arm", along=tuple(d))],
        drives=[mbs.Drive("arm", 1.0), mbs.Drive("pinion", 3.0)],
        couplings=[mbs.Rack("pinion:O", "rack:R", radius, tuple(d), carrier="arm")],
    )
    found = mbs.simulate(made, 1.0, solver=mbs.Closure())
    assert found.ok, found.message
    places = end - centre + np.outer(radius * 2.0 * found.time, d)
    turned = np.exp(1j * found.time) * (places @ (1, 1j))
    assert found["R.x"] - 0.1 == pytest.approx(turned.real, abs=1e-9)
    assert found["R.y"] - 0.2 == pytest.approx(turned.imag, abs=1e-9)
