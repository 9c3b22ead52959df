"""The study command line, on a study that exists only for tests and on the one the how-to shows."""

import math
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from made_up_study import Parameters, figure, metrics_of, run

from buckler.studies.kit import registry
from buckler.studies.kit.cli import COMMANDS, main
from buckler.studies.kit.running import find_study, make_parser

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def dummy(monkeypatch, tmp_path):
    """Run the made-up study: `dummy("--thickness", "1mm")` returns the exit status, files go to dummy.folder."""
    module = ModuleType("dummy_study", "A study for tests.\n\nNot shown in the help.")
    module.Parameters, module.run, module.figure = Parameters, run, figure
    monkeypatch.setitem(sys.modules, "dummy_study", module)
    monkeypatch.setitem(registry.STUDIES, "dummy", registry.StudyEntry("dummy_study", "a study for tests"))

    def call(*words):
        return main(argv=["run", "dummy", "--out", str(tmp_path), *words])

    call.folder = tmp_path / "dummy"
    return call


@pytest.mark.parametrize(
    ("code", "heavy"),
    [
        ("cli.main(argv=['list'])", "numpy scipy exudyn matplotlib tqdm tabulate numba meshio"),
        ("cli.main(argv=['--help'])", "numpy scipy exudyn matplotlib tqdm tabulate numba meshio sqlite3"),
        # loading scipy and figures takes longer than a rigid mechanism takes to run
        ("import buckler.mbs.simulation, buckler.studies.own.files",
         "scipy.special scipy.integrate scipy.sparse scipy.linalg matplotlib numba"),
    ],
)  # fmt: skip
def test_nothing_heavy_is_loaded_before_it_is_needed(code, heavy):
    whole = (
        f"import sys; from buckler.studies.kit import cli\ntry: {code}\nexcept SystemExit: pass\n"
        f"loaded = set('{heavy}'.split()) & set(sys.modules)\nraise SystemExit(f'imported {{sorted(loaded)}}' if loaded else 0)"
    )
    done = subprocess.run([sys.executable, "-c", whole], cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")


def test_list_names_every_study(capsys):
    assert len(COMMANDS) <= 15 and main(argv=["list"]) == 0
    out = capsys.readouterr().out
    assert [line.split()[0] for line in out.splitlines()] == list(registry.STUDIES)
    assert all(entry.summary in out for entry in registry.STUDIES.values())


@pytest.mark.parametrize("name", registry.STUDIES)
def test_a_study_has_its_name_and_its_parameters_written_as_options_are_read_again(name):
    study = find_study(name)
    usual, module = study.module.Parameters(), study.module
    assert module.__name__.rpartition(".")[2] == name.replace("-", "_") and module.__doc__ and callable(module.figure)
    texts = {key: ",".join(map(str, value)) if isinstance(value, tuple) else str(value) for key, value in vars(usual).items()}
    words = [f"--{key.replace('_', '-')}={text}" for key, text in texts.items()]
    assert study.parameters(make_parser(study, "run").read(words)) == usual


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


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--thickness", "5kg"], "thickness = 5kg: must be in m"),
        (["--thicknes", "1mm"], "unknown option '--thicknes'; did you mean --thickness?"),
        (["extra"], "unknown argument 'extra'; see --help"),
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
        (["run"], "the following arguments are required: NAME"),
        ([], "the following arguments are required: COMMAND"),
        (["shwo", "x.toml"], "unknown command 'shwo'; did you mean show?"),
        (["--version", "list"], "--version: takes no further arguments"),
    ],
)
def test_an_unknown_command_or_study_or_none_is_exit_2(capsys, argv, message):
    assert main(argv=argv) == 2
    assert capsys.readouterr() == ("", f"error: {message}\n")


def test_unwritable_out_is_exit_2_before_the_run(dummy, capsys, tmp_path):
    (tmp_path / "file").write_text("")
    assert dummy("--out", str(tmp_path / "file"), "--ending", "raises") == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert re.fullmatch(r"error: --out: cannot write to \S+/file/dummy: Not a directory\n", err)


