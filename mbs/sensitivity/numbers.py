"""Numbers of a mechanism by their paths in its file, as `links.crank.length`, and mechanisms with other values of them.

A document is the content of a file: nested mappings and sequences. Its table `parameters` names numbers that other entries use in
formulas.
"""

import contextlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from typing import Any, NamedTuple, Self

from ..declare import Declaration, declarations
from ..documents.document import PARAMETERS, change, get, resolve
from ..documents.shorthand import substitute
from ..mechanism import Mechanism
from ..units import is_measured, parse_quantity, unit_of
from ..validate import short

Source = Mechanism | Mapping[str, Any] | Callable[..., Mechanism]
"""A mechanism, the content of its file, or a function that makes a mechanism from numbers."""


class Entry(NamedTuple):
    """Entry of a document: its declaration, if there is one, its value and its unit."""

    declaration: Declaration | None
    value: Any
    unit: str


def find_entry(document: Mapping[str, object], path: str) -> Entry:
    """Look up the entry at a path of a document, or its default; raise a ValueError if there is neither.

    A formula of parameters gives its value. A parameter itself is returned as it is written.
    """
    mechanism = Mechanism.from_dict(document)  # raises a ValueError if the document is wrong
    keys = resolve(document, path)
    is_parameter = keys[0] == PARAMETERS
    declaration = None if is_parameter else _find_declaration(mechanism, keys, path)
    try:
        value = get(document, path)
    except KeyError:
        if declaration is None:
            raise ValueError(f"{path}: not in the file") from None
        value = declaration.default
    if is_parameter:
        return Entry(None, value, unit_of(value) if isinstance(value, str) and is_measured(value) else "")
    if isinstance(value, str) and PARAMETERS in document:
        value = get(substitute(document), path)  # a text that is no formula stays as it is
    return Entry(declaration, value, _find_unit(mechanism, keys, declaration.spec.unit, value) if declaration else "")


def _find_unit(mechanism: Mechanism, keys: Sequence[str | int], declared: str, value: Any) -> str:
    """Return the unit of an entry from the declared one.

    The fields of a drive declare two units, such as `rad/s or m/s`. A text with a unit, such as '5 mm/s', decides between them.
    A plain number has the first unit if a link is driven, the second if a point is.
    """
    alternatives = declared.split(" or ")
    for unit in alternatives if isinstance(value, str) else ():
        with contextlib.suppress(ValueError):  # the text is no quantity of this unit: try the next
            parse_quantity(value, unit)
            return unit
    if keys[0] == "drives" and isinstance(keys[1], int) and len(alternatives) == 2:
        of_link, of_point = alternatives
        return of_point if mechanism.drives[keys[1]].target in mechanism.points else of_link
    # the one list of a link without a declared unit: a place of a carried point, as `links.coupler.carries.P[0]`
    is_carried_place = keys[0] == "links" and isinstance(keys[-1], int) and not declared
    return "m" if is_carried_place else declared


def _find_declaration(mechanism: Mechanism, keys: Sequence[str | int], path: str) -> Declaration | None:
    """Find the declaration of the field at a path, whose parts are `keys`; None for the key `kind`, which names a class."""
    part: Any = mechanism
    declaration: Declaration | None = None
    for key in keys:
        if part is mechanism.links and isinstance(key, str):  # a file may name links or list them
            part = {link.name: link for link in mechanism.links}
        if isinstance(key, int) or isinstance(part, Mapping):
            try:
                part = part[key]
            except (KeyError, IndexError):
                raise ValueError(f"{path}: not in the file") from None
        elif key == "kind":
            return None
        else:
            fields = declarations(type(part)) if is_dataclass(part) else {}
            if key not in fields:
                raise ValueError(f"{path}: '{key}' is not known there; known: {', '.join(fields) or 'nothing'}")
            part, declaration = getattr(part, key), fields[key]
    return declaration


@dataclass(frozen=True)
class Family:
    """Mechanisms that differ in some numbers, with `values` [SI] and `units` of these numbers in the given mechanism.

    `make` makes a mechanism from other values. The units of a function's arguments are not known, ''.
    """

    make: Callable[[Mapping[str, float]], Mechanism]
    values: dict[str, float]
    units: dict[str, str]

    @classmethod
    def of(cls, source: Source, names: Iterable[str], arguments: Mapping[str, float] | None = None) -> Self:
        """Make a family by paths of numbers, or by names of a function's arguments.

        `arguments` are those with which a function makes the given mechanism. Those in `names` vary, and are the `values`.
        """
        if not isinstance(source, Mechanism | Mapping):
            function, fixed = source, dict(arguments or {})
            given = {name: float(value) for name, value in fixed.items() if name in names}
            return cls(lambda values: function(**{**fixed, **values}), given, dict.fromkeys(names, ""))
        document = source.to_dict() if isinstance(source, Mechanism) else source
        given, units = {}, dict[str, str]()
        for name in names:
            _, value, units[name] = find_entry(document, name)
            with contextlib.suppress(ValueError):  # a text that is no number remains, and is refused
                value = parse_quantity(value, units[name]) if isinstance(value, str) else value
            if isinstance(value, bool) or not isinstance(value, int | float):
                raise ValueError(f"{name} = {short(value)}: no number; name a number of the mechanism")
            given[name] = float(value)
        return cls(lambda values: Mechanism.from_dict(change(document, dict(values))), given, units)
