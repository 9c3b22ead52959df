"""Frequencies with their errors: Timoshenko's equation, forces that follow the motion, dampers, rigid motions."""

from dataclasses import replace
from fractions import Fraction
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from exact.columns import LENGTH, beck, column, critical, member
from exact.vibration import Frame, beam_frequencies
from scipy.optimize import brentq

from buckler.mbs import (
    Beam,
    Force,
    Link,
    Mechanism,
    Revolute,
    Rigid,
    Section,
    Slider,
    Spring,
    Weld,
    equilibrium,
    frequencies,
)
from buckler.mbs.functions import Table
from buckler.mbs.statics.problem import Problem, Rest, loads_of


def strip(section, ends):
    joint = {"clamped": Weld, "pinned": Revolute, "guided": partial(Slider, along=(0, 1))}
    joints = [joint[end](p, "strip", "ground") for end, p in zip(ends, "AB", strict=True) if end in joint]
    return Mechanism({"A": (0, 0), "B": (LENGTH, 0)}, [Link("strip", "A", "B", Beam(section))], joints)


ENDS = {
    "free-free": (("free", "free"), [1, 2, 3, 4, 5, 6, 7, 8]),
    "cantilever": (("clamped", "free"), [0.5, 1.5, 2.5, 3.5, 4.5]),
    "clamped-pinned": (("clamped", "pinned"), [1, 2, 3, 4]),
    "clamped-clamped": (("clamped", "clamped"), [1, 2, 3, 4]),
    "pinned-pinned": (("pinned", "pinned"), [1, 2, 3, 4]),
    "clamped-guided": (("clamped", "guided"), [1, 2, 3, 4]),
}


@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize(("thickness", "bar"), [(5e-3, 1e-8), (5e-4, 1e-7)])
def test_the_first_twelve_frequencies_are_right_at_the_default(ends, thickness, bar):
    section, (held, waves) = Section(0.02, thickness), ENDS[ends]
    found = frequencies(strip(section, held), count=12)
    axial = np.array(waves) * np.pi / LENGTH * np.sqrt(section.axial_stiffness / section.mass_per_length)
    rigid = [0.0] * 3 * (ends == "free-free")
    if ends == "clamped-guided":  # it slides across, and does not turn
        places = ((0.0, 0.0), (LENGTH, 0.0))
        bending = Frame(places, ((0, 1, replace(member(section), axial=np.inf)),), {0: (0, 1, 2), 1: (2,)}).frequencies(15)
    else:
        bending = [w for w in beam_frequencies(member(section), ends, 15) if w > 1e-3]
    exact = np.sort(np.concatenate([rigid, bending, axial]))[:12]
    off, elastic = np.abs(found.angular - exact), exact > 0
    assert found.status == "OK"
    assert (off[elastic] / exact[elastic]).max() < bar
    assert (off <= found.errors * 2 * np.pi + 1e-9 * exact).all()
    assert [name == "rigid motion of strip" for name in found.names] == list(~elastic)


SLIM = Section(0.02, 0.0005)
UNIT = SLIM.bending_stiffness / LENGTH**2


@pytest.mark.parametrize(("times", "least"), [(0.999, True), (1.001, False)])
def test_a_straight_columns_energy_is_least_up_to_its_critical_load(times, least):
    """A following load has no energy: nothing is known by it."""
    load, found = times * critical("cantilever", 1), []
    for follows in (None, "strip"):
        rest = equilibrium(column("cantilever", load=load, follows=follows))
        found.append(Problem(rest.scene, loads_of(rest.scene)).linearise(Rest(rest.q, rest.multipliers, 1.0)).definite)
    assert found == [least, False]


@pytest.mark.parametrize("times", [10.0, 19.0])
def test_a_follower_load_acts_with_its_whole_tangent(times):
    found = frequencies(column("cantilever", SLIM, times * UNIT, "strip"), count=2)
    squares = np.linspace(1.0, 500.0, 1000)
    (lows,) = np.nonzero(np.diff(np.sign([beck(times, square) for square in squares])))
    exact = [brentq(partial(beck, times), squares[k], squares[k + 1]) for k in lows]
    assert found.stable
    assert found.angular == pytest.approx(np.sqrt(np.array(exact) * UNIT / SLIM.mass_per_length) / LENGTH, rel=3e-5)  # no shear


@pytest.mark.parametrize(("times", "stable"), [(20.0, True), (20.1, False)])
def test_beyond_its_flutter_load_a_column_flutters(times, stable):
    found = frequencies(column("cantilever", SLIM, times * UNIT, "strip"), count=3)
    assert found.stable is stable
    assert ("flutter" in found.names) is not stable


