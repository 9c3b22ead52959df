"""A scene holds what its mechanism names and nothing else; any planar linkage builds, and starts as it should."""

import numpy as np
import pytest
from simulations import closed

from buckler.mbs import (
    Beam,
    Cable,
    Drive,
    Equal,
    Exudyn,
    Guide,
    GuideFriction,
    Link,
    Mechanism,
    Ramp,
    Revolute,
    Rigid,
    Section,
    Stop,
    Strut,
    build,
    simulate,
    slider_crank,
)
from buckler.mbs.kinematics.errors import KinematicsError
from buckler.mbs.kinematics.linkage import Linkage
from buckler.mbs.laws import ExactRestitution

BAR = Rigid(Section(width=0.020, thickness=0.005))
STRIP = Section(width=0.030, thickness=0.0003)
LAW = ExactRestitution(1e5, 0.8)
SPEED = 1.25
ITEMS = ("coordinates", "constraints", "objects", "nodes", "loads", "sensors")


def crank_and_slider(coupler=BAR, law=None, mass=0.3, friction=None, speed=SPEED, gravity=(0.0, 0.0)):
    plain = slider_crank(coupler, law=law, mass=mass, friction=friction, speed=speed)
    return Mechanism(plain.points, plain.links, plain.joints, plain.guides, plain.stops, plain.drives, gravity=gravity)


def summary(**changed):
    return build(crank_and_slider(**changed)).summary()


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


def test_a_stop_adds_one_connector():
    assert added(law=LAW) == {"Stop": 1, "objects": 1}


def test_friction_adds_one_connector():
    assert added(friction=GuideFriction(0.5)) == {"GuideFriction": 1, "objects": 1}


def test_gravity_in_the_plane_adds_one_load_a_body_and_gravity_normal_to_it_none():
    assert added(gravity=(0.0, -9.81)) == {"gravity": 1, "loads": 3}
    assert added(gravity=(0.0, 0.0)) == {}


def test_mass_and_speed_add_nothing():
    assert added(mass=0.0) == {} and added(speed=-3.0) == {}
    assert added(speed=Ramp(0.0, 1.0, 1.0)) == {}


@pytest.mark.parametrize("elements", [1, 4, 7])
@pytest.mark.parametrize(("make", "per_element", "per_node"), [
    (lambda n: Beam(STRIP, elements=n, nodes=2), 1, 3),
    (lambda n: Beam(STRIP, elements=n, nodes=3), 2, 3),
    (lambda n: Cable(STRIP, elements=n), 1, 4),
], ids=["linear beam", "quadratic beam", "cable"])  # fmt: skip
def test_flexible_link_has_its_nodes_and_elements(make, per_element, per_node, elements):
    body = make(elements)
    nodes = per_element * elements + 1
    assert added(coupler=body) == {
        name: change
        for name, change in {
            "Rigid": -1, type(body).__name__: 1,
            "coordinates": per_node * nodes - 3, "nodes": nodes - 1, "objects": elements - 1,
        }.items()
        if change
    }  # fmt: skip


def test_gravity_loads_every_element():
    assert summary(coupler=Beam(STRIP, elements=5), gravity=(0.0, -9.81))["loads"] == 1 + 5 + 1


def test_strut_has_no_coordinates_and_no_pins():
    """Instead of a bar with two pins one spring."""
    assert added(coupler=Strut(STRIP)) == {
        "Rigid": -1, "Strut": 1, "Revolute": -1,
        "coordinates": -3, "constraints": -4, "objects": -1 - 2 + 1, "nodes": -1,
    }  # fmt: skip
    assert summary(coupler=Strut(STRIP), gravity=(0.0, -9.81))["loads"] == 2


def test_no_drive_no_constraint():
    driven = crank_and_slider()
    loose = Mechanism(driven.points, driven.links, driven.joints, driven.guides)
    before, after = build(driven).summary(), build(loose).summary()
    assert "Drive" not in after
    assert before["constraints"] - after["constraints"] == before["objects"] - after["objects"] == 1


def test_nothing_is_ever_measured_by_engine_sensors():
    full = summary(coupler=Beam(STRIP), law=LAW, friction=GuideFriction(0.1), gravity=(0.0, -9.81), speed=Ramp(0.0, 1.0, 1.0))
    assert full["sensors"] == 0
    assert set(full) == {"Rigid", "Beam", "Guide", "Revolute", "Stop", "GuideFriction", "Drive", "gravity", *ITEMS}


def test_scenes_are_independent():
    one, two = build(crank_and_slider()), build(crank_and_slider())
    assert one.system is not two.system and one.summary() == two.summary()


# --- strut hosts ------------------------------------------------------------------------------------------------------


def test_strut_needs_mass_at_its_slider():
    with pytest.raises(ValueError, match=r"guide of 'B': mass = 0 kg: must be positive"):
        summary(coupler=Strut(STRIP), mass=0.0)


