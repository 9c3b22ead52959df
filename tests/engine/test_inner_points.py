"""Points along flexible links, and strips that are curved when free of stress."""

import math

import numpy as np
import pytest
from simulations import fine, rates

from buckler import mbs
from buckler.mbs.engine.strip import mesh

SPAN = 0.5
SECTION = mbs.Section(0.02, 0.005, mbs.Material(210e9, 7850.0, 0.3, bending_damping=5e-3, axial_damping=1e-4))
EI, GA = SECTION.bending_stiffness, SECTION.shear_stiffness
SLOW = mbs.Exudyn(mbs.Equal(1500), newton_absolute=2e-5)


def slowly(fx, fy):
    """A force that grows within a second, and stays: the strip comes to rest in it."""

    def force(t):
        share = min(t, 1.0) ** 3 * (10 - 15 * min(t, 1.0) + 6 * min(t, 1.0) ** 2)
        return share * fx, share * fy

    return force


def arc(angle):
    """An arc of a circle that turns by an angle, from the fraction of its length."""
    return lambda s: (math.sin(angle * (s - 0.5)), math.cos(angle * (s - 0.5)))


def settled(body, carries, *, joints=(), guides=(), loads=(), end=(SPAN, 0)):
    mechanism = mbs.Mechanism(
        points={"A": (0, 0), "B": end},
        links=[mbs.Link("strip", "A", "B", body, carries=carries)],
        joints=joints, guides=guides, loads=loads,
    )  # fmt: skip
    return fine(mbs.simulate(mechanism, 1.5, solver=SLOW)), mechanism


# --- where they lie ---------------------------------------------------------------------------------------------------


def test_a_point_at_a_fraction_finds_its_place():
    """On the line of a straight link; on the arc of a bent one, at its share of the arc length; in a turned frame."""
    end = (0.3, 0.4)
    for body in (mbs.Rigid(SECTION), mbs.Beam(SECTION), mbs.Cable(SECTION)):
        mechanism = mbs.Mechanism(points={"A": (0, 0), "B": end}, links=[mbs.Link("strip", "A", "B", body, carries={"M": 0.3})])
        assert mechanism.points["M"] == pytest.approx((0.09, 0.12), abs=1e-15)
    for body in (mbs.Beam(SECTION, shape=arc(1.2)), mbs.Cable(SECTION, shape=arc(1.2))):
        link = mbs.Link("strip", "A", "B", body, carries={"M": 0.5, "N": 0.25})
        mechanism = mbs.Mechanism(points={"A": (0, 0), "B": end}, links=[link])
        radius = SPAN / 2 / math.sin(0.6)
        rise = radius * (1 - math.cos(0.6))
        assert mechanism.points["M"] == pytest.approx((0.15 - 0.8 * rise, 0.2 + 0.6 * rise), abs=1e-9)
        across, along = radius * (math.cos(0.3) - math.cos(0.6)), SPAN / 2 - radius * math.sin(0.3)
        assert mechanism.points["N"] == pytest.approx((0.6 * along - 0.8 * across, 0.8 * along + 0.6 * across), abs=1e-9)
        found = mesh(link, SPAN)
        place = found.places[found.at["N"]]
        assert place == pytest.approx((along, across), abs=1e-9)


# --- what acts there --------------------------------------------------------------------------------------------------


def bent(body, force=5.0, part=0.5):
    """Three-point bending: deflection under the force."""
    supports = {"joints": [mbs.Revolute("A", "ground", "strip")], "guides": [mbs.Guide("B", "strip")]}
    return -settled(body, {"M": part}, loads=[mbs.Force("M", slowly(0, -force))], **supports)[0].signals["M.y"][-1]


@pytest.mark.parametrize("part", [0.5, 0.3])
def test_three_point_bending(part):
    """F a^2 b^2/(3 E I L), and F a b/(G A L) of shear: exact for cables at any mesh, for beams at the rate of theirs."""
    a, b = part * SPAN, (1 - part) * SPAN
    bending, shear = 5 * a**2 * b**2 / (3 * EI * SPAN), 5 * a * b / (GA * SPAN)
    assert bent(mbs.Cable(SECTION, 2), part=part) == pytest.approx(bending, rel=1e-5)
    assert bent(mbs.Beam(SECTION, 8), part=part) == pytest.approx(bending + shear, rel=1e-5)
    errors = [abs(bent(mbs.Beam(SECTION, n, nodes=2)) / (5 * SPAN**3 / (48 * EI) + 5 * SPAN / (4 * GA)) - 1) for n in (4, 8, 16)]
    assert rates(errors) == pytest.approx([2, 2], abs=0.2)


