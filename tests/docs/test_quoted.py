"""Numbers that the documents quote: each is that of its file, and a new run of the quick items gives them again."""

import json
import re
from pathlib import Path

import pytest

from buckler.studies.evidence import command, items, pages
from buckler.studies.evidence.pages import Quoted
from buckler.studies.kit.cli import main

FILE = {
    "status": "OK",
    "message": "",
    "work": {"wall_s": 12.0},
    "metrics": {
        "peak": {"value": 156.3283, "unit": "N"},
        "ratio": {"value": 0.59912, "unit": "1", "error": 0.005},
        "force": {"value": 1.7245, "unit": "N", "exact": 1.7246, "error": 6e-5},
    },
    "tables": [{"headers": ["a", "b"], "rows": [[1.23456, None], ["x", -2e-5]]}],
}


def test_every_page_quotes_its_files_and_every_file_is_quoted():
    assert [line for path in pages.pages() for line in pages.stale(path)] == []
    used = {number.item for path in pages.pages() for number in pages.quoted(path.read_text(encoding="utf-8"))}
    assert used == {path.stem for path in items.FILES.glob("*.json")}
    assert used <= set(items.ITEMS)


def test_every_number_of_the_paper_names_its_file_or_row():
    paper = items.ROOT / "docs" / "paper"
    _, _, body = (paper / "paper.md").read_text(encoding="utf-8").split("---\n", 2)
    sources = re.findall(r"^@\w+\{(\w+),", (paper / "paper.bib").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(set(re.findall(r"[\[;] ?@(\w+)", body))) == sorted(sources)
    rows = re.findall(r"<!-- validation: (.*?) -->", body)
    validation = (items.ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    assert rows and [row for row in rows if row not in validation] == []
    sentences = re.split(r"(?<=[.!?])\s+(?=[A-Z])", body)
    assert [each for each in sentences if re.search(r"\d", each) and "<!--" not in each] == []


@pytest.mark.parametrize("name", sorted(items.ITEMS))
def test_a_file_says_how_it_was_made(name):
    content = items.stored(name)
    assert content["provenance"]["commit"] and content["work"]["wall_s"] > 0
    given = content["provenance"]["parameters"]
    for setting, value in items.ITEMS[name].given.items():
        assert given[setting] == (list(value) if isinstance(value, tuple) else value)
    assert '"/' not in json.dumps(given)  # no place of anybody's machine


@pytest.mark.parametrize(
    ("what", "form", "text"),
    [
        ("peak", ".3g", "156"),
        ("peak", ".2e", "1.56e2"),
        ("peak", ".1f*1e-3", "0.2"),
        ("ratio", ".1f%", "59.9 %"),
        ("ratio", "±", "0.599 ± 0.003"),
        ("force@exact", ".4f", "1.7246"),
        ("force@error", ".0e", "6e-5"),
        ("work@wall_s", ".0f", "12"),
        ("peak", ".1f*1e-3~", "0.2"),
        ("table", "0", "\n| a | b |\n|---|---|\n| 1.235 |  |\n| x | −2e-5 |\n"),
    ],
)
def test_a_number_is_written_in_its_form(what, form, text):
    assert pages.written(Quoted("item", what, form, ""), lambda _: FILE) == text


def test_a_stale_number_is_told_and_filled(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("The peak is <!--= item peak .3g -->157<!--/--> N.\n")
    assert pages.stale(page, lambda _: FILE) == ["page.md: item peak: the page has '157', its file '156'"]
    page.write_text(pages.filled(page.read_text(), lambda _: FILE))
    assert page.read_text() == "The peak is <!--= item peak .3g -->156<!--/--> N.\n"
    assert pages.stale(page, lambda _: FILE) == []
    page.write_text("Of\n<!--= item peak .3g -->156<!--/--> N and <!--= item low .3g -->1<!--/--> N.\n")
    assert ["may not begin a line" in line or "has none" in line for line in pages.stale(page, lambda _: FILE)] == [True, True]


@pytest.mark.parametrize(
    ("what", "form", "text", "new", "differs"),
    [
        ("peak", ".3g", "156", 156.8, False),  # half a unit of the last digit
        ("peak", ".3g", "156", 156.9, True),
        ("ratio", "±", "0.599 ± 0.003", 0.606, False),  # two standard errors of the difference
        ("ratio", "±", "0.599 ± 0.003", 0.610, True),
        ("force", ".4f", "1.7245", 1.7246, True),  # a distance from an exact value is no uncertainty
    ],
)
def test_a_new_run_that_differs_is_told(tmp_path, monkeypatch, what, form, text, new, differs):
    (tmp_path / "page.md").write_text(f"x <!--= item {what} {form} -->{text}<!--/-->\n")
    monkeypatch.setattr(command, "pages", lambda: [tmp_path / "page.md"])
    monkeypatch.setattr(command, "stored", lambda _: FILE)
    run = {**FILE, "metrics": {**FILE["metrics"], what: {**FILE["metrics"][what], "value": new}}}
    assert bool(command.differing("item", run)) == differs
    (tmp_path / "page.md").write_text(f"x <!--= item {what} {form}~ -->{text}<!--/-->\n")
    assert command.differing("item", run) == []  # a time
    assert command.differing("item", {**FILE, "status": "SUSPECT"})


@pytest.mark.parametrize(
    ("was", "now", "alike"),
    [("0.60 ± 0.02", "0.65 ± 0.02", True), ("0.60 ± 0.02", "0.67 ± 0.02", False), ("a", "b", False), (1.5, 1.5, True)],
)
def test_cells_of_tables_are_compared_by_their_errors(was, now, alike):
    assert command._alike(was, now) == alike


def test_the_quick_items_hold(tmp_path, capsys):
    assert main(argv=["evidence", "--check", "--quick", "--quiet", "--out", str(tmp_path)]) == 0, capsys.readouterr().err
    made = {path.parent.name for path in Path(tmp_path).glob("evidence/*/evidence.json")}
    assert made == {name for name, item in items.ITEMS.items() if item.quick and not item.needs_data}
