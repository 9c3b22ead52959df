"""The page on adding an element counts right: files of its own, and lines elsewhere that name it."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/how-to-add-an-element.md").read_text(encoding="utf-8")


def elsewhere(kind, module):
    """Number of lines of `mbs`, by file, that import, register, export or draw a kind; files of kinds may use each other."""
    named = re.compile(rf'["\s.]{kind}(?:$|[",:])|^from .*\.{module} import|^    {module},|^def {module}\(')
    kinds = {path.stem for path in (ROOT / "mbs/elements").glob("*.py")} - {"__init__"}
    found = {}
    for path in sorted((ROOT / "mbs").rglob("*.py")):
        lines = [line for line in path.read_text(encoding="utf-8").splitlines() if named.search(line)]
        if path.stem not in kinds and lines:
            found[path.relative_to(ROOT).as_posix()] = len(lines)
    return found


@pytest.mark.parametrize(("kind", "column", "own"), [("Gear", 1, 1), ("Spring", 2, 1)])
def test_what_adding_an_element_touches(kind, column, own):
    module = kind.lower()
    assert len(list((ROOT / "mbs").rglob(f"{module}.py"))) == own
    rows = [row.split("|")[1:-1] for row in PAGE.splitlines() if row.startswith("| `mbs/")]
    promised = {re.findall(r"`(mbs/[\w/]+\.py)`", row[0])[0]: int(row[column]) for row in rows}
    assert elsewhere(kind, module) == {path: number for path, number in promised.items() if number}
    total = re.search(rf"`{kind}`\) \| {own}[^|]* \| (\d+)", PAGE)
    assert int(total[1]) == sum(promised.values())
