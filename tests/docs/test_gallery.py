"""The gallery: each script runs, asserts its physical number, and leaves a result of which a page can be made."""

import re
import runpy
from pathlib import Path

import pytest

from buckler.mbs.view.report import page

SCRIPTS = sorted((Path(__file__).resolve().parents[2] / "docs" / "gallery").glob("*.py"))
SLOW = {"net_of_strips", "uncertain_contact_force", "two_causes_told_apart"}
"""Scripts that take more than some seconds."""


def test_the_site_shows_every_script():
    order = re.search(r"^ORDER = \((.*?)^\)", (SCRIPTS[0].parents[1] / "pages.py").read_text(), re.MULTILINE | re.DOTALL)[1]
    assert sorted(re.findall(r'"(\w+)"', order)) == [script.stem for script in SCRIPTS]


@pytest.mark.parametrize(
    "script", [pytest.param(path, marks=[pytest.mark.slow] * (path.stem in SLOW), id=path.stem) for path in SCRIPTS]
)
def test_it_gives_its_number(script, capsys):
    text = script.read_text(encoding="utf-8")
    assert "\nassert " in text
    left = runpy.run_path(str(script))
    assert left["result"].ok, left["result"].message
    assert left["result"].movie.time[-1] == pytest.approx(left["result"].time[-1])
    assert len(page(left["result"], script.stem)) < 2_200 * max(1000, len(left["result"].signals))  # bytes
    title = left["__doc__"].partition("\n")[0]
    assert title.startswith("A ") and title.endswith(".") and capsys.readouterr().out.count("\n") >= 1
