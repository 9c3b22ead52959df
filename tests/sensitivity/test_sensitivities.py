"""Derivatives of readings against closed forms, and what is said where there is none."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk
from simulations import guided, pushed, slim

from buckler import mbs
from buckler.mbs.laws import CarvalhoMartins, KelvinVoigt
from buckler.mbs.sensitivity.derivatives import Derivative, Sensitivities
from buckler.mbs.sensitivity.runs import scale_tolerances
from buckler.mbs.spectral.run import once

G = 9.81


def pendulum(length=0.5, start=1.0):
    """A point mass on a massless rod, released from rest at an angle from the vertical."""
    points = {"O": (0.0, 0.0), "A": (float(length * np.sin(start)), float(-length * np.cos(start)))}
    rod, pin = mbs.Link("rod", "O", "A", mbs.Rigid.of(mass=1e-9, inertia=1e-12)), mbs.Revolute("O", "ground", "rod")
    return mbs.Mechanism(points, [rod], [pin], masses=[mbs.Mass("A", 1.0)], gravity=(0.0, -G))


def exact(readings, at):
    """Yield name, number, reading, its value and its derivative by differences of a function with closed forms of readings."""
    for name, number in at.items():
        low, high = (readings(**at | {name: number * (1 + d)}) for d in (-1e-5, 1e-5))
        for reading, value in readings(**at).items():
            yield name, number, reading, value, (high[reading] - low[reading]) / (2e-5 * number)


def test_finer_runs_raise_the_degree_of_a_solver_that_names_none():
    coarse, fine = mbs.Spectral(), mbs.Spectral(degree=8)
    assert scale_tolerances(coarse, 1 / 32, 4).degree == scale_tolerances(fine, 1 / 32, 4).degree == 12


def test_period_of_a_pendulum_by_its_length():
    def readings(length, start):
        return {"half": 2 * np.sqrt(length / G) * ellipk(np.sin(start / 2) ** 2)}

    at = {"length": 0.5, "start": 1.0}
    duration, of = 2.4 * readings(**at)["half"], {"half": "when(A.x, 0, 2) - when(A.x, 0, 1)"}
    found = mbs.sensitivities(pendulum, duration, by=list(at), at=at, of=of)
    assert found["half", "length"].relative == pytest.approx(0.5, rel=1e-6)
    for name, _, reading, value, true in exact(readings, at):
        row = found[reading, name]
        assert row.value == pytest.approx(value, rel=1e-8)
        assert abs(row.derivative - true) <= 1e-6 * abs(true)


def test_spring_and_mass_by_each_number():
    k, m, push, t = 200.0, 0.5, 3.0, 0.4
    w = np.sqrt(k / m)
    found = mbs.sensitivities(pushed(k, m, push), t, by=["loads[0].stiffness", "guides[0].mass"], of=["end(O.x)", "max(O.x)"])
    end = push / k * (1 - np.cos(w * t))
    by_mass = push / k * np.sin(w * t) * t * -0.5 * w / m
    by_stiffness = -end / k + push / k * np.sin(w * t) * t * 0.5 * w / k
    assert found["end(O.x)", "guides[0].mass"].derivative == pytest.approx(by_mass, rel=1e-6)
    assert found["end(O.x)", "loads[0].stiffness"].derivative == pytest.approx(by_stiffness, rel=1e-6)
    assert found["max(O.x)", "loads[0].stiffness"].relative == pytest.approx(-1.0, rel=1e-5)
    assert abs(found["max(O.x)", "guides[0].mass"].relative) < 1e-5


def test_frequency_and_euler_load_of_a_strip_by_its_thickness():
    def load(mechanism):
        """P with w1^2(P) = w1^2(0) (1 - P/P_E), from two frequencies; exact for pinned ends."""
        pushed = mbs.Mechanism.from_dict(mechanism.to_dict() | {"loads": [{"kind": "Force", "point": "B", "value": [-0.1, 0.0]}]})
        free, loaded = (mbs.frequencies(m, count=1).angular[0] ** 2 for m in (mechanism, pushed))
        return 0.1 / (1 - loaded / free)

    found = mbs.sensitivities(
        slim, by=["thickness"], at={"thickness": 3e-4}, of={"first": "frequency(1)", "Euler load": load},
    )  # fmt: skip
    section = mbs.Section(0.02, 3e-4)
    euler = pi**2 * section.material.modulus * 0.02 * 3e-4**3 / 12 / 0.3**2
    assert found["Euler load", "thickness"].value == pytest.approx(euler, rel=1e-4)
    assert found["Euler load", "thickness"].relative == pytest.approx(3.0, rel=1e-3)
    assert found["first", "thickness"].relative == pytest.approx(1.0, rel=1e-5)


def bounce(height=0.1, stiffness=1e4, law=None):
    """A block that falls along its guide onto a stop, by default without loss."""
    stop = mbs.Stop("O", at=0.0, law=law or CarvalhoMartins(stiffness, 1.0, exponent=1.0))
    return guided(start=(0.0, height), along=(0.0, 1.0), stops=[stop], gravity=(0.0, -G))


def test_what_follows_an_impact_has_derivatives_too():
    """Depth d of the first push: k d^2/2 = m g (h + d). It comes back after half an oscillation about the weight's depth."""

    def readings(height, stiffness):
        v, w, weight = np.sqrt(2 * G * height), np.sqrt(stiffness / 0.5), 0.5 * G
        back = v / G + 2 / w * (pi - np.arctan(v * w / G)) + 2 * v / G
        largest = weight + np.sqrt(weight**2 + 2 * stiffness * weight * height)
        return {"max(O.contact_force)": largest, "begins(O.contact_force, 2)": back}

    at = {"height": 0.1, "stiffness": 1e4}
    found = mbs.sensitivities(bounce, 0.5, by=list(at), at=at, of=list(readings(**at)))
    for name, number, reading, value, true in exact(readings, at):
        row = found[reading, name]
        assert row.value == pytest.approx(value, rel=1e-6)
        assert abs(row.derivative - true) <= min(row.error + 1e-9 * value / number, 1e-4 * value / number)
        assert row.error <= (1e-3 if reading.startswith("max") else 1e-2) * abs(true)


