"""Pictures by matplotlib."""

import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from looked_at import loose, pendulum, pushed, run

from buckler import mbs
from buckler.mbs import Force, Link, Mechanism, Rigid, Slider, Spring
from buckler.mbs.view import plot


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


@pytest.mark.parametrize(("count", "criticals"), [(4, (0.4, 2.6)), (3, (0.0,))])
def test_a_path_has_the_stability_of_its_ends_before_the_first_critical_point_and_after_the_last(count, criticals):
    """Unstable equilibria, critical points in the first interval and the last, or at the start: no part is stable or empty."""
    parameter = np.arange(float(count))
    points = [SimpleNamespace(rest=SimpleNamespace(q=np.zeros(1), parameter=at)) for at in criticals]
    path = SimpleNamespace(parameter=parameter, q=np.zeros((count, 1)), stable=np.zeros(count, dtype=bool), points=points)
    assert [stable for _, stable in plot._pieces(path, parameter)] == [False] * (3 if len(criticals) == 2 else 1)


@pytest.mark.parametrize("seed", range(100))
def test_a_path_changes_its_stability_at_an_equilibrium_that_is_critical(seed):
    dice = np.random.default_rng(seed)
    q, parameter = np.cumsum(dice.random((9, 1)), axis=0), np.cumsum(dice.random(9))
    critical = SimpleNamespace(rest=SimpleNamespace(q=q[4], parameter=parameter[4]))
    path = SimpleNamespace(parameter=parameter, q=q, stable=np.arange(9) < 4, points=[critical])
    first, *others = [stable for _, stable in plot._pieces(path, parameter)]
    assert first and others and not any(others)


def test_the_axis_of_a_path_names_what_changes():
    block = Link("block", "P", "Q", Rigid.of(mass=1.0, inertia=1e-3))
    mechanism = Mechanism(
        points={"P": (0, 0), "Q": (0, 0.1), "S": (1, 0)},
        links=[block],
        joints=[Slider("P", "block", "ground", along=(1, 0))],
        loads=[Spring("P", "ground:S", stiffness=10.0, free_length=1.0), Force("P", (1.0, 0.0))],
    )
    paths = mbs.path(mechanism, to=1.0), mbs.path(mechanism, to=20.0, parameter="loads.0.stiffness")
    labels = [path.plot("block", "P", "x").get_xlabel() for path in paths]
    assert labels == ["factor of the loads", "loads.0.stiffness [SI]"]


def test_signals_are_drawn_by_unit():
    result = run("strip")
    axes = result.plot("B.x", "A.x", "B.contact_force")
    assert [len(row.lines) for row in axes] == [2, 1]
    assert axes[1].get_ylabel() == "B.contact_force [N]" and axes[1].get_xlabel() == "time [s]"
    assert axes[1].lines[0].get_ydata() == pytest.approx(result.signals["B.contact_force"])
    with pytest.raises(ValueError, match=r"no signal 'B\.contact'; near it: B\.contact_force"):
        result.plot("B.contact")
    with pytest.raises(ValueError, match="name one signal"):
        result.plot()


def test_a_failed_run_says_so_above_its_plot():
    title = run("failed").plot("A.x").get_title(loc="left")
    assert "TOO_MANY_STEPS" in title and "do not trust" in title
    assert not run("pendulum").plot("A.x").get_title(loc="left")


def test_the_ledger_is_drawn_with_its_error():
    result = run("pendulum")
    lines = {line.get_label(): line.get_ydata() for line in result.plot_energy().lines}
    assert set(lines) >= {"kinetic", "weight", "error of the balance"}
    assert lines["kinetic"] + lines["weight"] == pytest.approx(lines["weight"][0], abs=1e-3)
    with pytest.raises(ValueError, match="ledger=True"):
        replace(result, energy={}).plot_energy()


def test_an_animation_moves(tmp_path, monkeypatch):
    from PIL import Image

    monkeypatch.setattr(plot, "MOST_FRAMES", 5)
    path = run("pendulum").animate(tmp_path / "new" / "run.gif", seconds=1.0, width=200)
    with Image.open(path) as picture:
        assert picture.n_frames == 5 and picture.width == 200 and picture.info["duration"] == 200
        shots = []
        for k in range(5):
            picture.seek(k)
            shots.append(np.asarray(picture.convert("L")))
    assert all((a != b).sum() > 20 for a, b in pairwise(shots))


def test_every_axis_label_in_the_project_gives_its_unit_in_one_style():
    """`force [N]`, never `force / N`."""
    root = Path(__file__).resolve().parents[2]
    units = "|".join(("m", "mm", "s", "ms", "N", "J", "rad", "deg", "N m", "m/s", "Hz", "1"))
    other = re.compile(rf"label\(?=?\(?f?\"[^\"]* / (?:{units})\"")
    files = [path for folder in ("mbs", "studies", "docs") for path in (root / folder).rglob("*.py")]
    assert files and not [path.name for path in files if other.search(path.read_text(encoding="utf-8"))]
    assert other.search('ax.set(xlabel="x / m")') and other.search('ax.set_ylabel("energy / J")')
