"""A section by its numbers: each of them against a closed form, in the statics, both solvers and files."""

import numpy as np
import pytest

from buckler.elastica.member import Member
from buckler.elastica.vibration import beam_frequencies
from buckler.mbs import (
    Beam,
    Cable,
    Exudyn,
    Force,
    Link,
    Mechanism,
    Profile,
    Revolute,
    Spectral,
    Torque,
    Weld,
    equilibrium,
    frequencies,
    simulate,
)

LENGTH = 0.5
NUMBERS = {"bending_stiffness": 2.0, "axial_stiffness": 4e4, "shear_stiffness": 700.0, "mass_per_length": 0.3,
           "inertia_per_length": 4e-3}  # fmt: skip
"""Of no rectangle: it shears and turns far more than it should."""
PROFILE = Profile(**NUMBERS)


def cantilever(force, kind=Beam, profile=PROFILE):
    return Mechanism(
        {"A": (0, 0), "B": (LENGTH, 0)}, [Link("strip", "A", "B", kind(profile))], [Weld("A", "ground", "strip")],
        loads=[Force("B", force)],
    )  # fmt: skip


@pytest.mark.parametrize("kind", [Beam, Cable])
def test_a_cantilever_bends_shears_and_stretches_by_them(kind):
    small = 1e-4
    bent = equilibrium(cantilever((0, small), kind)).point("strip", "B").position[1]
    sheared = small * LENGTH / PROFILE.shear_stiffness if kind is Beam else 0.0
    assert bent == pytest.approx(small * LENGTH**3 / 3 / PROFILE.bending_stiffness + sheared, rel=1e-6)
    stretched = equilibrium(cantilever((30.0, 0), kind)).point("strip", "B").position[0]
    assert stretched == pytest.approx(LENGTH * (1 + 30.0 / PROFILE.axial_stiffness), rel=1e-9)


def test_its_frequencies_are_timoshenkos():
    member = Member(LENGTH, *(NUMBERS[f"{key}"] for key in (
        "bending_stiffness", "mass_per_length", "shear_stiffness", "inertia_per_length", "axial_stiffness")))  # fmt: skip
    found = frequencies(cantilever((0, 0)), count=4).angular
    assert found == pytest.approx(beam_frequencies(member, "cantilever", 4), rel=1e-7)


SOLVERS = [Exudyn(), Spectral()]


@pytest.mark.parametrize("solver", SOLVERS, ids=["exudyn", "spectral"])
def test_a_pinned_strip_is_sped_up_by_its_mass_and_inertia(solver):
    """A rigid one, by T/(rho A L^3/3 + rho I L): half of that is the turn after one second squared."""
    stiff = Profile(**{key: (1e4 if "stiff" in key else 1.0) * value for key, value in NUMBERS.items()})
    made = Mechanism(
        {"A": (0, 0), "B": (LENGTH, 0)}, [Link("strip", "A", "B", Beam(stiff))], [Revolute("A", "ground", "strip")],
        loads=[Torque("strip", 1e-3)],
    )  # fmt: skip
    turned = simulate(made, 1.0, solver=solver)
    inertia = stiff.mass_per_length * LENGTH**3 / 3 + stiff.inertia_per_length * LENGTH
    angle = np.arctan2(turned.signals["B.y"][-1], turned.signals["B.x"][-1])
    assert angle == pytest.approx(0.5 * 1e-3 / inertia, rel=1e-3)  # rho I is 14 % of it


@pytest.mark.parametrize("solver", SOLVERS, ids=["exudyn", "spectral"])
@pytest.mark.parametrize("kind", [Beam, Cable])
def test_a_damped_cantilever_comes_to_its_closed_form(solver, kind):
    damped = Profile(**NUMBERS, bending_damping=0.05, axial_damping=0.002)
    ended = simulate(cantilever((30.0, 1e-3), kind, damped), 2.0, solver=solver)
    rest = equilibrium(cantilever((30.0, 1e-3), kind)).point("strip", "B").position
    assert [ended.signals[f"B.{axis}"][-1] for axis in "xy"] == pytest.approx(rest, rel=2e-3)


def test_it_survives_a_file():
    made = cantilever((1.0, 0))
    assert Mechanism.from_dict(made.to_dict()) == made
    table = made.to_dict()
    del table["links"]["strip"]["body"]["section"]["kind"]
    assert Mechanism.from_dict(table) == made
    del table["links"]["strip"]["body"]["section"]["shear_stiffness"]
    with pytest.raises(ValueError, match=r"links.strip.body.section: lacks 'shear_stiffness'"):
        Mechanism.from_dict(table)
