"""The grammar of random mechanisms: what it draws is valid, the seed's own, of every kind, and fits into a file."""

import pytest

from buckler.mbs.declare import known_kinds
from buckler.mbs.elements import KINDS, Body
from buckler.mbs.mechanism import Mechanism
from buckler.studies.kit.drawn import EVERYTHING, FAMILIES, draw


def kinds(mechanism):
    """Types of its elements, their bodies and drives' speeds, and of the laws of contacts and friction."""
    parts = [part for name in KINDS for part in getattr(mechanism, name)]
    parts += [link.body for link in mechanism.links] + [drive.speed for drive in mechanism.drives]
    return {type(each) for part in parts for each in (part, getattr(part, "law", None), getattr(part, "friction", None))}


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_draws_valid_mechanisms_the_same_ones_for_the_same_seed(family):
    for number in range(25):
        one, again, other = (draw(seed, number, (family,)) for seed in (5, 5, 6))
        assert 0 < one.duration == again.duration and one.name == f"{family} 5.{number}"
        assert one.mechanism == again.mechanism != other.mechanism
        assert Mechanism.from_dict(one.mechanism.to_dict()) == one.mechanism


def test_families_take_turns_and_a_mechanism_does_not_depend_on_which():
    assert [draw(2, k, ("free", "kinks")).name for k in range(3)] == ["free 2.0", "kinks 2.1", "free 2.2"]
    assert draw(2, 1, ("free", "kinks")).mechanism == draw(2, 1, ("kinks",)).mechanism
    assert [draw(2, k).name.rpartition(" ")[0] for k in range(len(FAMILIES))] == list(FAMILIES)


def test_the_whole_grammar_has_every_kind_of_element_and_body_and_most_laws():
    found = set().union(*(kinds(draw(1, k, EVERYTHING).mechanism) for k in range(40 * len(EVERYTHING))))
    assert found >= {kind for kind in known_kinds().values() if issubclass(kind, (*KINDS.values(), Body))}
    named = {kind.__name__ for kind in found}
    assert named >= {"CarvalhoMartins", "KelvinVoigt", "HuntCrossley", "Impact", "Hertz", "Flores", "GuideFriction"}
    assert named >= {"NoFriction", "Coulomb", "AdamsFriction", "Ambrosio", "Threlfall", "Stribeck", "LuGre"}
    assert named >= {"float", "Ramp", "Table"}