def test_strut_needs_a_host_at_each_end():
    points = {"O": (0, 0), "A": (1, 0), "B": (2, 0)}
    crank, strut = Link("crank", "O", "A", BAR), Link("strut", "A", "B", Strut(STRIP))
    pins = [Revolute("O", "ground", "crank"), Revolute("A", "crank", "strut")]
    with pytest.raises(ValueError, match=r"link 'strut'.*massless.*'B'"):
        build(Mechanism(points, [crank, strut], pins))
    with pytest.raises(ValueError, match=r"link 'strut'.*massless.*'A'"):
        build(Mechanism(points, [crank, strut], pins[:1], [Guide("B", "strut", mass=1.0)]))
    build(Mechanism(points, [crank, strut], pins, [Guide("B", "strut", mass=1.0)]))


def test_two_struts_cannot_hold_each_other():
    points = {"O": (0, 0), "A": (1, 0), "B": (2, 0)}
    links = [Link("one", "O", "A", Strut(STRIP)), Link("two", "A", "B", Strut(STRIP))]
    joints = [Revolute("O", "ground", "one"), Revolute("A", "one", "two"), Revolute("B", "two", "ground")]
    with pytest.raises(ValueError, match=r"massless.*'A'"):
        build(Mechanism(points, links, joints))


def test_strut_between_ground_and_a_bar_needs_no_guide():
    points = {"O": (0, 0), "A": (0, 1), "B": (1, 0)}
    links = [Link("bar", "O", "A", BAR), Link("stay", "A", "B", Strut(STRIP))]
    joints = [Revolute("O", "ground", "bar"), Revolute("A", "bar", "stay"), Revolute("B", "stay", "ground")]
    scene = build(Mechanism(points, links, joints))
    assert scene.summary()["coordinates"] == 3 and scene.summary()["Revolute"] == 1


def test_stop_where_the_point_starts_is_refused():
    plain = crank_and_slider()
    at = float(plain.points["B"][0])
    mechanism = Mechanism(plain.points, plain.links, plain.joints, plain.guides, [Stop("B", at=at, law=LAW)])
    with pytest.raises(ValueError, match=r"stop at 'B': at = .* m is where the point starts"):
        build(mechanism)


# --- any planar linkage -----------------------------------------------------------------------------------------------


def meeting(first, second, to_first, to_second):
    """Point at given distances from two others, to the left of the line between them."""
    line = second - first
    along = (to_first**2 - to_second**2 + abs(line) ** 2) / (2 * abs(line))
    return first + line / abs(line) * (along + 1j * np.sqrt(to_first**2 - along**2))


def places(**points):
    return {name: (complex(z).real, complex(z).imag) for name, z in points.items()}


def four_bar(rocker=BAR, speed=6.0):
    a = 0.105 * np.exp(1j * np.radians(50))
    return Mechanism(
        points=places(O=0, A=a, B=meeting(a, 0.225, 0.272, 0.175), C=0.225),
        links=[Link("crank", "O", "A", BAR), Link("coupler", "A", "B", BAR), Link("rocker", "C", "B", rocker)],
        joints=[
            Revolute("O", "ground", "crank"), Revolute("A", "crank", "coupler"),
            Revolute("B", "coupler", "rocker"), Revolute("C", "ground", "rocker"),
        ],
        drives=[Drive("crank", speed)],
    )  # fmt: skip


def watt_six_bar():
    """The rocker of a four-bar is ternary: its third point D moves a second rocker."""
    a, c, f = 0.05, 0.2, 0.45
    b = meeting(a, c, 0.2, 0.15)
    d = c + 1.2 * (b - c) * np.exp(-0.4j)
    e = meeting(d, f, 0.25, 0.2)
    return Mechanism(
        points=places(O=0, A=a, B=b, C=c, D=d, E=e, F=f),
        links=[
            Link("crank", "O", "A", BAR), Link("coupler", "A", "B", BAR), Link("rocker", "C", "B", BAR, carries=["D"]),
            Link("rod", "D", "E", BAR), Link("arm", "F", "E", BAR),
        ],
        joints=[
            Revolute("O", "ground", "crank"), Revolute("A", "crank", "coupler"), Revolute("B", "coupler", "rocker"),
            Revolute("C", "ground", "rocker"), Revolute("D", "rocker", "rod"), Revolute("E", "rod", "arm"),
            Revolute("F", "ground", "arm"),
        ],
        drives=[Drive("crank", 6.0)],
    )  # fmt: skip


def parallelogram():
    return Mechanism(
        points={"O": (0, 0), "P": (0.3, 0), "A": (0.05, 0.1), "B": (0.35, 0.1)},
        links=[Link("one", "O", "A", BAR), Link("two", "P", "B", BAR), Link("table", "A", "B", BAR)],
        joints=[
            Revolute("O", "ground", "one"), Revolute("P", "ground", "two"),
            Revolute("A", "one", "table"), Revolute("B", "two", "table"),
        ],
        drives=[Drive("one", 1.0)],
    )  # fmt: skip