def test_a_force_that_jumps_at_its_onset_and_ends_inside():
    """Fall on a spring and dashpot: m d'' = m g - F, F = k d + c d' until it is zero, the body still inside."""

    def readings(height, stiffness, damping):
        m, v, rate = 0.5, np.sqrt(2 * G * height), damping / 2 / 0.5
        w, rest = np.sqrt(stiffness / m - rate**2), m * G / stiffness
        beside = (v - rate * rest) / w

        def state(t):
            swing, turn = (
                np.exp(-rate * t) * np.array([np.cos(w * t), np.sin(w * t)]) @ np.array([[-rest, beside], [beside, rest]])
            )
            return rest + swing, w * turn - rate * swing

        end = brentq(lambda t: np.dot((stiffness, damping), state(t)), 0.6 * pi / w, 1.1 * pi / w, xtol=1e-15)
        return {"ends(O.contact_force, 1)": v / G + end, "impulse(O.contact_force)": m * (v - state(end)[1] + G * end)}

    at = {"height": 0.1, "stiffness": 1e4, "damping": 20.0}
    found = mbs.sensitivities(
        lambda height, stiffness, damping: bounce(height, law=KelvinVoigt(stiffness, damping)), 0.2, by=list(at), at=at,
        of=list(readings(**at)),
    )  # fmt: skip
    for name, number, reading, value, true in exact(readings, at):
        row = found[reading, name]
        assert row.value == pytest.approx(value, rel=1e-6)
        assert abs(row.derivative - true) <= min(3 * row.error, 1e-3 * value / number) + 1e-9 * value / number


def tied(stiffness, gap):
    made = pushed(push=3.0, mass=0.4)
    spring = mbs.Spring("ground:C", "O", 0.0, law=lambda stretch, _: stiffness * max(0.0, stretch - gap))
    return replace(made, loads=[spring, *made.loads[1:]])


def test_a_spring_that_is_slack_at_first():
    """A law of one's own with a kink: free way, half an oscillation about the push's stretch, free way back."""

    def readings(stiffness, gap):
        t, w = np.sqrt(2 * gap * 0.4 / 3), np.sqrt(stiffness / 0.4)
        v, rest = 3 / 0.4 * t, 3 / stiffness
        taut = 2 / w * (pi - np.arctan(v / rest / w))
        last = 0.25 - t - taut
        return {
            "begins(spring.C-O.force, 1)": t, "ends(spring.C-O.force, 1)": t + taut,
            "max(O.x)": gap + rest + np.hypot(rest, v / w), "impulse(spring.C-O.force)": 0.8 * v + 3 * taut,
            "end(O.x)": gap - v * last + 0.5 * 3 / 0.4 * last**2,
        }  # fmt: skip

    at = {"stiffness": 800.0, "gap": 0.02}
    found = mbs.sensitivities(tied, 0.25, by=list(at), at=at, of=list(readings(**at)))
    largest = readings(**at) | {"end(O.x)": readings(**at)["max(O.x)"]}
    for name, number, reading, value, true in exact(readings, at):
        row = found[reading, name]
        assert abs(row.derivative - true) <= 3 * row.error + 1e-9 * value / number
        assert abs(row.derivative - true) * number < 1e-2 * largest[reading]


