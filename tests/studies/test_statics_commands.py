"""Statics from the command line: what is printed and filed, and how wrong input is told."""

import re

import numpy as np
import pytest

from buckler.mbs.progress import Watch
from buckler.mbs.statics.vibration import Frequencies
from buckler.studies.kit.cli import EXAMPLES, main

COLUMN = """
points = { A = [0, 0], M = [0.25, 0], B = [0.5, 0] }
pins = ["A: ground strip"]
defaults.section = { width = 0.02, thickness = 1e-3 }
links.strip = { start = "A", end = "B", carries = { M = 0.5 }, body = { kind = "Beam" } }
guides = [{ point = "B", link = "strip" }]
loads = [{ kind = "Force", point = "B", value = [-1.0, 0.0] }]
"""
DRIVEN = """
points = { A = [0, 0], B = [0.5, 0] }
pins = ["A: ground strip"]
links.strip = { start = "A", end = "B", body = { kind = "Rigid", mass = 1.0, inertia = 1e-3 } }
[[loads]]
kind = "TorsionSpring"
first = "ground"
second = "strip"
stiffness = 4.0
damping = 0.01
[[loads]]
kind = "Torque"
link = "strip"
value = "0.1*cos(2*t)"
"""
"""A rigid bar on a torsion spring, turned by a torque in time."""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "column.toml"
    path.write_text(COLUMN)
    return path


def test_a_path_is_printed_drawn_and_written(file, tmp_path, capsys):
    asked = ["path", str(file), "--to", "15", "--branches", "--degree", "8", "--point", "strip:M"]
    assert main(argv=[*asked, "--plot", str(tmp_path / "d.png"), "--csv", str(tmp_path / "d.csv")]) == 0
    said = capsys.readouterr().out
    assert "branching: 13.817" in said
    assert said.count("ended") == 3
    rows = (tmp_path / "d.csv").read_text().splitlines()
    assert rows[0] == "factor of the loads,x [m],y [m],growth [1/s],negative eigenvalues"
    assert float(rows[-1].split(",")[0]) == 15.0
    assert (tmp_path / "d.png").stat().st_size > 5000


def test_rest_and_frequencies_are_printed_with_status_and_errors(file, capsys):
    assert main(argv=["equilibrium", str(file), "--load", "20"]) == 1  # UNSTABLE
    assert "unstable: a small motion grows" in capsys.readouterr().out
    assert main(argv=["frequencies", str(file), "--count", "2"]) == 0
    assert "damping ratio 0, error" in capsys.readouterr().out


def test_rounding_of_damping_is_not_printed():
    values = [complex(1e-14, 3.0), complex(-1e-14, 4.0), complex(-0.5, 5.0)]
    shown = Frequencies("OK", "", None, None, np.array(values), None, np.zeros(3), ["vibration"] * 3, True).rows()
    assert [re.search("ratio (.*), error", row)[1] for _, row in shown] == ["0", "0", "0.0995"]


def test_a_response_is_printed_drawn_and_written(file, tmp_path, capsys):
    file.write_text(DRIVEN)
    asked = ["response", str(file), "--period", "3.141592653589793", "--to", "0.4", "--point", "strip:B"]
    assert main(argv=[*asked, "--plot", str(tmp_path / "d.png"), "--csv", str(tmp_path / "d.csv")]) == 0
    assert "ended: reached at 0.4 after" in capsys.readouterr().out
    rows = (tmp_path / "d.csv").read_text().splitlines()
    assert rows[0] == "frequency [Hz],amplitude x [m],amplitude y [m],largest multiplier,error"
    assert float(rows[-1].split(",")[0]) == 0.4
    assert (tmp_path / "d.png").stat().st_size > 5000


def test_a_periodic_motion_is_printed_with_its_multipliers(file, capsys):
    file.write_text(DRIVEN)
    assert main(argv=["periodic", str(file), "--period", "3141.592653589793 ms"]) == 0
    said = capsys.readouterr().out
    assert said.startswith("OK\nperiod: 3.14159265 s\nstable: yes\nerror: ")
    assert said.count("multiplier: ") == 2


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["path", "FILE", "--to", "0"], "to = 0"),
        (["path", "FILE", "--to", "1", "--load", "force.X"], "unknown"),
        (["path", "FILE", "--to", "1", "--csv", "x.csv"], "--point LINK:POINT is missing"),
        (["frequencies", "FILE", "--count", "0"], "count = 0"),
        (["equilibrium", "nowhere.toml"], "nowhere.toml"),
        (["periodic", "FILE", "--period", "0"], "period = 0"),
        (["periodic", "FILE", "--period", "1m"], "--period = 1m: "),
        (["path", "FILE", "--to", "1N"], "--to = 1N: must be a plain number"),
        (["path", "FILE", "--to", "1N", "--parameter", "links.strip.body.section.thickness"], "--to = 1N: must be in m"),
        (["path", "FILE", "--to", "1", "--parameter", "links.strip.body.section.thicknes"], "'thicknes' is not known there"),
    ],
)
def test_wrong_input_is_told_in_a_line(file, words, said, capsys):
    assert main(argv=[str(file) if word == "FILE" else word for word in words]) == 2
    err = capsys.readouterr().err
    assert said in err
    assert err.count("\n") == 1


def test_steps_of_a_path_are_counted(monkeypatch, capsys):
    seen, step = [], Watch.step
    monkeypatch.setattr(Watch, "step", lambda watch, *now, **most: seen.append(watch.unit) or step(watch, *now, **most))
    assert main(argv=["path", str(EXAMPLES / "arch.toml"), "--to", "1"]) == 0
    steps = int(re.search(r"after (\d+) steps", capsys.readouterr().out)[1])
    assert set(seen) == {"steps"} and len(seen) >= steps
