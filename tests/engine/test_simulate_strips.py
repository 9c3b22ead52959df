"""Runs of flexible strips against the beam equation and the exact elastica: ringing, damping, buckling."""

import math
from dataclasses import replace

import numpy as np
import pytest
from simulations import LENGTH, SIMPLE, STRIP, UNIT, G, fine, pressed, rates, simply_supported

from buckler.elastica import pinned
from buckler.mbs import STEEL, Beam, Cable, Controlled, Exudyn, Section, Strut, simulate
from buckler.mbs.engine.pressed import pinned_strip

# --- beams ------------------------------------------------------------------------------------------------------------

STIFF = Section(width=0.020, thickness=0.004)


def sudden_load(times, pull, terms=6):
    """Mid deflection, sum of 4 g/(n pi omega_n^2) sin(n pi/2) (1 - cos omega_n t) over odd n, omega_n = n^2 omega_1."""
    total = np.zeros_like(times)
    for n in range(1, 2 * terms, 2):
        omega = n**2 * STIFF.first_frequency(SIMPLE)
        total -= 4 * pull / (n * np.pi * omega**2) * (1 - np.cos(omega * times)) * math.sin(n * np.pi / 2)
    return total


@pytest.mark.parametrize("body", [Beam(STIFF), Cable(STIFF)], ids=["beam", "cable"])
def test_beam_under_sudden_gravity_rings_between_zero_and_twice_its_sag(body):
    sag = 5 * STIFF.mass_per_length * G * SIMPLE**4 / (384 * STIFF.bending_stiffness)
    period = 2 * np.pi / STIFF.first_frequency(SIMPLE)
    result = fine(simulate(simply_supported(body, G), 3 * period, ledger=True, solver=Exudyn(Controlled(max_step=period / 300))))
    deflection = result.signals["strip.deflection"]
    assert deflection == pytest.approx(sudden_load(result.time, G), abs=0.01 * sag)
    assert deflection.min() == pytest.approx(-2 * sag, rel=0.01) and deflection.max() < 0.01 * sag
    second = np.abs(result.time - period) < period / 4
    assert result.time[second][np.argmax(deflection[second])] == pytest.approx(period, rel=0.02)
    assert result.energy_balance < 1e-4


def test_damped_beam_settles_on_its_static_sag():
    """Mid deflection 5 q L^4/(384 E I), and half the weight on the pin."""
    section = STIFF.damped(0.7, SIMPLE)
    period = 2 * np.pi / section.first_frequency(SIMPLE)
    result = fine(simulate(simply_supported(Beam(section), G), 5 * period, ledger=True))
    load = section.mass_per_length * G
    sag = 5 * load * SIMPLE**4 / (384 * section.bending_stiffness)
    assert result.signals["strip.deflection"][-1] == pytest.approx(-sag, rel=1e-3)
    assert result.signals["A.ground-strip.fy"][-1] == pytest.approx(load * SIMPLE / 2, rel=1e-3)
    strain = load**2 * SIMPLE**5 / (240 * section.bending_stiffness)  # half the work of the load on its own sag
    assert result.energy["strain"][-1] == pytest.approx(strain, rel=2e-3)
    assert result.energy["taken_damping"][-1] == pytest.approx(strain, rel=1e-2)  # the other half


@pytest.mark.parametrize("ratio", [0.02, 0.1])
def test_bending_damping_is_the_given_ratio(ratio):
    """Logarithmic decrement of the ringing about the sag."""
    section = STIFF.damped(ratio, SIMPLE)
    period = 2 * np.pi / section.first_frequency(SIMPLE) / math.sqrt(1 - ratio**2)
    result = fine(simulate(simply_supported(Beam(section), G), 4.5 * period, solver=Exudyn(Controlled(max_step=period / 200))))
    sag = 5 * section.mass_per_length * G * SIMPLE**4 / (384 * section.bending_stiffness)
    swing = result.signals["strip.deflection"] + sag
    peaks = [np.abs(swing[np.abs(result.time - k * period / 2) < period / 8]).max() for k in (2, 8)]
    decrement = math.log(peaks[0] / peaks[1]) / 3
    assert decrement / math.hypot(2 * np.pi, decrement) == pytest.approx(ratio, rel=0.02)