@pytest.mark.parametrize("late", [1e-3, 4e-3])
def test_a_kink_shortly_before_the_end(late):
    """The step to the kink is not halved because the next one would be short: it was, for ever."""
    tight = np.sqrt(2 * 0.02 * 0.4 / 3)
    found = once(tied(800.0, 0.02), tight * (1 + late), mbs.Spectral(mbs.Controlled(tolerance=1e-5, max_steps=2000)))
    assert not found.failure
    assert found.record.time[-1] == pytest.approx(tight * (1 + late))


def test_a_kink_is_told():
    row = mbs.sensitivities(pushed(), by=["loads[0].stiffness"], of={"off": lambda m: abs(m.loads[0].stiffness - 200.0)}).rows[0]
    assert np.isnan(row.derivative) and row.note == "a kink: -1 below, 1 above"


def test_a_graze_has_no_derivative():
    """The largest force of a block that just reaches the stop: none below, growing above."""

    def reach(push):
        made = pushed(push=push).to_dict()
        law = {"kind": "CarvalhoMartins", "stiffness": 1e4, "exponent": 1, "restitution": 1.0}
        return mbs.Mechanism.from_dict(made | {"stops": [{"point": "O", "at": 0.03, "law": law}]})

    found = mbs.sensitivities(reach, 0.3, by=["push"], at={"push": 3.0}, of="max(O.contact_force)")
    row = found["max(O.contact_force)", "push"]
    assert np.isnan(row.derivative) and "a kink: -0 below" in row.note


def test_wrong_input_is_refused_before_a_run():
    with pytest.raises(ValueError, match=r"loads\[0\].stifness"):
        mbs.sensitivities(pushed(), 0.1, by=["loads[0].stifness"], of="end(O.x)")
    with pytest.raises(ValueError, match="give a duration"):
        mbs.sensitivities(pushed(), by=["loads[0].stiffness"], of="end(O.x)")
    with pytest.raises(ValueError, match="standard deviation"):
        mbs.sensitivities(pushed(), 0.1, by=["points.O[0]"], of="end(O.x)")


@pytest.mark.parametrize("late", [1e-5, 1e-4])
@pytest.mark.parametrize("method", ["implicit", "explicit"])
def test_a_step_that_ends_right_after_an_onset(late, method):
    """A block falls for sqrt(2 h/g) on a stop; a step is to end a little later, by this share of what is before."""
    made, onset = bounce(height=0.1), float(np.sqrt(0.2 / G))
    ends = np.array([0.5 * onset, onset * (1 + 0.5 * late), *np.linspace(1.01, 1.3, 30) * onset])
    found = once(made, float(ends[-1]), mbs.Spectral(mbs.Controlled(tolerance=1e-7, max_steps=2000), method=method), ends=ends)
    assert not found.failure
    assert np.abs(found.record.time - onset).min() < 1e-7 * onset


def test_unknown_contributions_come_last():
    rows = [Derivative("f", name, 1.0, 1.0, "m", "m", value) for name, value in (("a", 1.0), ("b", np.nan), ("c", 2.0))]
    found = Sensitivities(rows, dict.fromkeys("abc", 1.0))
    assert list(found.contributions("f")) == ["c", "a", "b"]
    assert np.isnan(found.spread("f"))


def test_contributions_to_a_spread():
    by = {"loads[0].stiffness": 2.0, "guides[0].mass": 0.01}
    found = mbs.sensitivities(pushed(), 0.4, by=by, of="max(O.x)")
    parts = found.contributions("max(O.x)")
    assert list(parts) == ["loads[0].stiffness", "guides[0].mass"]
    assert found.spread("max(O.x)") == pytest.approx(2.0 / 200 * found.rows[0].value, rel=1e-4)


def test_command(tmp_path, capsys):
    from buckler.studies.kit.cli import main

    path = pushed().save(tmp_path / "block.toml")
    words = ["sensitivity", str(path), "--duration", "0.4 s", "--of", "max(O.x)"]
    assert main(argv=words) == 0
    said = capsys.readouterr().out
    assert "loads[0].stiffness" in said and "-1 " in said and "guides[0].mass" in said
    assert main(argv=[*words, "--by", "loads[0].stiffness=2N/m"]) == 0
    assert "standard deviation 0.0003" in capsys.readouterr().out
    assert main(argv=[*words, "--by", "loads[0].stifness"]) == 2
