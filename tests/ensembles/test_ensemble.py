"""Ensembles: starts, members that do not hang on how they are shared out, means with errors, resuming, failures."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context

import numpy as np
import pytest
from scipy.stats import norm, uniform
from test_statistics import rattling

from buckler import mbs
from buckler.mbs.ensembles.members import WIDEST, Members, displace_journals
from buckler.mbs.spectral.run import RunState, integrate
from buckler.mbs.spectral.scene import CompiledScene
from buckler.mbs.spectral.start import draw_offset, start_rates
from buckler.studies.rattling.bars import PlayParameters

FORCE = "rms(B.normal_force)"


def pendulum(angle=0.3):
    return mbs.Mechanism(
        {"O": (0, 0), "A": (0.5 * np.sin(angle), -0.5 * np.cos(angle))},
        [mbs.Link("bar", "O", "A", mbs.Rigid.of(mass=1.0, inertia=0.02))],
        [mbs.Revolute("O", "ground", "bar")],
        gravity=(0, -9.81),
    )


def test_journals_start_anywhere_in_their_bushes():
    scene = CompiledScene.of(rattling())
    places = []
    for seed in range(200):
        q = scene.q0 + displace_journals(scene, np.random.default_rng(seed))
        apart = scene.read(scene.marker("coupler", "B"), q).position - scene.read(scene.marker("rocker", "B"), q).position
        places.append(np.hypot(*apart) / (WIDEST * 2.5e-4))
        assert np.abs(scene.assemble(q, tangents=False).residual).max() < 1e-6
    assert max(places) < 1.001
    assert np.mean(places) == pytest.approx(2 / 3, abs=0.06)  # of a uniform circle


def test_rattling_motions_part_and_closed_ones_hardly_do():
    """A start 1e-12 m aside, 60 ms later: its offset grows by 1e7 in rattling joints."""
    apart = {}
    for unit in ("N.s/m", "N.s/mm"):
        scene = CompiledScene.of(PlayParameters(damping_unit=unit).bars())
        q, v, ends = scene.q0, start_rates(scene), []
        for shift in (np.zeros(scene.size), draw_offset(scene, 1e-12, 1)):
            state = RunState(0.0, q + shift, v, scene.memory())
            ends.append(integrate(scene, 0.06, mbs.Spectral(mbs.Controlled(1e-8)), state=state)[0].q[-1])
        apart[unit] = np.abs(ends[1] - ends[0]).max()
    assert apart["N.s/m"] > 2e-6 > 4 * apart["N.s/mm"]


def test_numbers_follow_their_distributions_and_lists_are_combined():
    vary = {"gravity[1]": norm(-9.81, 0.1), "links.bar.body.mass": [0.5, 1.0, 2.0], "links.bar.body.inertia": [0.01, 0.03]}
    drawn = Members.draw([pendulum()], 64, vary, seed=3)
    assert len(drawn) == 64 * 6 and len(np.unique(drawn.cells)) == 6
    assert drawn.numbers[:, 0].mean() == pytest.approx(-9.81, abs=0.02) and drawn.numbers[:, 0].std() == pytest.approx(
        0.1, rel=0.1
    )
    made = drawn.mechanism(70)
    assert made.gravity[1] == drawn.numbers[70, 0] and made.to_dict()["links"]["bar"]["body"]["mass"] == drawn.numbers[70, 1]


def test_a_regular_motion_has_its_own_readings():
    """The speed of a pendulum at its lowest place by energy; masses that only scale change nothing."""
    found = mbs.ensemble(pendulum(), 1.4, members=3, of=["max(A.vx)"], skip=0, seed=2)
    height = 0.25 * (1 - np.cos(0.3))
    exact = 0.5 * np.sqrt(2 * 9.81 * height / (0.02 + 0.25**2))
    assert found.mean("max(A.vx)") == pytest.approx(exact, rel=1e-4)
    assert found.error("max(A.vx)") < 1e-6 * exact


def run(**given):
    """Twelve members of a rattling crank-rocker with any clearance at B, five turns each."""
    readings, gaps = [FORCE, "onsets(B.normal_force)", "end(B.x)"], {"joints[2].gap": uniform(1e-4, 4e-4)}
    return mbs.ensemble(rattling(), 1.0, **{"members": 12, "of": readings, "each": 0.2, "seed": 5, "vary": gaps} | given)


@pytest.fixture(scope="module")
def chaotic():
    return run()


@pytest.mark.parametrize("pool", [ThreadPoolExecutor, partial(ProcessPoolExecutor, mp_context=get_context("spawn"))])
def test_members_do_not_depend_on_who_runs_them(chaotic, pool):
    with pool(1) as executor:
        assert np.array_equal(run(executor=executor).values, chaotic.values)


def test_means_have_the_errors_of_independent_members(chaotic):
    values = chaotic.of(FORCE)
    assert values.shape == (12, 4)
    assert chaotic.mean(FORCE) == pytest.approx(values.mean())
    assert chaotic.error(FORCE) == pytest.approx(values.mean(axis=1).std(ddof=1) / np.sqrt(12))
    low, high = chaotic.interval(FORCE)
    assert low < chaotic.mean(FORCE) < high
    assert FORCE in str(chaotic) and "12 of 12 members" in chaotic.message


def test_intervals_cover_as_often_as_they_say():
    """1000 draws of 20 members with windows that hang together, from a known distribution."""
    random, covered = np.random.default_rng(0), 0
    for _ in range(1000):
        drawn = Members.draw([pendulum()], 20, {}, 1)
        own = random.normal(3.0, 1.0, (20, 1, 1))
        values = own + random.normal(0.0, 0.5, (20, 5, 1))
        found = mbs.ensembles.result.Ensemble(drawn, ("r",), np.arange(6.0), 0, values, np.ones(20, dtype=bool), [""] * 20)
        low, high = found.interval("r")
        covered += low < 3.0 < high
    assert 930 <= covered <= 970


def test_an_ensemble_goes_on_from_its_file(tmp_path, chaotic):
    store = tmp_path / "ensemble.npz"
    half = replace(chaotic, done=chaotic.done.copy(), values=chaotic.values.copy())
    half.done[5:] = False
    half.values[5:] = np.nan
    half.save(store)
    again = run(store=store)
    assert np.array_equal(again.values, chaotic.values)
    with pytest.raises(ValueError, match="holds another ensemble"):
        run(of=[FORCE], store=store)


def test_several_mechanisms_have_cells_and_given_curves():
    """Pendulums of two amplitudes; less their own speed nothing is left of one, and of the other half."""
    made = [pendulum(0.01), pendulum(0.02)]
    rate = np.sqrt(9.81 * 0.25 / (0.02 + 0.25**2))

    def ideal(time):
        return -0.5 * 0.01 * rate * np.sin(rate * time)

    reading = "rms(A.vx - ideal.vx) / rms(ideal.vx)"
    found = mbs.ensemble(made, 1.0, members=2, of=[reading], curves={"ideal.vx": ideal}, skip=0, each=0.5)
    small, large = found.cells(reading)
    assert (small.mechanism, large.mechanism, small.members) == (0, 1, 2)
    assert small.mean < 1e-3 and large.mean == pytest.approx(1.0, abs=1e-3)


def test_members_that_fail_are_counted_by_name():
    found = mbs.ensemble(
        rattling(), 0.4, members=2, of=[FORCE], each=0.1, solver=mbs.Spectral(mbs.Controlled(tolerance=1e-6, max_steps=200))
    )
    assert found.failed.all() and "TOO_MANY_STEPS" in found.message and np.isnan(found.values).all()


def test_tables_and_figures(chaotic):
    frame = chaotic.frame()
    assert (
        list(frame.columns) == ["member", "window", "joints[2].gap", FORCE, "onsets(B.normal_force)", "end(B.x)"]
        and len(frame) == 60
    )
    assert chaotic.histogram(FORCE).get_xlabel() == f"{FORCE} [N]"
    assert list(chaotic.units.values()) == ["N", "1", "m"]
    assert len(chaotic.section("end(B.x)", FORCE).lines[0].get_xdata()) == 48


def test_a_map_over_two_lists():
    found = mbs.ensemble(
        pendulum(),
        0.5,
        members=1,
        of=["max(A.vx)"],
        skip=0,
        vary={"gravity[1]": [-9.0, -10.0], "links.bar.body.mass": [1.0, 2.0, 3.0]},
    )
    cells = found.cells("max(A.vx)")
    assert len(cells) == 6 and {cell.values["gravity[1]"] for cell in cells} == {-9.0, -10.0}
    drawn = found.map("gravity[1]", "links.bar.body.mass", "max(A.vx)")
    assert drawn.collections[0].get_array().shape == (3, 2)
    assert (drawn.get_xlabel(), drawn.get_ylabel()) == ("gravity[1] [m/s^2]", "links.bar.body.mass [kg]")
    assert drawn.figure.axes[1].get_ylabel() == "mean of max(A.vx) [m/s]"
    assert sorted(drawn.get_yticks()) == [1.0, 2.0, 3.0]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"of": []}, "one reading"), ({"of": ["max(B.nothing)"]}, "nothing"),
        ({"vary": {"links.bar.body.colour": [1.0]}}, "colour"),
        ({"skip": 9}, "skip = 9"), ({"vary": {"gravity[1]": [float("nan")]}}, "finite values"), ({"members": 0}, "members = 0"),
        ({"each": 0.0}, "each = 0"),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_refused_before_any_run(given, said):
    with pytest.raises(ValueError, match=said):
        mbs.ensemble(pendulum(), 0.5, **{"of": ["max(A.vx)"], "members": 2, "skip": 0, **given})
