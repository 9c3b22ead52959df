"""Ensembles from the command line: table, figures and file, continued stores, interruption, wrong input."""

import json
from concurrent.futures import FIRST_COMPLETED, wait

import numpy as np
import pytest
from stopping import stop_at

from buckler.mbs.ensembles import ensemble as ensembles
from buckler.studies.kit.cli import main

PENDULUM = """
points = { A = [0, 0], B = [0.5, 0] }
pins = ["A: ground bar"]
links.bar = { start = "A", end = "B", body = { kind = "Rigid", section = { width = "20 mm", thickness = "5 mm" } } }
loads = [{ kind = "Force", point = "B", value = [0.0, -1.0] }]
"""
MASS = 7850 * 0.02 * 0.005 * 0.5


@pytest.fixture
def file(tmp_path):
    pytest.importorskip("numba")
    path = tmp_path / "pendulum.toml"
    path.write_text(PENDULUM)
    return path


def asked(file, *more):
    words = ["ensemble", str(file), "--duration", "2 ms", "--each", "1 ms", "--members", "4", "--of", "min(B.vy)"]
    return main(argv=[*words, "--skip", "0", "--out", str(file.parent / "out"), *more])


def test_lists_are_tabled_and_mapped_and_the_numbers_are_those_of_a_falling_bar(file, capsys):
    vary = ["--vary", "loads[0].value[1]=-1 N,-2 N", "--vary", "points.B[0]=0.5,0.6"]
    assert asked(file, *vary, "--json") == 0
    found = json.loads(capsys.readouterr().out)[0]
    assert found["members"] == 16 and found["failed"] == 0 and found["low"] <= found["mean"] <= found["high"]
    assert len(found["cells"]) == 4
    for cell in found["cells"]:  # m L^2 / 3 a = F L for a thin bar; the windows end at 1 and 2 ms
        force, length = cell["values"]["loads[0].value[1]"], cell["values"]["points.B[0]"]
        assert cell["mean"] == pytest.approx(3 * force / (MASS * length / 0.5) * 1.5e-3, rel=1e-3)
    out = file.parent / "out" / "pendulum-ensemble"
    assert {path.name for path in out.iterdir()} == {"members.csv", "histogram.png", "map.png"}
    rows = np.loadtxt(out / "members.csv", delimiter=",", skiprows=1)
    assert rows.shape == (32, 5) and rows[:, 4].mean() == pytest.approx(found["mean"], rel=1e-8)


def test_ctrl_c_hands_over_what_is_there_and_the_same_command_goes_on(file, capsys, monkeypatch):
    def one(futures, *_):
        return wait(futures, None, FIRST_COMPLETED)

    for by, status, word in (("timeout", 1, "(TIMED_OUT)"), ("Ctrl-C", 130, "(interrupted)")):
        store = ["--store", str(file.parent / f"{by}.npz"), "--members", "40"]
        with monkeypatch.context() as patch:
            patch.setattr(ensembles, "wait", one)
            stop_at(patch, 2, by)
            assert asked(file, *store) == status
        said = capsys.readouterr()
        assert word in said.err and "min(B.vy)" in said.out
    assert asked(file, *store) == 0
    assert "40 of 40 members" in capsys.readouterr().err


def test_wrong_words_are_one_line(file, capsys):
    for words, said in (
        (["--vary", "points.B[0]=1:2:3"], "PATH=LOW:HIGH"), (["--vary", "points.B[0]=2:1"], "low must be less than high"),
        (["--vary", "points.Z=1:2"], "points.Z"), (["--of", "max(Z.vy)"], "signal 'Z.vy'"),
        (["--of", "B.vy"], "stands by itself"),
    ):  # fmt: skip
        assert asked(file, *words) == 2
        error = capsys.readouterr().err
        assert said in error and error.count("error: ") == 1
