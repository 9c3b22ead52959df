"""Error against run time with clearance: engine, reference, scipy and Python agree, and a wrong one is found."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

pytest.importorskip("numba")

from buckler.mbs import Rigid
from buckler.studies.rattling import clearance_precision
from buckler.studies.rattling.clearance_precision import DEFAULT, RATIOS, Parameters, run
from buckler.studies.rattling.clearance_precision_runs import QUANTITIES, Comparison, columns, finest, mechanism, plainly
from buckler.studies.rattling.turns import by_turn

SHORT = {
    "rockers": ("rigid",), "tolerances": (1e-2, 1e-5), "steps": (4000,), "span": 0.02, "repeats": 1, "members": 3, "cycles": 1,
}  # fmt: skip


@pytest.fixture(scope="module")
def short():
    return run(Parameters(**SHORT))


def errors(result, name):
    return dict(zip(result.signals[f"{name}.setting"], result.signals[f"{name}.error"], strict=True))


def test_explicit_and_implicit_runs_converge_to_the_reference(short):
    assert short.status == "OK", short.message
    explicit, implicit = errors(short, "rigid: Rigid"), errors(short, "rigid: Rigid, implicit")
    assert list(explicit) == list(implicit) == ["1e-2", DEFAULT, "1e-5"]  # the default stands at its place
    for found in (explicit, implicit):
        assert (np.diff([*found.values()]) < 0).all()
    assert explicit["1e-5"] < 5e-5 and explicit[DEFAULT] < 3e-3 and implicit["1e-5"] < 0.05
    assert errors(short, "rigid: scipy DOP853")["1e-7"] < 2e-3
    reference = [*errors(short, "rigid: compiled").values()]
    assert (np.diff(reference) < 0).all() and reference[-1] < 1e-4


def test_a_law_in_python_gives_the_same_and_takes_longer(short):
    assert errors(short, "rigid: Python law")[DEFAULT] == pytest.approx(
        errors(short, "rigid: Rigid")[DEFAULT], rel=0.6
    )  # rounding moves the steps
    assert short.metrics["python_law_over_rigid"].value > 2
    assert "beam_over_modal_reference" not in short.metrics


def test_front_is_the_engines(short):
    for name in short.signals:
        if name.endswith(".front") and ("compiled" in name or "DOP853" in name or "Python" in name):
            assert not short.signals[name].any()
    assert short.signals["rigid: Rigid.front"].any()


def test_it_is_drawn(short):
    (ax,) = clearance_precision.figure(short).axes
    assert ax.get_xscale() == ax.get_yscale() == "log" and len(ax.get_legend().get_texts()) == 8


def test_a_wrong_mass_is_found(monkeypatch):
    monkeypatch.setattr(clearance_precision.variants, "finest", lambda bar, t: finest(heavier(bar), t))
    monkeypatch.setattr(clearance_precision, "compare", lambda *a, **k: Comparison(*np.ones((2, 3, 5)) * chance((3, 5)), 1e-5))
    result = run(Parameters(**SHORT | {"tolerances": (1e-2,)}))
    assert result.status == "SUSPECT" and "clearances from the compiled solver" in result.message


def heavier(made):
    links = []
    for link in made.links:
        section = link.body.section
        material = replace(section.material, density=1.1 * section.material.density)
        links.append(replace(link, body=Rigid(replace(section, material=material))))
    return replace(made, links=links)


def chance(shape, seed=1):
    return 1 + 0.01 * np.random.default_rng(seed).standard_normal(shape)


def test_statistics_tell_a_difference_from_chance():
    one, same, other = chance((40, 5)), chance((160, 5), 2), chance((160, 5), 3)
    other[:, 3] *= 1.01
    alike, apart = Comparison(one, same, 0.0), Comparison(one, other, 0.0)
    assert alike.chance > 0.01 and apart.chance < 1e-4
    assert np.abs(alike.apart).max() < 3 and apart.apart[3] == pytest.approx(-1 / np.hypot(1 / 40**0.5, 1 / 160**0.5), abs=2)
    k = int(np.abs(alike.apart).argmax())
    assert alike.chance == pytest.approx(min(1.0, 5 * 2 * norm.sf(abs(alike.apart[k]))), rel=0.5)  # nearly normal with so many
    assert len(QUANTITIES) == alike.error.size == 5


def test_measures_of_a_turn_are_those_of_the_curves():
    """Of sines, at uneven times: largest values, root mean square, differences; the first turn is left out."""
    time = np.sort(np.concatenate([np.linspace(0, 3, 6001), 1.5 + 0.2 * np.random.default_rng(1).random(500)]))
    wave, turn = np.sin(2 * np.pi * time), np.floor(time) + 1
    sizes = {"O.ground-crank": 1, "A.coupler-crank": 1, "B.coupler-rocker": 3, "C.ground-rocker": 5}
    signals = {f"{joint}.f{axis}": k * turn * wave for joint, k in sizes.items() for axis in "xy"}
    signals |= {"coupler.ax": 2 * wave, "rocker.ax": 4 * wave}
    made = SimpleNamespace(time=time, signals=signals, energy={"taken_contact": time, "taken_friction": time**2})
    expected = [[k * n * 2**0.5 for k in (3, 5)] + [2**0.5, 2 * 2**0.5, 1 + 2 * n - 1] for n in (2, 3)]
    assert columns(by_turn(made, 1.0, 3, 1)) == pytest.approx(np.array(expected), rel=1e-3)
    made.signals["A.penetration"] = np.where(time > 2, 1e-5, 0.0)
    assert by_turn(made, 1.0, 3, 1)["depth"].tolist() == [[0, 0, 0, 0], [0, 1e-5, 0, 0]]


def test_run_that_ends_proves_nothing_and_one_that_does_not_has_no_error():
    """Steps of 1 ms: the engine with its own settings says that all is well."""
    p = Parameters(**SHORT).bars
    distance = finest(mechanism(p), 0.01)
    ended = plainly(mechanism(p, ramp=True), 0.02, 20)
    assert ended.status == "OK" and distance(ended) > p.clearance
    assert np.isnan(distance(replace(ended, status="stopped")))
    assert np.isnan(distance(replace(ended, time=ended.time[:5], path=ended.path[:5])))


def test_ratios_have_sides():
    assert RATIOS["rigid_over_reference"].bar.reached(11.9) and not RATIOS["rigid_over_reference"].bar.reached(12.1)
    assert RATIOS["dop853_over_reference"].bar.reached(25.1) and not RATIOS["dop853_over_reference"].bar.reached(24.9)


@pytest.mark.slow
def test_flexible_rockers_come_near_their_references():
    """The beam to what its elements and 12 + 12 modes allow, the modal rocker to what its steps do."""
    result = run(Parameters(**SHORT | {"rockers": ("beam", "modal"), "elements": (4, 8), "steps": (20_000,)}))
    assert result.status == "OK", result.message
    for name, least in (("beam: Beam x 4", 0.15), ("beam: Beam x 8", 0.1), ("modal: Modal", 0.03)):
        found = [*errors(result, name).values()]
        assert found[-1] < min(least, found[0]), name
