"""What is typed or measured wrongly: one sentence that names it, before or instead of a search."""

import numpy as np
import pytest
from simulations import pushed
from stopping import press_ctrl_c_at

from buckler.mbs import Link, Mechanism, Revolute, Rigid, Spectral, fit, optimise, simulate
from buckler.mbs.sensitivity.data import Experiment, read_csv
from buckler.mbs.sensitivity.reading import RunFailedError
from buckler.mbs.sensitivity.runs import run
from buckler.studies.kit.cli import main

K, MASS = "loads[0].stiffness", "guides[0].mass"
HEAD = "time [s],place [mm]"
ROWS = [f"{0.01 * k:g},{k * k:g}" for k in range(6)]


def data(tmp_path, text, encoding="utf-8"):
    path = tmp_path / "data.csv"
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([], "needs a line of names and two of numbers"),
        ([HEAD], "needs a line of names and two of numbers"),
        ([HEAD, *ROWS, "0.06"], "line 8: 1 cells for 2 columns"),
        ([HEAD, "0,01,5", *ROWS], "line 2: 3 cells for 2 columns"),
        ([HEAD, *ROWS, "", "0.06,x"], "line 9, place: 'x' is no number"),
        ([HEAD, *ROWS, ROWS[-1]], "time[6] = 0.05 s: times must be finite, 0 at least, and increase"),
        ([HEAD, *ROWS, "nan,1"], "time[6] = nan s: times"),
        ([HEAD, *ROWS, "0.06,inf"], "O.x: must be finite, or nan"),
        (["time [N],place", *ROWS], "time [N]: 'N' is no unit for a quantity in s"),
        (["time,place [foo]", *ROWS], "place [foo]: unknown unit 'foo'"),
        (["place,place", *ROWS], "two columns of the same name"),
        (["time [s],place (left)", *ROWS], "G; write its unit in brackets behind its name"),
        (["0.0,place", *ROWS], "line 1: '0.0' stands where names of columns should"),
        ([",t [s],place", "0,0.00,1", "1,0.01,2"], "line 1: the first column, which has no name, is read as the time; leave out"),
        (["frame,Time (s),place", "0,0.00,1", "1,0.01,2"], "the first column, 'frame', is read as the time"),
        ([HEAD, "12:00:01,1", "12:00:02,2"], "needs a line of names and two of numbers at least; the last line is '12:00:02,2'"),
    ],
)
def test_what_is_no_table(tmp_path, lines, message):
    with pytest.raises(ValueError) as error:
        read_csv(data(tmp_path, "\n".join(lines)), ["place=O.x"])
    assert message in str(error.value) and "data.csv: " in str(error.value)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
@pytest.mark.parametrize(
    ("lines", "column"),
    [
        (["time (s),place (mm)", "{0:g},{1:g}"], "place"),
        (["time (ms),place (mm)", "{2:g},{1:g}"], "place (mm)"),
        (["Time/s,Place/mm", "{0:g},{1:g}"], "Place"),
        (["time,place", "s,mm", "{0:g},{1:g}"], "place"),
        (["time,place", "[s],[mm]", "{0:g},{1:g}"], "place"),
        (["sep=;", "time [s];place [mm]", "{0:g};{1:g}"], "place"),
        (["# run 3", "30 frames a second", "", "time [s],place[mm]", "{0:g},{1:g}"], "place"),
        (["Separator\tTab", "***End_of_Header***\t", "X_Value\tplace", "{0:g}\t{3:g}"], "place"),
        (["time [s];place [mm]\r", "{0:g};{1:g}\r"], "place"),
        (["time [s],place [mm],", "{0:g},{1:g},"], "place"),
        (["t x", "{0:g} {3:g}"], "x"),
        (['"t [s]","x [mm]"', '"{0:.2f}","{1:.2f}"'], "x"),
    ],
)
def test_units_names_and_numbers_as_others_write_them(tmp_path, lines, column, encoding):
    *above, row = lines
    for decimal in ".," if '"' in row or "," not in row else ".":  # where a comma does not part the columns
        numbers = [row.format(0.05 * k, 2.5 * k, 50 * k, 2.5e-3 * k).replace(".", decimal) for k in range(5)]
        found = read_csv(data(tmp_path, "\n".join([*above, *numbers]), encoding), [f"{column}=O.x"])[0]
        assert found.time == pytest.approx(0.05 * np.arange(5))
        assert found.signals["O.x"] == pytest.approx(2.5e-3 * np.arange(5))
        assert (found.units == {"O.x": "mm"}) == ("mm" in "".join(above))


def test_a_clock_is_kept_or_begins_where_it_is_said_to(tmp_path):
    late = data(tmp_path, "\n".join([HEAD, *(f"{12.3 + 0.01 * k:g},{k}" for k in range(6))]))
    with pytest.raises(ValueError, match=r"its time begins at 12\.3 s, later than it lasts: give start=12\.3"):
        read_csv(late, ["place=O.x"])
    assert read_csv(late, ["place=O.x"], start=12.3)[0].time == pytest.approx(0.01 * np.arange(6))
    assert read_csv(late, ["place=O.x"], start=0)[0].time[0] == 12.3
    lines = [HEAD + ",load", *(f"{12.3 + 0.01 * k:g},{k},{k // 3}" for k in range(6))]
    for each in read_csv(data(tmp_path, "\n".join(lines)), ["place=O.x"], ["load"]):  # a setting: from the first row of each
        assert each.time == pytest.approx(0.01 * np.arange(3))


def measured(**more):
    time = np.linspace(0.0, 0.1, 11)
    return Experiment(time, **{"signals": {"O.x": time**2}} | more)


