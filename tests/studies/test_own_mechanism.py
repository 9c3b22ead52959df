"""Mechanisms of files on the command line and from Python: shown, run, swept, measured."""

import json
import re
import sys

import numpy as np
import pytest
from made_up_study import metrics_of
from own_file import PENDULUM
from scipy.integrate import solve_ivp

from buckler.mbs import Exudyn, Mechanism, Spectral, Torque, simulate
from buckler.studies.kit.cli import main
from buckler.studies.own.study import Settings


def test_run_reads_off_what_the_file_asks_for(pendulum, capsys):
    assert main(argv=["run", "pendulum.json"]) == 0
    out, err = capsys.readouterr()
    assert not err or err.startswith("What this run needs of the compiled solver")  # it may have to be compiled
    assert re.search(r"pendulum: OK in \S+ s, written to results/pendulum", out)
    found = metrics_of(pendulum / "results" / "pendulum")
    assert set(found["metrics"]) == {"min(A.y)", "max(abs(arm.vx))"}
    rows = found["provenance"]["parameters"]
    assert rows["duration"] == 0.5 and rows["mechanism"].startswith("pendulum ")
    with np.load(pendulum / "results" / "pendulum" / "signals.npz") as signals:
        assert signals["time"][-1] == pytest.approx(0.5)


