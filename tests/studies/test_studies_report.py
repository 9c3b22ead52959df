"""Parameters of a study and what is said of wrong ones; what it reports: metrics, tables, files, progress and figures."""

import math
import re

import numpy as np
import pytest
from made_up_study import Parameters, run

from buckler.studies.kit.report import Metric, StudyResult, atomic, write


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"thickness": "2cm"}, "thickness = 2cm: must lie in [1e-05, 0.01] m"),
        ({"thickness": "3kg"}, "thickness = 3kg: must be in m"),
        ({"thickness": math.nan}, "thickness = nan m: must lie in [1e-05, 0.01] m"),
        ({"thickness": True}, "thickness = true: must be a number, or one with a unit"),
        ({"speed": "1e999"}, "speed = inf rad/s: must lie in [-100, 100] rad/s"),
        ({"elements": 8.5}, "elements = 8.5: must be a whole number in [1, 64]"),
        ({"models": "strut,shell"}, "models[1] = 'shell': must be one of 'stitched', "),
        ({"models": "beam,beam"}, "models = ('beam', 'beam'): must not contain an item twice"),
        ({"ending": "sad"}, "ending = 'sad': must be one of 'fine', 'suspect', 'raises'"),
        ({"widths": (0.03, 5)}, "widths[1] = 5 m: must lie in [0.001, 1] m"),
        ({"elements": 13, "thickness": "2mm"}, "elements = 13: not with a thickness above 0.001 m"),
    ],
)
def test_wrong_parameters_name_value_range_and_unit(given, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
        Parameters(**given)


def test_parameters_read_numbers_strings_and_arrays():
    made = Parameters(thickness="0.3mm", widths=np.array([0.01, 0.02]), elements=np.int64(4), models="beam, strut")
    assert (made.thickness, made.widths, made.elements) == (3e-4, (0.01, 0.02), 4)
    assert made.models == ("beam", "strut")
    assert made == Parameters(thickness=3e-4, widths="1cm,20mm", elements="4", models=["beam", "strut"])


def test_error_is_relative_to_the_exact_value_or_the_studys_own():
    assert Metric(0.99, "N", exact=-1.1).error == pytest.approx(1.9)
    assert Metric(1.01, "N", exact=1.0).error == pytest.approx(0.01)
    assert Metric(1.0, "N", error=0.02).error == 0.02
    assert Metric(1.0, "N", published=2.0).error is None
    assert Metric(1.0, "N", exact=0.0).error is None


def test_a_value_that_is_zero_shows_its_error_in_its_unit():
    metrics = {
        "zero": Metric(0.0, "N", absolute=6.4e-8),
        "force": Metric(2.0, "N", error=0.01),
        "stress": Metric(0.0, "Pa", absolute=2e3),
    }
    assert metrics["zero"].format() == "0 ± 6.4e-08" and metrics["force"].error_in_unit == pytest.approx(0.02)
    lines = str(StudyResult(parameters=Parameters(), metrics=metrics)).splitlines()
    assert [re.split(r" {2,}", line.strip())[-1] for line in lines[2:]] == ["± 6.4e-08 N", "1 %", "± 0.002 MPa"]


def test_result_that_is_not_ok_must_say_why():
    with pytest.raises(ValueError, match="SUSPECT"):
        StudyResult(parameters=Parameters(), status="SUSPECT")


def test_file_is_written_whole_or_not_at_all(tmp_path):
    (tmp_path / "data").write_bytes(b"old")
    with pytest.raises(RuntimeError), atomic(tmp_path / "data") as file:
        file.write(b"half")
        raise RuntimeError
    assert [path.name for path in tmp_path.iterdir()] == ["data"]
    assert (tmp_path / "data").read_bytes() == b"old"
    with (tmp_path / "data").open("rb") as reader:
        with atomic(tmp_path / "data") as file:
            file.write(b"new")
            assert (tmp_path / "data").read_bytes() == b"old"
        assert reader.read() == b"old"  # a reader keeps the file that was opened
    assert (tmp_path / "data").read_bytes() == b"new"


def test_metrics_json_comes_last_so_that_it_vouches_for_the_rest(tmp_path):
    class Unsavable:
        def savefig(self, *_, **__):
            raise OSError("disk full")

    result = run(Parameters())
    write(result, tmp_path, {})
    with pytest.raises(OSError, match="disk full"):
        write(result, tmp_path, {"history": Unsavable()})
    assert not (tmp_path / "metrics.json").exists()
