"""Functions are compiled once for all of the same code and values; formulas are compiled as functions are."""

import ctypes
import math

import numpy as np
import pytest

pytest.importorskip("numba")

from buckler.mbs.functions import TURN, Components, Expression, component_functions
from buckler.mbs.laws import compiled
from buckler.mbs.laws.compiled import evaluate_compiled, function_pointer


def rise(t):
    return np.clip((t - 0.2) / 0.6, 0, 1)


FORMULAS = {
    "0.05*speed/sqrt(speed**2+0.1**2)": lambda t, angle, speed: 0.05 * speed / math.sqrt(speed**2 + 0.1**2),
    "-2*sin(3*t)*angle": lambda t, angle, speed: -2 * math.sin(3 * t) * angle,
    "max(t, 0.3) - min(angle, speed)": lambda t, angle, speed: max(t, 0.3) - min(angle, speed),
    "abs(speed)*sign(speed)**3 + exp(-t)*pi": lambda t, a, v: abs(v) * math.copysign(1, v) ** 3 + math.exp(-t) * math.pi,
    "step(t, 0.2, -1, 0.8, 3)": lambda t, angle, speed: -1 + 4 * rise(t) ** 2 * (3 - 2 * rise(t)),
    "atan2(speed, 2) + 2**t + e": lambda t, angle, speed: math.atan2(speed, 2) + 2**t + math.e,
}  # fmt: skip


def called(pointer, *values):
    kind = ctypes.CFUNCTYPE(ctypes.c_double, ctypes.POINTER(ctypes.c_double))
    return kind(pointer.address)((ctypes.c_double * len(values))(*values))


@pytest.mark.parametrize("text", FORMULAS)
def test_a_formula_is_machine_code_and_right(text):
    pointer = function_pointer(component_functions(Expression(text), TURN)[0], 3)
    assert pointer.compiled
    for values in np.random.default_rng(5).uniform(-1, 1, (20, 3)):
        assert called(pointer, *values) == pytest.approx(FORMULAS[text](*values), rel=1e-14)
        assert Expression(text)(*values) == pytest.approx(FORMULAS[text](*values), rel=1e-14)


def test_components_and_states_are_compiled_too():
    parts = component_functions(Components((Expression("state1*t"), Expression("2*x"))), ["t", "x", "y", "vx", "vy", "state1"])
    assert all(function_pointer(part, 6).compiled for part in parts)


def test_a_function_made_anew_is_the_machine_code_that_is_there():
    def made(slope, power=2):
        return lambda t: slope * t**power

    first, again, other = (function_pointer(made(k), 1) for k in (3.0, 3.0, 4.0))
    assert first is again and first.compiled and called(other, 2.0) == 16.0
    assert called(function_pointer(made(3.0, 3), 1), 2.0) == 24.0


def test_a_function_with_an_import_is_called_back():
    def sine(x):
        import math

        return math.sin(x)

    pointer = function_pointer(sine, 1)
    assert not pointer.compiled and called(pointer, 0.5) == pytest.approx(0.479425538604203)


FACTOR = 2.0


def scaled(t):
    return FACTOR * t


def test_what_a_function_uses_may_change(monkeypatch):
    """Kept by value: a global, a function that it calls, an attribute of a law."""
    calls = lambda t: scaled(t) + 1.0  # noqa: E731
    before = function_pointer(calls, 1)
    monkeypatch.setitem(globals(), "FACTOR", 5.0)
    after = function_pointer(calls, 1)
    assert (called(before, 1.0), called(after, 1.0)) == (3.0, 6.0)

    class Spring:
        stiffness = 0.0

        def force(self, x):
            return self.stiffness * x

    spring = Spring()
    spring.stiffness = 10.0
    first = function_pointer(spring.force, 1)
    assert function_pointer(spring.force, 1) is first and first.compiled
    spring.stiffness = 20.0
    assert (called(first, 1.0), called(function_pointer(spring.force, 1), 1.0)) == (10.0, 20.0)


def test_the_newest_functions_are_kept(monkeypatch):
    monkeypatch.setattr(compiled, "MOST_KEPT", 3)
    monkeypatch.setattr(compiled, "_COMPILED", {})

    def made(k):
        return lambda t: k * t

    for k in range(5):
        function_pointer(made(float(k)), 1)
    assert len(compiled._COMPILED) == 3


def test_what_is_no_arithmetic_calls_back():
    table = {0.0: 1.0}
    pointer = function_pointer(lambda t: table.get(t, 7.0), 1)
    assert not pointer.compiled and called(pointer, 0.0) == 1.0
    table[0.0] = 3.0
    assert called(function_pointer(lambda t: table.get(t, 7.0), 1), 0.0) == 3.0


def test_a_compiled_function_is_evaluated_at_many_arguments_by_its_machine_code():
    calls = []

    def brake(t, angle, speed):
        return -2.0 * speed * abs(angle) if 0.3 <= t < 0.5 else np.sin(t)

    columns = np.linspace(0, 1, 101), np.linspace(-1, 1, 101), np.linspace(3, 1, 101)
    assert evaluate_compiled(brake, columns) is None
    assert evaluate_compiled(lambda t: calls.append(t) or 1.0, columns[:1]) is None
    assert function_pointer(brake, 3).compiled
    assert evaluate_compiled(brake, columns) == pytest.approx([brake(*each) for each in zip(*columns, strict=True)], rel=1e-15)
