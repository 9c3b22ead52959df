"""The Python blocks of the documentation run as written; those of one page share their names."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = (
    "README.md",
    "docs/tutorial.md",
    "docs/how-to-add-a-mechanism.md",
    "docs/how-to-bring-your-own-mechanism.md",
    "docs/how-to-load-a-mechanism.md",
    "docs/how-to-clamp-and-guide.md",
    "docs/how-to-look.md",
)
ALL_PAGES = ("README.md", *sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")))
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def run_page(page):
    """Run the blocks of a page in the current directory; what they leave behind, by name."""
    text = (ROOT / page).read_text(encoding="utf-8")
    names = {"__name__": "page"}
    for block in BLOCK.finditer(text):
        lines_before = text.count("\n", 0, block.start(1))
        code = compile("\n" * lines_before + block[1], page, "exec")  # so that a traceback names the line of the page
        exec(code, names)
    return names


@pytest.mark.parametrize("page", PAGES)
def test_blocks_run_and_end_well(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = run_page(page)["result"]
    assert result.ok, result.message
    assert result.energy_balance < 1e-2


def test_readme_gives_the_force_it_promises(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_page("README.md")
    force, exact = re.search(r"180 degrees: (\S+) N; exact elastica (\S+) N", capsys.readouterr().out).groups()
    assert float(force) == pytest.approx(float(exact), rel=2e-3)
    assert (tmp_path / "run.npz").exists()
    assert list((tmp_path / "paraview").iterdir())


@pytest.mark.parametrize("page", ALL_PAGES)
def test_links_lead_somewhere(page):
    path = ROOT / page
    links = re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", path.read_text(encoding="utf-8"))
    assert [link for link in links if not (path.parent / link).exists()] == []


EXCERPT = re.compile(r"^<!-- (\S+) -->\n```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_excerpts_are_those_of_the_files():
    found = EXCERPT.findall((ROOT / "docs/how-to-add-an-element.md").read_text(encoding="utf-8"))
    assert len(found) >= 5
    assert [path for path, text in found if text not in (ROOT / path).read_text(encoding="utf-8")] == []
