"""The script for Exudyn runs without Buckler and gives the same numbers."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from looked_at import BAR, MECHANISMS, STRIP, loaded, pendulum

from buckler.mbs import Beam, Cable, Drive, Equal, Exudyn, GuideFriction, Motion, Ramp, Rigid, Section, simulate, slider_crank

CRANK = {"law": None, "mass": 0.3}


def driven(body, speed, **options):
    return slider_crank(body, speed=speed, **CRANK, **options)


CASES = {
    "pendulum": (pendulum(), 0.5, 100),
    "masses": (replace(loaded(), loads=[]), 0.3, 100),
    "rigid": (driven(BAR, 5.0, friction=GuideFriction(0.4, viscous=0.1)), 0.5, 200),
    "ramp": (driven(BAR, Ramp(0.0, 6.0, 0.2)), 0.4, 200),
    "beam": (driven(Beam(STRIP, elements=3, imperfection=-3e-5), 1.25), 0.3, 150),
    "cable": (replace(driven(Cable(STRIP, elements=3), 1.25), gravity=(0.0, -9.81)), 0.3, 150),
}


@pytest.mark.parametrize("name", CASES)
def test_the_script_gives_the_same_numbers(name, tmp_path):
    mechanism, duration, steps = CASES[name]
    path = mechanism.write_exudyn_script(tmp_path / "new" / "plain.py", duration, steps)
    assert "import buckler" not in path.read_text() and "from buckler" not in path.read_text()
    done = subprocess.run([sys.executable, "-I", path.name], cwd=path.parent, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stdout + done.stderr
    table = np.genfromtxt(path.parent / "plain.csv", delimiter=",", names=True, deletechars="")
    result = simulate(mechanism, duration, solver=Exudyn(Equal(steps)))
    assert len(table) == len(result.time) == steps + 1
    assert table["t"] == pytest.approx(result.time, abs=1e-12)
    for column in table.dtype.names[1:]:
        assert table[column] == pytest.approx(result.signals[column], abs=1e-9), column
    moved = [np.ptp(table[column]) for column in table.dtype.names[1:]]
    assert max(moved) > 0.05


def test_what_needs_python_is_refused_by_name(tmp_path):
    for name, told in (("strip", "stop 'B'"), ("strut", r"link 'coupler' \(Strut\)"), ("modal", r"link 'rocker' \(Modal\)")):
        with pytest.raises(ValueError, match=told):
            MECHANISMS[name][0]().write_exudyn_script(tmp_path / "plain.py", 1.0)
    with pytest.raises(ValueError, match=r"joint 'O.ground-crank' \(Clearance\)"):
        MECHANISMS["loose"][0]().write_exudyn_script(tmp_path / "plain.py", 1.0)
    waving = Motion(lambda t: 1 - np.cos(t), lambda t: np.sin(t))
    with pytest.raises(ValueError, match="'drive'"):
        replace(driven(BAR, 1.0), drives=[Drive("crank", waving)]).write_exudyn_script(tmp_path / "plain.py", 1.0)
    with pytest.raises(ValueError, match="duration"):
        driven(Rigid(Section(0.02, 0.01)), 1.0).write_exudyn_script(tmp_path / "plain.py", -1.0)
    assert not (tmp_path / "plain.py").exists()
