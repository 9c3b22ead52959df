"""Which modes matter: numbers and frequencies against closed forms, the reference's modal data, marks, engine, rigid limit."""

import numpy as np
import pytest

pytest.importorskip("numba")
pytest.importorskip("skfem")

from clearance_pair import beam_modes
from fourbar import FourBar, run

from buckler.mbs import Controlled, Exudyn, Modal, simulate
from buckler.mbs.library import CLOSED
from buckler.mbs.modal import FreeModes
from buckler.studies.kit.statistics import Mean
from buckler.studies.rattling import bars, modes
from buckler.studies.rattling.claims import CLAIMS, PLACES, Ratio
from buckler.studies.rattling.modes import AGREES, DIFFERS, LARGEST, UNDECIDED, Parameters, sameness
from buckler.studies.rattling.turns import FORCE, Turns, solver

L, E, RHO = 0.175, 207e9, 7850.0
ROOTS = np.array([4.730040744862704, 7.853204624095838, 10.995607838001671, 14.137165491257464, 17.27875965739948, 20.4203522456])
"""cos(x) cosh(x) = 1."""


def slender(depth):
    """Euler-Bernoulli, Hz, by hand."""
    return (ROOTS / L) ** 2 * np.sqrt(E / RHO * depth**2 / 12) / (2 * np.pi)


@pytest.mark.parametrize("depth", [20e-3, 5e-3])
def test_frequencies_of_the_solid_are_those_of_the_free_bar(depth):
    """Axial n c/2L; bending below the slender bar's, by ever more, and near it where the bar is slender for the mode."""
    table = bars.solid_modes(depth).table()
    axial, bending = ([row[1] for row in table if row[2] == kind] for kind in (bars.AXIAL, bars.BENDING))
    exact = np.arange(1, 5) * np.sqrt(E / RHO) / (2 * L)
    assert np.array(axial[:4]) == pytest.approx(exact, rel=0.01) and axial[0] == pytest.approx(exact[0], rel=6e-4)
    np.testing.assert_allclose(bars.beam_frequencies(depth)[bars.AXIAL][:4], exact, rtol=1e-9)
    np.testing.assert_allclose(bars.beam_frequencies(depth, shear=False)[bars.BENDING][:6], slender(depth), rtol=1e-7)
    lower = np.array(bending[:6]) / slender(depth)
    assert (lower < 1).all() and (np.diff(lower) < 0).all()
    # the first correction: rotary inertia and shear, (depth/L)^2 times a number of the mode
    assert 1 - lower[0] == pytest.approx(0.0433 * (depth / 20e-3) ** 2, rel=0.25)


def test_published_kilohertz_of_bending_4_to_6_are_those_without_shear():
    assert (slender(20e-3)[3:6] / 1e3).round() == pytest.approx([31, 46, 64])
    found = [row[1] for row in bars.solid_modes(20e-3).table() if row[2] == bars.BENDING][3:6]
    assert found == pytest.approx([23.0e3, 31.4e3, 40.0e3], rel=0.01)
    assert found == pytest.approx(bars.beam_frequencies(20e-3)[bars.BENDING][3:6], rel=0.012)


@pytest.mark.slow
def test_sets_hold_the_modes_they_name():
    hertz = {depth: bars.beam_frequencies(depth) for depth in (20e-3, 5e-3)}
    for depth, known in hertz.items():
        for name, kinds in bars.SETS.items():
            if name != "none" and not kinds.others:
                expected = sorted(
                    [known[bars.BENDING][n - 1] for n in kinds.bending] + [known[bars.AXIAL][n - 1] for n in kinds.axial]
                )
                found = np.sort(bars.make_rocker_of_set(depth, name, 0.01).frequencies(L))
                assert found == pytest.approx(expected, rel=0.03), name
    assert [bars.make_rocker_of_set(depth, name, 0.01) for depth in hertz for name in ("none", "456_free")] == [None] * 4


