"""Elements, laws and studies of another package, installed beside Buckler: in files, every solver, statics, reports."""

import os
import subprocess
import sys
import warnings
from importlib import metadata
from pathlib import Path

import pytest

from buckler.mbs.imports import extensions

OUTSIDE = Path(__file__).parents[1] / "outside"
FILE = """
gravity = [0, -9.81]
points = { O = [0, 0], A = [0.2, 0], P = [0, 0.2], B = [0.2, 0.2], G = [0.2, -0.15] }
pins = ["O: ground one", "P: ground two"]
couplings = [{ kind = "Parallel", first = "one:O", second = "two:P" }]
[links]
one = {start = "O", end = "A", body = {kind = "Rigid", mass = 0.5, inertia = 2e-3}}
two = {start = "P", end = "B", body = {kind = "Rigid", mass = 0.3, inertia = 1e-3}}
[[loads]]
kind = "Magnet"
a = "A"
b = "ground:G"
strength = 0.01
[[stops]]
point = "A"
at = -0.02
along = [0, 1]
law = {kind = "Rubber", stiffness = "50 kN/m", slowest = 0.5}
"""
SCRIPT = """
import numpy as np
from buckler.mbs import Controlled, Exudyn, Mechanism, Spectral, simulate
from buckler.studies.kit.cli import main
from buckler.studies.kit.registry import load
made = Mechanism.load("arms.toml")
assert Mechanism.from_dict(made.to_dict()) == made
free = Mechanism(made.points, made.links, made.joints, loads=made.loads, couplings=made.couplings, gravity=made.gravity)
runs = [simulate(free, 0.06, solver=solver, ledger=True) for solver in (Exudyn(Controlled(1e-7)), Spectral())]
for found in runs:
    assert found.ok and found.energy_balance < 1e-5, found.message
    angle = np.arctan2(found.signals["A.y"], found.signals["A.x"])
    rate = (found.signals["A.vy"] * np.cos(angle) - found.signals["A.vx"] * np.sin(angle)) / 0.2
    # energy by hand: both arms turn alike; (m L^2/4 + I) each
    moving = 0.5 * rate**2 * (0.5 * 0.01 + 2e-3 + 0.3 * 0.01 + 1e-3)
    gap = np.hypot(found.signals["A.x"] - 0.2, found.signals["A.y"] + 0.15)
    given = -0.8 * 9.81 * 0.1 * np.sin(angle) + 0.01 * (1 / gap - 1 / 0.15)
    np.testing.assert_allclose(moving, given, atol=2e-5 * given.max())
    accelerated = (0.3 * 0.01 + 1e-3) * np.gradient(rate, found.time) + 0.3 * 9.81 * 0.1 * np.cos(angle)
    moment = found.signals["parallel.one-two.moment"]  # on the first; the second feels the opposite
    inner = slice(len(moment) // 4, -len(moment) // 8)
    np.testing.assert_allclose(-moment[inner], accelerated[inner], rtol=0.02)
struck = [simulate(made, 0.12, solver=solver) for solver in (Exudyn(), Spectral())]
peaks = [each.signals["A.contact_force"].max() for each in struck]
assert all(each.ok for each in struck) and abs(peaks[0] / peaks[1] - 1) < 5e-3 and peaks[1] > 10, (struck, peaks)
struck[1].write_html("arms.html")
assert "magnet.A-G" in open("arms.html", encoding="utf-8").read()
assert main(argv=["list"]) == 0
study = load("magnet-rest")
result = study.run(study.Parameters())
assert result.metrics["sag"].error < 1e-8, result.metrics
assert main(argv=["run", "magnet-rest", "--strength", "0.01", "--out", "out"]) == 0
"""


def test_a_package_of_ones_own_works_like_buckler_s(tmp_path):
    (tmp_path / "arms.toml").write_text(FILE, encoding="utf-8")
    path = os.pathsep.join([str(OUTSIDE), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=tmp_path, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    assert "magnet-rest" in done.stdout


def test_what_does_not_load_is_warned_of_and_left_out(monkeypatch):
    broken = metadata.EntryPoint("Broken", "no_such_package:Broken", "buckler.made-up")
    monkeypatch.setattr(metadata, "entry_points", lambda group: [broken])
    with pytest.warns(RuntimeWarning, match=r"buckler.made-up: 'Broken' does not load: ModuleNotFoundError"):
        assert extensions("buckler.made-up") == {}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert extensions("buckler.made-up") == {}  # told once
