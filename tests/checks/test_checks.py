"""Self-checks of a run: each names its fault in a run that has it, and is silent in runs that are right."""

from dataclasses import dataclass

import numpy as np
import pytest
from judged import BARS, WET, K, rattling, striking, suspect
from simulations import LENGTH, STRIP, G, block, fine, pendulum, pressed

from buckler import mbs
from buckler.mbs.laws import Hertz, Impact, KelvinVoigt, NoFriction
from buckler.mbs.library import CrankRocker
from buckler.mbs.view.verdicts import verdicts

# --- runs that are right ----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Backwards(Hertz):
    """Damping with the wrong sign: it drives."""

    def force(self, depth, rate, onset):
        return self.elastic(depth) * (1 - 0.5 * rate / onset)


@dataclass(frozen=True)
class Driving(NoFriction):
    """Friction with the wrong sign."""

    def coefficient(self, speed):
        return -0.3 * np.tanh(speed / 0.01)


def test_contact_damping_of_the_wrong_sign_makes_energy():
    assert "makes energy" in suspect(mbs.simulate(block(G, Backwards(1e8)), 0.3), "ENERGY")
    suspect(mbs.simulate(rattling(Backwards(K), with_play="B"), 0.008), "ENERGY")


def test_friction_of_the_wrong_sign_makes_energy():
    reason = suspect(mbs.simulate(rattling(friction=Driving(), with_play="B"), 0.005), "ENERGY")
    assert "'taken_friction' gives back" in reason


@dataclass(frozen=True)
class Sticky(KelvinVoigt):
    """A dashpot that pulls when the contact opens, as no contact does."""

    def force(self, depth, rate, onset):
        return self.stiffness * depth + self.damping * rate


def test_a_contact_that_pulls():
    assert "'A.contact_force' pulls with -" in suspect(
        mbs.simulate(block(G, Sticky(1e6, 1e3)), 0.3, solver=mbs.Exudyn()), "CONTACT"
    )


def test_a_stop_and_a_bush_pierced():
    assert "'A' is" in suspect(mbs.simulate(block(G, Hertz(10.0)), 0.4), "PENETRATION")
    soft = Impact(1e-4 * K, 2.5, 1e-5)
    assert "more than 0.00025 m, its clearance" in suspect(mbs.simulate(rattling(soft), 0.01), "PENETRATION")


def test_a_strut_whose_ends_meet():
    suspect(mbs.simulate(pressed(mbs.Strut(STRIP), 0.995 * LENGTH, 1.0), 1.0), "CROSSED")


LENGTHS = CrankRocker()


def short_of_dead_centre(room, solver=mbs.Closure):
    """A turn of a linkage whose frame is so short that coupler and rocker come into line but for this, m."""
    lengths = LENGTHS._replace(frame=LENGTHS.crank + LENGTHS.coupler - LENGTHS.rocker + room)
    mechanism = mbs.crank_rocker(mbs.Rigid(BARS), speed=10 * np.pi, section=BARS, lengths=lengths, angle=0.5)
    return mbs.simulate(mechanism, 0.2, solver=solver(mbs.Controlled(max_step=2e-4)))


def test_a_linkage_that_meets_a_dead_centre():
    fine(short_of_dead_centre(1e-2))
    fine(short_of_dead_centre(1e-5))
    fine(short_of_dead_centre(1e-9))
    result = short_of_dead_centre(0.0)
    assert result.status is mbs.Status.SINGULAR and "coupler and rocker in line" in result.message
    assert "is not determined" in result.message
    assert result.time[-1] == pytest.approx(0.1 - 0.5 / (10 * np.pi) + 0.1, abs=1e-6)  # the crank at 2 pi


def test_a_linkage_that_is_integrated_through_a_dead_centre():
    assert "is not determined" in suspect(short_of_dead_centre(0.0, mbs.Exudyn), "BRANCH")


def test_a_linkage_that_is_integrated_past_a_dead_centre():
    """The compiled solver keeps to the assembly, as exact loop closure does; too long steps lead Exudyn into the other."""
    exact, right, wrong = (short_of_dead_centre(1e-6, solver) for solver in (mbs.Closure, mbs.Spectral, mbs.Exudyn))
    fine(right)
    assert right["B.y"] == pytest.approx(exact.at("B.y", right.time), abs=1e-6)
    assert abs(wrong["B.y"] - exact.at("B.y", wrong.time)).max() > 0.1
    assert "has left its assembly" in suspect(wrong, "BRANCH")


COARSE = {
    "1 of 3 nodes": mbs.Beam(WET, elements=1, imperfection=-1e-4 * LENGTH),
    "2 of 2 nodes": mbs.Beam(WET, elements=2, nodes=2, imperfection=-1e-4 * LENGTH),
    "1 cable": mbs.Cable(WET, elements=1, imperfection=-1e-4 * LENGTH),
}


def is_fine(mechanism, duration, signal, allowed):
    """A run without settings is OK, and as near to a fine one of the compiled solver as is allowed."""
    result = fine(mbs.simulate(mechanism, duration))
    right = mbs.simulate(mechanism, duration, solver=mbs.Spectral(mbs.Controlled(1e-8, duration / 400), degree=11))
    off = result[signal] - right.at(signal, result.time)
    assert np.sqrt(np.mean(off**2)) < allowed * np.ptp(right[signal])


@pytest.mark.slow
@pytest.mark.parametrize("mesh", COARSE)
def test_elements_too_few_for_a_rebound_are_not_used(mesh):
    is_fine(striking(COARSE[mesh]), 2.8, "coupler.deflection", 1e-2)
    result = mbs.simulate(striking(COARSE[mesh]), 2.8, solver=mbs.Exudyn())
    right = mbs.simulate(striking(COARSE[mesh]), 2.8)
    off = result["coupler.deflection"] - right.at("coupler.deflection", result.time)
    assert np.abs(off).max() > 5e-2 * np.ptp(right["coupler.deflection"]), "a solver that is named runs with them"


@pytest.mark.parametrize(
    "body", [mbs.Beam(WET, elements=1, imperfection=1e-3), mbs.Beam(WET, elements=4, nodes=2, imperfection=1e-3)]
)
def test_elements_too_few_for_a_load_are_not_used(body):
    is_fine(pressed(body, 0.3 * LENGTH, 10.0), 10.0, "strip.deflection", 1e-2)


def test_steps_of_ones_own_have_no_known_error():
    result = mbs.simulate(pendulum(2.5), 1.5, solver=mbs.Exudyn(mbs.Equal(20)))
    assert not result.error.known and "error not known" in repr(result)
    assert [row.verdict for row in verdicts(result) if row.name == "ACCURACY"] == ["not run"]


@pytest.mark.parametrize("times", [4, 130, 6400])
@pytest.mark.parametrize(
    "body", [mbs.Beam(STRIP), mbs.Cable(STRIP), mbs.Beam(STRIP, elements=16)], ids=["beam", "cable", "fine beam"]
)
def test_a_straight_strip_pressed_beyond_its_critical_load(body, times):
    """The shortening is far below half a per cent."""
    strain = times * STRIP.euler_load(LENGTH) / STRIP.axial_stiffness
    said = suspect(mbs.simulate(pressed(body, strain * LENGTH, 2.0), 2.0), "UNBUCKLED")
    assert "straight, though its bending grows at" in said
