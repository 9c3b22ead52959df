"""The study command line, on a study that exists only here and on the one the how-to shows."""

import importlib
import io
import json
import math
import os
import re
import runpy
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from studies import registry
from studies.cli import main
from studies.parameters import StudyParameters, choice, choices, integer, parse_quantity, quantities, quantity
from studies.report import QUIET, Metric, Progress, StudyResult, Table, atomic, to_json, write
from studies.style import STYLE, subplots

ROOT = Path(__file__).resolve().parent.parent


@dataclass(frozen=True)
class Parameters(StudyParameters):
    thickness: float = quantity(3e-4, "m", 1e-5, 1e-2, "thickness of the strip", "strip")
    speed: float = quantity(1.25, "rad/s", -100, 100, "speed of the crank", "drive")
    restitution: float = quantity(0.8, "1", 0, 1, "restitution, 80 % by default")
    widths: tuple[float, ...] = quantities((0.03,), "m", 1e-3, 1, "widths to run", "strip")
    elements: int = integer(8, 1, 64, "beam elements")
    ending: str = choice("fine", ("fine", "suspect", "raises", "interrupts", "undrawable", "prints"), "how it ends")
    models: tuple[str, ...] = choices(("strut",), ("stitched", "strut", "beam"), "models to run")

    def check(self):
        if self.elements == 13 and self.thickness > 1e-3:
            raise ValueError("elements = 13: not with a thickness above 0.001 m")


def run(parameters, progress=QUIET):
    for _ in progress(range(3), label="cases"):
        pass
    if parameters.ending == "raises":
        raise ZeroDivisionError("no stiffness left")
    if parameters.ending == "interrupts":
        raise KeyboardInterrupt
    if parameters.ending == "prints":
        print("engine chatter")
    suspect = {"status": "SUSPECT", "message": "energy grew by 3 %"} if parameters.ending == "suspect" else {}
    metrics = {
        "force": Metric(np.float64(1.7), "N", published=1.7684, exact=1.72465),
        "lost": Metric(math.nan, "J"),
    }
    signals = {"time": np.linspace(0, 1, 5), "force": np.arange(5.0)}
    return StudyResult(
        parameters=parameters,
        metrics=metrics,
        signals=signals,
        work={"steps": np.int64(5), "peak": math.inf},
        **suspect,
    )


def figure(result):
    if result.parameters.ending == "undrawable":
        raise RuntimeError("no ink")
    fig, ax = subplots(height=60)
    ax.plot(result.signals["time"], result.signals["force"], label="force")
    ax.set(xlabel="time [s]", ylabel="force [N]")
    return {"history": fig}


@pytest.fixture
def dummy(monkeypatch, tmp_path):
    """Run the study of this file: `dummy("--thickness", "1mm")` returns the exit status, files go to dummy.folder."""
    module = ModuleType("dummy_study", "A study for tests.\n\nNot shown in the help.")
    module.Parameters, module.run, module.figure = Parameters, run, figure
    monkeypatch.setitem(sys.modules, "dummy_study", module)
    monkeypatch.setitem(registry.STUDIES, "dummy", registry.Entry("dummy_study", "a study for tests"))

    def call(*words):
        return main(argv=["run", "dummy", "--out", str(tmp_path), *words])

    call.folder = tmp_path / "dummy"
    return call


def metrics_of(folder):
    """Content of metrics.json, refusing the NaN and Infinity that only Python's reader takes."""

    def refuse(word):
        raise AssertionError(f"{word} is no JSON")

    return json.loads((folder / "metrics.json").read_text(), parse_constant=refuse)


