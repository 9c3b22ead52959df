"""What the papers leave open is a parameter of every study that it touches, and the page that says so is true."""

from pathlib import Path
from runpy import run_path

import numpy as np
import pytest

pytest.importorskip("numba")

from buckler.mbs import Beam, Controlled, Exudyn, Section, Spectral, simulate, slider_crank
from buckler.mbs.laws import CarvalhoMartins
from buckler.mbs.library import PAPER
from buckler.mbs.sensitivity.curve import positive_ranges
from buckler.studies.rattling import clearance_speed
from buckler.studies.rattling.bars import RockerParameters
from buckler.studies.rattling.turns import solver
from buckler.studies.striking.impact import StrikeAssumptions, crank_angle

DOCS = Path(__file__).parents[2] / "docs"
PAGES, missing, tables = map(run_path(str(DOCS / "open_assumptions.py")).get, ("PAGES", "missing", "tables"))
PAPERS = {"striking": "evidence-slider-crank.md", "rattling": "evidence-crank-rocker.md"}


@pytest.mark.parametrize("package", PAGES)
def test_every_study_has_what_is_open_and_the_page_says_so(package):
    assert missing(package) == []
    assert tables(package) in (DOCS / PAPERS[package]).read_text(encoding="utf-8"), "run python docs/open_assumptions.py"


def test_a_study_without_a_parameter_is_missed(monkeypatch):
    monkeypatch.setitem(PAGES, "striking", ("gravity", "bow_of_the_moon"))
    assert ("slider-crank", "bow_of_the_moon") in missing("striking") and ("slider-crank", "gravity") not in missing("striking")


def test_journals_of_a_flexible_rocker_are_as_deep_as_its_contacts():
    """Joints B and C, whose pins the rocker's ends carry or hold: depth is the distance of the centres beyond the clearance."""
    p = RockerParameters(rocker="modal", modal_damping="ADAMS", modes_of="Craig-Bampton", in_plane_depth=5e-3, pin_on="C.rocker")
    made = p.bars(angle=0.3)
    result = simulate(made, 6e-3, solver=solver(made, 1e-9))
    for joint in "BC":
        far = np.hypot(*(result[f"{joint}.journal_{axis}"] for axis in "xy"))
        touched = result[f"{joint}.penetration"] > 1e-9
        assert touched.any()
        np.testing.assert_allclose((far - p.clearance)[touched], result[f"{joint}.penetration"][touched], atol=1e-12)
    assert np.abs(result["rocker.deflection"]).max() > 1e-8  # the rocker's deformation is seen


def test_modes_need_a_rocker_that_has_them():
    with pytest.raises(ValueError, match="modal_damping = ADAMS: only a rocker of modes"):
        clearance_speed.Parameters(modal_damping="ADAMS")
    p = clearance_speed.Parameters(rocker="modal", modal_damping="ADAMS", modes_of="Craig-Bampton")
    assert min(p.bars().link("rocker").body.damping) >= 0.01
    assert "modes of the rocker Craig-Bampton, damping ratio ADAMS" in p.describe()
    without_free = clearance_speed.Parameters(
        rocker="modal", modes_of="Craig-Bampton", bending=0, axial=0
    )  # it has no free modes
    assert "modes of the rocker Craig-Bampton" in without_free.describe()
    plain = clearance_speed.Parameters()
    assert "rocker rigid" in plain.describe() and not plain.bars().link("rocker").body.flexible


@pytest.mark.parametrize("given, ringing", [
    ({"motor": 1.6, "gravity": 9.81}, 0.05), pytest.param({"gravity": 9.81}, 0.05, marks=pytest.mark.slow),
    pytest.param({"imperfection": 0.01}, 0.2, marks=pytest.mark.slow),
])  # fmt: skip
def test_two_solvers_agree_under_what_the_paper_leaves_open(given, ringing):
    """Largest force and impulse of the first impact within 2 %, mean force over some periods about 180 degrees within 0.2 %."""
    bow = given.pop("imperfection", 1e-4) * PAPER.coupler
    assumed, law = StrikeAssumptions(**given), CarvalhoMartins(7.2e4, 0.8, exponent=1.0)
    strip = Beam(Section(0.030, 3e-4).damped(0.05, PAPER.coupler), elements=8, imperfection=-bow)
    mechanism = assumed.apply(slider_crank(strip, law=law, mass=0.3, speed=1.25))
    found = []
    for code in (Exudyn(Controlled(1e-5)), Spectral(Controlled(1e-6))):
        result = simulate(mechanism, assumed.extend_for_motor(2.8), solver=code)
        force, angle = result["B.contact_force"], crank_angle(result.signals)
        first = slice(*positive_ranges(force)[0])
        settled = np.interp(np.pi + np.linspace(-ringing, ringing, 2001), angle, force).mean()
        found.append([force[first].max(), np.trapezoid(force[first], result.time[first]), settled])
    off = np.abs(np.array(found[0]) / found[1] - 1)
    assert off[0] < 0.02 and off[1] < 0.02 and off[2] < 2e-3
    assert found[0][0] < 0.7 * 156  # of the straight strip at constant speed