def test_fine_run_prints_a_table_and_writes_every_file(dummy, capsys):
    assert dummy("--thickness", "0.5mm", "--speed", "-12rpm", "--models", "strut,beam") == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert re.search(r"metric +value +unit +published +exact +relative error\n", out)
    assert re.search(r"force +1\.7 +N +1\.7684 +1\.72465 +1\.4 %\n", out)
    written = {"metrics.json", "signals.npz", "history.png", "history.pdf"}
    assert {path.name for path in dummy.folder.iterdir()} == written
    with np.load(dummy.folder / "signals.npz") as signals:
        assert set(signals) == {"time", "force"} and signals["force"].tolist() == [0, 1, 2, 3, 4]
    content = metrics_of(dummy.folder)
    assert list(content) == ["status", "message", "metrics", "tables", "work", "provenance", "files"]
    force = {"value": 1.7, "unit": "N", "published": 1.7684, "exact": 1.72465, "error": pytest.approx(0.01429275)}
    assert content["metrics"] == {"force": force, "lost": {"value": None, "unit": "J"}}
    assert content["work"] == {"wall_s": content["work"]["wall_s"], "steps": 5, "peak": None} and content["work"]["wall_s"] > 0
    provenance = content["provenance"]
    assert provenance["versions"].keys() == {"python", "buckler", "exudyn", "numpy", "scipy"}
    assert provenance["versions"]["numpy"] == np.__version__ and "commit" in provenance
    assert provenance["machine"].keys() == {"cpu", "cores", "os"}
    parameters = provenance["parameters"]
    assert parameters.keys() == set(Parameters.__dataclass_fields__) and parameters["models"] == ["strut", "beam"]
    assert (parameters["thickness"], parameters["speed"]) == (5e-4, pytest.approx(-12 * math.pi / 30))


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


def test_a_package_that_is_missing_is_one_line(capsys, monkeypatch):
    def lacking(*_, **__):
        raise ImportError("a Modal link needs scikit-fem: pip install 'buckler[modal]'")

    monkeypatch.setattr("buckler.mbs.sensitivities", lacking)
    assert main(argv=["sensitivity", str(ROOT / "studies/own/examples/pendulum.toml"), "--of", "max(A.y)"]) == 2
    assert capsys.readouterr().err == "error: a Modal link needs scikit-fem: pip install 'buckler[modal]'\n"


def test_interrupt_is_exit_130_and_writes_nothing(dummy, capsys):
    assert dummy("--ending", "interrupts") == 130
    assert capsys.readouterr() == ("", "interrupted\n")
    assert list(dummy.folder.iterdir()) == []


def test_how_to_study_converges_at_second_order():
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / "docs" / "how-to-add-a-study.md").read_text(), re.DOTALL)
    study = {"__name__": "euler_load"}
    exec(blocks[0], study)
    result = study["run"](study["Parameters"](finest=32))
    assert result.status == "OK"
    assert result.metrics["rate"].value == pytest.approx(2, abs=0.02)
    assert result.metrics["load"].error < 1e-3


def test_ci_runs_the_command_the_readme_shows():
    command = (ROOT / ".ci" / "run").read_text().rstrip().splitlines()[-1]
    assert command.endswith("python -m pytest -n 2 --dist loadfile")
    assert os.access(ROOT / ".ci" / "run", os.X_OK)
    blocks = re.findall(r"^```\w*\n(.*?)^```", (ROOT / "README.md").read_text(), re.DOTALL | re.MULTILINE)
    assert command in [line for block in blocks for line in block.splitlines()]


def test_one_version_everywhere():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert f"\nversion: {project['version']}\n" in (ROOT / "CITATION.cff").read_text()
    assert project["version"] in (ROOT / "CHANGELOG.md").read_text()
