"""Loop closure with other drives and guides, and mobility: closed forms, and how they fail."""

from dataclasses import replace

import numpy as np
import pytest
from simulations import BAR, closed, parallelogram, position

from buckler.mbs import Drive, Gear, Guide, Link, Mass, Mechanism, Revolute, crank_rocker
from buckler.mbs.library import PAPER
from buckler.mbs.scene.linkage import KinematicsError, Linkage
from buckler.mbs.scene.scene import Scene


def slider_driven(start_angle, speed):
    a = PAPER.crank * np.exp(1j * start_angle)
    points = {"O": (0, 0), "A": (a.real, a.imag), "B": (PAPER.slider(start_angle), 0)}
    links = [Link("crank", "O", "A", BAR), Link("coupler", "A", "B", BAR)]
    joints = [Revolute("O", "ground", "crank"), Revolute("A", "crank", "coupler")]
    return Mechanism(points, links, joints, guides=[Guide("B", "coupler")], drives=[Drive("B", speed)])


def test_driving_the_slider_inverts_driving_the_crank():
    times = (0.0, 0.5, 1.5)
    for t, state in zip(times, closed(slider_driven(np.radians(60), -0.05), times)[1], strict=True):
        x = PAPER.slider(np.radians(60)) - 0.05 * t
        angle = PAPER.contact_angle(x)
        assert state.q[0, 2] == pytest.approx(angle, abs=1e-11)
        assert state.q_t[0, 2] == pytest.approx(-0.05 / PAPER.slider_rate(angle), rel=1e-10)


@pytest.mark.parametrize("angle", [0.0, np.pi], ids=["inner", "outer"])
def test_dead_centre_is_named(angle):
    """The slider cannot start the mechanism from where its speed is zero whatever the crank does."""
    with pytest.raises(KinematicsError, match=r"velocities at t = 0 s do not exist.*dead centre"):
        _ = Scene.of(slider_driven(angle, -0.05)).start


def test_masses_beyond_the_digits_of_a_number_are_named():
    mechanism = slider_driven(np.radians(60), -0.05)
    heavy = replace(mechanism, masses=[Mass("A", 1e25)])
    with pytest.raises(KinematicsError, match="masses differ by too many orders of magnitude"):
        _ = Scene.of(heavy).start


@pytest.mark.parametrize("along", [(1, 1), (0, 2), (-3, 1)])
def test_inclined_guide_is_the_level_one_turned(along):
    """The same slider-crank in a frame that is turned: positions and rates turn with it."""
    turn = complex(*along) / abs(complex(*along))
    times = (0.0, 1.0)
    level, ones = closed(slider_driven(np.radians(60), -0.05), times)
    places = {name: turn * complex(*place) for name, place in level.mechanism.points.items()}
    points = {name: (z.real, z.imag) for name, z in places.items()}
    mechanism = replace(level.mechanism, points=points, guides=[Guide("B", "coupler", along=along)])
    turned, twos = closed(mechanism, times)
    for one, two in zip(ones, twos, strict=True):
        for before, after in ((one.q_t, two.q_t), (one.q_tt, two.q_tt)):
            assert after[:, 2] == pytest.approx(before[:, 2], abs=1e-11)
            assert after[:, :2] @ (1, 1j) == pytest.approx(turn * (before[:, :2] @ (1, 1j)), abs=1e-11)
        assert complex(*position(turned, "coupler", "B", two.q)) == pytest.approx(
            turn * complex(*position(level, "coupler", "B", one.q)), abs=1e-12
        )


def bars(points, *pairs):
    return dict(points=points, links=[Link(a + b, a, b, BAR) for a, b in pairs])


GROUNDED = {"O": (0.0, 0.0), "A": (1.0, 0.2), "B": (2.0, 0.0)}


@pytest.mark.parametrize(
    ("mechanism", "free"),
    [
        (crank_rocker(BAR, speed=1.0), 0),
        (slider_driven(1.0, 0.1), 0),
        (parallelogram([Drive("a", 1.0)], third_bar=False), 0),
        (parallelogram([Drive("a", 1.0)], third_bar=True), 0),  # one bar too many, counted as -1 by Gruebler's rule
        (Mechanism(**bars(GROUNDED, "OA")), 3),
        (Mechanism(**bars(GROUNDED, "OA"), joints=[Revolute("O", "ground", "OA")]), 1),
        (Mechanism(**bars(GROUNDED, "OA", "AB"), joints=[Revolute("O", "ground", "OA"), Revolute("A", "OA", "AB")]), 2),
        (Mechanism(**bars(GROUNDED, "OA"), guides=[Guide("O", "OA"), Guide("A", "OA")]), 1),
        (Mechanism(**bars(GROUNDED, "OA"), guides=[Guide("O", "OA"), Guide("A", "OA")], drives=[Drive("OA", 1.0)]), None),
    ],
    ids=["four-bar", "slider-crank", "parallelogram", "redundant", "free", "pendulum", "double", "shuttle", "jammed"],
)
def test_mobility_counts_freedoms_not_rows(mechanism, free):
    if free is None:
        # two parallel guides keep the bar's direction (it cannot turn): the drive adds no freedom and takes none
        assert Linkage(mechanism).count_free_motions() == 1
        with pytest.raises(KinematicsError):
            _ = Scene.of(mechanism).start
    else:
        assert Linkage(mechanism).count_free_motions() == free


def test_mobility_in_the_remark_counts_no_redundant_drive():
    """Two geared cranks have one degree of freedom though both are driven; the pendulum beside them has another."""
    points = {"O": (0.0, 0.0), "A": (0.0, 0.1), "P": (1.0, 0.0), "B": (1.0, 0.1), "Q": (2.0, 0.0), "C": (2.0, -0.1)}
    pairs = ("OA", "PB", "QC")
    mechanism = Mechanism(
        **bars(points, *pairs),
        joints=[Revolute(pair[0], "ground", pair) for pair in pairs],
        couplings=[Gear("OA:O", "PB:P", ratio=-1.0)],
        drives=[Drive("OA", 1.0), Drive("PB", -1.0)],
    )
    assert any(remark.startswith("mobility 2, 2 driven") for remark in Scene.of(mechanism).remarks)
