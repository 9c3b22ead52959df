"""Functions given by users: formulas and tables as values, the search for their jumps and kinks, and fields for them."""

from .looking import Argument, Called, Looks, edges_along, locate, looking, looks_or
from .piecewise import Piecewise
from .values import TURN, Components, Expression, Integral, Table, has_user_code, kinks, numbers_of

__all__ = [
    "TURN", "Argument", "Called", "Components", "Expression", "Integral", "Looks", "Piecewise", "Table", "edges_along",
    "has_user_code", "kinks", "locate", "looking", "looks_or", "numbers_of",
]  # fmt: skip
