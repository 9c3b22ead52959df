"""Loads whose law has states: what is refused before a run, files, what is compiled."""

import pytest

from buckler.mbs import Force, Guide, Link, Mechanism, Revolute, Rigid, States, Torque, equilibrium, frequencies, path, periodic
from buckler.mbs.functions import component_functions
from buckler.mbs.laws.compiled import function_pointer


def turned(value, rates=None, initial=(0.0,), **more):
    states = None if rates is None else States(rates, initial=initial)
    return Mechanism(
        points={"O": (0, 0), "A": (0.1, 0)}, links=[Link("rotor", "O", "A", Rigid.of(mass=1.0, inertia=0.02))],
        joints=[Revolute("O", "ground", "rotor")], loads=[Torque("rotor", value, states=states)], **more,
    )  # fmt: skip


def pid(t, angle, speed, total):
    return 0.2 * (10 - speed) + 2 * total


def missing(t, angle, speed, total):
    return 10 - speed


WRONG = {
    "no states": ((pid,), r"value\(0, 0, 0\) raises TypeError: pid\(\) missing 1 required positional argument: 'total'"),
    "a number": ((1.0, missing), "value = 1.0: must be a function where there are states"),
    "value fails": ((lambda t, angle, speed, x: 1 / x, missing), r"value\(0, 0, 0, 0\) raises ZeroDivisionError"),
    "rate fails": ((pid, lambda t, angle, speed, x: 1 / x), r"states\.rates\(0, 0, 0, 0\) raises ZeroDivisionError"),
    "too many rates": ((pid, lambda *_: (1.0, 2.0)), r"states\.rates at t = 0 = \(1\.0, 2\.0\): must be a number"),
    "too few rates": ((lambda *_: 0.0, lambda *_: (1.0,), (1.0, 2.0)), r"states\.rates at t = 0 = \(1\.0,\): must be 2 numbers"),
    "too many formulas": (("state1", ["1", "speed"]), r"states\.rates at t = 0 = \[1\.0, 0\.0\]: must be a number"),
    "no number": ((pid, lambda *_: float("nan")), r"states\.rates at t = 0 = nan"),
    "no such state": (("state2", missing), "'state2': there is no state2; known: t, angle, speed, state1"),
    "no such measure": (("x*state1", missing), "'x\\*state1': there is no x; known: t, angle, speed, state1"),
    "a state of none": (("speed + state1",), "there is no state1; known: t, angle, speed"),
    "no initial value": ((pid, missing, ()), "initial = .*at least 1"),
    "no number to begin with": ((pid, missing, ("a",)), "initial.*'a': not a number"),
    "an infinite one": ((pid, missing, (float("inf"),)), "initial.*inf"),
}


@pytest.mark.parametrize("what", WRONG)
def test_what_is_wrong_is_refused_by_name(what):
    given, sentence = WRONG[what]
    with pytest.raises(ValueError, match=sentence):
        turned(*given)


@pytest.mark.parametrize("more", [{"follows": "rod"}, {"through": (0.0, 1.0)}])
def test_a_force_with_states_keeps_its_direction_and_its_point(more):
    with pytest.raises(ValueError, match="states: a force with states neither follows a link nor goes through a place"):
        Mechanism(
            points={"B": (0, 0), "C": (0.3, 0)}, links=[Link("rod", "B", "C", Rigid.of(mass=0.2, inertia=1e-3))],
            guides=[Guide("B", "rod")],
            loads=[Force("C", lambda t, x, y, vx, vy, p: (p, 0.0), states=States(lambda t, x, y, vx, vy, p: -p), **more)],
        )  # fmt: skip


@pytest.mark.parametrize(
    "asked", [equilibrium, frequencies, lambda m: path(m, to=1.0, load=["torque.rotor"]), lambda m: periodic(m, 1.0)],
    ids=["equilibrium", "frequencies", "path", "periodic"],
)  # fmt: skip
def test_statics_refuse_states(asked):
    with pytest.raises(ValueError, match=r"'torque\.rotor' has states, which have no statics"):
        asked(turned(pid, missing))


def test_a_file_has_states_by_formulas(tmp_path):
    text = """
    points = { O = [0, 0], A = [0.1, 0] }
    pins = ["O: ground rotor"]
    links.rotor = { start = "O", end = "A", body = { kind = "Rigid", mass = 1.0, inertia = 0.02 } }
    [[loads]]
    kind = "Torque"
    link = "rotor"
    value = "0.2*(10 - speed) + 2*state1"
    states = { rates = ["10 - speed", "(speed - state2)/0.1"], initial = [0.5, 0] }
    """
    file = tmp_path / "rotor.toml"
    file.write_text(text, encoding="utf-8")
    mechanism = Mechanism.load(file)
    assert mechanism.loads[0].states.initial == (0.5, 0.0)
    value, *rates = mechanism.loads[0].functions()
    assert (value(0, 0, 4.0, 0.5, 1.0), *(rate(0, 0, 4.0, 0.5, 1.0) for rate in rates)) == pytest.approx((2.2, 6.0, 30.0))
    mechanism.save(file)
    assert Mechanism.load(file) == mechanism


def test_a_law_with_helpers_of_its_own_is_compiled():
    """As a law that is written within a function is: its helpers are what it holds of that function."""
    pytest.importorskip("numba")
    gain = 3.0

    def error(t, angle):
        return t - gain * angle

    def law(t, angle, speed, x):
        return error(t, angle) + x, speed

    assert all(function_pointer(each, 4).compiled for each in component_functions(law, ["t", "angle", "speed", "state1"], 2))


def test_kinks_of_a_law_with_states_are_found():
    """A jump of what is wanted, at a time that no step would meet."""
    load = Torque(
        "rotor", lambda t, angle, speed, x: x, states=States(lambda t, angle, speed, x: (0.0 if t < 0.123 else 1.0) - speed)
    )  # fmt: skip
    (jump,) = load.kinks(1.0)
    assert jump == pytest.approx(0.123, abs=1e-9)
