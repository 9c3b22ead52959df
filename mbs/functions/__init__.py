"""Users' functions: formulas and tables as values, the search for their jumps and kinks, and fields for them."""

from .edge_memory import Argument, Called, EdgeMemory, current_memory, step_ends, use_memory
from .piecewise import Piecewise
from .values import TURN, Components, Expression, Integral, Table, component_functions, has_user_code, kinks

__all__ = [
    "TURN", "Argument", "Called", "Components", "EdgeMemory", "Expression", "Integral", "Piecewise", "Table", "current_memory",
    "step_ends", "has_user_code", "kinks", "component_functions", "use_memory",
]  # fmt: skip
