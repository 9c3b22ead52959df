"""Formulas such as `2*sin(3*t)`: their check, and Python functions made from them.

The syntax is that of Python. Allowed are numbers, + - * / **, parentheses, `pi`, `e`, `FUNCTIONS`, and variables by name.
"""

import ast
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from ..declare.spec import did_you_mean
from ..geometry import Array
from ..validate import short

LONGEST = 2000
"""Largest number of characters of a formula; chosen."""
DEEPEST = 60
"""Largest depth of nesting of a formula, below the limit of Python's parser."""
CONSTANTS = {"pi": math.pi, "e": math.e}
"""Constants by their names in formulas."""


def _step(x: float, begin: float, low: float, end: float, high: float) -> float:
    """Return the ADAMS function STEP: a cubic from low at begin to high at end, constant outside."""
    fraction = min(max((x - begin) / (end - begin), 0.0), 1.0)
    return low + (high - low) * fraction * fraction * (3.0 - 2.0 * fraction)


def _step_of_arrays(x: Array, begin: Array, low: Array, end: Array, high: Array) -> Array:
    fraction = np.clip((x - begin) / (end - begin), 0.0, 1.0)
    return low + (high - low) * fraction * fraction * (3.0 - 2.0 * fraction)


def _sign(x: float) -> float:
    return 1.0 if x > 0.0 else -1.0 if x < 0.0 else 0.0


FUNCTIONS: dict[str, tuple[Callable[..., float], int]] = {
    "sin": (math.sin, 1), "cos": (math.cos, 1), "tan": (math.tan, 1), "asin": (math.asin, 1), "acos": (math.acos, 1),
    "atan": (math.atan, 1), "atan2": (math.atan2, 2), "sinh": (math.sinh, 1), "cosh": (math.cosh, 1), "tanh": (math.tanh, 1),
    "exp": (math.exp, 1), "log": (math.log, 1), "sqrt": (math.sqrt, 1), "abs": (abs, 1), "sign": (_sign, 1),
    "min": (min, 2), "max": (max, 2), "step": (_step, 5),
}  # fmt: skip
"""Functions by their names in formulas, with the number of arguments."""


class NoFormulaError(ValueError):
    """Error of a text that is no formula at all."""


def parse(text: str, variables: Iterable[str], functions: Mapping[str, object] = FUNCTIONS) -> ast.expr:
    """Parse a formula; a ValueError names the part that is not allowed.

    `functions` maps a name to a pair: the function, or a text about its use for messages, and the number of arguments.
    """
    if not isinstance(text, str):
        raise ValueError(f"formula = {short(text)}: must be text")
    if len(text) > LONGEST:
        raise ValueError(f"a formula of {len(text)} characters; allowed: {LONGEST}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        raise NoFormulaError(f"'{text}' is no formula{_syntax(text, error)}") from None
    _check(tree, {*variables, *CONSTANTS}, functions, 0)
    return tree


def _syntax(text: str, error: Exception) -> str:
    """Return the end of a message, which explains a syntax error of a formula."""
    if re.search(r"\d\s+[A-Za-z%]", text):
        return "; a formula has plain numbers, in SI, as 6.28 for 60 rpm"
    is_unclosed = "never closed" in str(error)  # Python's message; 'atan2(1, t' lacks a bracket, not a * before it
    if re.search(r"[\d)]\s*[A-Za-z(]", text) and not is_unclosed:
        return "; a product is written with *"
    return f": {error.msg.partition('. ')[0]}" if isinstance(error, SyntaxError) else ""


def _check(node: ast.expr, names: set[str], functions: Mapping[str, Any], depth: int) -> None:
    """Raise a ValueError for syntax or names that are not allowed, in a node of a syntax tree and all nodes below."""
    if depth > DEEPEST:
        raise ValueError(f"nested deeper than {DEEPEST} levels")
    inner: Sequence[ast.expr] = ()
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            if not abs(value) <= 1e308:  # near the largest float; 1e999 reads as inf
                raise ValueError("a number too large")
        case ast.Name(id=name):
            if name not in names:
                raise ValueError(f"unknown name '{name}'{did_you_mean(name, names)}; known: {', '.join(sorted(names))}")
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
            inner = (operand,)
        case ast.BinOp(op=operator, left=left, right=right):
            if not isinstance(operator, ast.Add | ast.Sub | ast.Mult | ast.Div | ast.Pow):
                raise ValueError("'^' is no power; write **" if isinstance(operator, ast.BitXor) else _not_allowed(node))
            inner = left, right
        case ast.Call(func=ast.Name(id=name), args=inner, keywords=[]):
            if name not in functions:
                raise ValueError(f"unknown function '{name}'{did_you_mean(name, functions)}; known: {', '.join(functions)}")
            use, count = functions[name]
            if len(inner) != count:
                advice = f": write {use}" if isinstance(use, str) else ""
                raise ValueError(f"{name} takes {count} arguments, not {len(inner)}{advice}")
        case _:
            raise ValueError(_not_allowed(node))
    for each in inner:
        _check(each, names, functions, depth + 1)


def _not_allowed(node: ast.expr) -> str:
    # 2(x + 1) is a call in Python, and 2,5 a tuple
    advice = {ast.Tuple: "; decimals are written with a point", ast.Call: "; a product is written with *"}
    return f"'{ast.unparse(node)[:60]}' is not allowed in a formula{advice.get(type(node), '')}"


def names_in(node: ast.AST) -> set[str]:
    """Return the variables of a parsed formula."""
    called = {id(call.func) for call in ast.walk(node) if isinstance(call, ast.Call)}
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and id(n) not in called} - set(CONSTANTS)


class _RealArithmetic(ast.NodeTransformer):
    """Transformer of whole numbers to floats, as huge powers of whole numbers take long, and of ** to `pow`, which is real."""

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        """Return a number as a float."""
        return ast.Constant(float(node.value))  # type: ignore[arg-type]  # `parse` allows numbers only

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        """Return a power as a call of pow, other operations unchanged."""
        self.generic_visit(node)
        return ast.Call(ast.Name("pow", ast.Load()), [node.left, node.right], []) if isinstance(node.op, ast.Pow) else node


def function_of(text: str, variables: Sequence[str], arrays: bool = False) -> Callable[..., Any]:
    """Make the Python function of a formula; its arguments are the variables, as arrays if `arrays` is true, or floats."""
    arguments = ast.arguments([], [ast.arg(name) for name in variables], None, [], [], None, [])
    tree = ast.fix_missing_locations(ast.Expression(ast.Lambda(arguments, _RealArithmetic().visit(parse(text, variables)))))
    of_arrays = {"min": np.minimum, "max": np.maximum, "step": _step_of_arrays}  # NumPy has the others under their names
    names: dict[str, object] = {"pow": math.pow, **{name: function for name, (function, _) in FUNCTIONS.items()}}
    if arrays:
        names = {name: of_arrays[name] if name in of_arrays else getattr(np, name) for name in names}
    # `__name__` becomes `__module__` of the function, which `laws.compiled` reads
    names |= {"__builtins__": {}, "__name__": __name__, **CONSTANTS}
    return eval(compile(tree, "<formula>", "eval"), names)  # `parse` has checked all of it
