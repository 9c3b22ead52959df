"""Error against run time: errors and orders of the works, a wrong one found, and what scenes are made of."""

import numpy as np
import pytest

pytest.importorskip("numba")

from drawing import inked

from buckler.mbs import Cable, Link, Mechanism, Revolute, Rigid, Section, slider_crank
from buckler.mbs.engine.pressed import pinned_strip
from buckler.mbs.library import PAPER
from buckler.studies.error_against_run_time import error_against_run_time as study
from buckler.studies.error_against_run_time import plain, works
from buckler.studies.error_against_run_time.error_against_run_time import Parameters, run
from buckler.studies.error_against_run_time.ingredients import ingredients
from buckler.studies.error_against_run_time.work import ONCE
from buckler.studies.error_against_run_time.works import SHORTENINGS, STRIP, WORKS


@pytest.mark.slow
def test_quick_works_are_accurate():
    quick = run(Parameters(works="strip,smooth,bars", quick=1, scenes=0, repeats=1))
    found = {name: metric.value for name, metric in quick.metrics.items()}
    assert quick.status == "OK", quick.message
    assert found["smooth_engine_error"] < 5e-4 and found["smooth_once_error"] < 1e-3 and found["smooth_uncertainty"] < 3e-4
    assert max(found["bars_engine_error"], found["strip_engine_error"]) < 1e-5 and found["bars_once_error"] < 1e-6
    assert found["bars_known_error"] < 1e-3 and found["smooth_known_error"] < 1e-3  # what was asked for
    assert found["bars_once_ratio"] > 0 and len(quick.tables) == 1
    drawn = inked(study, quick)
    axes = drawn.axes
    assert len(drawn.legends) == 1 and all(ax.get_xlabel() and ax.get_ylabel() for ax in axes)
    assert [ax.get_title() for ax in axes] == ["strip", "smooth", "bars"]


def test_load_of_the_strip_converges_at_fourth_order_in_its_elements():
    """Twice the order of the strains of three-node beams, against the boundary value problem of their own theory."""
    work, counts = WORKS["strip"](), np.array([8, 16, 32])
    errors = np.array([work.difference(work.runs[ONCE, str(n)](), work.references[ONCE]()) for n in counts])
    slope = np.polyfit(np.log(1 / counts), np.log(errors), 1)[0]
    assert slope == pytest.approx(4, abs=0.2) and errors[-1] < 1.5e-6
    assert run(Parameters(works="strip", scenes=0, repeats=1)).metrics["strip_order"].value == pytest.approx(4, abs=0.2)


@pytest.mark.slow
def test_an_engine_that_is_wrong_is_found(monkeypatch):
    """Its deflections are 5 % too large: the references of both codes differ."""
    right = plain.slider_crank
    monkeypatch.setattr(plain, "slider_crank", lambda *given: 1.05 * right(*given))
    result = run(Parameters(works="smooth", quick=1, scenes=0, repeats=1))
    assert result.status == "SUSPECT" and "smooth: its two references differ by 5" in result.message


def test_plain_strip_is_the_same_mesh_as_the_cable():
    unit = STRIP.bending_stiffness / PAPER.coupler**2
    theirs = plain.buckled_strip(STRIP, PAPER.coupler, SHORTENINGS, 16) / unit
    assert theirs == pytest.approx(pinned_strip(Cable(STRIP, 16), PAPER.coupler, SHORTENINGS), rel=5e-6)  # Newton's


def test_plain_run_that_fails_is_nan():
    strip = Cable(Section(0.030, 3e-4), 4, imperfection=3e-4)
    mechanism = slider_crank(strip, law=works.KelvinVoigt(1e5, 300.0), mass=0.3, speed=1.25)
    assert np.isnan(plain.slider_crank(mechanism, np.linspace(0.0, 5.0, 11), 50, 1e-300, 1e-300)[1:]).all()


def test_a_bar_let_go_level_falls_with_one_and_a_half_g_at_its_end():
    """Of the chain's own reference: 3/4 g at the centre, less by the bar's thickness."""
    bar, pin = Link("link0", "P0", "P1", Rigid(Section(0.020, 0.005))), Revolute("P0", "ground", "link0")
    short = Mechanism({"P0": (0.0, 0.0), "P1": (0.1, 0.0)}, [bar], [pin], gravity=(0.0, -works.GRAVITY))
    time = np.array([0.0, 2e-3])
    thick = 1 + (0.005 / 0.1) ** 2 / 4
    fall = np.diff(works.pendulum(short, time), axis=0)[0]
    assert fall == pytest.approx([0.0, -0.375 * works.GRAVITY / thick * time[1] ** 2], abs=1e-8)


@pytest.mark.slow
def test_every_work_is_no_less_accurate_than_hand_tuned_runs():
    result = run(Parameters(scenes=0, repeats=1))
    assert result.status == "OK", result.message
    for name in WORKS:
        assert result.metrics[f"{name}_once_error"].value <= result.metrics[f"{name}_engine_error"].value
        if name != "strip":
            assert result.metrics[f"{name}_known_error"].value <= result.metrics[f"{name}_engine_error"].value


ALONE = {"accelerate", "assemble", "follow", "measure_at", "place_markers"}
"""Compiled functions of any run of the compiled solver but its integrator."""
STRIKING = {"Rigid": 1, "Beam": 1, "Revolute": 2, "Guide": 1, "Stop": 1, "Drive": 1}
MADE_OF = {
    ("bars", "Spectral"): ({"Rigid": 16, "Revolute": 16, "gravity": 1}, 80, {"run_implicit"}, {"numba"}, {"spectral"}),
    ("stop", "Spectral"): (STRIKING, 36, {"run_implicit"}, {"numba"}, {"spectral"}),
    ("rigid", "Spectral"): ({"Rigid": 3, "Clearance": 4, "Drive": 1}, 10, {"run_explicit"}, {"numba"}, {"spectral"}),
    ("bars", "Exudyn"): ({"Rigid": 16, "Revolute": 16, "gravity": 1}, 80, set(), {"exudyn"}, {"engine"}),
    ("stop", "Exudyn"): (STRIKING, 62, set(), {"exudyn"}, {"engine"}),
}
"""Objects, unknowns, integrator, packages, folders of each."""


@pytest.mark.parametrize("scene", MADE_OF)
def test_a_scene_holds_what_it_needs_and_no_more(scene):
    objects, unknowns, integrator, packages, folders = MADE_OF[scene]
    found = ingredients(*scene)
    assert found.status == "OK"
    assert (found.objects, found.unknowns) == (objects, unknowns)
    assert set(found.kernels) == (integrator | ALONE if integrator else set())
    assert set(found.packages) == packages and set(found.folders) == folders