# --- struts and buckled strips ----------------------------------------------------------------------------------------


def test_pressed_strut_gives_the_exact_elastica():
    travel, duration = 0.95 * LENGTH, 1.0
    result = fine(simulate(pressed(Strut(STRIP), travel, duration), duration, ledger=True, solver=Exudyn()))
    u = result.signals["strip.end_shortening"] / LENGTH
    load = UNIT * pinned.load(np.maximum(u, 1e-9))
    later = u > 1e-3
    assert result.signals["strip.compression"][later] == pytest.approx(load[later], rel=1e-5)
    inertia = 0.1 * 6 * travel * result.time / duration**3
    assert result.signals["drive.force"][later] == pytest.approx((load + inertia)[later], rel=1e-3)
    bending = STRIP.bending_stiffness / LENGTH * pinned.energy(u[-1])
    assert result.energy["strain"][-1] == pytest.approx(bending, rel=1e-4)


def test_taut_strut_is_damped_along_its_axis():
    """Pulled by U = U_1 t^3: E A/L (U + tau U'), and the damping takes E A/L tau 9 U_1^2/5 in the first second."""
    tau, pull, rigidity = 0.05, 1e-5, STRIP.axial_stiffness / LENGTH
    section = replace(STRIP, material=replace(STEEL, axial_damping=tau))
    result = fine(simulate(pressed(Strut(section), -pull, 1.0), 1.0, ledger=True))
    t = result.time
    force = rigidity * pull * (t**3 + tau * 3 * t**2) + 0.1 * 6 * pull * t
    assert -result.signals["drive.force"] == pytest.approx(force, abs=1e-4 * force[-1])
    assert result.energy["taken_damping"][-1] == pytest.approx(rigidity * tau * 9 * pull**2 / 5, rel=1e-3)


DAMPED = STRIP.damped(0.1, LENGTH)


@pytest.mark.parametrize(
    "body", [Beam(DAMPED, imperfection=1e-5), Cable(DAMPED, elements=16, imperfection=1e-5)], ids=["beam", "cable"]
)
def test_strip_pressed_slowly_follows_the_exact_elastica(body):
    result = fine(simulate(pressed(body, 0.6 * LENGTH, 80.0), 80.0, ledger=True))
    u = result.signals["strip.end_shortening"] / LENGTH
    later = u > 0.05
    assert u[-1] == pytest.approx(0.6, abs=1e-6)
    load = UNIT * pinned.load(u[later])
    assert result.signals["drive.force"][later] == pytest.approx(load, rel=1e-3)
    height = np.abs(result.signals["strip.deflection"][later])
    assert height == pytest.approx(LENGTH * pinned.mid_deflection(u[later]), rel=1e-3)
    bending = STRIP.bending_stiffness / LENGTH * pinned.energy(u[-1])
    assert result.energy["strain"][-1] == pytest.approx(bending, rel=1e-3)


@pytest.mark.parametrize(("make", "order", "bound"), [
    (lambda n: Beam(STRIP, elements=n, nodes=2), 2, 1e-2),
    (lambda n: Beam(STRIP, elements=n, nodes=3), 4, 1e-4),
    (lambda n: Cable(STRIP, elements=n), 4, 1e-3),
], ids=["linear beam", "quadratic beam", "cable"])  # fmt: skip
def test_static_force_converges_to_the_elastica(make, order, bound):
    """At u = 0.1, 0.5, 0.9; the error is taken where it is largest."""
    u, errors = np.array([0.1, 0.5, 0.9]), []
    for elements in (8, 16) if order == 4 else (16, 32):
        errors.append(np.abs(pinned_strip(make(elements), LENGTH, u) / pinned.load(u) - 1).max())
    assert rates(errors)[0] == pytest.approx(order, abs=0.5)
    assert errors[-1] < bound