def double_slider(body=BAR, along=(0, 1), speed=0.1):
    return Mechanism(
        points={"A": (0.3, 0), "B": (0, 0.4)},
        links=[Link("bar", "A", "B", body)],
        guides=[Guide("A", "bar", mass=0.1), Guide("B", "bar", along=along, mass=0.1)],
        drives=[Drive("A", speed)],
    )


def pushed_along(body, along=(1, 1)):
    """A link between two blocks on one line; the first is driven."""
    return Mechanism(
        points={"A": (0, 0), "B": (0.2 * along[0], 0.2 * along[1])},
        links=[Link("strip", "A", "B", body)],
        guides=[Guide("A", "strip", along=along, mass=0.1), Guide("B", "strip", along=along, mass=0.1)],
        drives=[Drive("A", 0.05)],
    )


LINKAGES = {
    "four-bar": four_bar(),
    "four-bar, backwards": four_bar(speed=-6.0),
    "Watt six-bar": watt_six_bar(),
    "parallelogram": parallelogram(),
    "double slider": double_slider(),
    "inclined double slider": double_slider(along=(1, 2)),
    "along one line": pushed_along(BAR),
    "driven by a ramp": four_bar(speed=Ramp(2.0, 6.0, 0.3)),
}
STIFF = Section(width=0.020, thickness=0.002)
FLEXIBLE = {
    "four-bar, beam": four_bar(Beam(STIFF)),
    "four-bar, cable": four_bar(Cable(STIFF)),
    "four-bar, linear beam": four_bar(Beam(STIFF, nodes=2, elements=16)),
    "double slider, strut": double_slider(Strut(STRIP)),
    "double slider, beam": double_slider(Beam(STRIP)),
    "inclined double slider, strut": double_slider(Strut(STRIP), along=(1, 2)),
    "along one line, strut": pushed_along(Strut(STRIP)),
    "along one line, beam": pushed_along(Beam(STRIP), along=(-1, 2)),
    "slider-crank, strut": crank_and_slider(Strut(STRIP)),
    "slider-crank, cable": crank_and_slider(Cable(STRIP)),
}


def ideal(mechanism, duration):
    """Positions and velocities of all points at the end, by loop closure."""
    closure, (state,) = closed(mechanism, [duration])
    return {
        point: (closure.position(link.name, point, state.q), closure.velocity(link.name, point, state.q, state.q_t))
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
        result = simulate(mechanism, duration, solver=Exudyn(Equal(steps), newton_relative=1e-10))
        assert result.status == "OK", result.message
        place, speed = distances(result, expected)
        assert place < 1e-11
        errors.append(speed)
    assert errors[1] < 1e-4 and (errors[1] < errors[0] / 3.5 or errors[0] < 1e-9)


@pytest.mark.parametrize("name", FLEXIBLE)
def test_stiff_link_moves_nearly_as_a_rigid_one(name):
    mechanism, duration = FLEXIBLE[name], 0.1
    result = simulate(mechanism, duration)
    assert result.status == "OK", result.message
    place, speed = distances(result, ideal(mechanism, duration))
    assert place < 2e-5 and speed < 2e-3


@pytest.mark.parametrize("mechanism", [*LINKAGES.values(), *FLEXIBLE.values()], ids=[*LINKAGES, *FLEXIBLE])
def test_linkage_starts_as_drawn_with_consistent_velocities(mechanism):
    result = simulate(mechanism, 1e-6, solver=Exudyn(Equal(1)))
    closure, (state,) = closed(mechanism, [0.0])
    for link in mechanism.links:
        for point in link.points:
            place = [result.signals[f"{point}.{axis}"][0] for axis in "xy"]
            speed = [result.signals[f"{point}.v{axis}"][0] for axis in "xy"]
            assert place == pytest.approx(mechanism.points[point], abs=1e-15)
            assert speed == pytest.approx(closure.velocity(link.name, point, state.q, state.q_t), abs=1e-12)


@pytest.mark.parametrize("mechanism", LINKAGES.values(), ids=LINKAGES)
def test_coordinates_minus_constraints_are_the_freedoms(mechanism):
    data = build(mechanism).summary()
    assert data["coordinates"] - data["constraints"] == Linkage(mechanism).mobility() == 0


def test_drive_at_a_dead_centre_is_refused_before_the_run():
    plain = crank_and_slider()
    with pytest.raises(KinematicsError, match="dead centre"):
        build(Mechanism(plain.points, plain.links, plain.joints, plain.guides, drives=[Drive("B", -0.1)]))


def test_length_along_the_arc():
    """A half wave of height b is 1 + (pi b/L)^2/4 longer than its chord, to second order."""
    assert build(pushed_along(Beam(STRIP), along=(1, 0))).placed["strip"].pieces.sum() == pytest.approx(0.2, rel=1e-14)
    for body in (Cable(STRIP, imperfection=0.005), Beam(STRIP, imperfection=-0.005)):
        longer = build(pushed_along(body, along=(1, 0))).placed["strip"].pieces.sum() / 0.2 - 1
        assert longer == pytest.approx((np.pi * 0.005 / 0.2) ** 2 / 4, rel=2e-3)
