"""The movie of a run: where things are drawn is where they are."""

from dataclasses import replace

import numpy as np
import pytest
from looked_at import MECHANISMS, STRIP, loose, pendulum, pushed, run

from buckler.elastica import pinned
from buckler.mbs import Beam, Exudyn, Force, LineLoad, Link, Mechanism, Revolute, Spectral, Weld, simulate
from buckler.mbs.declare import known_kinds
from buckler.mbs.elements import KINDS
from buckler.mbs.record.record import Record
from buckler.mbs.view.drawing import INKS, Disc, Label, Outline, StripMark
from buckler.mbs.view.movie import make_movie, still, to_ground
from buckler.mbs.view.symbols import SYMBOLS

LENGTH = 0.31


@pytest.mark.parametrize("name", MECHANISMS)
def test_points_are_drawn_where_the_signals_say(name):
    result = run(name)
    movie = result.movie
    for point in movie.points:
        for axis, letter in enumerate("xy"):
            values = result.signals[f"{point}.{letter}"]
            found = result.at(f"{point}.{letter}", movie.time)
            assert movie.frames[point][:, axis] == pytest.approx(found, abs=2e-3 * max(np.ptp(values), 0.01))
    assert all(mark.ink in INKS for mark in movie.marks if hasattr(mark, "ink"))
    assert all(mark.frame in movie.frames for mark in movie.marks if hasattr(mark, "frame"))


