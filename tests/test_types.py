"""Types reach a user's script: mypy, strict, in an environment of its own into which Buckler is installed as the README does."""

import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
SCRIPT = """
from buckler.mbs import Beam, Drive, Gear, Link, Mechanism, Result, Revolute, Section, Spectral, simulate
from buckler.mbs.laws import CarvalhoMartins

strip = Section(width=0.030, thickness=0.3e-3)
law = CarvalhoMartins(7.2e4, 0.8)
mechanism = Mechanism(
    {"O": (0, 0), "A": (0.1, 0)}, [Link("arm", "O", "A", Beam(strip))], [Revolute("O", "ground", "arm")], drives=[Drive("arm", 1)]
)
result: Result = simulate(mechanism, 1.0, accuracy=1e-3, solver=Spectral())
reveal_type(result.status)
reveal_type(result.signals)
reveal_type(mechanism.joints)
"""
WRONG = """
simulate(mechanism, "long")
Link("arm", "O")
Gear("one:A", "two:B", ratio="fast", carriage="ground")
mechanism.loads[0].strength_of_nothing
"""


def test_a_user_s_script_is_checked_with_the_types_of_the_door(tmp_path):
    """In an environment with Buckler as an editable install leaves it, a path, and with the libraries of this one."""
    pytest.importorskip("mypy")
    venv.create(tmp_path / "env")
    site = Path(sysconfig.get_path("purelib", vars={"base": str(tmp_path / "env")}))
    site.joinpath("buckler.pth").write_text(f"{ROOT / 'src'}\n{sysconfig.get_path('purelib')}\n")
    tmp_path.joinpath("script.py").write_text(SCRIPT + WRONG)
    words = ["--strict", "--python-executable", str(tmp_path / "env" / "bin" / "python"), "--config-file=", "script.py"]
    command = [sys.executable, "-m", "mypy", *words]
    run = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert run.returncode in (0, 1), run.stderr
    said = run.stdout.splitlines()
    assert [line.partition("Revealed type is ")[2] for line in said if "Revealed" in line] == [
        '"buckler.mbs.record.errors.Status"',
        '"dict[str, numpy.ndarray[Any, Any]]"',
        '"typing.Sequence[buckler.mbs.elements.joint.Joint]"',
    ]
    begin = SCRIPT.count("\n") + 2
    wrong = {int(line.split(":")[1]) for line in said if ": error:" in line}
    assert wrong == {begin, begin + 1, begin + 2, begin + 3}, said


def test_links_of_the_source_are_its_folders():
    for name in ("elastica", "mbs", "studies"):
        assert (ROOT / "src/buckler" / name).resolve() == ROOT / name and (ROOT / name / "py.typed").is_file()
