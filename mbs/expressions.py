"""Formulas such as `2*sin(3*t)`: a strict reader of our own, their values, and their derivatives.

Allowed are numbers, + - * / **, parentheses, `pi`, `e`, the functions in `FUNCTIONS` and the variables named by whoever asks.
Everything else is refused by name; nothing is ever handed to Python's `eval`.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from .geometry import Array
from .validate import near, short

Values = tuple[Any, ...]
Compiled = Callable[[Values], Any]
LONGEST, DEEPEST = 2000, 60
"""Characters and levels of nesting."""
CONSTANTS = {"pi": math.pi, "e": math.e}


def _step(x: float, x0: float, h0: float, x1: float, h1: float) -> float:
    """ADAMS STEP: a cubic from h0 at x0 to h1 at x1, constant outside."""
    part = min(max((x - x0) / (x1 - x0), 0.0), 1.0)
    return h0 + (h1 - h0) * part * part * (3.0 - 2.0 * part)


def _sign(x: float) -> float:
    return float(x > 0) - float(x < 0)


FUNCTIONS: dict[str, tuple[Callable[..., float], int]] = {
    "sin": (math.sin, 1), "cos": (math.cos, 1), "tan": (math.tan, 1), "asin": (math.asin, 1), "acos": (math.acos, 1),
    "atan": (math.atan, 1), "atan2": (math.atan2, 2), "sinh": (math.sinh, 1), "cosh": (math.cosh, 1), "tanh": (math.tanh, 1),
    "exp": (math.exp, 1), "log": (math.log, 1), "sqrt": (math.sqrt, 1), "abs": (abs, 1), "sign": (_sign, 1),
    "min": (min, 2), "max": (max, 2), "step": (_step, 5),
}  # fmt: skip
"""Functions with the number of their arguments."""


def _steps(x: Array, x0: Array, h0: Array, x1: Array, h1: Array) -> Array:
    part = np.clip((x - x0) / (x1 - x0), 0.0, 1.0)
    return h0 + (h1 - h0) * part * part * (3.0 - 2.0 * part)


ELEMENTWISE: dict[Any, Callable[..., Any]] = {ast.Pow: np.power, "min": np.minimum, "max": np.maximum, "step": _steps}
"""What stands on arrays for a function or an operator; of the rest, numpy's of the same name."""
DERIVATIVES = {
    "sin": "cos(a)*da", "cos": "-sin(a)*da", "tan": "da/cos(a)**2", "asin": "da/sqrt(1-a**2)", "acos": "-da/sqrt(1-a**2)",
    "atan": "da/(1+a**2)", "atan2": "(b*da-a*db)/(a**2+b**2)", "sinh": "cosh(a)*da", "cosh": "sinh(a)*da",
    "tanh": "da/cosh(a)**2", "exp": "exp(a)*da", "log": "da/a", "sqrt": "da/(2*sqrt(a))", "abs": "sign(a)*da", "sign": "0",
    "min": "((1-sign(a-b))*da+(1+sign(a-b))*db)/2", "max": "((1+sign(a-b))*da+(1-sign(a-b))*db)/2",
    "step": "6*(e-c)*min(max((a-b)/(d-b),0),1)*(1-min(max((a-b)/(d-b),0),1))/(d-b)*da",
}  # fmt: skip
"""By the arguments a, b, c, d, e and their derivatives da, db; of `step` by its first argument only."""
OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Pow: math.pow,
}  # fmt: skip


def parse(text: str, variables: Iterable[str], functions: Mapping[str, object] = FUNCTIONS) -> ast.expr:
    """Read a formula.

    Raises
    ------
    ValueError
        If it is none, or holds what is not allowed; says what.
    """
    if not isinstance(text, str):
        raise ValueError(f"formula = {short(text)}: must be text")
    if len(text) > LONGEST:
        raise ValueError(f"a formula of {len(text)} characters; allowed: {LONGEST}")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ValueError(f"'{text}' is no formula") from None
    _check(tree, {*variables, *CONSTANTS}, functions, 0)
    return tree


def _check(node: ast.expr, names: set[str], functions: Mapping[str, Any], depth: int) -> None:
    """Refuse what is not on the list."""
    if depth > DEEPEST:
        raise ValueError(f"nested deeper than {DEEPEST} levels")
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            if not math.isfinite(_number(value)):
                raise ValueError("a number too large")
        case ast.Name(id=name):
            if name not in names:
                raise ValueError(f"unknown name '{name}'{_hint(name, names)}; known: {', '.join(sorted(names))}")
        case ast.UnaryOp(op=ast.UAdd() | ast.USub(), operand=operand):
            _check(operand, names, functions, depth + 1)
        case ast.BinOp(op=operator, left=left, right=right):
            if type(operator) not in OPERATORS:
                raise ValueError("'^' is no power; write **" if isinstance(operator, ast.BitXor) else _not_allowed(node))
            _check(left, names, functions, depth + 1)
            _check(right, names, functions, depth + 1)
        case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
            if name not in functions:
                raise ValueError(f"unknown function '{name}'{_hint(name, functions)}; known: {', '.join(functions)}")
            if len(arguments) != functions[name][1]:
                raise ValueError(f"{name} takes {functions[name][1]} arguments, not {len(arguments)}")
            for argument in arguments:
                _check(argument, names, functions, depth + 1)
        case _:
            raise ValueError(_not_allowed(node))


