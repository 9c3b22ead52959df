"""Hostile input: any field of any mechanism replaced by anything. It runs, or one clear line says what is wrong.

Nothing hangs, and nothing is left behind that changes the next run.
"""

import math
from dataclasses import fields, is_dataclass, replace
from functools import cache

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from simulations import pendulum

from buckler.mbs import Exudyn, Spectral, Status, simulate
from buckler.studies.kit.drawn import FAMILIES, draw

PATIENCE = 2.0
"""Longest time of a run, s; what is beyond it by more than as much again hangs."""
ODD = [
    math.nan, math.inf, -math.inf, 0, -1, -0.0, 1e-300, 1e300, 10**400, 1e12, 1e-12, True, None, "x", "", b"x", [], (), {},
    (0, 0), [1, 2, 3], 1j, object(), float, (math.nan, 0.0), "A", "ground", 2.5, np.float64(-1.0), np.array([1.0, 2.0]),
    abs, "é\n",
]  # fmt: skip
VALUES = st.sampled_from(ODD) | st.floats() | st.integers() | st.text(max_size=3) | st.lists(st.floats(), max_size=3)


def places(value, at=()):
    """Where something can be put in a mechanism, to any depth."""
    if is_dataclass(value) and not isinstance(value, type):
        inner = [(f.name, getattr(value, f.name)) for f in fields(value) if f.init]
    elif isinstance(value, tuple | list):
        inner = list(enumerate(value))
    elif hasattr(value, "items"):
        inner = [(("key", k), v) for k, v in value.items()]
    else:
        return
    for k, v in inner:
        yield (*at, k)
        yield from places(v, (*at, k))


def put(value, at, new):
    """The same with something else at a place; every dataclass on the way is made, and checked, again."""
    if not at:
        return new
    head, *rest = at
    if isinstance(head, str):
        return replace(value, **{head: put(getattr(value, head), rest, new)})
    if isinstance(head, tuple):
        return {**value, head[1]: put(value[head[1]], rest, new)}
    return tuple(put(v, rest, new) if k == head else v for k, v in enumerate(value))


def one_clear_line(text):
    """Whether a sentence of an error is one line that a person can read, and begins with what it is about."""
    assert 12 <= len(text) <= 400 and "\n" not in text and "Traceback" not in text, text


def survives(family, number, share, value, scale=None):
    """Put a value somewhere in a drawn mechanism, or scale a number there, and run what comes of it."""
    made = draw(0, number, (family,))
    everywhere = list(places(made.mechanism))
    at = everywhere[min(len(everywhere) - 1, int(share * len(everywhere)))]
    if scale is not None:
        here = made.mechanism
        for head in at:
            here = getattr(here, head) if isinstance(head, str) else here[head[1]] if isinstance(head, tuple) else here[head]
        value = here * scale if isinstance(here, float) else value
    try:
        result = simulate(put(made.mechanism, at, value), made.duration / 5, timeout=PATIENCE)
    except ValueError as error:
        one_clear_line(str(error))
        return
    assert result.status is not Status.ENGINE_ERROR, result.message
    if not result.ok:
        one_clear_line(result.message.partition("; ")[0])


HOSTILE = {
    "family": st.sampled_from(list(FAMILIES)), "number": st.integers(0, 10**6), "share": st.floats(0, 1), "value": VALUES,
    "scale": st.none() | st.sampled_from([10.0**k for k in (-9, -6, -3, 3, 6, 9)]),
}  # fmt: skip
QUIET = {"deadline": None, "database": None, "suppress_health_check": list(HealthCheck)}


@cache
def sound():
    """A run that must not depend on what ran before it."""
    return simulate(pendulum(1.0), 0.5, solver=Exudyn())


@settings(max_examples=100, derandomize=True, **QUIET)
@given(**HOSTILE)
def test_anything_anywhere_runs_or_is_named(family, number, share, value, scale):
    sound()
    survives(family, number, share, value, scale)


def test_nothing_of_it_is_left_behind():
    """Bit for bit, after all of the above."""
    before, after = sound(), simulate(pendulum(1.0), 0.5, solver=Exudyn())
    assert set(before.signals) == set(after.signals)
    for name, values in before.signals.items():
        assert (values == after.signals[name]).all(), name


@pytest.mark.parametrize("name", ["duration", "accuracy", "timeout", "shapes", "solver", "mechanism"])
def test_anything_as_an_argument_of_a_run(name):
    given = {"mechanism": pendulum(1.0), "duration": 1e-3}
    for value in [*ODD, [math.nan], [[1]], ["x"]]:
        try:
            result = simulate(**({"timeout": PATIENCE} | given | {name: value}))
        except ValueError as error:
            one_clear_line(str(error))
        else:
            ended = (Status.OK, Status.SUSPECT, Status.TOO_MANY_STEPS, Status.TIMED_OUT, Status.NEWTON_DIVERGED)
            assert result.status in ended, (name, value)


@pytest.mark.parametrize("kind", [Exudyn, Spectral])
def test_anything_as_a_setting(kind):
    for name in [f.name for f in fields(kind)]:
        for value in ODD:
            try:
                made = kind(**{name: value})
            except ValueError as error:
                one_clear_line(str(error))
            else:
                assert simulate(pendulum(1.0), 1e-3, solver=made, timeout=PATIENCE).status is not Status.ENGINE_ERROR


def test_odd_values_at_every_place_are_taken_or_refused():
    """At places of a mechanism of each family, without a run."""
    dice = np.random.default_rng(5)
    for family in sorted(FAMILIES):
        mechanism = draw(5, 0, (family,)).mechanism
        for at in places(mechanism):
            for value in dice.choice(len(ODD), 4, replace=False):
                try:
                    put(mechanism, at, ODD[value])
                except ValueError as error:
                    one_clear_line(str(error))