# --- units and parameters ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("0.3mm", "m", 3e-4),
        ("3e-4", "m", 3e-4),
        ("0.3e-3m", "m", 3e-4),
        ("300um", "m", 3e-4),
        ("300 µm", "m", 3e-4),
        ("-2.5cm", "m", -0.025),
        (".5e1 mm", "m", 5e-3),
        ("12rpm", "rad/s", 12 * math.pi / 30),
        ("300r/min", "rad/s", 10 * math.pi),
        ("1.25rad/s", "rad/s", 1.25),
        ("180deg", "rad", math.pi),
        ("180°", "rad", math.pi),
        ("300g", "kg", 0.3),
        ("68kN/m", "N/m", 68e3),
        ("68N/mm", "N/m", 68e3),
        ("5ms", "s", 5e-3),
        ("2min", "s", 120),
        ("210GPa", "Pa", 210e9),
        ("253 N.s/m", "N.s/m", 253),
        ("253N·s/mm", "N.s/m", 253e3),
        ("253 N s/mm", "N.s/m", 253e3),
        ("2.53e5 N/mm^1.5", "N/m^1.5", 2.53e5 * 1e3**1.5),
        ("14.175 N.mm²", "N.m^2", 14.175e-6),
        ("7.85 g/cm^3", "kg/m^3", 7850),
        ("2500mV", "V", 2.5),
        ("80%", "1", 0.8),
        ("7Hz", "1/s", 7),
        ("3", "mm", 3),
        ("3cm", "mm", 30),
    ],
)
def test_quantities_with_units(text, unit, value):
    assert parse_quantity(text, unit) == pytest.approx(value, rel=4e-16, abs=0)


@pytest.mark.parametrize("text", ["300um", "0.3mm", "0.03cm", "3e2um", "0.3e-3m"])
def test_decimal_prefixes_are_exact(text):
    assert parse_quantity(text, "m") == 3e-4


@pytest.mark.parametrize(
    ("text", "unit", "reason"),
    [
        ("5kg", "m", "'kg' is no unit for a quantity in m"),
        ("20Hz", "rad/s", "'Hz' is no unit"),
        ("5N/m", "N.s/m", "'N/m' is no unit"),
        ("1m", "1", "no unit for a quantity in plain numbers"),
        ("5furlong", "m", "unknown unit 'furlong'"),
        ("5mdeg", "rad", "unknown unit 'mdeg'"),
        ("5m/", "m", "unknown unit 'm/'"),
        ("5m)", "m", "unknown unit"),
        ("thin", "m", "not a number"),
        ("", "m", "not a number"),
        ("nan", "m", "not a number"),
        ("1,5mm", "m", "unknown unit"),
    ],
)
def test_wrong_quantities_say_why(text, unit, reason):
    with pytest.raises(ValueError, match=re.escape(reason)):
        parse_quantity(text, unit)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"thickness": -1}, "thickness = -1 m: out of range; allowed: 1e-05 to 0.01 m"),
        ({"thickness": "2cm"}, "thickness = 2cm: out of range; allowed: 1e-05 to 0.01 m"),
        ({"thickness": "3kg"}, "thickness = 3kg: 'kg' is no unit for a quantity in m; allowed: 1e-05 to 0.01 m"),
        ({"thickness": math.nan}, "thickness = nan m: out of range; allowed: 1e-05 to 0.01 m"),
        ({"thickness": True}, "thickness = True m: not a number; allowed: 1e-05 to 0.01 m"),
        ({"thickness": None}, "thickness = None m: not a number; allowed: 1e-05 to 0.01 m"),
        ({"restitution": 1.1}, "restitution = 1.1: out of range; allowed: 0 to 1"),
        ({"speed": "1e999"}, "speed = 1e999: out of range; allowed: -100 to 100 rad/s"),
        ({"elements": 8.5}, "elements = 8.5: not a whole number; allowed: 1 to 64"),
        ({"elements": "8.0"}, "elements = 8.0: not a whole number; allowed: 1 to 64"),
        ({"elements": 65}, "elements = 65: out of range; allowed: 1 to 64"),
        ({"models": "strut,shell"}, "models = strut,shell: not one of the options; allowed: one or more of stitched, "),
        ({"models": ()}, "models = : none given; allowed: one or more of stitched, strut, beam"),
        ({"models": "beam,beam"}, "models = beam,beam: one of them given twice"),
        ({"ending": "sad"}, "ending = sad: not one of the options; allowed: fine, suspect, raises"),
        ({"widths": (0.03, 5)}, "widths = 0.03 m,5 m: out of range; allowed: one or more of 0.001 to 1 m"),
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


def test_ranges_are_closed_and_what_is_not_finite_is_out():
    assert [Parameters(restitution=end).restitution for end in (0, 1)] == [0, 1]
    assert [Parameters(elements=end).elements for end in (1, 64)] == [1, 64]

    @dataclass(frozen=True)
    class Unbounded(StudyParameters):
        load: float = quantity(1, "N", 0, math.inf, "load")

    with pytest.raises(ValueError, match="load = inf N: out of range; allowed: 0 to inf N"):
        Unbounded(load=math.inf)