def test_modes_four_five_and_six_by_counting():
    """20 mm in the plane: torsion and two out of the plane; bending 3, 4 and axial 2. 5 mm: bending 3 and 4; bending 4 to 6."""
    kinds = {depth: {row[0]: row[2] for row in bars.solid_modes(depth).table()} for depth in (20e-3, 5e-3)}
    assert [kinds[20e-3][n] for n in (4, 5, 6)] == ["torsion", "out-of-plane bending", "out-of-plane bending"]
    assert [kinds[5e-3][n] for n in (4, 5, 6)] == ["torsion", bars.BENDING, bars.BENDING]
    assert bars.planar_modes(20e-3, "456_flexible") == () and bars.planar_modes(5e-3, "456_flexible") == (5, 6)
    assert [kinds[20e-3][n] for n in bars.planar_modes(20e-3, "456_in_plane")] == [bars.BENDING, bars.BENDING, bars.AXIAL]
    assert [kinds[5e-3][n] for n in bars.planar_modes(5e-3, "456_in_plane")] == [bars.BENDING, bars.BENDING, bars.AXIAL]
    rows = {row[0]: row for row in modes._modes_table(20e-3).rows}
    assert rows[4][1:4] == [10, None, "torsion"] and rows[11][2:4] == [3, bars.AXIAL] and rows[3][2] == 1
    assert rows[11][-1] == f"{np.sqrt(E / RHO) / (2 * L):.0f}"


@pytest.mark.parametrize("depth", [20e-3, 5e-3])
def test_modal_data_of_the_solid_are_those_of_the_beam(depth):
    solid = bars.make_rocker_of_set(depth, "bending_1_3_axial_1", 0.02).planar(L)
    beam = beam_modes(width=1e-4 / depth, thickness=depth, bending=3, axial=1, damping=0.02).planar(L)
    order = np.argsort(beam.frequency)  # the solid's come by frequency
    ends = [shapes[1, :2].sum(axis=0) for shapes in (solid.shapes, beam.shapes[:, :, order])]
    scale = np.sign(ends[0] * ends[1])  # modes of unit mass have a free sign
    assert solid.frequency == pytest.approx(beam.frequency[order], rel=0.01)
    expected = beam.shapes[:, :, order] * scale
    for component in range(3):
        size = abs(expected[:, component]).max()
        np.testing.assert_allclose(solid.shapes[:, component], expected[:, component], atol=0.02 * size)
    np.testing.assert_allclose(solid.radial, beam.radial[order] * scale, atol=0.01 * abs(beam.radial * scale.max()).max())
    gyration = beam.gyration[np.ix_(order, order)] * np.outer(scale, scale)
    np.testing.assert_allclose(solid.gyration, gyration, atol=0.02 * abs(gyration).max())
    assert (solid.mass, solid.inertia) == pytest.approx((beam.mass, beam.inertia), rel=1e-9)
    assert (solid.damping == 0.02).all() and np.diag(solid.gram) == pytest.approx(np.diag(beam.gram), rel=0.01)


@pytest.mark.parametrize(("value", "error", "mark"), [
    (1.0, 0.01, AGREES), (1.0, 0.03, UNDECIDED), (1.02, 0.005, AGREES), (1.1, 0.02, DIFFERS), (0.9, 0.02, DIFFERS),
    (1.1, 0.06, UNDECIDED), (1.0, 0.0, AGREES), (1.045, 0.01, DIFFERS),
])  # fmt: skip
def test_marks_in_words(value, error, mark):
    """2.275 % at each end: two standard errors; margin 5 %."""
    assert sameness(Ratio(value, error, 1e9), 0.02275, 0.05) == mark


