"""What a study reports: metrics, tables, files, progress and figures."""

import io
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from made_up_study import Parameters, figure, run

from buckler.studies.kit.files import atomic, to_json, write
from buckler.studies.kit.report import QUIET, Metric, Progress, StudyResult, Table
from buckler.studies.kit.style import STYLE, subplots

ROOT = Path(__file__).parents[2]


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
    assert metrics["zero"].format() == "0 ± 6.4e-08" and metrics["force"].off == pytest.approx(0.02)
    lines = str(StudyResult(parameters=Parameters(), metrics=metrics)).splitlines()
    assert [re.split(r" {2,}", line.strip())[-1] for line in lines[2:]] == ["± 6.4e-08 N", "1 %", "± 0.002 MPa"]


def test_result_that_is_not_ok_must_say_why():
    with pytest.raises(ValueError, match="SUSPECT"):
        StudyResult(parameters=Parameters(), status="SUSPECT")


def test_own_tables_replace_the_table_of_metrics():
    tables = [Table(["h [mm]", "F [N]"], [[0.1, 0.0655]], title="Table 2", notes="measured")]
    text = str(StudyResult(parameters=Parameters(), metrics={"m": Metric(1, "N")}, tables=tables))
    assert re.fullmatch(r"Table 2\n +h \[mm\] +F \[N\]\n[- ]+\n +0\.1 +0\.0655\nmeasured", text)


def test_json_of_numpy_and_unfinite_values():
    content = {"a": np.array([1.0, np.nan]), "b": (np.float32(0.5), np.inf), "c": Path("x"), "d": np.bool_(True)}
    assert json.loads(to_json(content)) == {"a": [1.0, None], "b": [0.5, None], "c": "x", "d": True}


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


def test_earlier_metrics_cannot_name_files_elsewhere(tmp_path):
    (tmp_path / "precious").write_text("")
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "metrics.json").write_text('{"files": ["../precious"]}')
    write(run(Parameters()), tmp_path / "here", {})
    assert (tmp_path / "precious").exists()


def test_progress_stays_silent_on_short_work_and_shows_on_a_terminal(capsys, monkeypatch):
    assert list(Progress()(range(3))) == [0, 1, 2]
    assert list(QUIET(iter("ab"), total=2)) == ["a", "b"]
    assert capsys.readouterr() == ("", "")

    class Terminal(io.StringIO):
        def isatty(self):
            return True

    times = iter(range(10**6))
    monkeypatch.setattr("tqdm.std.time", lambda: float(next(times)))  # each look at the clock is a second later
    monkeypatch.setattr(sys, "stderr", terminal := Terminal())
    assert list(Progress()(range(30), label="cases")) == list(range(30))
    assert "cases" in terminal.getvalue()
    show = Progress().forecast("arch")
    for done in (0.0, 0.4, 1.0, 0.2, 0.9, 0.1):  # three runs, the second one not to its end
        show(done)
    assert "arch run 1:  40%" in terminal.getvalue() and "arch run 2:  90%" in terminal.getvalue()
    assert "arch run 3:  10%" in terminal.getvalue()
    assert QUIET.forecast("arch") is False


def test_figures_are_a_column_wide_and_legible():
    fig, axes = subplots(1, 2, height=60, sharex=True)
    assert fig.get_size_inches() * 25.4 == pytest.approx([160, 60])
    assert axes.shape == (2,)
    assert axes[0].xaxis.label.get_size() == STYLE["axes.labelsize"] == 9


def test_same_figure_is_the_same_file(tmp_path):
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write(run(Parameters()), tmp_path / name, figure(run(Parameters())))
    for name in ("history.pdf", "history.png"):
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes()
    assert b"CreationDate" not in (tmp_path / "one" / "history.pdf").read_bytes()


def test_no_text_of_a_figure_is_below_seven_points():
    """Of sources: studies that run long are not drawn in the tests."""
    small = re.compile(r"(?:fontsize|labelsize|titlesize|font\.size)[\"']?\s*[=:]\s*([\d.]+)")
    sources = [path for room in ("studies", "mbs/view") for path in (ROOT / room).rglob("*.py")]
    found = [(path.name, size) for path in sources for size in small.findall(path.read_text(encoding="utf-8")) if float(size) < 7]
    assert found == []
