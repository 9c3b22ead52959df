"""What a class declares of its fields is what it refuses: every number of every kind, on both sides of its range."""

import dataclasses
import re

import numpy as np
import pytest

from buckler.mbs import laws
from buckler.mbs.declare import (
    Declaration,
    Either,
    Quantity,
    RefusalError,
    Several,
    Vector,
    build,
    declarations,
    fields_written,
    known_kinds,
)
from buckler.mbs.elements import Rigid, Section
from buckler.mbs.units import parse_unit

BAR = Section(0.02, 0.005)
SOUND = {
    "point": "A", "first": "one", "second": "two", "name": "bar", "start": "A", "end": "B", "body": Rigid(BAR), "link": "one",
    "target": "one", "a": "A", "b": "B", "section": BAR, "law": laws.Hertz(1e6), "value": (1.0, 0.0), "v1": 5.0, "dynamic": 0.25,
}  # fmt: skip
ASIDE = {"Table", "Expression", "Components", "Motion", "MeshFile", "FreeModes"}  # no field of theirs is a number with a range
TRIED = np.array([-2e9, -3.0, -1.0, -0.7, -1e-7, 0.0, 1e-7, 0.3, 0.7, 1.0, 1.3, 3.0, 7.0, 20.0, 2e9])


def number(field: Declaration) -> Quantity | None:
    """What is declared of the number that may stand in a field."""
    forms = field.spec.specs if isinstance(field.spec, Either) else (field.spec,)
    return next((form for form in forms if isinstance(form, Quantity)), None)


def test_ranges_name_their_open_ends():
    assert Quantity("1", 0.0, 1.0, open_high=True).allowed == "0 to below 1"
    assert Quantity("1", high=1.0, open_high=True).allowed == "< 1"


@dataclasses.dataclass(frozen=True)
class Tabled:
    """A user's class with two tables, which may be None."""

    first: dict[str, float] | None = None
    second: dict[str, float] | None = dataclasses.field(default_factory=dict)


@dataclasses.dataclass(frozen=True)
class Refusing:
    """A user's class that refuses all values and does not say at which part."""

    def __post_init__(self) -> None:
        raise RefusalError("two loads act at one point")


@pytest.mark.parametrize(("name", "message"), [("", "two loads act"), ("loads", "loads: two loads act")])
def test_a_refusal_without_a_place_begins_with_the_path_of_the_table(name, message):
    with pytest.raises(ValueError, match=f"^{message}"):
        build(name, {}, {"Refusing": Refusing})


def test_a_table_differs_from_none():
    assert fields_written("", Tabled()) == {}
    assert fields_written("", Tabled({}, None)) == {"first": {}, "second": None}


def sound(name):
    """The least that a kind is made of."""
    own = {
        "Rigid": {"mass": 1.0, "inertia": 1.0},
        "Ramp": {"start": 1.0, "end": 2.0},
        "Piecewise": {"value": "sin(t)", "breaks": (0.0,)},
    }
    given = own.get(name, {})
    for key, field in declarations(known_kinds()[name]).items():
        if field.required and key not in given:
            given = given | {key: SOUND.get(key, 0.5)}
    return given


NUMBERS = [
    (name, key)
    for name, kind in known_kinds().items()
    if name not in ASIDE
    for key, field in declarations(kind).items()
    if number(field)
]


def beside(name, key):
    """Fields against which this one is checked, too: `static >= dynamic`."""
    fields = set(declarations(known_kinds()[name]))
    pairs = {("static", "dynamic"), ("v_d", "v_s"), ("v1", "v0")}
    return [b if a == key else a for a, b in pairs if key in (a, b) and {a, b} <= fields]


def test_kinds_are_known_but_for_bases():
    assert len(NUMBERS) > 90 and not {"Curve", "End", "Kernel", "HysteresisLaw"} & set(known_kinds())


@pytest.mark.parametrize(("name", "key"), NUMBERS)
def test_what_is_declared_is_what_is_refused_and_written(name, key):
    kind, given, field = known_kinds()[name], sound(name), number(declarations(known_kinds()[name])[key])
    others = beside(name, key)
    for x in TRIED:
        inside = field.low < x <= field.high or (x == field.low and not field.open_low)
        if others and x >= 0:
            continue  # the other one decides
        if x == 0 and (field.nonzero or key == "restitution"):
            continue
        try:
            made = kind(**given | {key: float(x)})
        except ValueError as error:
            assert not (inside and not others), f"{name}.{key} = {x:g} is refused, though nothing declares it: {error}"
            assert re.search(rf"\b{key}\b", str(error)) or others, error
        else:
            assert inside, f"{name}.{key} = {x:g} is taken, though [{field.low}, {field.high}] is declared"
            assert build("", fields_written("", made), {name: kind}) == made
    with pytest.raises(ValueError) as refused:
        kind(**given | {key: float("nan")})
    for unit in field.unit.split(" or "):
        parse_unit(unit.replace("^n", "^1.5"))
    if field.unit not in ("", "1") and "must lie in" in str(refused.value):
        assert str(refused.value).endswith(f"{field.unit}; {field.hint}" if field.hint else field.unit)


@pytest.mark.parametrize("spec", [Vector("m"), Several(Quantity("m"))], ids=["vector", "list"])
def test_a_set_is_no_list(spec):
    """It has no order: x and y, or the items, would change places from run to run."""
    with pytest.raises(ValueError, match=r"^place = .*must be (two numbers|a list)"):
        spec.read("place", {1.0, 2.0})
