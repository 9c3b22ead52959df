"""The page of a sweep: what it holds, that it needs no network, and what a real browser makes of it."""

import json
import re
import shlex

import pytest
import sweep_toy
from chromium import browser
from own_file import PENDULUM, metrics
from sweep_toy import Parameters

from buckler.mbs import Mechanism
from buckler.studies.kit.cli import main
from buckler.studies.own.sweep import sweep as mechanism_sweep
from buckler.studies.sweeping import report as pages
from buckler.studies.sweeping.command import shared
from buckler.studies.sweeping.sweep import sweep

SHORT = {**PENDULUM, "run": {"duration": "20 ms", "measure": ["min(A.y)"]}}


def content_of(path):
    text = path.read_text(encoding="utf-8")
    return json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.DOTALL)[1])


def test_the_page_holds_the_rows_of_the_table(toy):
    toy("--vary", "length=0.1,10", "--vary", "ending=fine,fails", "--noise", "0")
    found = content_of(toy.page)
    assert (found["status"], found["repeats"]) == ("FAILED", 1)
    assert [parameter["name"] for parameter in found["parameters"]] == ["length", "ending"]
    assert found["metrics"] == [{"name": "strut.force", "unit": "N"}, {"name": "strut.time", "unit": "s"}]
    assert [row["v"] for row in found["rows"]] == [[0.1, "fine"], [0.1, "fails"], [10, "fine"], [10, "fails"]]
    assert [row["s"] for row in found["rows"]] == ["OK", "TIMED_OUT"] * 2
    assert found["rows"][0]["m"] == [pytest.approx(2), pytest.approx(1 / 1.1)]
    assert found["rows"][2]["m"][1] is None  # not a number there
    assert found["rows"][1]["w"] == "after 1 s"
    text = toy.page.read_text(encoding="utf-8")
    assert "<title>\u25b2 FAILED: toy</title>" in text
    assert "http" not in text and re.findall(r'<(?:script|link|img|iframe)[^>]*(?:src|href)="([^"]*)"', text) == ["data:,"]


def test_repeats_are_means_with_standard_errors(toy):
    toy("--vary", "length=0,1", "--repeat", "4", "--noise", "1")
    row = content_of(toy.page)["rows"][1]
    assert (row["k"], row["seed"]) == (4, 0)
    assert 0.05 < row["e"][0] < 3 and abs(row["m"][0] - 11) < 4 * row["e"][0]


def test_a_page_may_hold_fewer_points_than_the_store(toy, monkeypatch):
    monkeypatch.setattr(pages, "MOST", 3)
    toy("--vary", "length=0:1:5")
    found = content_of(toy.page)
    assert len(found["rows"]) == 3 and found["facts"][-1] == ["left out", "2 points; the store has them"]


def test_words_of_a_single_run_are_kept():
    given = "--models strut --vary a=1 --measure 'max(A.y)' --store x --retry -q --duration=1 --samples=3 --seed 4"
    assert shared(shlex.split(given)) == ["--models", "strut", "--measure", "max(A.y)", "--duration=1"]


def test_reports_of_the_cases_are_linked_and_the_command_runs_one(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pendulum.json").write_text(json.dumps(SHORT))
    words = ["--vary", "links.arm.body.mass=1kg,2kg", "--workers", "0", "-q", "--measure", "end(A.y)"]
    assert main(argv=["sweep", "pendulum.json", *words, "--reports"]) == 0
    path = tmp_path / "results" / "pendulum-sweep" / "report.html"
    found = content_of(path)
    links = [row["p"] for row in found["rows"]]
    assert len(set(links)) == 2 and all("motion" in (path.parent / link).read_text(encoding="utf-8") for link in links)
    command = [*shlex.split(found["command"])[3:], "--set", "links.arm.body.mass=2.0", "-q"]
    assert command[:2] == ["run", "pendulum.json"]
    assert main(argv=command) == 0
    alone = metrics(tmp_path / "results" / "pendulum")
    assert alone["metrics"]["end(A.y)"]["value"] == pytest.approx(found["rows"][1]["m"][0], rel=1e-6)
    assert main(argv=["sweep", "pendulum.json", *words]) == 0  # the store knows nothing of reports
    assert [row["p"] for row in content_of(path)["rows"]] == links


def test_a_sweep_from_python_writes_its_page(tmp_path):
    document = {name: each for name, each in PENDULUM.items() if name != "run"}
    places = {"links.arm.body.mass": [1.0, 2.0]}
    words = {"measure": "end(A.y)", "duration": 0.02, "report": tmp_path / "report.html"}
    rows = mechanism_sweep(Mechanism.from_dict(document), places, **words)
    found = content_of(tmp_path / "report.html")
    assert [row["m"][0] for row in found["rows"]] == [pytest.approx(row.value("end(A.y)"), rel=1e-6) for row in rows]
    assert found["parameters"][0]["unit"] == "kg" and found["places"] and found["status"] == "OK"


def test_a_study_that_sweeps_another_has_its_page(toy):
    cases = [Parameters(length=x, order=7) for x in (0.25, 0.5)]
    text = pages.study_page("wide", "toy", cases, ("length",), sweep(sweep_toy, cases, workers=0))
    found = json.loads(re.search(r'<script id="data" type="application/json">(.*?)</script>', text, re.DOTALL)[1])
    assert found["command"].endswith("run toy --order 7")
    assert [row["m"][0] for row in found["rows"]] == [3.5, 6.0] and found["facts"][0] == ["sweeps", "toy"]


@pytest.mark.browser
def test_a_browser_draws_sorts_and_selects(toy):
    toy("--vary", "length=0.1:10:5:log", "--vary", "speed=1,2,3", "--vary", "ending=suspect,fine,raises")
    with browser() as tab:
        tab.open(toy.page)
        assert tab.errors == []
        assert [url for url in tab.requests if not url.startswith(("file:", "data:", "about:"))] == []
        assert tab.run("report.spots().length") == 15
        assert tab.run("report.state().chosen") == 2 and "no stiffness left" in tab.run(
            "$('numbers').textContent"
        )  # a failed one
        top, bottom = (tab.run(f"document.getElementById('{name}').getBoundingClientRect().top") for name in ("alert", "map"))
        assert top < bottom and "30 of 45 cases not OK" in tab.run("$('alert').textContent")
        tab.run("report.set({fixed: {2: 1}})")
        drawn = "[...$('picture').getContext('2d').getImageData(0, 0, 300, 300).data].reduce((a, b) => (a * 31 + b) % 65521, 7)"
        before = tab.run(drawn)
        tab.run("""(() => { const s = report.spots()[4], box = $('picture').getBoundingClientRect();
            $('picture').dispatchEvent(new MouseEvent('click', {clientX: box.left + s.x, clientY: box.top + s.y})); })()""")
        assert tab.run("report.state().chosen") == tab.run("report.spots()[4].k") != 2
        assert tab.run(drawn) != before
        tab.run("document.querySelector('[data-column=\"4\"]').click(); document.querySelector('[data-column=\"4\"]').click()")
        forces = tab.run("[...document.querySelectorAll('#cases tbody tr')].map((line) => line.children[4].textContent)")
        known = [float(text) for text in forces if text]
        assert known == sorted(known, reverse=True) and len(known) == 30 and forces[-1] == ""
        tab.run("$('odd').click()")
        assert tab.run("document.querySelectorAll('#cases tbody tr').length") == 30
        assert tab.run("report.command(0)").endswith("run toy --length 0.1 --speed 1 --ending suspect")