@pytest.mark.parametrize("body", [mbs.Beam(SECTION, 6), mbs.Cable(SECTION, 6)], ids=["beam", "cable"])
def test_a_pin_at_an_inner_point_carries_an_overhang(body):
    """Tip of a strip on a guide at A and a pin at M: F c^2 (a + c)/(3 E I), and F c (1 + c/a)/(G A) of shear."""
    a, c = 0.6 * SPAN, 0.4 * SPAN
    supports = {"joints": [mbs.Revolute("M", "ground", "strip")], "guides": [mbs.Guide("A", "strip")]}
    result, _ = settled(body, {"M": 0.6}, loads=[mbs.Force("B", slowly(0, -5))], **supports)
    shear = 5 * c * (1 + c / a) / GA if isinstance(body, mbs.Beam) else 0.0
    assert -result.signals["B.y"][-1] == pytest.approx(5 * c**2 * (a + c) / (3 * EI) + shear, rel=3e-5)
    assert result.signals["M.ground-strip.fy"][-1] == pytest.approx(5 * SPAN / a, rel=1e-5)


# --- curved strips ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("solver", [mbs.Exudyn(mbs.Equal(20)), mbs.Spectral()], ids=["Exudyn", "compiled"])
@pytest.mark.parametrize("kind", [mbs.Beam, mbs.Cable])
@pytest.mark.parametrize("carries", [(), {"M": 0.3, "N": 0.45}])
def test_an_arc_is_free_of_stress_at_rest(kind, carries, solver):
    """Pinned to the ground at all its points it stays on its arc: no strain energy, no force."""
    points = ["A", "B", *carries]
    joints = [mbs.Revolute(p, "ground", "strip") for p in points]
    mechanism = mbs.Mechanism(
        points={"A": (0, 0), "B": (0.3, 0.4)},
        links=[mbs.Link("strip", "A", "B", kind(SECTION, 5, shape=arc(1.5)), carries=carries)],
        joints=joints,
    )
    result = fine(mbs.simulate(mechanism, 0.01, solver=solver, ledger=True))
    assert np.abs(result.energy["strain"]).max() < 1e-12
    assert max(np.abs(result.signals[f"{p}.ground-strip.fx"]).max() for p in points) < 1e-2
    for p in points:
        assert (result[f"{p}.x"][-1], result[f"{p}.y"][-1]) == pytest.approx(mechanism.points[p], abs=1e-8)


@pytest.mark.parametrize("solver", [mbs.Exudyn(mbs.Equal(20)), mbs.Spectral()], ids=["Exudyn", "compiled"])
@pytest.mark.parametrize("kind", [mbs.Beam, mbs.Cable])
@pytest.mark.parametrize("elements", [3, 4, 6])
def test_the_deflection_is_that_of_mid_length_wherever_the_nodes_are(kind, elements, solver):
    """A bow of 20 mm, a node at 0.6 of its length; the nearest one to its middle is 5 % lower."""
    mechanism = mbs.Mechanism(
        points={"A": (0, 0), "B": (0.3, 0.4)},
        links=[mbs.Link("strip", "A", "B", kind(SECTION, elements, imperfection=0.02), carries={"M": 0.6})],
        joints=[mbs.Revolute(p, "ground", "strip") for p in "AB"],
    )
    result = mbs.simulate(mechanism, 1e-3, solver=solver)
    assert result["strip.deflection"][0] == pytest.approx(0.02, rel=3e-3)


def test_an_arch_gives_way_as_castigliano_says():
    """Half-circle on a pin and a guide, pulled apart at the guide: F R^3 pi/(2 E I) + F R pi/2 (1/E A + 1/G A)."""
    radius, force = SPAN / 2, 2.0
    supports = {"joints": [mbs.Revolute("A", "ground", "strip")], "guides": [mbs.Guide("B", "strip")]}
    bending = force * radius**3 * math.pi / (2 * EI)
    stretched = force * radius * math.pi / 2 * (1 / SECTION.axial_stiffness + 1 / GA)
    errors = []
    for count in (4, 8, 16):
        result, _ = settled(
            mbs.Beam(SECTION, count, shape=arc(math.pi)), (), loads=[mbs.Force("B", slowly(force, 0))], **supports
        )
        errors.append(abs((result.signals["B.x"][-1] - SPAN) / (bending + stretched) - 1))
    assert errors[-1] < 3e-3  # the deflection is 1/400 of the radius: so much is not linear
    assert errors[-1] < 1.1 * errors[0]