def test_a_strip_ends_in_its_pins_and_bends_as_its_force_says():
    """In rest on the stop the moment is the force times the deflection, so the curvature is F d / (E I).

    A run without settings is held to 10 % of forces.
    """
    result = run("strip")
    movie, band = result.movie, result.movie.bands["coupler"]
    assert band.points[:, 0] == pytest.approx(movie.frames["A"][:, :2], abs=1e-6)
    assert band.points[:, -1] == pytest.approx(movie.frames["B"][:, :2], abs=1e-6)
    k = int(np.argmin(abs(movie.time - 2.9)))
    chord = band.points[k, -1] - band.points[k, 0]
    force = -result.at("B.contact_force", movie.time[k]) / abs(chord[0]) * np.hypot(*chord)  # along the chord
    deflection = np.interp(movie.time[k], result.time, result.signals["coupler.deflection"])
    assert band.bending[k][band.bending.shape[1] // 2] == pytest.approx(force * deflection / STRIP.bending_stiffness, rel=0.05)
    assert band.stress[k].max() == pytest.approx(band.modulus * abs(band.bending[k]).max() * STRIP.thickness / 2, rel=1e-2)
    mean = result.at("coupler.axial_force", movie.time[k])
    assert np.trapezoid(band.axial_force[k]) / (len(band.axial_force[k]) - 1) == pytest.approx(mean, rel=0.1)


@pytest.mark.parametrize("turns", [False, True])
def test_a_line_load_turns_in_the_picture_only_if_it_does_in_the_run(turns):
    mechanism = Mechanism(
        points={"A": (0, 0), "B": (0.3, 0)},
        links=[Link("strip", "A", "B", Beam(STRIP, elements=2))],
        joints=[Revolute("A", "ground", "strip")],
        loads=[LineLoad("strip", force=(0.0, -0.1), turns=turns)],
    )  # fmt: skip
    movie = simulate(mechanism, 0.3, solver=Spectral()).movie
    arrows = [mark for mark in movie.marks if isinstance(mark, Outline) and mark.ink == "load"]
    assert arrows
    for mark in arrows:
        assert (np.ptp(movie.frames[mark.frame][:, 2]) > 0.1) == turns
    lines = [mark for mark in arrows if len(mark.points) == 2]
    for mark, station in zip(lines, (0, -1), strict=True):
        frame = movie.frames[mark.frame]
        tips = np.array([to_ground(row, mark.points[-1:])[0] for row in frame])
        distance = np.linalg.norm(tips - movie.bands["strip"].points[:, station], axis=1)
        assert distance == pytest.approx(0.5 * movie.unit, rel=1e-3)


def test_both_solvers_leave_the_same_movie():
    """A clamped strip whose end is pushed to and fro bends alike in elements and in polynomials."""
    mechanism = Mechanism(
        points={"A": (0, 0), "B": (0.3, 0)},
        links=[Link("strip", "A", "B", Beam(STRIP, elements=8))],
        joints=[Weld("A", "ground", "strip")],
        loads=[Force("B", lambda t: (0.0, 0.02 * np.sin(20 * t)))],
    )
    first, second = (simulate(mechanism, 0.2, solver=solver).movie for solver in (Exudyn(), Spectral()))
    one, other = first.bands["strip"], second.bands["strip"]
    assert first.time == pytest.approx(second.time)
    size = np.ptp(one.points[:, -1, 1])
    assert one.points[:, -1] == pytest.approx(other.points[:, -1], abs=0.01 * size)
    root = abs(one.bending[:, 0]).max()
    assert one.bending[:, 0] == pytest.approx(other.bending[:, 0], abs=0.05 * root)


def test_a_strut_is_drawn_as_the_exact_elastica():
    movie = run("strut").movie
    band = movie.bands["coupler"]
    span = np.hypot(*(band.points[:, -1] - band.points[:, 0]).T)
    k = int(np.argmin(span))
    u = 1 - span[k] / LENGTH
    assert u > 0.1
    chord = (band.points[k, -1] - band.points[k, 0]) / span[k]
    middle = band.points[k, band.points.shape[1] // 2] - band.points[k, 0]
    assert chord[0] * middle[1] - chord[1] * middle[0] == pytest.approx(LENGTH * pinned.mid_deflection(u), rel=1e-3)
    assert abs(band.bending[k]).max() == pytest.approx(pinned.curvature_max(u) / LENGTH, rel=0.02)


def test_a_pin_drawn_in_its_bush_touches_when_it_does():
    result = run("loose")
    movie = result.movie
    name = next(name for name in movie.frames if "~" in name and "rocker:B" in name)
    bush = movie.frames[name.partition("~")[0]]
    drawn = np.hypot(*(movie.frames[name] - bush)[:, :2].T) / (0.28 * movie.unit)
    eccentricity = np.hypot(*(np.interp(movie.time, result.time, result.signals[f"B.journal_{letter}"]) for letter in "xy"))
    assert drawn == pytest.approx(eccentricity / 1e-4, abs=0.1)
    assert 0.9 < drawn.max() < 1.5


def test_a_run_that_went_wrong_is_shown_up_to_its_last_finite_state():
    record = run("pendulum").film.record
    motion = record.links["plate"]
    broken = {**record.links, "plate": replace(motion, q=motion.q.copy())}
    broken["plate"].q[30:] = np.nan
    movie = make_movie(Record(record.mechanism, record.time, broken, {}))
    assert movie.time[-1] == record.time[29]
    assert all(np.isfinite(frame).all() for frame in movie.frames.values())
    broken["plate"].q[:] = np.nan
    assert len(make_movie(Record(record.mechanism, record.time, broken, {})).time) == 1


def test_every_kind_has_a_symbol():
    kinds = [name for name, kind in known_kinds().items() if issubclass(kind, tuple(KINDS.values())) and name != "Link"]
    assert kinds and set(kinds) <= set(SYMBOLS)


@pytest.mark.parametrize("make", [pendulum, pushed, loose, MECHANISMS["strip"][0], MECHANISMS["modal"][0]])
def test_a_still_shows_the_mechanism_at_the_start(make):
    mechanism = make()
    assert isinstance(mechanism, Mechanism)
    movie = still(mechanism)
    assert len(movie.time) == 1
    for point, at in mechanism.points.items():
        assert movie.frames[point][0, :2] == pytest.approx(at)
    assert {type(mark) for mark in movie.marks} >= {Outline, Disc, Label}
    assert len([mark for mark in movie.marks if isinstance(mark, StripMark)]) == len(movie.bands)
