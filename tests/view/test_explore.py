"""The page with sliders: what it answers, to whom, and that it moves in a browser."""

import json
import re
import threading
import time
import urllib.error
import urllib.request
from base64 import b64decode
from pathlib import Path

import numpy as np
import pytest
from chromium import browser

from buckler.mbs import Mechanism, simulate
from buckler.studies.kit.cli import main
from buckler.studies.own import explore
from buckler.studies.own.explore import ANSWERS, OMITTED, Explorer, server
from buckler.studies.own.files import open_file, varied_numbers

EXAMPLES = Path(__file__).resolve().parents[2] / "studies" / "own" / "examples"
MASS = "links.lower.body.mass"


@pytest.fixture
def served(tmp_path):
    path = Mechanism.load(EXAMPLES / "pendulum.toml").save(tmp_path / "pendulum.toml")
    file, changes = open_file(path, ["gravity[1]=-5"], "0.5"), {"gravity[1]": -5}
    made, address = server(Explorer(path, file, {MASS: (0.1, 1.0), "links.upper.body.mass": None}, changes))
    thread = threading.Thread(target=made.serve_forever, kwargs={"poll_interval": 0.05})
    thread.start()
    yield address, tmp_path
    made.shutdown()
    made.server_close()
    thread.join()


def track(found, point):
    """Places of a point in all pictures of an answer."""
    words, motion = np.frombuffer(b64decode(found["store"]), dtype="<u2"), found["motion"]

    def column(entry):
        start, low, step = entry
        return np.full(motion["count"], low) if start < 0 else low + step * words[start : start + motion["count"]].astype(float)

    return np.stack([column(entry) for entry in motion["frames"][motion["names"].index(point)][:2]], axis=1)


def post(address, name, values, **headers):
    asked = urllib.request.Request(f"{address}{name}", json.dumps(values).encode(), headers)
    with urllib.request.urlopen(asked, timeout=900) as answer:
        return json.loads(answer.read())


def test_numbers_move_the_mechanism_and_are_saved_beside_the_file(served):
    address, folder = served
    first, second = (post(address, "move", {MASS: mass}) for mass in (0.5, 0.9))
    assert first["status"] == "OK"
    lower = Mechanism.load(folder / "pendulum.toml").link("lower")
    joint, end = ([track(each, point) for each in (first, second)] for point in (lower.start, lower.end))
    assert end[0][0] == pytest.approx(end[1][0], abs=1e-3) and np.abs(end[0][-1] - end[1][-1]).max() > 0.01
    assert np.hypot(*(end[0] - joint[0]).T) == pytest.approx(0.5, abs=1e-3)
    assert {mark[0] for mark in first["motion"]["marks"]} >= {"Outline", "Label", "Arrow"}  # as the report draws it
    judged = post(address, "judge", {MASS: 0.9})
    assert judged["error"] < 1e-2 and judged["checks"] and all(row["error"] >= 0 for row in judged["readings"])
    assert post(address, "save", {MASS: 0.9}) == {"saved": str(folder / "pendulum-1.toml")}
    saved = Mechanism.load(folder / "pendulum-1.toml")
    assert saved.link("lower").body.mass == 0.9 and saved.gravity == (0.0, -5.0)  # the mechanism that the page shows
    assert Mechanism.load(folder / "pendulum.toml").link("lower").body.mass == 0.5
    assert "mass" in post(address, "move", {MASS: -1})["wrong"]
    assert post(address, "move", {"gravity[1]": 1.0}) == {"wrong": "gravity[1]: has no slider"}


def explorer(free):
    return Explorer(EXAMPLES / "pendulum.toml", open_file(EXAMPLES / "pendulum.toml", duration="0.5"), free, changes={})


def test_a_move_without_a_compiler_is_one_run(monkeypatch):
    monkeypatch.setattr(explore, "has_compiler", lambda: False)
    runs = []

    def simulate_and_keep(*arguments, **options):
        runs.append(simulate(*arguments, **options))
        return runs[-1]

    monkeypatch.setattr(explore, "simulate", simulate_and_keep)
    explorer({MASS: None}).move({MASS: 0.5})
    assert np.isnan(runs[0].error.motion) and "runs" not in runs[0].work