# --- list, help, wrong input ------------------------------------------------------------------------------------------


def test_list_names_every_study_and_imports_nothing_heavy():
    code = (
        "import sys; from studies.cli import main; status = main(argv=['list'])\n"
        "heavy = {'numpy', 'scipy', 'exudyn', 'matplotlib', 'tqdm', 'tabulate', 'numba', 'meshio'} & set(sys.modules)\n"
        "raise SystemExit(f'imported {sorted(heavy)}' if heavy else status)"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert [line.split()[0] for line in done.stdout.splitlines()] == list(registry.STUDIES)
    assert all(entry.summary in done.stdout for entry in registry.STUDIES.values())


def test_python_m_studies_is_the_command_line():
    done = subprocess.run([sys.executable, "-m", "studies", "list"], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0
    assert done.stdout.startswith(next(iter(registry.STUDIES)))


def test_help_lists_every_parameter_with_unit_default_and_range(dummy, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit, match="0"):
        dummy("--help")
    text = capsys.readouterr().out
    assert re.search(r"--thickness m +thickness of the strip; default 0.0003 m; 1e-05 to 0.01 m\n", text)
    assert re.search(r"--speed rad/s +speed of the crank; default 1.25 rad/s; -100 to 100 rad/s\n", text)
    assert re.search(r"--restitution NUMBER +restitution, 80 % by default; default 0.8; 0 to 1\n", text)
    assert re.search(r"--models NAME,... +models to run; default strut; one or more of stitched, strut, beam\n", text)
    assert re.search(r"--elements N +beam elements; default 8; 1 to 64\n", text)
    assert text.index("strip:") < text.index("--widths") < text.index("drive:") < text.index("--speed")
    assert "A study for tests." in text
    assert "Not shown" not in text
    assert "python -m studies run dummy [options]" in text


@pytest.mark.parametrize("argv", [["--help"], ["run", "--help"]])
def test_general_help(argv, capsys):
    with pytest.raises(SystemExit, match="0"):
        main(argv=argv)
    assert "python -m studies" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--thickness", "5kg"], "thickness = 5kg: 'kg' is no unit for a quantity in m; allowed: 1e-05 to 0.01 m"),
        (["--speed", "-200"], "speed = -200: out of range; allowed: -100 to 100 rad/s"),
        (["--thicknes", "1mm"], "unknown parameter '--thicknes'; did you mean --thickness?"),
        (["--thick=1mm"], "unknown parameter '--thick'; did you mean --thickness?"),
        (["--qqq", "1mm"], "unknown parameter '--qqq'; see --help"),
        (["extra"], "unknown argument 'extra'; see --help"),
        (["--thickness"], "argument --thickness: expected one argument"),
        (["--elements", "13", "--thickness", "2mm"], "elements = 13: not with a thickness above 0.001 m"),
        (["--config", "absent.toml"], "--config absent.toml: No such file or directory"),
    ],
)
def test_wrong_input_is_one_line_and_exit_2(dummy, capsys, words, message):
    assert dummy(*words) == 2
    assert capsys.readouterr() == ("", f"error: {message}\n")
    assert not dummy.folder.exists()


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["run", "slider-krank"], "unknown study 'slider-krank'; did you mean slider-crank?"),
        (["run", "zzz"], "unknown study 'zzz'; see `python -m studies list`"),
        (["run"], "the following arguments are required: NAME"),
        ([], "the following arguments are required: COMMAND"),
    ],
)
def test_unknown_study_or_none_is_exit_2(capsys, argv, message):
    assert main(argv=argv) == 2
    assert capsys.readouterr() == ("", f"error: {message}\n")


def test_unwritable_out_is_exit_2_before_the_run(dummy, capsys, tmp_path):
    (tmp_path / "file").write_text("")
    assert dummy("--out", str(tmp_path / "file"), "--ending", "raises") == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert re.fullmatch(r"error: --out: cannot write to \S+/file/dummy: Not a directory\n", err)


def test_folder_that_takes_no_file_is_exit_2(dummy, capsys, monkeypatch):
    def refuse(dir):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("tempfile.TemporaryFile", refuse)
    assert dummy("--ending", "raises") == 2
    assert capsys.readouterr().err == f"error: --out: cannot write to {dummy.folder}: Permission denied\n"


