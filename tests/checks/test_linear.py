"""Modal links beyond linear theory: what it leaves out against beams that do not leave it out, and links that are told so."""

from dataclasses import replace

import numpy as np
import pytest
from simulations import LENGTH, STRIP, pressed

from buckler.mbs import Beam, Exudyn, Guide, Link, Mechanism, Modal, Revolute, Spectral, Status, simulate
from buckler.mbs.engine.solve import run_once
from buckler.mbs.modal import BarModes

pytest.importorskip("numba")

BARS = Modal(STRIP, BarModes(bending=3, axial=1), damping=0.5)


def sagging(body, pull):
    """A strip between a pin and a guide, let go under a weight across it."""
    return Mechanism(
        {"A": (0, 0), "B": (LENGTH, 0)}, [Link("s", "A", "B", body)], [Revolute("A", "ground", "s")],
        guides=[Guide("B", "s", mass=1e-3)], gravity=(0.0, -pull),
    )  # fmt: skip


def test_what_a_bent_link_leaves_out_is_what_a_beam_comes_nearer():
    """At the same deflection, 2.5 % of the length: 1.5e-3 of it."""
    duration = 0.6 * 2 * np.pi / STRIP.first_frequency(LENGTH)
    linear = run_once(sagging(BARS, 12.0), duration, Exudyn(), None, None).record.links["s"]
    beam = run_once(sagging(Beam(STRIP.damped(0.5, LENGTH), elements=8), 12.0), duration, Exudyn(), None, None).record.links["s"]
    bent = abs(linear.deflection())
    chord = beam.point("B")[0] - beam.point("A")[0]
    line = beam.line(8)
    sag = abs(line[:, line.shape[1] // 2, 1])
    k, other = int(np.argmax(bent)), int(np.argmax(sag))
    missed = linear.foreshortening()[k] / bent[k] ** 2 * LENGTH
    right = (LENGTH - np.linalg.norm(chord[other])) / sag[other] ** 2 * LENGTH
    assert (
        bent[k] > 0.02 * LENGTH and missed == pytest.approx(right, rel=0.03) and missed == pytest.approx(np.pi**2 / 4, rel=0.05)
    )


@pytest.mark.parametrize(("pull", "told"), [(2.0, False), (20.0, True)])
def test_a_modal_link_that_bends_too_far_is_told(pull, told):
    result = simulate(sagging(BARS, pull), 0.3, solver=Exudyn())
    assert ("LINEAR: at t" in result.message and "'s' bends so far" in result.message) is told, result.message


@pytest.mark.parametrize("solver", [Exudyn(), Spectral()], ids=["Exudyn", "compiled"])
@pytest.mark.parametrize(("share", "told"), [(0.8, False), (3.0, True)])
def test_a_modal_link_pressed_beyond_its_critical_load_is_told(solver, share, told):
    """It stays straight for ever; a strip would have buckled and pushed back with hardly more than its critical load."""
    strain = share * STRIP.euler_load(LENGTH) / STRIP.axial_stiffness
    mechanism = pressed(BARS, strain * LENGTH, 2.0)
    aside = replace(mechanism, points={name: (x - 1.0, y) for name, (x, y) in mechanism.points.items()})
    result = simulate(aside, 2.0, solver=solver)
    assert result.status in (Status.OK, Status.SUSPECT), result.message
    assert ("LINEAR" in result.message and "times its critical load; make it a Beam" in result.message) is told, result.message
