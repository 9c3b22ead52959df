"""Designs against closed forms."""

import numpy as np
import pytest
from simulations import guided, pushed, slim
from stopping import stop_at

from buckler import mbs
from buckler.mbs.laws import KelvinVoigt
from buckler.mbs.process import Interrupted
from buckler.mbs.sensitivity.reading import RunFailedError
from buckler.mbs.sensitivity.searching import parse_constraint

K, F = "loads[0].stiffness", "loads[1].value[0]"


def test_softest_spring_that_keeps_its_way():
    """The largest push that goes no farther than 30 mm with a spring of at most 180 N/m is k x/2."""
    found = mbs.optimise(
        pushed(150.0), 0.4, free={K: (100.0, 180.0), F: (1.0, 5.0)}, minimise="push",
        subject_to=["max(O.x) <= 30 mm"], readings={"push": lambda m: -m.loads[1].value[0]}, starts=2,
    )  # fmt: skip
    assert found.possible and found.values[F] == pytest.approx(180 * 0.03 / 2, rel=1e-4)
    assert found.binding == [f"{K} = high end", "max(O.x) <= 30 mm"]
    assert abs(found.changes["max(O.x)"]) < 1e-5


def test_values_that_are_asked_for():
    """Two wishes, two numbers: 40 mm after 0.1 s."""
    found = mbs.optimise(pushed(150.0), 0.3, free={K: (100.0, 900.0), F: (1.0, 20.0)},
                     subject_to=["max(O.x) = 40 mm ± 0.1 %", "when(O.x, 0.02, 1) = 50 ms ± 0.1 %"], starts=4)  # fmt: skip
    stiffness = 0.5 * (np.pi / 0.1) ** 2
    assert found.possible
    assert found.values[K] == pytest.approx(stiffness, rel=3e-3)
    assert found.values[F] == pytest.approx(0.04 * stiffness / 2, rel=3e-3)


def test_what_cannot_be_had_is_said():
    found = mbs.optimise(pushed(150.0), 0.3, free={K: (100.0, 180.0)}, subject_to=["max(O.x) = 100 mm"], starts=2)
    assert not found.possible and "none" in found.message and found.binding[0] == f"{K} = low end"


def test_a_budget_of_runs():
    """It ends the search; the best so far is shown with what it misses, and a search that has what it wants does not care."""
    asked = {"free": {K: (100.0, 900.0), F: (1.0, 20.0)}, "subject_to": ["max(O.x) = 40 mm", "when(O.x, 0.02, 1) = 50 ms"]}
    short, whole = (mbs.optimise(pushed(150.0), 0.3, **asked, starts=2, budget=budget) for budget in (3, 100))
    assert whole.complete and whole.possible and not whole.message and 4 < whole.runs < 30
    assert not short.complete and not short.possible and short.runs == 4  # the finer one among them
    way = 2 * short.values[F] / short.values[K]
    said = f"the budget of 3 runs was used up; the best so far misses max(O.x) = 40 mm: {str(way)[:6]}"
    assert short.message.startswith(said)
    assert short.message.endswith("% off")
    least = mbs.optimise(pushed(150.0), 0.4, free={K: (100.0, 180.0)}, minimise="max(O.x)", starts=2, budget=2)
    assert least.possible and not least.complete and least.message == "the budget of 2 runs was used up: this is the best so far"
    with pytest.raises(ValueError, match="budget = 0"):
        mbs.optimise(pushed(150.0), 0.4, free={K: (100.0, 180.0)}, minimise="max(O.x)", budget=0)


def test_where_a_search_begins():
    """A start that does as wished is the design, and nothing else is run but the finer one."""
    wish = {"free": {K: (100.0, 900.0), F: (1.0, 20.0)}, "subject_to": ["max(O.x) = 40 mm"]}
    found = mbs.optimise(pushed(150.0), 0.3, **wish, start={K: 300.0, F: 6.0})
    assert found.values == {K: pytest.approx(300.0), F: pytest.approx(6.0)} and found.runs == 2
    with pytest.raises(ValueError, match="must lie in its range, 100 to 900"):
        mbs.optimise(pushed(150.0), 0.3, **wish, start={K: 50.0})
    with pytest.raises(ValueError, match="free has no range of that name"):
        mbs.optimise(pushed(150.0), 0.3, **wish, start={"k": 300.0})


def struck(push, gap):
    """A block pushed steadily from rest against an elastic stop, 1e4 N/m, after a gap."""
    return guided(loads=[mbs.Force("O", (push, 0.0))], stops=[mbs.Stop("O", at=gap, law=KelvinVoigt(1e4, 0.0))])


