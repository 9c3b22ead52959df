"""A scene holds what its mechanism names and nothing else; any planar linkage builds, and starts as it should."""

import numpy as np
import pytest
from simulations import closed, parallelogram, position, velocity

from buckler import mbs
from buckler.mbs.laws import ExactRestitution

BAR = mbs.Rigid(mbs.Section(width=0.020, thickness=0.005))
STRIP = mbs.Section(width=0.030, thickness=0.0003)
LAW = ExactRestitution(1e5, 0.8)
SPEED = 1.25


def crank_and_slider(coupler=BAR, law=None, mass=0.3, friction=None, speed=SPEED, gravity=(0.0, 0.0)):
    plain = mbs.slider_crank(coupler, law=law, mass=mass, friction=friction, speed=speed)
    return mbs.Mechanism(plain.points, plain.links, plain.joints, plain.guides, plain.stops, plain.drives, gravity=gravity)


def summary(**changed):
    return mbs.build(crank_and_slider(**changed)).summary()


def added(**changed):
    """What a change adds to the rigid slider-crank, zeros left out."""
    before, after = summary(), summary(**changed)
    names = before.keys() | after.keys()
    return {name: after.get(name, 0) - before.get(name, 0) for name in names if after.get(name, 0) != before.get(name, 0)}


# --- only what is named -----------------------------------------------------------------------------------------------


def test_rigid_slider_crank_counts():
    """Two bars of 3 coordinates and a block of 1; two rows a pin, the block's included, and one for the drive."""
    assert summary() == {
        "Rigid": 2, "Guide": 1, "Revolute": 2, "Drive": 1,
        "coordinates": 7, "constraints": 7, "objects": 3 + 3 + 1, "nodes": 3 + 2, "loads": 0, "sensors": 0,
    }  # fmt: skip


ADDED = {
    "a stop is one connector": (dict(law=LAW), {"Stop": 1, "objects": 1}),
    "friction is one": (dict(friction=mbs.GuideFriction(0.5)), {"objects": 1}),
    "gravity in the plane is one load a body": (dict(gravity=(0.0, -9.81)), {"gravity": 1, "loads": 3}),
    "gravity normal to it is none": (dict(gravity=(0.0, 0.0)), {}),
    "mass is none": (dict(mass=0.0), {}),
    "speed is none": (dict(speed=-3.0), {}),
    "a ramp is none": (dict(speed=mbs.Ramp(0.0, 1.0, 1.0)), {}),
    "a strut is one spring instead of a bar with two pins": (
        dict(coupler=mbs.Strut(STRIP)),
        {"Rigid": -1, "Strut": 1, "coordinates": -3, "constraints": -4, "objects": -1 - 2 + 1, "nodes": -1},
    ),
}


@pytest.mark.parametrize(("change", "counts"), ADDED.values(), ids=ADDED)
def test_a_change_adds_what_it_is_made_of(change, counts):
    assert added(**change) == counts


# --- strut hosts ------------------------------------------------------------------------------------------------------


def test_strut_needs_mass_at_its_slider():
    with pytest.raises(ValueError, match=r"guide of 'B': mass = 0 kg: must be positive"):
        summary(coupler=mbs.Strut(STRIP), mass=0.0)


def test_strut_needs_a_host_at_each_end():
    points = {"O": (0, 0), "A": (1, 0), "B": (2, 0)}
    crank, strut = mbs.Link("crank", "O", "A", BAR), mbs.Link("strut", "A", "B", mbs.Strut(STRIP))
    pins = [mbs.Revolute("O", "ground", "crank"), mbs.Revolute("A", "crank", "strut")]
    with pytest.raises(ValueError, match=r"link 'strut'.*massless.*'B'"):
        mbs.build(mbs.Mechanism(points, [crank, strut], pins))
    with pytest.raises(ValueError, match=r"link 'strut'.*massless.*'A'"):
        mbs.build(mbs.Mechanism(points, [crank, strut], pins[:1], [mbs.Guide("B", "strut", mass=1.0)]))
    mbs.build(mbs.Mechanism(points, [crank, strut], pins, [mbs.Guide("B", "strut", mass=1.0)]))


def test_two_struts_cannot_hold_each_other():
    points = {"O": (0, 0), "A": (1, 0), "B": (2, 0)}
    links = [mbs.Link("one", "O", "A", mbs.Strut(STRIP)), mbs.Link("two", "A", "B", mbs.Strut(STRIP))]
    joints = [mbs.Revolute("O", "ground", "one"), mbs.Revolute("A", "one", "two"), mbs.Revolute("B", "two", "ground")]
    with pytest.raises(ValueError, match=r"massless.*'A'"):
        mbs.build(mbs.Mechanism(points, links, joints))


def test_strut_between_ground_and_a_bar_needs_no_guide():
    points = {"O": (0, 0), "A": (0, 1), "B": (1, 0)}
    links = [mbs.Link("bar", "O", "A", BAR), mbs.Link("stay", "A", "B", mbs.Strut(STRIP))]
    joints = [mbs.Revolute("O", "ground", "bar"), mbs.Revolute("A", "bar", "stay"), mbs.Revolute("B", "stay", "ground")]
    scene = mbs.build(mbs.Mechanism(points, links, joints))
    assert scene.summary()["coordinates"] == 3 and scene.summary()["constraints"] == 2


# --- any planar linkage -----------------------------------------------------------------------------------------------