def test_study_that_cannot_be_imported_is_exit_1(monkeypatch, capsys):
    monkeypatch.setitem(registry.STUDIES, "dummy", registry.Entry("studies.absent_study", ""))
    assert main(argv=["run", "dummy"]) == 1
    assert capsys.readouterr().err == "dummy: cannot be loaded: No module named 'studies.absent_study'\n"


# --- runs -------------------------------------------------------------------------------------------------------------


def test_fine_run_prints_a_table_and_writes_every_file(dummy, capsys):
    assert dummy("--thickness", "0.5mm", "--speed", "-12rpm", "--models", "strut,beam") == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert re.search(r"metric +value +unit +published +exact +relative error\n", out)
    assert re.search(r"force +1\.7 +N +1\.7684 +1\.72465 +0\.014\n", out)
    assert {path.name for path in dummy.folder.iterdir()} == {
        "metrics.json", "signals.npz", "history.png", "history.pdf",
    }  # fmt: skip
    with np.load(dummy.folder / "signals.npz") as signals:
        assert set(signals) == {"time", "force"}
        assert signals["force"].tolist() == [0, 1, 2, 3, 4]
    content = metrics_of(dummy.folder)
    assert content["provenance"]["parameters"]["thickness"] == 5e-4
    assert content["provenance"]["parameters"]["speed"] == pytest.approx(-12 * math.pi / 30)
    assert content["provenance"]["parameters"]["models"] == ["strut", "beam"]


def test_metrics_json_is_strict_and_complete(dummy):
    assert dummy() == 0
    content = metrics_of(dummy.folder)
    assert list(content) == ["status", "message", "metrics", "work", "provenance", "files"]
    assert content["metrics"]["force"] == {
        "value": 1.7, "unit": "N", "published": 1.7684, "exact": 1.72465, "error": pytest.approx(0.01429275),
    }  # fmt: skip
    assert content["metrics"]["lost"] == {"value": None, "unit": "J"}
    assert content["work"].keys() == {"wall_s", "steps", "peak"}
    assert content["work"]["wall_s"] > 0
    assert content["work"]["steps"] == 5
    assert content["work"]["peak"] is None
    provenance = content["provenance"]
    assert provenance["versions"].keys() == {"python", "buckler", "exudyn", "numpy", "scipy"}
    assert provenance["versions"]["numpy"] == np.__version__
    assert provenance["machine"].keys() == {"cpu", "cores", "os"}
    assert "commit" in provenance
    assert provenance["parameters"].keys() == set(Parameters.__dataclass_fields__)


def test_json_prints_the_file_and_nothing_else(dummy, capsys):
    assert dummy("--json", "--ending", "prints") == 0
    out, err = capsys.readouterr()
    assert out == (dummy.folder / "metrics.json").read_text()
    assert err == "engine chatter\n"


def test_suspect_run_is_exit_1_named_and_written(dummy, capsys):
    assert dummy("--ending", "suspect") == 1
    assert capsys.readouterr().err == "dummy: SUSPECT: energy grew by 3 %\n"
    content = metrics_of(dummy.folder)
    assert (content["status"], content["message"]) == ("SUSPECT", "energy grew by 3 %")
    assert (dummy.folder / "history.pdf").exists()


def test_failed_run_is_exit_1_and_leaves_no_earlier_figure(dummy, capsys):
    assert dummy() == 0
    (dummy.folder / "notes.txt").write_text("mine")
    assert dummy("--ending", "raises") == 1
    err = capsys.readouterr().err
    assert err.splitlines()[-1] == "dummy: ERROR: ZeroDivisionError: no stiffness left"
    assert metrics_of(dummy.folder)["status"] == "ERROR"
    assert {path.name for path in dummy.folder.iterdir()} == {"metrics.json", "notes.txt"}


def test_figure_that_fails_keeps_the_numbers(dummy, capsys):
    assert dummy("--ending", "undrawable") == 1
    assert "dummy: ERROR: drawing the figures: RuntimeError: no ink" in capsys.readouterr().err
    assert metrics_of(dummy.folder)["metrics"]["force"]["value"] == 1.7
    assert (dummy.folder / "signals.npz").exists()


def test_interrupt_is_exit_130_and_writes_nothing(dummy, capsys):
    assert dummy("--ending", "interrupts") == 130
    assert capsys.readouterr() == ("", "interrupted\n")
    assert list(dummy.folder.iterdir()) == []


