"""The page with sliders: what it answers, to whom, and that it moves in a browser."""

import json
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from chromium import browser

from buckler.mbs import Mechanism
from buckler.studies.own.explore import Explorer, server
from buckler.studies.own.turning import opened

EXAMPLES = Path(__file__).resolve().parents[2] / "studies" / "own" / "examples"
MASS = "links.lower.body.mass"


@pytest.fixture
def served(tmp_path):
    path = Mechanism.load(EXAMPLES / "pendulum.toml").save(tmp_path / "pendulum.toml")
    document = Mechanism.load(path).to_dict()
    made, address = server(Explorer(path, document, 0.5, {MASS: (0.1, 1.0), "links.upper.body.mass": None}))
    thread = threading.Thread(target=made.serve_forever, kwargs={"poll_interval": 0.05})
    thread.start()
    yield address, tmp_path
    made.shutdown()
    made.server_close()
    thread.join()


def post(address, name, values, **headers):
    asked = urllib.request.Request(f"{address}{name}", json.dumps(values).encode(), headers)
    with urllib.request.urlopen(asked, timeout=900) as answer:
        return json.loads(answer.read())


def test_numbers_move_the_mechanism_and_are_saved_beside_the_file(served):
    address, folder = served
    first, second = (post(address, "move", {MASS: mass}) for mass in (0.5, 0.9))
    assert first["status"] == "OK" and set(first["lines"]) == {"upper", "lower"}
    assert first["lines"]["lower"][0] == second["lines"]["lower"][0] != first["lines"]["upper"][0]
    assert first["lines"]["lower"][-1] != second["lines"]["lower"][-1]
    (ax, ay), (bx, by) = first["lines"]["lower"][-1]
    assert (bx - ax) ** 2 + (by - ay) ** 2 == pytest.approx(0.25, abs=1e-4)
    assert post(address, "judge", {MASS: 0.9})["error"] < 1e-2
    assert post(address, "save", {MASS: 0.9}) == {"saved": str(folder / "pendulum-1.toml")}
    assert Mechanism.load(folder / "pendulum-1.toml").link("lower").body.section.mass == 0.9
    assert Mechanism.load(folder / "pendulum.toml").link("lower").body.section.mass == 0.5
    assert "mass" in post(address, "move", {MASS: -1})["wrong"]
    assert post(address, "move", {"gravity[1]": 1.0}) == {"wrong": "gravity[1]: has no slider"}


def test_a_number_of_the_defaults_is_turned_and_saved(tmp_path):
    path, number = tmp_path / "stephenson.toml", "links.crank.body.section.thickness"
    path.write_text((EXAMPLES / path.name).read_text(encoding="utf-8"), encoding="utf-8")
    file = opened(path, [f"{number}=4mm"])
    saved = Explorer(path, file.document, file.duration, {number: None}).saved({number: 0.006})["saved"]
    assert [Mechanism.load(saved).link(name).body.section.thickness for name in ("crank", "rod")] == [0.006, 0.005]
    path.write_text('[run]\nmeasures = "x"\n', encoding="utf-8")
    with pytest.raises(ValueError, match=r"stephenson\.toml: run\.measures: unknown key; known: duration"):
        opened(path)


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
        begin = time.perf_counter()
        page.press("ArrowRight")
        page.wait("window.explore.answers > 1 && !!window.explore.state().ghost")
        assert time.perf_counter() - begin < 5
        assert page.run("window.explore.state().values['links.lower.body.mass'] > 0.5")
        assert page.run("window.explore.state().now !== window.explore.state().ghost")
        assert not page.errors and all(url.startswith((address, "data:", "about:")) for url in page.requests)
