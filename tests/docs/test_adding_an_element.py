"""The page on adding an element counts right: files of its own, and lines elsewhere that name it."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/how-to-add-an-element.md").read_text(encoding="utf-8")


def elsewhere(kind):
    """Number of lines of `mbs`, by file, that import, register, export or draw a kind; files of kinds may use each other."""
    function = kind.lower()
    named = re.compile(rf'["\s.]{kind}(?:$|[",:])|^    {function},|^def draw_{function}\(')
    kinds = {path.stem for path in (ROOT / "mbs/elements").glob("*.py")} - {"__init__"}
    found = {}
    for path in sorted((ROOT / "mbs").rglob("*.py")):
        lines = [line for line in path.read_text(encoding="utf-8").splitlines() if named.search(line)]
        if path.stem not in kinds and lines:
            found[path.relative_to(ROOT).as_posix()] = len(lines)
    return found


@pytest.mark.parametrize(("kind", "column", "module"), [("Gear", 1, "coupling"), ("Spring", 2, "spring")])
def test_what_adding_an_element_touches(kind, column, module):
    assert f"\nclass {kind}(" in (ROOT / f"mbs/elements/{module}.py").read_text(encoding="utf-8")
    rows = [row.split("|")[1:-1] for row in PAGE.splitlines() if row.startswith("| `mbs/")]
    promised = {re.findall(r"`(mbs/[\w/]+\.py)`", row[0])[0]: int(row[column]) for row in rows}
    assert elsewhere(kind) == {path: number for path, number in promised.items() if number}
    total = re.search(rf"`{kind}`\) \| 1[^|]* \| (\d+)", PAGE)
    assert int(total[1]) == sum(promised.values())