def test_the_next_change_does_not_wait_for_the_error_of_the_last_one(monkeypatch):
    made, begun, looks = explorer({MASS: None}), threading.Event(), []

    def slow(*_, progress, **__):  # a run of a minute that tells where it is
        begun.set()
        for k in range(6000):
            looks.append(k)
            progress(k / 6000)
            time.sleep(0.01)

    monkeypatch.setattr("buckler.studies.own.explore.simulate", slow)
    monkeypatch.setitem(ANSWERS, "move", lambda explorer, values: {"moved": True})
    answers = []
    judge = threading.Thread(target=lambda: answers.append(made.answer("judge", {})))
    judge.start()
    assert begun.wait(60)
    assert made.answer("move", {}) == {"moved": True}
    judge.join(60)
    assert answers == [{"late": True}] and len(looks) < 6000


@pytest.mark.parametrize(
    ("free", "message"),
    [
        ({MASS: (1.0, 2.0)}, r"links\.lower\.body\.mass = 0\.5 kg: must lie in \[1, 2\] kg"),
        ({"gravity[0]": None}, r"gravity\[0\] = 0: has no range of its own; give one, as --free gravity\[0\]=LOW:HIGH"),
    ],
)
def test_a_slider_has_a_range_that_its_number_lies_in(free, message):
    with pytest.raises(ValueError, match=message):
        explorer(free)


def test_wrong_words(served, capsys, monkeypatch):
    address, folder = served
    monkeypatch.chdir(folder)
    for words, message in (
        (["--port", address.split(":")[2].split("/")[0]], "--port .*: Address already in use"),
        (["--free", f"{MASS}=2kg:1kg"], "low must be less than high"),
        (["--free", f"{MASS}=1kg,2kg"], "write PATH=LOW:HIGH"),
    ):
        assert main(argv=["explore", "pendulum.toml", "--no-browser", *words]) == 2
        assert re.search(message, capsys.readouterr().err)


def test_a_guess_of_a_place_gets_no_slider(tmp_path):
    path = Mechanism.load(EXAMPLES / "dwell-six-bar.toml").save(tmp_path / "numbers.toml")
    paths = varied_numbers(open_file(path), OMITTED)[1]
    assert "links.crank.length" in paths and not [name for name in paths if "near" in name]


def test_nobody_else_gets_an_answer(served):
    address, _ = served
    root = address.rsplit("/", 2)[0]
    for bad in (f"{root}/", f"{root}/guess/"):
        with pytest.raises(urllib.error.HTTPError, match="404"):
            urllib.request.urlopen(bad, timeout=10)
    with pytest.raises(urllib.error.HTTPError, match="404"):
        post(address, "move", {}, Host="example.org")
    assert address.startswith("http://127.0.0.1:")


@pytest.mark.browser
def test_the_page_in_a_browser(served):
    address, _ = served
    with browser() as page:
        page.call("Page.navigate", url=address)
        page.wait("!!window.explore && window.explore.answers > 0", 900)
        page.run("document.getElementById('links.lower.body.mass').focus()")
        page.press("ArrowRight")
        page.wait("window.explore.answers > 1 && !!window.explore.state().ghost")
        assert page.run("window.explore.state().values['links.lower.body.mass'] > 0.5")
        page.wait("window.explore.judged > 0", 60)
        assert page.run("document.querySelectorAll('#measures tbody tr').length > 0 && plots[0].plot.before.length === 1")
        for width in (390, 1280):
            page.call("Emulation.setDeviceMetricsOverride", width=width, height=800, deviceScaleFactor=1, mobile=width < 500)
            assert page.run("document.documentElement.scrollWidth") <= width
            top = page.run("document.getElementById('scene').getBoundingClientRect().top")
            assert 0 <= top < 300 and page.run("document.getElementById('scene').clientHeight") > 200
        page.run("document.getElementById('links.lower.body.mass').focus()")
        page.press(" ", "Space")  # while the slider has the focus
        assert page.run("!window.explore.state().playing")
        assert not page.errors and all(url.startswith((address, "data:", "about:")) for url in page.requests)