def _number(value: int | float) -> float:
    try:
        return float(value)
    except OverflowError:
        return math.inf


def _not_allowed(node: ast.expr) -> str:
    return f"'{ast.unparse(node)[:60]}' is not allowed in a formula"


def _hint(word: str, known: Iterable[str]) -> str:
    close = near(word, known)
    return f", did you mean {close[0]}?" if close else ""


def names_in(node: ast.AST) -> set[str]:
    """Variables of a formula."""
    called = {id(call.func) for call in ast.walk(node) if isinstance(call, ast.Call)}
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name) and id(n) not in called} - set(CONSTANTS)


def compiled(node: ast.expr, variables: tuple[str, ...], arrays: bool = False) -> Compiled:
    """A formula as a function of the tuple of its variables' values: floats, or arrays."""
    match node:
        case ast.Constant(value=value):
            constant = float(value)  # type: ignore[arg-type]  # _check has seen to it
            return lambda _v: constant
        case ast.Name(id=name) if name in variables:
            place = variables.index(name)
            return lambda v: v[place]
        case ast.Name(id=name):
            known = CONSTANTS[name]
            return lambda _v: known
        case ast.UnaryOp(op=sign, operand=operand):
            inner = compiled(operand, variables, arrays)
            return inner if isinstance(sign, ast.UAdd) else lambda v: -inner(v)
        case ast.BinOp(op=op, left=left, right=right):
            a, b, apply = compiled(left, variables, arrays), compiled(right, variables, arrays), OPERATORS[type(op)]
            apply = ELEMENTWISE.get(type(op), apply) if arrays else apply
            return lambda v: apply(a(v), b(v))
        case ast.Call(func=ast.Name(id=name), args=arguments):
            parts = [compiled(argument, variables, arrays) for argument in arguments]
            function = (ELEMENTWISE.get(name) or getattr(np, name)) if arrays else FUNCTIONS[name][0]
            if len(parts) == 1:
                (only,) = parts
                return lambda v: function(only(v))
            return lambda v: function(*[part(v) for part in parts])
    raise ValueError(_not_allowed(node))


# --- derivatives --------------------------------------------------------------------------------------------------------


def derivative(node: ast.expr, variable: str) -> ast.expr:
    """The derivative of a formula by one of its variables, with zeros and ones taken out."""
    if variable not in names_in(node):
        return ast.Constant(0)
    match node:
        case ast.Name():
            return ast.Constant(1)
        case ast.UnaryOp(op=operator, operand=operand):
            return ast.UnaryOp(operator, derivative(operand, variable))
        case ast.BinOp(op=operator, left=a, right=b):
            return _filled(_of_operator(operator, b, variable), {"a": a, "b": b}, variable)
        case ast.Call(func=ast.Name(id=name), args=arguments):
            if name == "step" and any(variable in names_in(argument) for argument in arguments[1:]):
                raise ValueError("step: only its first argument may vary where a derivative is needed")
            return _filled(DERIVATIVES[name], dict(zip("abcde", arguments, strict=False)), variable)
    raise ValueError(_not_allowed(node))


def _of_operator(operator: ast.operator, right: ast.expr, variable: str) -> str:
    match operator:
        case ast.Add():
            return "da+db"
        case ast.Sub():
            return "da-db"
        case ast.Mult():
            return "da*b+a*db"
        case ast.Div():
            return "da/b-a*db/b**2"
    return "a**b*(db*log(a)+b*da/a)" if variable in names_in(right) else "b*a**(b-1)*da"


def _filled(template: str, parts: Mapping[str, ast.expr], variable: str) -> ast.expr:
    """A template with its letters replaced by parts of a formula, and d and a letter by their derivatives."""

    class Fill(ast.NodeTransformer):
        def visit_Call(self, node: ast.Call) -> ast.AST:
            node.args = [self.visit(argument) for argument in node.args]
            return node

        def visit_Name(self, node: ast.Name) -> ast.AST:
            if node.id in parts:
                return parts[node.id]
            return derivative(parts[node.id[1:]], variable)

    return _simple(Fill().visit(ast.parse(template, mode="eval").body))


def _simple(node: object) -> Any:
    """Take out products with 0 and 1 and sums with 0."""
    if isinstance(node, ast.UnaryOp):
        node = ast.UnaryOp(node.op, _simple(node.operand))
        return ast.Constant(0) if _is(node.operand, 0) else node
    if not isinstance(node, ast.BinOp):
        return node
    a, b = _simple(node.left), _simple(node.right)
    match node.op:
        case ast.Add():
            return b if _is(a, 0) else a if _is(b, 0) else ast.BinOp(a, node.op, b)
        case ast.Sub():
            return a if _is(b, 0) else ast.UnaryOp(ast.USub(), b) if _is(a, 0) else ast.BinOp(a, node.op, b)
        case ast.Mult():
            if _is(a, 0) or _is(b, 0):
                return ast.Constant(0)
            return b if _is(a, 1) else a if _is(b, 1) else ast.BinOp(a, node.op, b)
        case ast.Div():
            return ast.Constant(0) if _is(a, 0) else ast.BinOp(a, node.op, b)
    return ast.BinOp(a, node.op, b)


def _is(node: ast.expr, value: int) -> bool:
    return isinstance(node, ast.Constant) and node.value == value