def test_config_gives_parameters_and_the_command_line_overrides(dummy, tmp_path):
    config = tmp_path / "case.toml"
    config.write_text('thickness = "0.5mm"\nspeed = "12rpm"\nelements = 4\nmodels = ["beam"]\n')
    assert dummy("--config", str(config), "--elements", "16") == 0
    parameters = metrics_of(dummy.folder)["provenance"]["parameters"]
    assert (parameters["thickness"], parameters["elements"], parameters["models"]) == (5e-4, 16, ["beam"])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("thicknes = 1", "unknown parameter 'thicknes'; did you mean thickness?"),
        ("out = 'x'", "unknown parameter 'out'"),
        ("thickness = ", "no valid TOML"),
        ("thickness = 7", "thickness = 7 m: out of range; allowed: 1e-05 to 0.01 m"),
    ],
)
def test_wrong_config_is_one_line_and_exit_2(dummy, tmp_path, capsys, content, message):
    (tmp_path / "case.toml").write_text(content)
    assert dummy("--config", str(tmp_path / "case.toml")) == 2
    err = capsys.readouterr().err
    assert message in err
    assert err.count("\n") == 1


# --- pieces -----------------------------------------------------------------------------------------------------------


def test_error_is_relative_to_the_exact_value_or_the_studys_own():
    assert Metric(0.99, "N", exact=-1.1).error == pytest.approx(1.9)
    assert Metric(1.01, "N", exact=1.0).error == pytest.approx(0.01)
    assert Metric(1.0, "N", error=0.02).error == 0.02
    assert Metric(1.0, "N", published=2.0).error is None
    assert Metric(1.0, "N", exact=0.0).error is None


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


# --- the how-to, and what the project says of itself ------------------------------------------------------------------


@pytest.fixture
def euler_load(monkeypatch, tmp_path):
    """The how-to's study, importable as `euler_load`."""
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "how-to-add-a-study.md").read_text(), re.DOTALL)
    (tmp_path / "euler_load.py").write_text(blocks[0])
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(registry.STUDIES, "euler-load", registry.Entry("euler_load", "rate of convergence"))
    yield importlib.import_module("euler_load")
    del sys.modules["euler_load"]


def test_how_to_study_converges_at_second_order(euler_load):
    result = euler_load.run(euler_load.Parameters(finest=32))
    assert result.status == "OK"
    assert result.metrics["rate"].value == pytest.approx(2, abs=0.02)
    assert result.metrics["load"].error < 1e-3


def test_study_run_as_a_script_uses_its_importable_self(euler_load, monkeypatch, tmp_path, capsys):
    used = []
    monkeypatch.setattr(euler_load, "run", lambda p, progress, run=euler_load.run: used.append(p) or run(p, progress))
    monkeypatch.setattr(sys, "argv", ["euler_load", "--finest", "32", "--out", str(tmp_path)])
    with pytest.raises(SystemExit, match="0"):
        runpy.run_module("euler_load", run_name="__main__")
    assert type(used[0]) is euler_load.Parameters
    assert capsys.readouterr().err == ""
    folder = tmp_path / "euler-load"
    assert {p.name for p in folder.iterdir()} == {"metrics.json", "signals.npz", "figure.png", "figure.pdf"}
    assert metrics_of(folder)["metrics"]["rate"]["value"] == pytest.approx(2, abs=0.02)


def test_study_run_as_a_script_shows_its_own_command_in_help(euler_load, capsys):
    with pytest.raises(SystemExit, match="0"):
        main("euler-load", ["--help"])
    assert "usage: python -m euler_load [options]" in capsys.readouterr().out


def test_ci_runs_the_command_the_readme_shows():
    command = (ROOT / ".ci" / "run").read_text().rstrip().splitlines()[-1]
    assert command.endswith("python -m pytest")
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
    blocks = re.findall(r"^```\w*\n(.*?)^```", (ROOT / "README.md").read_text(), re.DOTALL | re.MULTILINE)
    assert command in [line for block in blocks for line in block.splitlines()]


def test_one_version_everywhere():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert f"\nversion: {project['version']}\n" in (ROOT / "CITATION.cff").read_text()
    assert project["version"] in (ROOT / "CHANGELOG.md").read_text()
