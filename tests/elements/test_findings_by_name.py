"""What fails, fails by name; what looks forgotten is noted."""

import math
from dataclasses import replace

import numpy as np
import pytest
from made import stiff
from simulations import BAR, STRIP, block, fine, parallelogram, pendulum

from buckler import mbs
from buckler.mbs.laws import Hertz


def test_a_parallel_fourth_leg_is_redundant_and_runs_right():
    result = fine(mbs.simulate(parallelogram([mbs.Drive("a", 1.0)]), 0.5, ledger=True))
    assert "redundant: 'C.c-k'" in result.provenance["notes"][0]
    for leg in "abc":
        assert result[f"{leg}.ax"] == pytest.approx(0.5 * np.sin(result.time), abs=1e-12)
    assert result["drive.torque"] == pytest.approx(0.0, abs=1e-10)


def test_a_drive_square_to_its_guide_is_refused_by_name():
    bar, pin = mbs.Link("bar", "O", "B", BAR), mbs.Revolute("O", "ground", "bar")
    made = mbs.Mechanism({"O": (0, 0), "B": (1, 0)}, [bar], [pin], [mbs.Guide("B", "bar")], drives=[mbs.Drive("B", 0.1)])
    with pytest.raises(ValueError, match=r"'guide B'|'O.ground-bar'.*'drive'") as caught:
        mbs.simulate(made, 1.0)
    assert "contradict each other" in str(caught.value)


@pytest.mark.parametrize("bow", [0.26, -0.5])
def test_a_bow_that_no_half_sine_has_is_refused(bow):
    """Angles of a half-sine make a closed loop of height 0 at a bow of the whole length."""
    with pytest.raises(
        ValueError, match=f"imperfection of flexible link 'bar' = {bow:g} m: must be at most 0.25 of its length, 1 m"
    ):
        mbs.Mechanism({"O": (0, 0), "A": (1, 0)}, [mbs.Link("bar", "O", "A", mbs.Beam(STRIP, imperfection=bow))])


class Typo(Hertz):
    def force(self, depth, rate, onset):
        return self.stifness * depth


def test_a_law_with_a_typo_is_told_first():
    result = mbs.simulate(block(9.81, Typo(1e8)), 0.3)
    assert result.status is mbs.Status.FUNCTION_FAILED and "raised AttributeError" in result.message
    assert "stifness" in result.message and "\n" not in result.message and len(result.message) < 200
    assert result.time[-1] == pytest.approx(math.sqrt(0.2 / 9.81), rel=0.02)


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_what_a_progress_raises_comes_through(error):
    def progress(share):
        if share > 0.1:
            raise error

    with pytest.raises(error):
        mbs.simulate(mbs.slider_crank(mbs.Beam(STRIP), law=None, mass=0.3, speed=1.25), 5.0, accuracy=1e-2, progress=progress)


def one_bar(**parts):
    return mbs.Mechanism({"O": (0, 0), "A": (1, 0)}, [mbs.Link("bar", "O", "A", BAR)], **parts)


SOFT = mbs.Section(0.02, 0.002, mbs.Material(modulus=210, density=7850))
NOTED = {
    "a point shared without a joint": (
        lambda: replace(pendulum(0.1), links=[*pendulum(0.1).links, mbs.Link("other", "O", "A", BAR)]),
        "links 'bar' and 'other' share the point 'O' without a joint there",
    ),
    "a driven link without bearing": (
        lambda: one_bar(drives=[mbs.Drive("bar", 1.0)]), "nothing ties the driven link 'bar' to the ground",
    ),
    "a stop out of reach": (
        lambda: stiff(drives=[mbs.Drive("crank", 1.0)], stops=[mbs.Stop("B", at=20.0, law=Hertz(1e8))]),
        "the stop of 'B' lies farther than the links reach",
    ),
    "a block that turns on its only guide": (
        lambda: one_bar(guides=[mbs.Guide("O", "bar", (1, 0))]), "links.bar: the guide of 'O' leaves its angle free",
    ),
    "a modulus without its giga": (
        lambda: mbs.Mechanism(
            {"O": (0, 0), "A": (1, 0)}, [mbs.Link("bar", "O", "A", mbs.Beam(SOFT))], [mbs.Weld("O", "ground", "bar")]
        ),
        "links.bar: so soft that waves run along it at 0.16 m/s",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", NOTED)
def test_what_looks_forgotten_is_noted(case):
    make, words = NOTED[case]
    notes = mbs.simulate(make(), 0.05).provenance["notes"]
    assert any(words in note for note in notes), notes


def test_a_load_at_another_point_of_the_same_last_letter_hides_no_note():
    """The force acts at 'BA'; at 'A' the links still pass each other."""
    links = [mbs.Link("bar", "O", "A", BAR), mbs.Link("other", "O", "A", BAR), mbs.Link("third", "A", "BA", BAR)]
    joints = [mbs.Revolute("O", "ground", "bar"), mbs.Revolute("A", "bar", "third"), mbs.Revolute("O", "bar", "other")]
    points = {"O": (0, 0), "A": (1, 0), "BA": (2, 0)}
    mechanism = mbs.Mechanism(points, links, joints, loads=[mbs.Force("BA", (0, -1))])
    notes = mbs.simulate(mechanism, 0.01).provenance["notes"]
    assert any("share the point 'A' without a joint there" in note for note in notes), notes


class Wordy(Hertz):
    """A law that asks a dictionary, which Numba cannot compile."""

    def force(self, depth, rate, onset):
        return {"force": super().force(depth, rate, onset)}["force"]


@pytest.mark.parametrize("solver", [mbs.Exudyn(), mbs.Spectral()], ids=["Exudyn", "Spectral"])
def test_a_law_that_cannot_be_compiled_is_told(solver):
    play = [mbs.Clearance("A", "crank", "rod", pin=0.01, gap=1e-4, law=law(1e8)) for law in (Wordy, Hertz)]
    slow, quick = (
        mbs.simulate(stiff(joints=[mbs.Revolute("O", "ground", "crank"), joint]), 1e-4, solver=solver) for joint in play
    )
    assert any("called back in Python" in note and "slower" in note for note in slow.provenance["notes"])
    assert not any("Python" in note for note in quick.provenance.get("notes", ()))
    assert slow["rod.x"] == pytest.approx(quick["rod.x"])