def test_a_contact_that_is_not_there_yet_waits_for_the_others():
    """At first the stop is not reached in time: x = F t^2/2m = 10 mm sets F = 4 N, then k x^2/2 = F (g + x) the gap for 90 N."""
    found = mbs.optimise(struck, 0.35, free={"push": (0.1, 10.0), "gap": (0.05, 0.2)}, start={"push": 0.5, "gap": 0.15}, starts=1,
                     subject_to=["at(O.x, 0.05) = 10 mm", "peak(O.contact_force, 1) = 90 N"], budget=40)  # fmt: skip
    assert found.possible and found.values["push"] == pytest.approx(4.0, rel=2e-3)
    assert found.values["gap"] == pytest.approx(90**2 / (2 * 1e4 * 4.0) - 90 / 1e4, rel=5e-3)


def test_what_a_finer_run_says_is_met():
    """Steps so long that the finer run is 8 % off what the search had: the constraint holds for that one."""
    rough = mbs.Spectral(mbs.Controlled(tolerance=3e-2))
    found = mbs.optimise(
        pushed(150.0), 5.0, free={F: (1.0, 20.0)}, subject_to=["end(O.x) = 20 mm ± 0.1 %"], starts=2, solver=rough
    )
    assert found.possible and abs(found.changes["end(O.x)"]) > 0.05 * 0.02


@pytest.mark.parametrize("high", [1.2, 1e2, 1e5, np.inf])
def test_a_bound_is_kept_whatever_the_other_end_of_its_band(high):
    """The lightest block that is slow enough, m = k (T/pi)^2 for half an oscillation in T: 1e-6, not a share of the band."""
    bound = np.pi * 0.05
    readings = {"mass": lambda m: m.guides[0].mass, "time": lambda m: np.pi * (m.guides[0].mass / 200) ** 0.5}
    found = mbs.optimise(lambda mass: pushed(200.0, mass), free={"mass": (0.1, 2.0)}, minimise="mass",
                     subject_to=[("time", bound, high)], readings=readings, starts=3)  # fmt: skip
    assert found.possible and found.complete and len(found.binding) == 1
    assert found.readings["time"] >= bound * (1 - 1e-6)
    assert found.values["mass"] == pytest.approx(0.5, rel=3e-6)


def test_an_unstable_rest_has_no_frequency():
    """A strip pressed beyond its load, P = pi^2 E b h^3/12 L^2."""

    def column(thickness):
        strip = slim(thickness)
        return mbs.Mechanism.from_dict(strip.to_dict() | {"loads": [{"kind": "Force", "point": "B", "value": [-3.0, 0.0]}]})

    critical = (3.0 * 12 * 0.3**2 / (np.pi**2 * 210e9 * 0.02)) ** (1 / 3)
    with pytest.raises(RunFailedError, match="UNSTABLE"):
        mbs.sensitivities(column, by=["thickness"], at={"thickness": 0.9 * critical}, of="frequency(1)")


def test_constraints_as_text():
    assert parse_constraint("max(B.x) = 1.5 N ± 1 %")[1:4] == ("max(B.x)", 1.485, 1.515)
    assert parse_constraint("end(B.x) >= 2 mm")[1:4] == ("end(B.x)", 0.002, np.inf)
    assert parse_constraint(("end(B.x)", 1, 2))[1:4] == ("end(B.x)", 1.0, 2.0)
    with pytest.raises(ValueError, match="write for instance"):
        parse_constraint("end(B.x) about 2 mm")
    with pytest.raises(ValueError, match="a tolerance is that of a value, not of >="):
        parse_constraint("end(B.x) >= 2 mm ± 1 %")
    with pytest.raises(ValueError, match="neither"):
        mbs.optimise(pushed(150.0), 0.1, free={K: (100.0, 180.0)})


def test_command(tmp_path, capsys):
    from buckler.studies.kit.cli import main

    path = pushed(150.0).save(tmp_path / "block.toml")
    words = ["optimise", str(path), "--duration", "0.4s", "--free", f"{K}=1e2N/m:9e2N/m", "--starts", "2"]
    assert main(argv=[*words, "--subject-to", "max(O.x) = 10 mm ± 0.1 %"]) == 0
    said = capsys.readouterr().out
    assert abs(float(said.split(K)[1].split()[0]) - 600) < 2 and "binding" in said
    assert main(argv=[*words, "--subject-to", "max(O.x) is small"]) == 2


def test_a_search_whose_time_is_over_shows_its_best_so_far(monkeypatch):
    asked = {"free": {K: (100.0, 180.0)}, "minimise": "max(O.x)"}
    whole = mbs.optimise(pushed(150.0), 0.4, **asked, starts=2)
    stop_at(monkeypatch, 5)
    found = mbs.optimise(pushed(150.0), 0.4, **asked, starts=2, timeout=3600.0)
    assert whole.complete and not found.complete and found.runs < whole.runs
    assert found.message == "timeout = 1 s is over: this is the best so far"
    assert 100 <= found.values[K] <= 180
    stop_at(monkeypatch, 5, "Ctrl-C")
    with pytest.raises(Interrupted) as stop:
        mbs.optimise(pushed(150.0), 0.4, **asked, starts=2)
    assert stop.value.result.values == found.values and stop.value.result.message == "Ctrl-C: this is the best so far"
