"""Functions that users give: formulas and tables as values, where they jump, and how fields read them."""

from .values import TURN, Components, Expression, Integral, Slope, Table, kinks, numbers_of, own_functions

__all__ = ["TURN", "Components", "Expression", "Integral", "Slope", "Table", "kinks", "numbers_of", "own_functions"]
