"""Faults to plant in a file, one at a time: signs turned, comparisons turned, constants tenfold up and down."""

from __future__ import annotations

import ast
from dataclasses import dataclass
from pathlib import Path

SIGNS = {ast.Add: "-", ast.Sub: "+"}
COMPARISONS = {ast.Lt: ">", ast.Gt: "<", ast.LtE: ">=", ast.GtE: "<=", ast.Eq: "!=", ast.NotEq: "=="}
TEXTS = (ast.JoinedStr, ast.List, ast.Tuple, ast.Set, ast.Dict)
"""What a plus joins and does not add."""


@dataclass(frozen=True)
class Fault:
    """A change of one place of a file.

    Attributes
    ----------
    file : str
        From the root of the tree.
    line : int
    owner : str
        Function or method that holds it, as `name` or `Class.name`; empty outside of any.
    names : tuple of str
        Names that it gives a value to, outside of any function.
    kind, before, after : str
        'sign', 'comparison' or 'constant'; source of the place.
    start, end : int
        Place in the file, bytes.
    """

    file: str
    line: int
    owner: str
    names: tuple[str, ...]
    kind: str
    before: str
    after: str
    start: int
    end: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line} {self.owner or ', '.join(self.names)}: {self.before}  ->  {self.after}"

    def plant(self, text: bytes) -> bytes:
        """The file with it."""
        return text[: self.start] + self.after.encode() + text[self.end :]


class _Search(ast.NodeVisitor):
    def __init__(self, root: Path, path: Path) -> None:
        self.file, self.text = str(path.relative_to(root)), path.read_bytes()
        self.starts = [0]
        for line in self.text.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))
        self.found: list[Fault] = []
        self.scope: list[str] = []
        self.inside = False
        self.names: tuple[str, ...] = ()

    def place(self, node: ast.AST) -> tuple[int, int]:
        return (
            self.starts[node.lineno - 1] + node.col_offset,  # type: ignore[attr-defined]
            self.starts[node.end_lineno - 1] + node.end_col_offset,  # type: ignore[attr-defined]
        )

    def source(self, node: ast.AST) -> str:
        start, end = self.place(node)
        return self.text[start:end].decode()

    def add(self, node: ast.AST, kind: str, after: str) -> None:
        owner = ".".join(self.scope) if self.inside else ""
        start, end = self.place(node)
        self.found.append(
            Fault(self.file, node.lineno, owner, self.names, kind, self.source(node), after, start, end)  # type: ignore[attr-defined]
        )

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        outermost = not self.inside
        if outermost:
            self.scope.append(node.name)
        self.inside = True
        for part in [*node.args.defaults, *(d for d in node.args.kw_defaults if d), *node.body]:
            self.visit(part)
        if outermost:
            self.inside = False
            self.scope.pop()

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        self.scope.append(node.name)
        for part in node.body:
            self.visit(part)
        self.scope.pop()

    def visit_Assign(self, node: ast.Assign) -> None:
        self._given(node.targets, node.value)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        if node.value:
            self._given([node.target], node.value)

    def _given(self, targets: list[ast.expr], value: ast.expr) -> None:
        if not self.inside:
            self.names = tuple(each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name))
        self.visit(value)
        self.names = ()

    def visit_Raise(self, node: ast.Raise) -> None:
        """Words are not counted."""

    def visit_JoinedStr(self, node: ast.JoinedStr) -> None:
        """Nor here."""

    def visit_Subscript(self, node: ast.Subscript) -> None:
        self.visit(node.value)  # a place in an array that is moved raises nearly always

    def visit_UnaryOp(self, node: ast.UnaryOp) -> None:
        if isinstance(node.op, ast.USub):
            self.add(node, "sign", self.source(node.operand))
        self.visit(node.operand)

    def visit_BinOp(self, node: ast.BinOp) -> None:
        sides = (node.left, node.right)
        words = any(isinstance(s, TEXTS) or (isinstance(s, ast.Constant) and isinstance(s.value, str)) for s in sides)
        if type(node.op) in SIGNS and not words:
            left, right = (self.source(side) for side in sides)
            self.add(node, "sign", f"({left}) {SIGNS[type(node.op)]} ({right})")
        self.generic_visit(node)

    def visit_Compare(self, node: ast.Compare) -> None:
        if type(node.ops[0]) in COMPARISONS and len(node.ops) == 1:
            left, right = self.source(node.left), self.source(node.comparators[0])
            self.add(node, "comparison", f"{left} {COMPARISONS[type(node.ops[0])]} {right}")
        self.generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> None:
        if isinstance(node.value, int | float) and not isinstance(node.value, bool) and node.value != 0:
            self.add(node, "constant", repr(node.value * 10))
            if isinstance(node.value, float):
                self.add(node, "constant", repr(node.value / 10))
            elif abs(node.value) >= 10:
                self.add(node, "constant", repr(node.value // 10))


def faults(root: Path, path: Path) -> list[Fault]:
    """All faults that can be planted in a file of Python."""
    search = _Search(root, path)
    search.visit(ast.parse(search.text))
    return search.found
