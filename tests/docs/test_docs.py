"""The Python blocks of the documentation run as written; those of one page share their names."""

import re
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from pkgutil import resolve_name

import numpy as np
import pytest

from buckler.mbs import Mechanism, elements, simulate

ROOT = Path(__file__).resolve().parents[2]
HOW_TO = "bring-your-own-mechanism load-a-mechanism clamp-and-guide look rest-and-vibrate run-an-ensemble fit-and-design"
PAGES = ("README.md", "docs/tutorial.md", *(f"docs/how-to-{name}.md" for name in HOW_TO.split()), "docs/theory-elastica.md")
ALL_PAGES = ("README.md", *sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md")), "docs/paper/paper.md")
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
    left = run_page(page)
    if "simulate" in left:  # the last run of the page
        assert left["result"].ok, left["result"].message
        assert left["result"].energy_balance < 6e-2  # 1 %, and a twentieth that the check grants vibrations nobody sees


TREE = re.compile(r"\b(?:mbs|studies|elastica|tests)/[\w/.-]+\.py\b|(?<=`)(?:mbs|studies|elastica|tests)/[\w./-]+(?=`)")
DOTTED = re.compile(r"\bbuckler((?:\.[A-Za-z_]\w*)+)")
TO_COME = "euler_load"
"""The study that its reader writes."""


@pytest.mark.parametrize(
    "page", [*(page for page in ALL_PAGES if "upgrade" not in page), "CONTRIBUTING.md"]
)  # names what is gone
def test_files_and_names_in_a_page_are_there(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    assert [path for path in set(TREE.findall(text)) if not (ROOT / path).exists() and TO_COME not in path] == []
    dead = []
    for name in {m for m in DOTTED.findall(text) if m.split(".")[1] in ("mbs", "studies", "elastica") and TO_COME not in m}:
        try:
            resolve_name(f"buckler{name}")
        except (ImportError, AttributeError):
            dead.append(name)
    assert dead == []


def test_readme_gives_the_force_it_promises(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    run_page("README.md")
    force, exact = re.search(r"180 degrees: (\S+) N; exact elastica (\S+) N", capsys.readouterr().out).groups()
    assert float(force) == pytest.approx(float(exact), rel=2e-3)
    assert (tmp_path / "run.xdmf").exists()


README = (ROOT / "README.md").read_text(encoding="utf-8")
FILES = re.findall(r"^```toml\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def test_six_lines_move():
    first = FILES[0]
    result = simulate(Mechanism.from_dict(tomllib.loads(first)), 5.0)
    assert first.count("\n") <= 6 and result.status == "OK" and np.ptp(result.signals["B.y"]) > 0.1
    assert result.error.until == 5.0 and result.error["B.x"] < 1e-2


def test_the_file_in_the_readme_is_a_part_of_the_example():
    _, by_lengths, shown = map(tomllib.loads, FILES)
    example = Mechanism.load(ROOT / "studies" / "own" / "examples" / "stephenson.toml")
    assert Mechanism.from_dict(by_lengths) == replace(example, joints=Mechanism.from_dict(by_lengths).joints)
    assert set(example.joints) == set(Mechanism.from_dict(by_lengths).joints)
    whole = tomllib.loads((ROOT / "studies" / "own" / "examples" / "six-bar.toml").read_text(encoding="utf-8"))
    assert shown["points"].items() <= whole["points"].items()
    assert shown["joints"][0] in whole["joints"] and shown["stops"] == whole["stops"] and shown["drives"] == whole["drives"]
    assert shown["links"]["rocker"] == whole["links"]["rocker"]
    strip, full = shown["links"]["strip"], whole["links"]["strip"]
    assert (strip["start"], strip["end"]) == (full["start"], full["end"])
    assert strip["body"]["imperfection"] == full["body"]["imperfection"]
    assert strip["body"]["section"].items() <= full["body"]["section"].items()


@pytest.mark.parametrize("page", ALL_PAGES)
def test_links_lead_somewhere(page):
    path = ROOT / page
    links = re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", path.read_text(encoding="utf-8"))
    assert [link for link in links if not link.startswith("made/") and not (path.parent / link).exists()] == []


TOCTREE = re.compile(r"^```\{toctree\}\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_the_site_leads_to_every_page():
    pages = {path.stem: path.read_text(encoding="utf-8") for path in (ROOT / "docs").glob("*.md")}
    listed = [
        line
        for text in pages.values()
        for tree in TOCTREE.findall(text)
        for line in tree.splitlines()
        if line and not line.startswith((":", "made/"))
    ]
    assert sorted([*listed, "index"]) == sorted(pages)  # each once, and none that is not there


@pytest.mark.slow
def test_the_site_is_built_without_warnings(tmp_path):
    pytest.importorskip("sphinx")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", str(ROOT / "docs"), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr  # -W: a warning is an error
    assert (tmp_path / "made" / "gallery.html").exists()


EXCERPT = re.compile(r"^<!-- (\S+) -->\n```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def test_excerpts_are_those_of_the_files():
    found = EXCERPT.findall((ROOT / "docs/how-to-add-an-element.md").read_text(encoding="utf-8"))
    assert len(found) >= 5
    assert [path for path, text in found if text not in (ROOT / path).read_text(encoding="utf-8")] == []


ABSTRACT = {"Body", "Coupling", "Joint", "KINDS", "Load"}
"""Names that nobody writes in a mechanism."""
ELSEWHERE = ("docs/how-to-add-a-clearance-joint.md",)
"""Pages whose code other tests run."""


@pytest.mark.parametrize("kind", sorted(set(elements.__all__) - ABSTRACT))
def test_every_kind_is_in_the_reference_and_in_code_that_runs(kind):
    word = re.compile(rf"\b{kind}\b")
    code = "".join(block for page in (*PAGES, *ELSEWHERE) for block in BLOCK.findall((ROOT / page).read_text(encoding="utf-8")))
    assert word.search(code), "no page whose code is run uses it"
    assert word.search((ROOT / "docs/reference.md").read_text(encoding="utf-8"))
