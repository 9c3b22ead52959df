"""Public classes show an example that runs: elements, laws, solvers, results."""

import doctest
import inspect
import sys

import pytest

import buckler.mbs as mbs
from buckler.mbs import laws

PUBLIC = {name: getattr(room, name) for room in (mbs, laws) for name in room.__all__}
CLASSES = {thing for thing in PUBLIC.values() if inspect.isclass(thing)}
WITHOUT = {"FrictionLaw", "BristleLaw", "NormalLaw", "HysteresisLaw", "PowerLaw"}
"""Protocols and bases: nobody makes one."""


@pytest.mark.parametrize("room", sorted({thing.__module__ for thing in CLASSES}))
def test_examples_run(room):
    module = sys.modules[room]
    test = doctest.DocTestRunner()
    for example in doctest.DocTestFinder().find(module, extraglobs=PUBLIC):
        test.run(example)
    assert test.failures == 0


def test_every_public_class_has_one():
    assert {thing.__name__ for thing in CLASSES if ">>>" not in thing.__doc__} == WITHOUT
