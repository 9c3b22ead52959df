"""The design study: what it finds, what it says of what cannot be had, its tables, figure and command line."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from drawing import inked

from buckler.studies.kit.cli import main
from buckler.studies.striking import design as study
from buckler.studies.striking import design_check, design_figure
from buckler.studies.striking.design_check import CheckedTurn, random_wishes
from buckler.studies.striking.impact import ModelRun
from buckler.studies.striking.inverse import design
from buckler.studies.striking.inverse_limits import feasible, limits


@pytest.fixture(autouse=True)
def coarse_map(monkeypatch):
    monkeypatch.setattr(design_figure, "POINTS", 40)


@pytest.fixture(scope="module")
def result():
    return study.run(study.Parameters(wishes=2))


def value(result, name):
    return result.metrics[name].value


def drawn(result):
    """The figure: map, its stop axis and the turn of the crank, all named."""
    above, below, stop = inked(study, result).axes
    assert above.get_legend() is not None and below.get_legend() is not None
    assert "stop" in stop.get_ylabel() and "[mm]" in stop.get_ylabel()
    assert all("[" in ax.get_xlabel() and "[" in ax.get_ylabel() for ax in (above, below))
    return {text.get_text() for text in above.get_legend().get_texts()}


def test_strut_does_what_was_asked_and_beam_is_reported(result):
    assert result.status == "OK" and value(result, "feasible") == 1, result.message
    for name, wished, bar in (("contact_force", 2.0, 5e-3), ("impact_force", 30.0, 2e-2)):
        assert result.metrics[f"strut.{name}"].exact == wished and result.metrics[f"strut.{name}"].error < bar
        assert value(result, f"around.strut.{name}.largest") < bar
    assert value(result, "strut.contact_angle") == pytest.approx(120, abs=0.5)
    assert value(result, "around.wishes") == 2 and value(result, "around.strut.contact_angle.largest") < np.radians(0.5)
    assert result.metrics["beam.contact_force"].error < 5e-3
    assert value(result, "beam.impact_force") > 4 * 30  # a straight strip buckles late: said, not designed for
    assert value(result, "around.beam.impact_force.median") > 1
    assert value(result, "strut.settled") < value(result, "beam.settled") < 180


def test_design_is_that_of_the_closed_form_and_shown(result):
    d = design(study.Parameters().wish, study.Parameters().given)
    assert (value(result, "thickness"), value(result, "speed"), value(result, "width")) == (d.thickness, d.speed, 0.030)
    assert value(result, "contact_time") == pytest.approx(np.radians(120) / d.speed, rel=1e-12)
    words = "found given wish strut beam Limits buckling 0.000315".split()
    assert all(word in str(result) for word in [*words, "random wishes", "True dry friction"])
    named = drawn(result)
    assert {"design", "can be had", "yield", "buckling", "2 N, width 30 mm"} <= named and "asked for" not in named


def test_what_cannot_be_had_is_answered_by_the_nearest():
    result = study.run(study.Parameters(contact_force="0.1N", models="strut", wishes=0))
    assert result.status == "INFEASIBLE"
    assert "\n" not in result.message
    assert re.match(r"buckling: .* allowed .*; nearest wish that can be had: ", result.message)
    near = [float(x) for x in re.search(r"had: (\S+) N, (\S+) N, (\S+) deg", result.message).groups()]
    again = study.Parameters(contact_force=near[0], impact_force=near[1], contact_angle=f"{near[2]}deg", models="strut", wishes=0)
    assert feasible(design(again.wish, again.given))
    assert value(result, "feasible") == 0
    assert value(result, "wish.contact_force") == pytest.approx(near[0], rel=1e-3)
    assert result.metrics["strut.contact_force"].error < 5e-3  # of the nearest, which was simulated
    assert "Nearest that can be had" in str(result)
    assert {"asked for", "design", "can be had"} <= drawn(result)


def test_nothing_at_all_can_be_had():
    result = study.run(study.Parameters(slowest=500, fastest=1000, models="strut", wishes=0))
    assert result.status == "INFEASIBLE" and "no wish" in result.message
    assert re.search(r"speed .* broken|speed .* at least", str(result))
    named = drawn(result)
    assert "asked for" in named and not {"design", "can be had"} & named


def test_a_simulation_off_the_wish_is_suspect(monkeypatch):
    def wrong(model, d, *how):
        return design_check.check(model, d, *how)._replace(impact_force=1.03 * d.wish.impact_force)

    monkeypatch.setattr(study, "check", wrong)
    result = study.run(study.Parameters(models="strut", wishes=0))
    assert result.status == "SUSPECT"
    assert result.message == "strut: impact_force off by more than 2 %"


def test_a_simulation_that_fails_gives_its_status():
    result = study.run(study.Parameters(models="strut", wishes=0, timeout=0.01, tolerance=1e-9))
    assert result.status == "TIMED_OUT"
    assert result.message.startswith("strut: ")


def test_random_wishes_repeat_and_keep_their_limits():
    d = design(study.Parameters().wish, study.Parameters().given)
    first, second = random_wishes(d, 5, 7), random_wishes(d, 5, 7)
    assert len(first) == 5 and [x.thickness for x in first] == [x.thickness for x in second]
    assert all(feasible(x) for x in first)
    assert random_wishes(d, 5, 8)[0].thickness != first[0].thickness


def made_up(angle, force):
    zero = np.zeros_like(angle)
    return CheckedTurn.of(ModelRun("strut", "OK", "", angle, angle, np.maximum(force, 0), zero + 1, zero, zero, zero, 0.0, {}))


def test_reading_of_a_slider_that_never_meets_the_stop():
    angle, p = np.linspace(0, 6, 50), study.Parameters(models="strut")
    turn = made_up(angle, np.zeros(50))
    assert np.isnan(turn[:4]).all()
    assert study._verdict(p, design(p.wish, p.given), {"strut": turn}, [], [])["status"] == "SUSPECT"


@pytest.mark.parametrize("impact", [9, 1])
def test_reading_of_made_up_contacts(impact):
    """Impact of 9 or 1 N from 2.0 rad, rebound, rest from 2.5 to 4.0 rad with 3 N at the dead centre."""
    angle = np.linspace(0, 6, 6001)
    force = np.where((angle > 2.0) & (angle < 2.1), impact * np.sin((angle - 2.0) * np.pi / 0.1), 0.0)
    force += np.where((angle > 2.5) & (angle < 4.0), 3 - (angle - np.pi) ** 2, 0.0)
    turn = made_up(angle, force)
    assert (turn.impact_force, turn.contact_force) == (pytest.approx(impact, rel=1e-3), pytest.approx(3, rel=1e-3))
    assert (turn.contact_angle, turn.settled) == (pytest.approx(2.0, abs=3e-3), pytest.approx(2.5, abs=2e-3))


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"speed": 2}, "speed = 2, mass = 0.3, stop_stiffness = 72000: exactly one of them must be 0"),
        ({"width": 0}, "thickness = 0, width = 0: exactly one of them must be 0"),
        ({"crank": 0.4}, "crank = 0.4 m: must be shorter than the coupler"),
        ({"slowest": 5, "fastest": 2}, "slowest = 5 rad/s: must not exceed fastest = 2 rad/s"),
        ({"heaviest": 1e-5}, "lightest = 0.001 kg: must not exceed heaviest"),
        ({"contact_angle": "400deg"}, "contact_angle = 400deg"),
    ],
)
def test_wrong_input_is_named(given, text):
    with pytest.raises(ValueError, match=re.escape(text)):
        study.Parameters(**given)


def test_command_line(tmp_path, capsys):
    wish = ["--contact-force", "2N", "--impact-force", "30N", "--contact-angle", "60deg", "--speed", "2", "--stop-stiffness", "0"]
    options = [*wish, "--models", "strut", "--wishes", "0", "--out", str(tmp_path)]
    assert main("design", options) == 0
    printed = capsys.readouterr().out
    assert "60 deg in contact" in printed and "stop_stiffness" in printed
    assert (tmp_path / "design" / "figure.png").exists()
    assert main("design", [*options, "--contact-force", "200N"]) == 1
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and "INFEASIBLE" in lines[0] and "nearest wish that can be had" in lines[0]


# --- the how-to -------------------------------------------------------------------------------------------------------

PAGE = (Path(__file__).parents[2] / "docs" / "how-to-design.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


def test_commands_of_the_how_to_end_as_it_says(tmp_path, capsys):
    commands = [shlex.split(line)[1:] for kind, block in BLOCKS if kind == "sh" for line in block.splitlines()]
    assert [command[:2] for command in commands] == [["run", "design"]] * 3
    quick = ["--models", "strut", "--wishes", "0", "--out", str(tmp_path)]
    assert main(argv=[*commands[0], *quick]) == 0
    assert main(argv=[*commands[1], *quick]) == 1
    assert main(argv=[*commands[2], "--models", "beam", *quick[2:]]) == 0
    promised = re.search(r"`INFEASIBLE: (.*?)`", PAGE, re.DOTALL)[1]
    assert " ".join(promised.split()) in capsys.readouterr().err


def test_code_of_the_how_to_runs(capsys):
    names = {}
    for kind, block in BLOCKS:
        if kind == "python":
            exec(compile(block, "how-to-design.md", "exec"), names)
    assert names["result"].contact_force == pytest.approx(2.0, rel=5e-3)
    assert feasible(design(names["instead"], None)) and names["many"].speed.shape == (400, 250)
    assert re.search(r"\d+% can be had, strips of 0\.\d+ mm and more", capsys.readouterr().out)


def test_the_how_to_names_every_limit():
    known = {limit.name for limit in limits(design(study.Parameters().wish, study.Parameters().given))}
    table = PAGE[PAGE.index("| limit |") : PAGE.index("## From Python")]
    assert known == {name for row in table.splitlines()[2:] if row for name in row.split("|")[1].strip().split(", ")}


@pytest.mark.slow
def test_beam_presses_as_designed_wherever_it_comes_to_rest():
    """Its impact is another one, but equilibrium is equilibrium."""
    p = study.Parameters(thickness=0, friction_force=0.05)
    errors = []
    for d in random_wishes(design(p.wish, p.given), 30, 5):
        o = design_check.check("beam", d)
        if o.settled < np.radians(165):
            errors.append(abs(o.contact_force / d.wish.contact_force - 1))
        assert o.impact_force > 1.2 * d.wish.impact_force
    assert len(errors) >= 10
    assert np.median(errors) < 2e-3
