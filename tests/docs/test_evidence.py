"""The evidence pages: every equation, table and figure of both papers has a row, and every row a verdict."""

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
VERDICTS = ("reproduced", "corrected", "open")


def rows(page):
    """First cell, verdict and evidence of every row of a page whose second column is a verdict."""
    found, verdicts = [], False
    for line in (DOCS / page).read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split(" | ")]
        if not line.startswith("|"):
            verdicts = False
        elif len(cells) > 2 and cells[1] == "verdict":
            verdicts = True
        elif verdicts and not line.startswith("|---"):
            found.append(cells[:3])
    return found


def numbers(words, texts):
    """Numbers that follow a word such as Fig. or Figs, ranges with to or – included."""
    found = set()
    for text in texts:
        for listed in re.findall(rf"(?:{words})\s*((?:\d+(?:\s*(?:,|to|and|–)\s*)?)+)", text):
            parts = [int(x) for x in re.findall(r"\d+", listed)]
            found |= set(parts)
            for low, high in re.findall(r"(\d+)\s*(?:to|–)\s*(\d+)", listed):
                found |= set(range(int(low), int(high) + 1))
    return found


@pytest.mark.parametrize(
    ("page", "figures", "least"), [("evidence-slider-crank.md", 11, 30), ("evidence-crank-rocker.md", 10, 30)]
)
def test_every_figure_has_a_row_and_every_row_a_verdict(page, figures, least):
    found = rows(page)
    assert len(found) >= least
    for item, verdict, evidence in found:
        assert verdict.startswith(VERDICTS), (item, verdict)
        assert evidence.strip(" |"), item
    assert numbers("Figs?\\.?", [item for item, *_ in found]) >= set(range(1, figures + 1))


def test_every_equation_and_table_of_the_first_paper_has_a_row():
    items = [item for item, *_ in rows("evidence-slider-crank.md")]
    equations = set()
    for item in items:
        for low, high in re.findall(r"^\((\d+)\)(?:–\((\d+)\))?", item):
            equations |= set(range(int(low), int(high or low) + 1))
    assert equations >= set(range(1, 14))
    assert numbers("Table", items) >= {1, 2}
