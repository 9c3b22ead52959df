"""The energy balance of every load, mass and joint on a flexible link closes to 1e-6 at a tight tolerance.

The balance converges at second order of the spacing: its terms come from forces and speeds at the samples.
"""

from __future__ import annotations

import math

import pytest

pytest.importorskip("numba")


from buckler.mbs import simulate
from buckler.mbs.elements import (
    Beam,
    Cable,
    Force,
    Link,
    Mass,
    Modal,
    Motor,
    Revolute,
    Rigid,
    Slider,
    Slot,
    Spring,
    Torque,
    TorsionSpring,
    Weld,
)
from buckler.mbs.elements.modal import Box
from buckler.mbs.elements.section import Material, Section
from buckler.mbs.mechanism import Mechanism
from buckler.mbs.solvers import Controlled, Spectral

STRIP = Section(0.03, 0.003, Material(210e9, 7850.0, 0.3, bending_damping=1e-4, axial_damping=2e-6))
BODIES = {"beam": Beam(STRIP), "cable": Cable(STRIP)}
LOADS = {
    "spring": Spring("strip:M", "ground:P", 200.0, 1.0, free_length=0.1),
    "spring with a law": Spring("strip:M", "ground:P", 0.0, law=lambda e, rate: 500 * e + 0.2 * rate),
    "torque": Torque("strip:M", lambda t, _angle, speed: 0.5 * math.sin(30 * t) - 0.01 * speed),
    "force": Force("strip:M", lambda t: (10 * math.sin(50 * t), 3.0)),
    "force that follows": Force("strip:M", (0.0, 3.0), follows="strip"),
    "torsion spring": TorsionSpring("ground", "strip", 1.0, 0.001, free_angle=0.0),
    "motor": Motor("strip", 3.0, 1.0, 0.05, inertia=1e-5, gear=2.0),
    "mass": Mass("M", 0.1, link="strip"),
}


def swinging(body, part, carries=("M",)):
    """A strip pinned at one end swings; the part is at its middle, or at its end if it carries no point."""
    masses = [part] if isinstance(part, Mass) else []
    return Mechanism(
        points={"O": (0, 0), "A": (0.3, 0), "P": (0.15, 0.2)},
        links=[Link("strip", "O", "A", body, carries={name: 0.5 for name in carries})],
        joints=[Revolute("O", "ground", "strip")],
        loads=[] if masses else [part], masses=masses, gravity=(0, -9.81), velocities={"strip": 1.0},
    )  # fmt: skip


def balance(mechanism, tolerance, duration=0.05):
    result = simulate(mechanism, duration, solver=Spectral(Controlled(tolerance=tolerance)), ledger=True)
    assert result.ok, result.message
    return result.energy_balance


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("body", BODIES)
def test_of_loads_at_an_inner_point(body, load):
    assert balance(swinging(BODIES[body], LOADS[load]), 1e-10) < 1e-6


@pytest.mark.parametrize("load", ["force that follows", "motor", "mass"])
def test_of_loads_on_a_modal_link(load):
    pytest.importorskip("skfem")
    at_the_end = {"mass": Mass("A", 0.1, 1e-4), "force that follows": Force("A", (0.0, 3.0), follows="strip")}
    part = at_the_end.get(load) or LOADS[load]
    assert balance(swinging(Modal(STRIP, mesh=Box((8, 1, 1))), part, carries=()), 1e-10) < 1e-6


@pytest.mark.parametrize("joint", [Revolute, Weld, Slider, Slot])
def test_of_joints_between_two_strips(joint):
    along = {"along": (0.2, 1.0)} if joint in (Slider, Slot) else {}
    mechanism = Mechanism(
        points={"O": (0, 0), "A": (0.2, 0), "B": (0.4, 0.1)},
        links=[Link("one", "O", "A", Beam(STRIP)), Link("two", "A", "B", Rigid(STRIP))],
        joints=[Weld("O", "ground", "one"), joint("A", "two", "one", **along)],
        gravity=(0, -9.81),
    )  # fmt: skip
    assert balance(mechanism, 1e-10) < 1e-6


def test_converges_at_least_with_the_square_of_the_samples_spacing():
    """Samples lie as close as straight lines between them need: their spacing falls as tolerance to the power 0.75/2."""
    mechanism = swinging(BODIES["beam"], LOADS["spring"])
    coarse, fine = balance(mechanism, 1e-7), balance(mechanism, 1e-10)
    assert math.log(coarse / fine, 1000**0.375) > 1.5
