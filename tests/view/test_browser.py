"""The report in a real browser: no error, something drawn, moving, in agreement with the arrays, by keyboard too."""

import numpy as np
import pytest
from chromium import browser
from looked_at import MECHANISMS, run

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def tab():
    with browser() as page:
        yield page


@pytest.fixture(scope="module", params=list(MECHANISMS))
def report(request, tab, tmp_path_factory):
    result = run(request.param)
    tab.open(result.write_html(tmp_path_factory.mktemp("report") / f"{request.param}.html"))
    return result, tab


SHADES = """(() => {
  const canvas = document.querySelector('%s'), pen = canvas.getContext('2d');
  const bytes = pen.getImageData(0, 0, canvas.width, canvas.height).data, seen = new Set();
  let drawn = 0, sum = 0;
  for (let k = 0; k < bytes.length; k += 4) if (bytes[k + 3] > 0) {
    drawn++; sum = (sum * 31 + bytes[k] + 7 * bytes[k + 1] + 13 * bytes[k + 2] + k) %% 2147483647;
    seen.add(bytes[k] << 16 | bytes[k + 1] << 8 | bytes[k + 2]);
  }
  return [drawn, seen.size, sum];
})()"""


UNNAMED = """[...document.querySelectorAll('button, input, select, canvas[role]')].filter((control) =>
  !(control.getAttribute('aria-label') || control.textContent.trim() || (control.labels && control.labels.length))).length"""


def test_nothing_goes_wrong_nothing_is_fetched_and_controls_have_names(report):
    _, tab = report
    tab.run("report.seek(1e9); report.seek(0); report.step(3)")
    assert tab.errors == []
    assert [url for url in tab.requests if not url.startswith(("file:", "data:", "about:"))] == []
    assert tab.run(UNNAMED) == 0 and tab.run("document.documentElement.lang") == "en"


def test_the_scene_is_drawn_and_moves(report):
    result, tab = report
    tab.run("report.seek(0)")
    before = tab.run(SHADES % "#scene")
    tab.run(f"report.seek({0.6 * result.time[-1]})")
    after = tab.run(SHADES % "#scene")
    assert min(before[0], after[0]) > 500 and min(before[1], after[1]) > 20
    assert before[2] != after[2]
    assert tab.run(SHADES % "#plots canvas")[0] > 500


def test_frames_and_cursor_agree_with_the_arrays(report):
    result, tab = report
    for share in (0.0, 0.31, 0.77, 1.0):
        t = float(share * result.time[-1])
        tab.run(f"report.seek({t!r})")
        assert tab.run("report.state().time") == pytest.approx(t, abs=1e-9)
        picture = tab.run("report.state().picture")
        count = tab.run("motion.count")
        shown = picture / (count - 1) * result.time[-1]
        assert shown == pytest.approx(t, abs=result.time[-1] / (count - 1))
        for point in result.movie.points:
            x, y, _ = tab.run(f"report.frame({point!r})")
            for value, letter in ((x, "x"), (y, "y")):
                name = f"{point}.{letter}"
                room = 2e-3 * max(np.ptp(result[name]), 0.01)
                assert value == pytest.approx(float(result.at(name, min(shown, result.time[-1]))), abs=room)  # steps are long
        width = result.time[-1] / tab.run("bins")
        for name in tab.run("report.state().chosen"):
            values, near = result.signals[name], abs(result.time - t) <= 2 * width
            value, room = tab.run(f"report.valueAt({name!r})"), 1e-3 * np.ptp(values)
            around = np.append(values[near], np.interp([t - width, t + width], result.time, values))
            assert around.min() - room <= value <= around.max() + room


def test_the_cursor_is_shown_in_words(report):
    result, tab = report
    name = tab.run("report.state().chosen[0]")
    tab.run(f"report.seek({0.4 * result.time[-1]})")
    assert tab.run("document.querySelector('.plot b').textContent").startswith(name)
    text = tab.run("document.querySelector('.plot output').textContent").replace("\u2212", "-")
    scale = {"m": 1e-3, "\u00b5": 1e-6, "k": 1e3, "n": 1e-9}
    number, *unit = text.split(" ", 1)
    unit = unit[0] if unit else ""
    base = result.units[name]
    factor = 1.0 if unit in (base, "") else scale[unit[0]]
    size = max(abs(result.signals[name].min()), abs(result.signals[name].max()))
    assert float(number) * factor == pytest.approx(tab.run(f"report.valueAt({name!r})"), abs=2e-3 * size)


def test_measures_beyond_the_first_five_are_shown_by_a_button(report):
    _, page = report
    rows = "[...document.querySelectorAll('#measures tbody tr')].filter((row) => row.offsetParent).length"
    all_rows, beyond = page.run("[data.readings.length, data.readings.filter((row, k) => k >= 5 && row.beyond).length]")
    few = min(all_rows, 5) + beyond
    assert page.run(rows) == few
    assert page.run("$('measures-all').hidden") == (few == all_rows)
    page.run("$('measures-all').click()")
    assert page.run(rows) == all_rows
    page.run("$('measures-all').click()")
    assert page.run(rows) == few


def test_the_keyboard_works(report):
    result, tab = report
    tab.run("report.seek(0); document.activeElement.blur()")
    tab.press("ArrowRight")
    tab.press("ArrowRight")
    assert tab.run("report.state().picture") == 2
    tab.press("ArrowRight", shift=True)
    tab.press("ArrowLeft")
    assert tab.run("report.state().picture") == 11
    tab.press("End")
    assert tab.run("report.state().time") == pytest.approx(result.time[-1])
    tab.press("Home")
    assert tab.run("report.state().time") == 0
    tab.press("+")
    assert tab.run("report.state().zoom") == pytest.approx(1.4)
    tab.press("0")
    assert tab.run("report.state().zoom") == 1
    tab.press("n")
    assert not tab.run("document.getElementById('names').checked")
    tab.press("n")
    tab.press(" ", "Space")
    assert tab.run("report.state().playing")
    tab.wait("report.state().picture > 0")
    tab.press(" ", "Space")
    assert not tab.run("report.state().playing")
    assert tab.errors == []


def test_the_verdict_comes_first(report):
    result, tab = report
    assert tab.run("document.getElementById('badge').textContent.trim()") == result.status
    top, bottom = (tab.run(f"document.getElementById('{name}').getBoundingClientRect().top") for name in ("badge", "motion"))
    assert top < bottom
    assert tab.run("document.getElementById('alert').hidden") == result.ok
    if not result.ok:
        assert result.message in tab.run("document.getElementById('alert').textContent")
        assert tab.run("document.title").startswith("\u25b2")
        assert tab.run("document.getElementById('alert').getBoundingClientRect().bottom") < bottom


def test_a_run_that_failed_opens_where_it_ended(tab, tmp_path):
    for name, share in (("failed", 1.0), ("pendulum", 0.0)):
        tab.open(run(name).write_html(tmp_path / f"{name}.html"))
        assert tab.run("report.state().time") == pytest.approx(share * run(name).time[-1])
