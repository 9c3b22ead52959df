"""Numbers of a mechanism by their paths, as in its file: declaration, value, unit, and mechanisms with other values."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from typing import Any, NamedTuple

from ..declare import Declaration, declarations
from ..documents.document import PARAMETERS, change, get, steps
from ..documents.shorthand import substitute
from ..mechanism import Mechanism
from ..units import is_measured, parse_quantity, unit_of
from ..validate import short

Source = Mechanism | Mapping[str, Any] | Callable[..., Mechanism]
Make = Callable[[Mapping[str, float]], Mechanism]


class Standing(NamedTuple):
    """Entry of a document: its declaration if there is one, present value, unit."""

    about: Declaration | None
    now: Any
    unit: str


def standing(document: Mapping[str, object], path: str) -> Standing:
    """Look up the entry at a path of a document; raise a ValueError if there is none."""
    way = steps(document, path)
    about = _find_declaration(document, path)
    try:
        now = get(document, path)
    except KeyError:
        if about is None:
            raise ValueError(f"{path}: not in the file") from None
        now = about.default
    if way[0] == PARAMETERS:
        return Standing(None, now, unit_of(now) if isinstance(now, str) and is_measured(now) else "")
    if isinstance(now, str) and PARAMETERS in document:
        now = get(substitute(document), path)
    return Standing(about, now, _fitting(document, way, about.spec.unit, now) if about else "")


def _fitting(document: Mapping[str, object], way: Sequence[str | int], unit: str, now: Any) -> str:
    """Choose among the units of an entry, as `rad/s or m/s` of a drive, by its value or by what is driven."""
    for each in unit.split(" or ") if isinstance(now, str) else ():
        with contextlib.suppress(ValueError):
            parse_quantity(now, each)
            return each
    if way[0] == "drives" and isinstance(way[1], int) and " or " in unit:
        made = Mechanism.from_dict(document)
        return unit.split(" or ")[made.drives[way[1]].target in made.points]
    is_position = way[0] == "links" and isinstance(way[-1], int)  # of a point on a link
    return unit or ("m" if is_position else "")


def _find_declaration(document: Mapping[str, object], path: str) -> Declaration | None:
    """Find the declaration of the field at a path."""
    found: Any = Mechanism.from_dict(document)
    about: Declaration | None = None
    way = steps(document, path)
    for step in way if way[0] != PARAMETERS else ():
        if way[0] == "links" and found.__class__ is tuple and isinstance(step, str):
            found = {link.name: link for link in found}
        if isinstance(step, int) or isinstance(found, Mapping):
            try:
                found = found[step]
            except (KeyError, IndexError):
                raise ValueError(f"{path}: not in the file") from None
        elif step == "kind":
            return None
        else:
            found, about = _field(found, step, path)
    return about


def _field(found: object, name: str, path: str) -> tuple[object, Declaration | None]:
    fields = declarations(type(found)) if is_dataclass(found) else {}
    if name in fields:
        return getattr(found, name), fields[name]
    known = ", ".join(fields) or "nothing"
    raise ValueError(f"{path}: '{name}' is not known there; known: {known}")


@dataclass(frozen=True)
class Family:
    """Mechanisms that differ in some numbers: `make` one from these by name; present values in SI, units."""

    make: Make
    values: dict[str, float]
    units: dict[str, str]

    @classmethod
    def of(cls, mechanism: Source, names: Iterable[str], given: Mapping[str, float]) -> Family:
        """Make the family of a mechanism whose numbers at some paths vary, or of a function of some arguments that makes one.

        A mapping is the content of a file; paths are its own, as `links.crank.length`. `given` are the present values of a
        function's arguments. A ValueError names a path without a number.
        """
        if not isinstance(mechanism, Mechanism | Mapping):
            function = mechanism
            return cls(lambda values: function(**values), {name: float(given[name]) for name in names}, dict.fromkeys(names, ""))
        document = mechanism.to_dict() if isinstance(mechanism, Mechanism) else mechanism
        found, units = {}, {}
        for name in names:
            _, now, units[name] = standing(document, name)
            with contextlib.suppress(ValueError):
                now = parse_quantity(now, units[name]) if isinstance(now, str) else now
            if isinstance(now, bool) or not isinstance(now, int | float):
                raise ValueError(f"{name} = {short(now)}: no number; name a number of the mechanism")
            found[name] = float(now)
        return cls(lambda values: Mechanism.from_dict(change(document, dict(values))), found, units)
