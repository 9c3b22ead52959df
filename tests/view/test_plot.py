"""Pictures by matplotlib."""

import re
from itertools import pairwise
from pathlib import Path
from shutil import which

import numpy as np
import pytest
from looked_at import loose, pendulum, pushed, run

from buckler.mbs import Force, Mechanism
from buckler.mbs.view import plot
from buckler.mbs.view.drawing import Label
from buckler.mbs.view.drawing import Path as Path_
from buckler.mbs.view.movie import still, to_ground


@pytest.fixture(autouse=True)
def closed():
    """No figure outlives its test."""
    yield
    import matplotlib.pyplot as plt

    plt.close("all")


def texts(axes):
    return {text.get_text() for text in axes.texts}


@pytest.mark.parametrize("make", [pendulum, pushed, loose])
def test_a_mechanism_is_drawn_with_its_names(make):
    mechanism = make()
    axes = mechanism.plot()
    assert texts(axes) >= set(mechanism.points) | {link.name for link in mechanism.links}
    assert not texts(mechanism.plot(names=False))
    places = np.array(list(mechanism.points.values()))
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    assert left < places[:, 0].min() and right > places[:, 0].max() and low < places[:, 1].min() and high > places[:, 1].max()
    assert axes.get_aspect() == 1.0
    assert min(text.get_fontsize() for text in axes.texts) >= 7


def test_a_force_that_turns_with_another_point_ends_at_its_own():
    """`follows` may name a point, as 'bar:B'; the arrow's tip is half a symbol before the force's point."""
    mechanism = Mechanism(**{**vars(pushed()), "loads": [Force("B", (0.0, 1.0), follows="bar:B")]})
    movie = still(mechanism)
    (line,) = [mark for mark in movie.marks if isinstance(mark, Path_) and mark.ink == "load" and len(mark.points) == 2]
    tip = to_ground(movie.frames[line.frame][0], line.points)[1]
    assert tip == pytest.approx(np.array(mechanism.points["B"]) - (0.0, 0.5 * movie.unit), abs=1e-12)


def test_a_link_is_drawn_to_scale():
    from matplotlib.patches import Polygon

    bar = pushed().plot().patches[0]
    assert isinstance(bar, Polygon)
    along = np.array([0.8, 0.6])
    assert np.ptp(bar.get_xy() @ (-along[1], along[0])) == pytest.approx(0.010)
    assert np.ptp(bar.get_xy() @ along) == pytest.approx(0.110)


def test_signals_are_drawn_by_unit():
    result = run("strip")
    axes = result.plot("B.x", "A.x", "B.contact_force")
    assert [len(row.lines) for row in axes] == [2, 1]
    assert axes[1].get_ylabel() == "B.contact_force [N]" and axes[1].get_xlabel() == "time [s]"
    assert axes[1].lines[0].get_ydata() == pytest.approx(result.signals["B.contact_force"])
    with pytest.raises(ValueError, match=r"unknown signal 'B\.contact'; near: B\.contact_force"):
        result.plot("B.contact")
    with pytest.raises(ValueError, match="name one signal"):
        result.plot()


def test_a_failed_run_says_so_above_its_plot():
    title = run("failed").plot("A.x").get_title(loc="left")
    assert "TOO_MANY_STEPS" in title and "do not trust" in title
    assert not run("pendulum").plot("A.x").get_title(loc="left")


def test_the_ledger_is_drawn_with_its_error():
    from dataclasses import replace

    result = run("pendulum")
    lines = {line.get_label(): line.get_ydata() for line in result.plot_energy().lines}
    assert set(lines) >= {"kinetic", "weight", "error of the balance"}
    assert lines["kinetic"] + lines["weight"] == pytest.approx(lines["weight"][0], abs=1e-3)
    with pytest.raises(ValueError, match="ledger=True"):
        replace(result, energy={}).plot_energy()


def test_an_animation_moves(tmp_path, monkeypatch):
    from PIL import Image

    monkeypatch.setattr(plot, "FRAMES", 5)
    path = run("pendulum").animate(tmp_path / "new" / "run.gif", seconds=1.0, width=200)
    with Image.open(path) as picture:
        assert picture.n_frames == 5 and picture.width == 200 and picture.info["duration"] == 200
        shots = []
        for k in range(5):
            picture.seek(k)
            shots.append(np.asarray(picture.convert("L")))
    assert all((a != b).sum() > 20 for a, b in pairwise(shots))


def test_what_cannot_be_animated_is_told(tmp_path, monkeypatch):
    result = run("pendulum")
    with pytest.raises(ValueError, match=r"'run\.avi' must end in \.gif or \.mp4"):
        result.animate(tmp_path / "run.avi")
    with pytest.raises(ValueError, match="seconds"):
        result.animate(tmp_path / "run.gif", seconds=0)
    monkeypatch.setattr(plot, "which", lambda _name: None)
    with pytest.raises(RuntimeError, match="needs the program ffmpeg"):
        result.animate(tmp_path / "run.mp4")


@pytest.mark.skipif(which("ffmpeg") is None, reason="no ffmpeg")
def test_a_film_file_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr(plot, "FRAMES", 5)
    assert run("pendulum").animate(tmp_path / "run.mp4", width=201).stat().st_size > 500


def test_a_notebook_shows_picture_and_parts():
    text = pushed()._repr_html_()
    assert text.count("<svg") == 1 and "Link (Rigid)" in text and "guide A" in text


def test_every_axis_label_in_the_project_gives_its_unit_in_one_style():
    """`force [N]`, never `force / N`."""
    root = Path(__file__).resolve().parents[2]
    units = "|".join(("m", "mm", "s", "ms", "N", "J", "rad", "deg", "N m", "m/s", "Hz", "1"))
    other = re.compile(rf"label\(?=?\(?f?\"[^\"]* / (?:{units})\"")
    files = [path for folder in ("mbs", "studies", "docs") for path in (root / folder).rglob("*.py")]
    assert files and not [path.name for path in files if other.search(path.read_text(encoding="utf-8"))]
    assert other.search('ax.set(xlabel="x / m")') and other.search('ax.set_ylabel("energy / J")')


def test_names_of_points_and_bars_lie_beside_the_links():
    """At the start, in symbols: farther from every link's line than half a symbol."""
    mechanism = Mechanism.load(Path(__file__).resolve().parents[2] / "studies" / "own" / "examples" / "stephenson.toml")
    movie = still(mechanism)
    ends = [(np.array(mechanism.points[link.start]), np.array(mechanism.points[link.end])) for link in mechanism.links]
    labels = [mark for mark in movie.marks if isinstance(mark, Label) and mark.text not in ("coupler", "D")]
    assert {mark.text for mark in labels} >= {"crank", "rod", "output", "A", "B", "E"}
    for mark in labels:
        x, y = to_ground(movie.frames[mark.frame][0], [mark.place])[0]
        for a, b in ends:
            share = np.clip((np.array([x, y]) - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
            assert np.hypot(*(np.array([x, y]) - a - share * (b - a))) > 0.4 * movie.unit, mark.text
