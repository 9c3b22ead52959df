"""Imports of the source's files."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]


def sources(package):
    return sorted((ROOT / package).rglob("*.py"))


def imports(path, with_types=True):
    """List what a file imports, wherever in it, as dotted names; without what types alone need, if asked."""
    tree, below, found = ast.parse(path.read_text(encoding="utf-8")), ["buckler", *path.relative_to(ROOT).parent.parts], set()
    checks = [node for node in ast.walk(tree) if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING"]
    aside = set() if with_types else {id(inner) for node in checks for inner in ast.walk(node)}
    for node in (node for node in ast.walk(tree) if id(node) not in aside):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = below[: len(below) - node.level + 1] if node.level else []
            found |= {".".join([*base, *filter(None, [node.module]), alias.name]) for alias in node.names}
        elif isinstance(node, ast.Call) and getattr(node.func, "id", getattr(node.func, "attr", "")) == "import_module":
            found |= {arg.value for arg in node.args if isinstance(arg, ast.Constant)}
    return found
