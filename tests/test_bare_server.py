"""A server without graphics: Exudyn does not load; all that needs no engine runs, and the rest says what is missing."""

import os
import subprocess
import sys
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def bare(tmp_path_factory):
    """A folder with a mechanism, and an environment in which the engine's library of graphics is missing."""
    folder = tmp_path_factory.mktemp("bare")
    hidden = folder / "hidden" / "exudyn"
    hidden.mkdir(parents=True)
    hidden.joinpath("__init__.py").write_text("raise ImportError('libGL.so.1: cannot open shared object file')\n")
    made = folder, os.environ | {"PYTHONPATH": str(hidden.parent)}
    assert buckler(made, "new", "pendulum").returncode == 0
    return made


def buckler(bare, *words):
    folder, environment = bare
    command = [sys.executable, "-m", "buckler.studies", *words]
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)


def test_an_example_runs_and_is_shown(bare):
    for words in (("run", "pendulum.toml", "--duration", "0.2"), ("show", "pendulum.toml"), ("--version",)):
        said = buckler(bare, *words)
        assert said.returncode == 0, said.stderr
    assert Path(bare[0], "results/pendulum/report.html").exists()


def test_the_engine_says_what_is_missing_in_one_line(bare):
    said = buckler(bare, "run", "pendulum.toml", "--duration", "0.2", "--solver", "exudyn")
    assert said.returncode == 1
    line = next(line for line in said.stderr.splitlines() if "Exudyn does not load" in line)
    assert "libGL.so.1" in line and "apt-get install libgl1" in line and "Traceback" not in said.stderr
