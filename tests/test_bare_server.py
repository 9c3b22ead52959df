"""A server without graphics: Exudyn does not load; all that needs no engine runs, and the rest says what is missing."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

SIX_LINES = """
points = { O = [0, 0] }
gravity = [0, "-9.81 m/s^2"]
defaults = { body = { kind = "Rigid" }, section = { width = "20 mm", thickness = "5 mm" } }
links.upper = { start = "O", end = "A", length = "300 mm", angle = "80 deg" }
links.lower = { start = "A", end = "B", length = "250 mm", angle = "10 deg" }
pins = ["O: ground upper", "A: upper lower"]
"""


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """A folder with a mechanism, and an environment in which the engine's library of graphics is missing."""
    folder = tmp_path_factory.mktemp("bare")
    folder.joinpath("double.toml").write_text(SIX_LINES)
    hidden = folder / "hidden" / "exudyn"
    hidden.mkdir(parents=True)
    hidden.joinpath("__init__.py").write_text("raise ImportError('libGL.so.1: cannot open shared object file')\n")
    return folder, os.environ | {"PYTHONPATH": str(hidden.parent)}


def buckler(bare, *words):
    folder, environment = bare
    command = [sys.executable, "-m", "buckler.studies", *words]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300)


def test_the_six_lines_run_and_are_shown(bare):
    for words in (("run", "double.toml", "--duration", "0.2"), ("show", "double.toml"), ("--version",)):
        said = buckler(bare, *words)
        assert said.returncode == 0, said.stderr
    assert Path(bare[0], "results/double/report.html").exists()


def test_the_engine_says_what_is_missing_in_one_line(bare):
    said = buckler(bare, "run", "double.toml", "--duration", "0.2", "--solver", "exudyn")
    assert said.returncode == 1
    line = next(line for line in said.stderr.splitlines() if "Exudyn does not load" in line)
    assert "libGL.so.1" in line and "apt-get install libgl1" in line and "Traceback" not in said.stderr