def test_a_changed_mass_falls_as_the_formula_says(pendulum):
    """A rod of another inertia about its pivot: theta'' = m g l / I at the start."""
    words = ["--set", "links.arm.body.inertia=0.5kg m^2", "--duration", "10ms", "--accuracy", "1e-5", "-q", "--measure"]
    assert main(argv=["run", "pendulum.json", *words, "end(A.y)"]) == 0
    found = metrics_of(pendulum / "results" / "pendulum")["metrics"]
    assert found["end(A.y)"]["value"] == pytest.approx(-0.5 * 9.81 * 0.5 / (0.25 + 0.5) * 0.01**2, rel=1e-3)
    assert found["relative error of the motion"]["value"] < 1e-5


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--duration", "-1"], "error: --duration = -1.0 s: must lie in (0, inf) s"),
        (["--accuracy", "1e-3", "--of", "speeds"], "error: pendulum.json: of = ('speeds',): must be one of 'places'"),
        (["--accuracy", "1e-3", "--of", "A.z"], "error: pendulum.json: no signal 'A.z'; near it: A.y"),
        (["--accuracy", "1e-9"], "error: --accuracy = 1e-09: must lie in [1e-06, 0.1]"),
        (["--of", "forces"], "error: pendulum.json: of: without an accuracy; give both"),
        (["--duration", "1 kg"], "error: --duration = 1 kg: must be in s"),
        (["--durtion", "1"], "error: unknown option '--durtion'; did you mean --duration?"),
        (["--set", "links.arm.body.mas=1"], "error: --set links.arm.body.mas=1: links.arm.body.mas: unknown key, did you"),
        (["--set", "links.arm.body.mass=-1kg"], "error: --set links.arm.body.mass=-1kg: links.arm.body.mass = -1kg: must lie"),
        (["--set", "links.arm.body.mass"], "error: --set links.arm.body.mass: write PATH=VALUE"),
        (["--measure", "maxx(A.y)"], "error: pendulum.json: maxx(A.y): unknown function 'maxx'"),
        (["--solver", "abaqus"], "error: --solver = 'abaqus': must be one of 'exudyn', 'spectral'"),
        (["--degree", "4"], "error: pendulum.json: solver: degree is a setting of spectral, not of exudyn"),
        (["--tolerance", "1e-6", "--steps", "9"], "error: pendulum.json: solver: tolerance is for controlled steps: leave out"),
        (["--steps", "1e3"], "error: --steps = '1e3': must be a whole number"),
        (["--tolerance", "3 mm"], "error: --tolerance = 3 mm: "),
        (["--solver", "spectral", "--degree", "99"], "error: --degree = 99: must be a whole number in [2, 60]"),
        (["--measure", "max(A.yy)"], "error: pendulum.json: max(A.yy): no signal 'A.yy'; near it: A.y"),
        ([], "error: nothing varies: give --vary; see --help\n"),
        (["--vary", "links.arm.body.mas=1,2"], "error: --vary links.arm.body.mas: links.arm.body.mas: 'mas' is not known there"),
        (["--vary", "links.arn.body.mass=1,2"], "error: --vary links.arn.body.mass: links.arn: not in the file, did you mean"),
        (["--vary", "links.arm.body.mass=1kg:2m:3"], "error: --vary links.arm.body.mass=1kg:2m:3: links.arm.body.mass = 2m:"),
        (["--vary", "links.arm.body.mass=-1,2"], "error: links.arm.body.mass = -1 kg: links.arm.body.mass = -1.0 kg: must lie"),
        (["--vary", "links.arm.body.mass=1,2", "--measure", "max(A.z)"], "error: pendulum.json: max(A.z): no signal 'A.z'; nea"),
    ],
)  # fmt: skip
def test_wrong_words_are_one_line_and_exit_2(pendulum, capsys, words, message):
    command = "sweep" if not words or words[0] == "--vary" else "run"
    assert main(argv=[command, "pendulum.json", *words]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith(message) and err.count("\n") == 1
    assert not (pendulum / "results").exists()


def test_a_solver_with_an_accuracy_is_kept_and_its_error_told(pendulum):
    words = ["--solver", "exudyn", "--accuracy", "1e-3", "--measure", "end(A.y)", "-q"]
    assert main(argv=["run", "pendulum.json", *words]) == 0
    found = metrics_of(pendulum / "results" / "pendulum")
    assert found["work"]["exudyn_runs"] >= 2 and "spectral_runs" not in found["work"]
    assert 0 < found["metrics"]["relative error of the motion"]["value"] <= 1e-3


@pytest.mark.parametrize(("solver", "setting", "value"), [("exudyn", "spectral_radius", 0.5), ("spectral", "degree", 6)])
def test_the_solver_and_its_settings_are_options(pendulum, solver, setting, value):
    words = ["--solver", solver, "--steps", "200", f"--{setting.replace('_', '-')}", str(value), "--measure", "end(A.y)", "-q"]
    assert main(argv=["run", "pendulum.json", *words]) == 0
    found = metrics_of(pendulum / "results" / "pendulum")
    assert found["provenance"]["parameters"]["solver"] == {"kind": solver, "steps": 200, setting: value}
    assert found["work"]["steps"] == 200
    falls = solve_ivp(lambda _, y: (y[1], -9.81 * 0.5 / 0.35 * np.cos(y[0])), (0, 0.5), (0.0, 0.0), rtol=1e-10, atol=1e-12)
    assert found["metrics"]["end(A.y)"]["value"] == pytest.approx(np.sin(falls.y[0, -1]), abs=1e-3)


def test_the_solver_of_the_file_gives_way_to_the_command_line(pendulum):
    content = PENDULUM | {"run": PENDULUM["run"] | {"solver": {"kind": "spectral", "degree": 5, "max_step": "1 ms"}}}
    (pendulum / "pendulum.json").write_text(json.dumps(content))

    def ran_with(*words):
        assert main(argv=["run", "pendulum.json", "-q", *words]) == 0
        return metrics_of(pendulum / "results" / "pendulum")["provenance"]["parameters"]["solver"]

    assert ran_with() == {"kind": "spectral", "degree": 5, "max_step": 1e-3}
    assert ran_with("--degree", "6") == {"kind": "spectral", "degree": 6, "max_step": 1e-3}
    assert ran_with("--solver", "exudyn") == {"kind": "exudyn"}
    assert main(argv=["run", "pendulum.json", "-q", "--accuracy", "1e-2"]) == 0
    assert metrics_of(pendulum / "results" / "pendulum")["provenance"]["parameters"]["accuracy"] == 1e-2
    (pendulum / "pendulum.json").write_text(json.dumps(PENDULUM | {"run": {"duration": 0.1, "accuracy": 1e-2}}))
    assert ran_with("--steps", "50") == {"steps": 50}
    for wrong, message in (
        ({"degre": 5}, "run.solver.degre: unknown key"),
        ({"max_step": "1 kg"}, "run.solver.max_step = 1 kg: "),
    ):
        with pytest.raises(ValueError, match=re.escape(message)):
            Settings().read("run.solver", wrong)


def test_wrong_files_are_one_line_and_exit_2(pendulum, capsys):
    (pendulum / "bad.toml").write_text("[points]\nO = [0, 0]\n[links.arm]\nstart = 'O'\nend = 'P'\n")
    for command in (["run"], ["show"], ["sweep", "--vary", "points.O=1,2"]):
        assert main(argv=[command[0], "bad.toml", *command[1:]]) == 2
        err = capsys.readouterr().err
        assert err.startswith("error: bad.toml: links.arm: lacks 'body'") and err.count("\n") == 1, command
    assert main(argv=["run", "absent.toml"]) == 2
    assert capsys.readouterr().err == "error: absent.toml: No such file or directory; there are: bad.toml\n"


def test_verify_tells_the_other_solvers_difference(pendulum, capsys):
    pytest.importorskip("numba")
    assert main(argv=["run", "pendulum.json", "--verify", "--out", "runs"]) == 0
    found = metrics_of(pendulum / "runs" / "pendulum")["metrics"]["difference from the other solver"]["value"]
    assert 0 < found < 1e-2
    assert "difference from the other solver" in capsys.readouterr().out


def test_a_modal_link_without_its_extra_is_one_line(pendulum, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "skfem", None)
    body = {"kind": "Modal", "section": {"width": "20 mm", "thickness": "5 mm"}}
    links = {"arm": {**PENDULUM["links"]["arm"], "body": body}}
    (pendulum / "pendulum.json").write_text(json.dumps({**PENDULUM, "links": links}))
    status, err = main(argv=["run", "pendulum.json"]), capsys.readouterr().err
    assert (status, err.count("\n"), "Traceback" in err) == (2, 1, False) and "pip install 'buckler[modal]'" in err


@pytest.mark.parametrize(
    ("solver", "status", "said"),
    [
        (Exudyn(), "FUNCTION_FAILED", "the function of 'torque.arm' raised SystemExit: 3"),
        (Spectral(), "FUNCTION_FAILED", "a function of the mechanism raised SystemExit: 3"),
    ],
    ids=["engine", "compiled"],
)
def test_a_function_that_ends_the_program_fails_the_run(solver, status, said):
    """Python's `sys.exit` in a torque: named by either solver, with its time."""

    def leaving(t, _angle, _speed):
        return sys.exit(3) if t > 0.05 else 0.1

    described = Mechanism.from_dict(PENDULUM)
    result = simulate(Mechanism(**{**vars(described), "loads": [Torque("arm", leaving)]}), 0.2, solver=solver)
    assert result.status == status and said in result.message
    assert 0.04 < result.time[-1] < 0.06
