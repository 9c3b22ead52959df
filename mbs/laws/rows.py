"""Laws as rows of the compiled table: kind and numbers of those of this package, addresses of compiled methods of any other."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import Protocol

from .. import laws
from . import table as k
from .compiled import Pointer, function_pointer

Known = Mapping[type, tuple[int, tuple[str, ...]]]


class Rows(Protocol):
    """A table of laws in the making."""

    def add_law(
        self, key: Hashable, kind: int, numbers: Sequence[float], pointers: Sequence[Pointer] = (), about: str = "", /
    ) -> int:
        """Add a row, or find the one kept under this key."""


NORMAL: Known = {
    laws.HysteresisLaw: (k.POWER, ("stiffness", "exponent", "chi")),
    laws.Hertz: (k.POWER, ("stiffness", "exponent")),
    laws.KelvinVoigt: (k.VOIGT, ("stiffness", "damping")),
    laws.Impact: (k.IMPACT, ("stiffness", "exponent", "damping", "damping_depth")),
}
RUBBING = ("static", "dynamic", "v_stribeck", "exponent")
FRICTION: Known = {
    laws.NoFriction: (k.SMOOTH, ()),
    laws.Coulomb: (k.COULOMB, ("dynamic", "v_reg", "viscous")),
    laws.AdamsFriction: (k.ADAMS, ("static", "dynamic", "v_s", "v_d")),
    laws.Ambrosio: (k.AMBROSIO, ("dynamic", "v0", "v1")),
    laws.Threlfall: (k.THRELFALL, ("dynamic", "v0")),
    laws.Stribeck: (k.STRIBECK, (*RUBBING, "v_reg", "viscous")),
    laws.LuGre: (k.LUGRE, (*RUBBING, "bristle_stiffness", "bristle_damping", "viscous")),
}
"""Kind of the row of a law of this package, and its numbers by name; an exponent that a law does not have is 2."""


def _row(law: object, rows: Known) -> tuple[int, list[float]] | None:
    """Kind and numbers of a law; None if it is not one of this package's."""
    found = next((rows[kind] for kind in type(law).__mro__ if kind in rows), None) if _ours(law) else None
    return found and (found[0], [getattr(law, name, 2.0) for name in found[1]])


def add_normal(builder: Rows, law: laws.NormalLaw) -> int:
    """Add a normal law to the table."""
    row, key = _row(law, NORMAL), _key("normal", law)
    if row is not None:
        return builder.add_law(key, *row)
    about = f"the normal law {type(law).__name__}"
    return builder.add_law(key, k.NORMAL_CALLED, (), [function_pointer(law.force, 3)], about)


def add_friction(builder: Rows, law: laws.FrictionLaw | laws.BristleLaw) -> int:
    """Add a friction law to the table."""
    row, key = _row(law, FRICTION), _key("friction", law)
    if row is not None:
        return builder.add_law(key, *row)
    about = f"the friction law {type(law).__name__}"
    if isinstance(law, laws.BristleLaw):
        pointers = [function_pointer(law.coefficient, 2), function_pointer(law.after, 3)]
        return builder.add_law(key, k.BRISTLE_CALLED, (), pointers, about)
    return builder.add_law(key, k.COEFFICIENT_CALLED, (), [function_pointer(law.coefficient, 1)], about)


def _ours(law: object) -> bool:
    """Return True for a law of this package, or a hysteresis law that changes nothing but chi; a derived class may differ."""
    kind = type(law)
    if isinstance(law, laws.HysteresisLaw):
        return type(law).force is laws.HysteresisLaw.force
    return kind.__module__.startswith(laws.__name__)


def _key(role: str, law: object) -> Hashable:
    try:
        hash(law)
    except TypeError:
        return role, id(law)
    return role, type(law), law
