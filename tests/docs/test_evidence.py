"""Evidence: the pages quote what is stored, a new run gives it again, and every item of both papers has a verdict."""

import re
import shlex

import evidence
import pytest

from buckler.studies.kit.running import find_study, make_parser

RESULT = {
    "status": "OK",
    "work": {"wall_s": 12.0},
    "metrics": {
        "peak": {"value": 156.3283, "unit": "N"}, "ratio": {"value": 0.59912, "unit": "1", "error": 0.005},
        "force": {"value": 1.7245, "unit": "N", "exact": 1.7246, "error": 6e-5},
    },
    "tables": [{"headers": ["a", "b"], "rows": [[1.23456, None], ["0.60 ± 0.02", -2e-5]]}],
}  # fmt: skip


def test_pages_have_the_stored_numbers_and_every_stored_result_is_quoted():
    used = set()
    for path in evidence.pages():
        text = path.read_text(encoding="utf-8")
        assert evidence.fill(text) == text, f"{path.name}: run docs/tools/evidence.py"
        used |= {study for study, *_ in evidence.NUMBER.findall(text)}
    files = {path.stem for path in (evidence.DOCS / "evidence").glob("*.json")}
    assert used == files == set(evidence.ITEMS)


def test_every_sentence_of_the_paper_with_a_number_names_its_source():
    _, _, body = (evidence.DOCS / "paper" / "paper.md").read_text(encoding="utf-8").split("---\n", 2)
    sources = re.findall(r"^@\w+\{(\w+),", (evidence.DOCS / "paper" / "paper.bib").read_text(encoding="utf-8"), re.MULTILINE)
    assert sorted(set(re.findall(r"[\[;] ?@(\w+)", body))) == sorted(sources)
    rows = re.findall(r"<!-- ([\w-]+): (.*?) -->", body)
    assert rows and [row for page, row in rows if row not in (evidence.DOCS / f"{page}.md").read_text(encoding="utf-8")] == []
    sentences = re.split(r"(?<=[.!?])\s+(?=[A-Z])", body)
    assert [each for each in sentences if re.search(r"\d", each) and "<!--" not in each] == []


@pytest.mark.parametrize("name", sorted(evidence.ITEMS))
def test_a_stored_result_was_made_with_the_options_of_its_item(name):
    made, options = evidence.stored(name), evidence.ITEMS[name].get("options", "")
    assert made["provenance"]["commit"] and made["work"]["wall_s"] > 0
    found = find_study(evidence.ITEMS[name].get("study", name))
    parameters = found.parameters(make_parser(found, "run").read(shlex.split(options))).plain()
    for option in re.findall(r"--([a-z-]+)", options):
        value, setting = parameters[option.replace("-", "_")], option.replace("-", "_")
        assert made["provenance"]["parameters"][setting] == (list(value) if isinstance(value, tuple) else value)


@pytest.mark.parametrize(
    ("metric", "form", "text"),
    [
        ("peak", ".3g", "156"), ("peak", ".2e", "1.56e2"), ("peak", ".1f*1e-3~", "0.2"), ("ratio", ".1f%", "59.9 %"),
        ("force@exact", ".4f", "1.7246"), ("force@error", ".0e", "6e-5"), ("work@wall_s", ".0f", "12"),
        ("table", "0", "\n| a | b |\n|---|---|\n| 1.235 |  |\n| 0.60 ± 0.02 | −2e-5 |\n"),
    ],
)  # fmt: skip
def test_a_number_is_written_in_its_format(metric, form, text):
    assert evidence.write_number(metric, form, RESULT) == text


def test_a_wrong_number_is_filled_or_named(monkeypatch):
    monkeypatch.setattr(evidence, "stored", lambda _: RESULT)
    page = "The peak is <!--= item peak .3g -->157<!--/--> N.\n"
    assert evidence.fill(page) == page.replace("157", "156")
    for text, message in (
        ("Of\n<!--= item peak .3g -->156<!--/-->", "begin a line"),
        ("a <!--= item low .3g -->1<!--/-->", "low"),
    ):
        with pytest.raises(ValueError, match=message):
            evidence.fill(text)


def test_quick_studies_give_their_stored_numbers(capsys):
    quick = (name for name, item in evidence.ITEMS.items() if item.get("quick"))
    assert evidence.main(["--check", *quick]) == 0, capsys.readouterr()


def rows(page):
    """Rows of the tables of a page whose second column is a verdict."""
    found, verdicts = [], False
    for line in (evidence.DOCS / page).read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip().strip("|").split(" | ")]
        if not line.startswith("|") or cells[1:2] == ["verdict"]:
            verdicts = line.startswith("|")
        elif verdicts and len(cells) > 2 and not line.startswith("|---"):
            found.append(cells[:3])
    return found


def numbers(pattern, texts):
    """Numbers behind a word such as Fig., with those within `2 to 5`, `2–5` and `(2)–(5)`."""
    found = set()
    for listed in (listed for text in texts for listed in re.findall(pattern, text)):
        found |= {int(x) for x in re.findall(r"\d+", listed)}
        for low, high in re.findall(r"(\d+)\)?\s*(?:to|–)\s*\(?(\d+)", listed):
            found |= set(range(int(low), int(high) + 1))
    return found


LIST = r"\s*((?:\d+(?:\s*(?:,|to|and|–)\s*)?)+)"


@pytest.mark.parametrize(("page", "figures"), [("evidence-slider-crank.md", 11), ("evidence-crank-rocker.md", 10)])
def test_every_figure_has_a_row_and_every_row_a_verdict(page, figures):
    found = rows(page)
    for item, verdict, source in found:
        assert verdict.startswith(("reproduced", "corrected", "open")), (item, verdict)
        assert source.strip(" |"), item
    assert numbers(r"Figs?\.?" + LIST, [item for item, *_ in found]) >= set(range(1, figures + 1))


def test_every_equation_and_table_of_the_first_paper_has_a_row():
    items = [item for item, *_ in rows("evidence-slider-crank.md")]
    assert numbers(r"^(\(\d+\)(?:–\(\d+\))?)", items) >= set(range(1, 14))
    assert numbers("Table" + LIST, items) >= {1, 2}