@pytest.mark.slow
def test_planted_difference_gets_its_mark(monkeypatch):
    """Made-up numbers, the same but: with bending 1 alone the force at B is 30 % up; without modes velocities are 50 % up."""

    def made_up(p, mechanisms, of, batch, curves):
        draw, found = np.random.default_rng(batch), []
        for bar in mechanisms:
            body = bar.link("rocker").body
            means = {reading: draw.gumbel(1.0, 0.05, p.members) for reading in of}
            if body.flexible and len(body.planar(L)) == 1:
                means[FORCE.format(place="B")] *= 1.3
            for reading in of if not body.flexible else ():
                means[reading] *= 1.5 if ".vx" in reading else 1.0
            numbers = {name: Mean(x.mean(), x.std(ddof=1) / len(x) ** 0.5, len(x)) for name, x in means.items()}
            found.append(Turns(numbers, 0.5, ()))
        return found

    monkeypatch.setattr(modes, "run_turns", made_up)
    wanted = {"sets": ("bending_1", "bending_1_2", "456_free"), "members": 400}
    result = modes.run(Parameters(**wanted))
    assert result.status == "OK"
    marks = {name: m.value for name, m in result.metrics.items() if name.endswith(".agrees")}
    assert len(marks) == 4 * 5 * len(CLAIMS)
    wrong = {"bending_1.force.coupler_rocker"}
    wrong |= {f"{name}.velocity.{place}" for name in ("none", "456_free") for place in PLACES}
    assert {name for name, value in marks.items() if value != 1} == {
        f"c_max[{unit}].h{h}mm.{name}.agrees" for unit in ("N.s/m", "N.s/mm") for h in (20, 5) for name in wrong
    }
    row = next(row for row in result.tables[2].rows if row[0] == "bending 1")
    assert float(row[1].split()[0]) == pytest.approx(1.3, abs=0.02) and row[1].endswith(DIFFERS) and row[2].endswith(AGREES)
    summary = next(row for row in result.tables[-1].rows if row[0] == "bending 1")
    assert len(summary) == 5 and all(cell.split(", ")[0].endswith(DIFFERS) and cell.endswith(AGREES) for cell in summary[1:])
    assert len(modes.figure(result).axes) == 4


@pytest.fixture(scope="module")
def closed():
    wanted = {"sets": ("bending_1", "axial_1", "456_free"), "damping_unit": "N.s/mm", "in_plane_depth": 20e-3}
    return modes.run(Parameters(**wanted, members=2, cycles=1))


@pytest.mark.slow
def test_the_axial_mode_softens_closed_joints_and_the_first_bending_mode_alone_does_not(closed):
    assert closed.status == "OK", closed.message
    case = "c_max[N.s/mm].h20mm"
    names = ("bending_1", "axial_1", "456_free", LARGEST)
    value = {name: closed.metrics[f"{case}.{name}.force.rocker_frame.over_rigid"].value for name in names}
    assert value["axial_1"] == pytest.approx(value[LARGEST], rel=0.1) and value[LARGEST] < 0.6 and value["bending_1"] > 1.1
    assert value["456_free"] == pytest.approx(1, abs=0.01)  # other runs of the same rigid rocker
    assert closed.metrics["h20mm.axial.1"].exact == pytest.approx(np.sqrt(E / RHO) / (2 * L), rel=1e-9)


def test_axial_mode_of_the_solid_strikes_as_the_beams_does():
    """First impacts of closed joints: modal data from two sources."""
    data = bars.make_rocker_of_set(20e-3, "axial_1", 0.01), beam_modes(bending=0, axial=1)
    forces = [run(FourBar(law=CLOSED, modes=each), 0.02, samples=11).peak_force[:, 3].max() for each in data]
    assert forces[0] == pytest.approx(forces[1], rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("depth", [20e-3, 5e-3])
def test_both_solvers_agree_through_the_first_impacts(depth):
    p, duration = Parameters(), 5e-3
    made = p.crank_rocker(
        "N.s/m", depth, Modal(bars.section(depth), FreeModes((1, 2, 3), "in-plane"), p.rocker_damping, bars.MESH)
    )
    engine = simulate(made, duration, solver=Exudyn(Controlled(tolerance=1e-6)))
    ours = simulate(made, duration, solver=solver(made, 1e-10))
    for link in ("coupler", "rocker"):
        away = np.hypot(*(engine[f"{link}.{x}"] - ours.at(f"{link}.{x}", engine.time) for x in "xy"))
        assert away.max() < 1e-3 * p.clearance