@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.999, 3.0])
def test_a_damped_block_swings_or_creeps_as_its_equation_says(ratio):
    mass, stiffness = 2.0, 5e3
    damping = 2 * ratio * np.sqrt(mass * stiffness)
    made = Mechanism(
        {"P": (0, 0), "Q": (0, 0.1), "S": (1, 0)}, [Link("block", "P", "Q", Rigid.of(mass=mass, inertia=1e-3))],
        [Slider("P", "block", "ground", along=(1, 0))], loads=[Spring("P", "ground:S", stiffness=stiffness, damping=damping)],
    )  # fmt: skip
    roots = np.roots([mass, damping, stiffness])
    roots = np.sort_complex(roots[roots.imag >= 0])[::-1]
    found = frequencies(made)
    assert found.values == pytest.approx(roots, rel=1e-9)
    assert found.damping == pytest.approx(-roots.real / np.abs(roots), abs=1e-9)
    assert found.stable


def below(masses, springs, square):
    """How many eigenvalues of a chain lie below w^2, by Sturm's sequence in fractions, without rounding."""
    masses, springs, square = [Fraction(x) for x in masses], [Fraction(x) for x in springs], Fraction(square)
    count, pivot = 0, Fraction(1)
    for k, mass in enumerate(masses):
        pivot = springs[k] + springs[k + 1] - square * mass - (springs[k] ** 2 / pivot if k else 0)
        count += pivot < 0
    return count


@pytest.mark.parametrize("seed", range(4))
def test_a_chain_of_masses_and_springs_over_twelve_decades_keeps_every_frequency(seed):
    dice, count = np.random.default_rng(seed), 8
    masses, springs = 10 ** dice.uniform(-6, 6, count), 10 ** dice.uniform(-3, 9, count + 1)
    points = {"W": (0, 0), "V": (count + 1, 0)} | {f"P{k}": (k + 1, 0) for k in range(count)}
    points |= {f"Q{k}": (k + 1, 0.1) for k in range(count)}
    links = [Link(f"b{k}", f"P{k}", f"Q{k}", Rigid.of(mass=m, inertia=1e-3 * m)) for k, m in enumerate(masses)]
    ends = ["ground:W", *(f"P{k}" for k in range(count)), "ground:V"]
    made = Mechanism(
        points, links, [Slider(f"P{k}", f"b{k}", "ground", along=(1, 0)) for k in range(count)],
        loads=[Spring(a, b, stiffness=k) for (a, b), k in zip(pairwise(ends), springs, strict=True)],
    )  # fmt: skip
    found = frequencies(made, count=count)
    assert found.status == "OK"
    for k, (value, error) in enumerate(zip(found.angular, 2 * np.pi * found.errors, strict=True)):
        for off in (error + 1e-12 * value, 1e-5 * value):
            assert below(masses, springs, (value - off) ** 2) == k
            assert below(masses, springs, (value + off) ** 2) == k + 1


def test_a_pinned_and_guided_strip_past_its_load_grows():
    section = Section(0.02, 0.001)
    found = frequencies(column("pinned", section, 2 * section.euler_load(LENGTH)))
    assert found.names[0] == "growth"
    assert found.values[0].real == pytest.approx(section.first_frequency(LENGTH), rel=1e-4)
    assert not found.stable
    assert found.hertz[0] == 0.0


def test_a_strip_that_creeps_keeps_its_vibrations_first():
    """Of Kelvin and Voigt's strip the higher modes creep, ever more of them near s = -1/(retardation time)."""
    section = Section(0.02, 0.005)
    plain = frequencies(strip(section, ("clamped", "free")), count=1).angular[0]
    damped = section.damped(0.3, LENGTH)
    found = frequencies(strip(damped, ("clamped", "free")), count=2)
    share = damped.material.bending_damping * plain / 2
    assert found.names[0] == "vibration"
    assert found.damping[0] == pytest.approx(share, rel=1e-3)
    assert found.angular[0] == pytest.approx(plain * np.sqrt(1 - share**2), rel=1e-3)


@pytest.mark.parametrize(
    ("gap", "force", "known"), [(0.01, 0.0, False), (0.01, 2e-3, False), (0.01, 2.0, True), (0.0, 2.0, True)]
)
def test_a_law_with_a_kink_at_rest_has_no_frequency(gap, force, known):
    """Beside a dead zone the spring's own frequency; at its edge, or 5e-5 of the link's 0.1 m from it, the tangent differs."""
    law = Table((-0.1 - gap, -gap, gap, 0.1 + gap) if gap else (-0.1, 0.1), (-40.0, 0.0, 0.0, 40.0) if gap else (-40.0, 40.0))
    mechanism = Mechanism(
        {"O": (0, 0), "A": (0.25, 0), "B": (0.35, 0)},
        [Link("block", "A", "B", Rigid.of(mass=0.5, inertia=1e-3))],
        [Slider("A", "block", "ground", along=(1, 0))],
        loads=[Spring("ground:O", "block:A", stiffness=0.0, free_length=0.2, law=law), Force("A", (force, 0.0))],
    )
    found = frequencies(mechanism, count=1)
    assert (found.status == "OK") is known and ("kink" in found.message) is not known
    assert not known or found.hertz[0] == pytest.approx((400.0 / 0.5) ** 0.5 / (2 * np.pi), rel=1e-9)
    assert known or found.errors[0] > 1.0