def meeting(first, second, to_first, to_second):
    """Point at given distances from two others, to the left of the line between them."""
    line = second - first
    along = (to_first**2 - to_second**2 + abs(line) ** 2) / (2 * abs(line))
    return first + line / abs(line) * (along + 1j * np.sqrt(to_first**2 - along**2))


def places(**points):
    return {name: (complex(z).real, complex(z).imag) for name, z in points.items()}


def watt_six_bar():
    """The rocker of a four-bar is ternary: its third point D moves a second rocker."""
    a, c, f = 0.05, 0.2, 0.45
    b = meeting(a, c, 0.2, 0.15)
    d = c + 1.2 * (b - c) * np.exp(-0.4j)
    e = meeting(d, f, 0.25, 0.2)
    return mbs.Mechanism(
        points=places(O=0, A=a, B=b, C=c, D=d, E=e, F=f),
        links=[
            mbs.Link("crank", "O", "A", BAR), mbs.Link("coupler", "A", "B", BAR),
            mbs.Link("rocker", "C", "B", BAR, carries=["D"]), mbs.Link("rod", "D", "E", BAR), mbs.Link("arm", "F", "E", BAR),
        ],
        joints=[
            mbs.Revolute("O", "ground", "crank"), mbs.Revolute("A", "crank", "coupler"), mbs.Revolute("B", "coupler", "rocker"),
            mbs.Revolute("C", "ground", "rocker"), mbs.Revolute("D", "rocker", "rod"), mbs.Revolute("E", "rod", "arm"),
            mbs.Revolute("F", "ground", "arm"),
        ],
        drives=[mbs.Drive("crank", 6.0)],
    )  # fmt: skip


def double_slider(body=BAR, along=(0, 1), speed=0.1):
    return mbs.Mechanism(
        points={"A": (0.3, 0), "B": (0, 0.4)},
        links=[mbs.Link("bar", "A", "B", body)],
        guides=[mbs.Guide("A", "bar", mass=0.1), mbs.Guide("B", "bar", along=along, mass=0.1)],
        drives=[mbs.Drive("A", speed)],
    )


def pushed_along(body, along=(1, 1)):
    """A link between two blocks on one line; the first is driven."""
    return mbs.Mechanism(
        points={"A": (0, 0), "B": (0.2 * along[0], 0.2 * along[1])},
        links=[mbs.Link("strip", "A", "B", body)],
        guides=[mbs.Guide("A", "strip", along=along, mass=0.1), mbs.Guide("B", "strip", along=along, mass=0.1)],
        drives=[mbs.Drive("A", 0.05)],
    )


LINKAGES = {
    "four-bar": mbs.crank_rocker(BAR, speed=6.0),
    "four-bar, backwards": mbs.crank_rocker(BAR, speed=-6.0),
    "Watt six-bar": watt_six_bar(),
    "parallelogram": parallelogram([mbs.Drive("a", 1.0)], third_bar=False),
    "double slider": double_slider(),
    "inclined double slider": double_slider(along=(1, 2)),
    "along one line": pushed_along(BAR),
    "driven by a ramp": mbs.crank_rocker(BAR, speed=mbs.Ramp(2.0, 6.0, 0.3)),
}


def ideal(mechanism, duration):
    """Positions and velocities of all points at the end, by loop closure."""
    closure, (state,) = closed(mechanism, [duration])
    return {
        point: (position(closure, link.name, point, state.q), velocity(closure, link.name, point, state.q, state.q_t))
        for link in mechanism.links
        for point in link.points
    }


def distances(result, expected):
    """Largest distances in position and velocity at the end of a run."""
    gaps = []
    for point, values in expected.items():
        found = [[result.signals[f"{point}.{name}"][-1] for name in pair] for pair in (("x", "y"), ("vx", "vy"))]
        gaps.append([np.abs(np.subtract(*pair)).max() for pair in zip(found, values, strict=True)])
    return np.max(gaps, axis=0)


@pytest.mark.parametrize("name", LINKAGES)
def test_rigid_linkage_moves_as_its_ideal_kinematics(name):
    """Constraints hold to the solver's tolerance; velocities converge with the step, at second order."""
    mechanism, duration = LINKAGES[name], 0.5
    expected = ideal(mechanism, duration)
    errors = []
    for steps in (200, 400):
        result = mbs.simulate(mechanism, duration, solver=mbs.Exudyn(mbs.Equal(steps)))
        assert result.status == "OK", result.message
        place, speed = distances(result, expected)
        assert place < 1e-11
        errors.append(speed)
    assert errors[1] < 1e-4 and (errors[1] < errors[0] / 3.5 or errors[0] < 1e-9)


def test_length_along_the_arc():
    """A half wave of height b is 1 + (pi b/L)^2/4 longer than its chord, to second order."""
    assert mbs.build(pushed_along(mbs.Beam(STRIP), along=(1, 0))).placed["strip"].pieces.sum() == pytest.approx(0.2, rel=1e-14)
    for body in (mbs.Cable(STRIP, imperfection=0.005), mbs.Beam(STRIP, imperfection=-0.005)):
        longer = mbs.build(pushed_along(body, along=(1, 0))).placed["strip"].pieces.sum() / 0.2 - 1
        assert longer == pytest.approx((np.pi * 0.005 / 0.2) ** 2 / 4, rel=2e-3)
