"""The laws of `buckler.mbs.laws` as rows of the kernel's table; any other law by the address of its compiled methods."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from typing import Any

from buckler.mbs import laws
from buckler.mbs.laws.compiled import method_pointer
from buckler.mbs.spectral import tables as k
from buckler.mbs.spectral.builder import Builder

Row = tuple[int, Sequence[float]]


@singledispatch
def normal_row(law: Any) -> Row | None:
    """Kind and numbers of a normal law; None if it is not one of this package's."""
    return None


@normal_row.register
def _(law: laws.HysteresisLaw) -> Row | None:
    return k.POWER, (law.stiffness, law.exponent, law.chi)


@normal_row.register
def _(law: laws.Hertz) -> Row | None:
    return k.POWER, (law.stiffness, law.exponent, 0.0)


@normal_row.register
def _(law: laws.KelvinVoigt) -> Row | None:
    return k.VOIGT, (law.stiffness, law.damping)


@normal_row.register
def _(law: laws.Impact) -> Row | None:
    return k.IMPACT, (law.stiffness, law.exponent, law.damping, law.damping_depth)


@singledispatch
def friction_row(law: Any) -> Row | None:
    """Kind and numbers of a friction law; None if it is not one of this package's."""
    return None


@friction_row.register
def _(law: laws.NoFriction) -> Row | None:
    return k.SMOOTH, ()


@friction_row.register
def _(law: laws.Coulomb) -> Row | None:
    return k.COULOMB, (law.dynamic, law.v_reg, law.viscous)


@friction_row.register
def _(law: laws.AdamsFriction) -> Row | None:
    return k.ADAMS, (law.static, law.dynamic, law.v_s, law.v_d)


@friction_row.register
def _(law: laws.Ambrosio) -> Row | None:
    return k.AMBROSIO, (law.dynamic, law.v0, law.v1)


@friction_row.register
def _(law: laws.Threlfall) -> Row | None:
    return k.THRELFALL, (law.dynamic, law.v0)


@friction_row.register
def _(law: laws.Stribeck) -> Row | None:
    return k.STRIBECK, (law.static, law.dynamic, law.v_stribeck, law.exponent, law.v_reg, law.viscous)


@friction_row.register
def _(law: laws.LuGre) -> Row | None:
    stiff, damp = law.bristle_stiffness, law.bristle_damping
    return k.LUGRE, (law.static, law.dynamic, law.v_stribeck, 2.0, stiff, damp, law.viscous)


def add_normal(builder: Builder, law: Any) -> int:
    """Add a normal law to the table."""
    row, key = (normal_row(law) if _ours(law) else None), _key("normal", law)
    if row is not None:
        return builder.add_law(key, *row)
    about = f"the normal law {type(law).__name__}"
    return builder.add_law(key, k.NORMAL_CALLED, (), [method_pointer(law, "force", 3)], about)


def add_friction(builder: Builder, law: Any) -> int:
    """Add a friction law to the table."""
    row, key = (friction_row(law) if _ours(law) else None), _key("friction", law)
    if row is not None:
        return builder.add_law(key, *row)
    about = f"the friction law {type(law).__name__}"
    if isinstance(law, laws.BristleLaw):
        pointers = [method_pointer(law, "coefficient", 2), method_pointer(law, "after", 3)]
        return builder.add_law(key, k.BRISTLE_CALLED, (), pointers, about)
    return builder.add_law(key, k.COEFFICIENT_CALLED, (), [method_pointer(law, "coefficient", 1)], about)


def _ours(law: Any) -> bool:
    """Whether a law is this package's own, or a hysteresis law that changes nothing but chi: no derived class may differ."""
    kind = type(law)
    if isinstance(law, laws.HysteresisLaw):
        return kind.force is laws.HysteresisLaw.force
    return kind.__module__.startswith(laws.__name__)


def _key(role: str, law: Any) -> Any:
    try:
        hash(law)
    except TypeError:
        return role, id(law)
    return role, type(law), law
