"""A section by its numbers: each of them against a closed form, in the statics, both solvers and files."""

import numpy as np
import pytest
from exact.columns import member
from exact.vibration import beam_frequencies

from buckler import mbs

LENGTH = 0.5
NUMBERS = {"bending_stiffness": 2.0, "axial_stiffness": 4e4, "shear_stiffness": 700.0, "mass_per_length": 0.3,
           "inertia_per_length": 4e-3}  # fmt: skip
"""Of no rectangle: it shears and turns far more than it should."""
PROFILE = mbs.Profile(**NUMBERS)


def cantilever(force, kind=mbs.Beam, profile=PROFILE):
    return mbs.Mechanism(
        {"A": (0, 0), "B": (LENGTH, 0)}, [mbs.Link("strip", "A", "B", kind(profile))], [mbs.Weld("A", "ground", "strip")],
        loads=[mbs.Force("B", force)],
    )  # fmt: skip


@pytest.mark.parametrize("kind", [mbs.Beam, mbs.Cable])
def test_a_cantilever_bends_shears_and_stretches_by_them(kind):
    small = 1e-4
    bent = mbs.equilibrium(cantilever((0, small), kind)).point("strip", "B").position[1]
    sheared = small * LENGTH / PROFILE.shear_stiffness if kind is mbs.Beam else 0.0
    assert bent == pytest.approx(small * LENGTH**3 / 3 / PROFILE.bending_stiffness + sheared, rel=1e-6)
    stretched = mbs.equilibrium(cantilever((30.0, 0), kind)).point("strip", "B").position[0]
    assert stretched == pytest.approx(LENGTH * (1 + 30.0 / PROFILE.axial_stiffness), rel=1e-9)


def test_its_frequencies_are_timoshenkos():
    found = mbs.frequencies(cantilever((0, 0)), count=4).angular
    assert found == pytest.approx(beam_frequencies(member(PROFILE, LENGTH), "cantilever", 4), rel=1e-7)


SOLVERS = [mbs.Exudyn(), mbs.Spectral()]


@pytest.mark.parametrize("solver", SOLVERS, ids=["exudyn", "spectral"])
def test_a_pinned_strip_is_sped_up_by_its_mass_and_inertia(solver):
    """A rigid one, by T/(rho A L^3/3 + rho I L): half of that is the turn after one second squared."""
    stiff = mbs.Profile(**{key: (1e4 if "stiff" in key else 1.0) * value for key, value in NUMBERS.items()})
    made = mbs.Mechanism(
        {"A": (0, 0), "B": (LENGTH, 0)}, [mbs.Link("strip", "A", "B", mbs.Beam(stiff))], [mbs.Revolute("A", "ground", "strip")],
        loads=[mbs.Torque("strip", 1e-3)],
    )  # fmt: skip
    turned = mbs.simulate(made, 1.0, solver=solver)
    inertia = stiff.mass_per_length * LENGTH**3 / 3 + stiff.inertia_per_length * LENGTH
    angle = np.arctan2(turned.signals["B.y"][-1], turned.signals["B.x"][-1])
    assert angle == pytest.approx(0.5 * 1e-3 / inertia, rel=1e-3)  # rho I is 14 % of it


@pytest.mark.parametrize("solver", SOLVERS, ids=["exudyn", "spectral"])
@pytest.mark.parametrize("kind", [mbs.Beam, mbs.Cable])
def test_a_damped_cantilever_comes_to_its_closed_form(solver, kind):
    damped = mbs.Profile(**NUMBERS, bending_damping=0.05, axial_damping=0.002)
    ended = mbs.simulate(cantilever((30.0, 1e-3), kind, damped), 2.0, solver=solver)
    rest = mbs.equilibrium(cantilever((30.0, 1e-3), kind)).point("strip", "B").position
    assert [ended.signals[f"B.{axis}"][-1] for axis in "xy"] == pytest.approx(rest, rel=2e-3)


def test_it_survives_a_file():
    made = cantilever((1.0, 0))
    assert mbs.Mechanism.from_dict(made.to_dict()) == made
    table = made.to_dict()
    del table["links"]["strip"]["body"]["section"]["kind"]
    assert mbs.Mechanism.from_dict(table) == made
    del table["links"]["strip"]["body"]["section"]["shear_stiffness"]
    with pytest.raises(ValueError, match=r"links.strip.body.section: lacks 'shear_stiffness'"):
        mbs.Mechanism.from_dict(table)
