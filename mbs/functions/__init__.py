"""Functions that users give: formulas and tables as values, where they jump, and how fields read them."""

from .values import TURN, Components, Expression, Integral, Slope, Table, has_user_code, kinks, numbers_of

__all__ = ["TURN", "Components", "Expression", "Integral", "Slope", "Table", "kinks", "numbers_of", "has_user_code"]