@pytest.mark.parametrize(
    ("experiment", "more", "message"),
    [
        (measured(signals={"O.x": np.full(11, np.nan)}), {}, "data: O.x has no value at any time"),
        (measured(signals={"O.xx": np.zeros(11)}), {}, "no signal 'O.xx'; near it: O.x"),
        (measured(units={"O.x": "N"}), {}, r"data: O.x \[N\]: must be in m"),
        ([[measured()]], {}, r"data\[0\] = .*: must be Experiment; this is a list"),
        (measured(), {"timeout": 0.0}, "timeout = 0"),
        (measured(), {"starts": 0}, "starts = 0: must be a whole number"),
        (measured(), {"profiles": ["O.x"]}, "profiles: 'O.x' is not among"),
    ],
)
def test_wrong_data_of_a_fit(experiment, more, message):
    with pytest.raises(ValueError, match=message):
        fit(pushed(150.0), experiment, free={K: (100.0, 200.0)}, **{"starts": 1} | more)


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({"minimise": "max(O.xx)"}, r"max\(O\.xx\): no signal 'O\.xx'; near it: .*O\.x"),
        ({"subject_to": ["max(O.x) = 10 N ± 1 %"]}, r"subject_to 'max\(O\.x\) = 10 N ± 1 %': max\(O\.x\) is in m"),
        ({"subject_to": ["max(O.x) = 10 mm ± -1 %"]}, "a tolerance is positive"),
        ({"subject_to": ["max(O.x) > 10 mm"]}, "has none of =, <=, >= with a value behind it"),
        ({"minimise": "max(O.x)", "starts": 0}, "starts = 0: must be a whole number"),
    ],
)
def test_wrong_wishes_of_a_design(asked, message):
    with pytest.raises(ValueError, match=message):
        optimise(pushed(150.0), 0.1, free={K: (100.0, 200.0)}, **{"starts": 1} | asked)


def test_why_no_start_leads_to_a_run_is_told():
    why = "narrow the ranges. The first: .*mass = -1.5 kg: must lie in"
    with pytest.raises(RunFailedError, match=why):
        fit(pushed(150.0), measured(), free={MASS: (-2.0, -1.0)}, starts=1)
    with pytest.raises(RunFailedError, match=why):
        optimise(pushed(150.0), 0.1, free={MASS: (-2.0, -1.0)}, minimise="max(O.x)", starts=1)


def test_a_signal_in_other_units_is_told_as_not_explained():
    time = np.linspace(0.0, 0.5, 51)
    place = simulate(pushed(150.0), 0.5).at("O.x", time)
    made = [Experiment(time, {"O.x": factor * place}) for factor in (1.0, 1e3, 1e-3)]
    told = [fit(pushed(150.0), each, free={K: (100.0, 200.0)}, starts=1).unidentified for each in made]
    assert told[0] == [] and all("O.x is explained worse than by its mean" in each[-1] for each in told[1:])


@pytest.mark.parametrize("offset", [0.0, -0.4])
def test_an_angle_from_an_axis_given_as_a_turn_is_told(offset):
    bar = Link("bar", "O", "A", Rigid.of(mass=1.0, inertia=1e-3))
    arm = Mechanism({"O": (0, 0), "A": (0.3, 0)}, [bar], [Revolute("O", "ground", "bar")], gravity=(0, -9.81))
    time = np.linspace(0.0, 0.5, 51)
    data = Experiment(time, {"bar.angle": simulate(arm, 0.5).at("bar.angle", time) + offset})
    told = fit(arm, data, free={"links.bar.body.mass": (0.5, 1.5)}, starts=1).unidentified
    assert any("bar.direction counts from the x axis" in each for each in told) is (offset != 0.0)


def test_numbers_and_values_have_their_units(tmp_path, capsys):
    path = pushed(150.0).save(tmp_path / "block.toml")
    found = fit(pushed(150.0), measured(), free={K: (100.0, 200.0)}, starts=1)
    assert found.units == {K: "N/m", "O.x": "m"} and " N/m  (95 %: " in str(found) and str(found).splitlines()[1].endswith(" m")
    words = ["optimise", str(path), "--duration", "0.1s", "--free", f"{K}=100:200", "--starts", "1"]
    assert main(argv=[*words, "--subject-to", "max(O.x) >= 1 m"]) == 1
    said = capsys.readouterr().out
    assert f"{K}  100 N/m" in said and " m, 97 % off" in said


def test_a_reading_without_a_value_is_told_and_exit_1(tmp_path, capsys):
    path = pushed(150.0).save(tmp_path / "block.toml")
    words = ["sensitivity", str(path), "--duration", "0.1s", "--by"]
    assert main(argv=[*words, K, "--of", "peak(O.x, 3)"]) == 1
    assert "the reading has no value there" in capsys.readouterr().out
    assert main(argv=[*words, f"{K}=-1", "--of", "max(O.x)"]) == 2
    assert "standard deviation of loads[0].stiffness = -1.0 N/m: must lie in (0, inf) N/m" in capsys.readouterr().err
    assert main(argv=[*words, f"{K}=1s", "--of", "max(O.x)"]) == 2
    assert "error: --by loads[0].stiffness=1s: 's' is no unit" in capsys.readouterr().err


def test_ctrl_c_ends_a_search_and_is_no_design_that_fails(monkeypatch):
    """The integrator ends at its next look; to take that for a failure would go on with the search."""
    press_ctrl_c_at(monkeypatch, 3)
    with pytest.raises(KeyboardInterrupt):
        run(pushed(150.0), 1e5, Spectral())
