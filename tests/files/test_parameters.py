"""Named numbers of a file: put in where they are named, changed by name, refused in one line with the place."""

import tomllib

import numpy as np
import pytest

from buckler.mbs import Mechanism
from buckler.mbs.documents import document as documents
from buckler.mbs.documents.document import change
from buckler.mbs.documents.shorthand import free_parameters
from buckler.mbs.sensitivity.numbers import Family, find_entry
from buckler.studies.kit.cli import main

TEXT = """
gravity = [0, "-g"]
pins = ["O: ground arm"]

[parameters]
L = "300 mm"
h = "L/60"
turn = "60 rpm"
g = 9.81

[points]
O = [0, 0]
Q = ["-2*L + 5 mm", 0]

[defaults]
body = { kind = "Rigid" }
section = { width = "2*h", thickness = "h" }

[links]
arm = { start = "O", end = "A", length = "L", angle = "30 deg", carries = { P = ["L/2", 0] } }

[[drives]]
target = "arm"
speed = "turn*(1 - exp(-t/0.2))"
"""
FILE = tomllib.loads(TEXT)


def test_a_file_with_them_is_the_file_with_their_numbers():
    numbers = {
        '"L"': 0.3, '"L/2"': 0.15, '"-2*L + 5 mm"': -2 * 0.3 + 0.005, "turn*": f"({2 * np.pi})*", '"2*h"': 2 * 0.3 / 60,
        '"h"': 0.3 / 60,
    }  # fmt: skip
    plain = TEXT.replace('"-g"', "-9.81")
    for named, number in numbers.items():
        plain = plain.replace(named, str(number))
    without = {key: each for key, each in tomllib.loads(plain).items() if key != "parameters"}
    assert Mechanism.from_dict(FILE) == Mechanism.from_dict(without)


def test_they_change_by_name_and_what_is_made_of_them_follows():
    made = Mechanism.from_dict(change(FILE, {"L": "600 mm"}))
    assert made.length("arm") == pytest.approx(0.6) and made.links[0].body.section.thickness == pytest.approx(0.01)
    assert change(FILE, {"parameters.L": 0.6}) == change(FILE, {"L": 0.6})
    assert find_entry(FILE, "L")[1:] == ("300 mm", "m") and find_entry(FILE, "turn").unit == "rad/s"
    assert find_entry(FILE, "links.arm.length")[1:] == ("300 mm", "m")
    family = Family.of(FILE, ["L"])
    assert family.values == {"L": 0.3} and family.make({"L": 0.45}).length("arm") == pytest.approx(0.45)
    assert free_parameters(FILE) == ["parameters.L", "parameters.turn", "parameters.g"]  # h follows from L


def test_commands_take_them_by_name(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "arm.toml").write_text(TEXT.replace("turn*(1 - exp(-t/0.2))", "turn"), encoding="utf-8")
    assert main(argv=["sweep", "arm.toml", "--vary", "L=200mm:400mm:2", "--measure", "max(abs(A.x))", "--duration", "0.2"]) == 0
    out = capsys.readouterr().out
    assert "L [mm]" in out and "200 " in out and "400 " in out
    assert main(argv=["run", "arm.toml", "--set", "L=150mm", "--measure", "start(A.x)", "--duration", "0.2"]) == 0
    assert f"{0.15 * np.cos(np.pi / 6):.4g}"[:5] in capsys.readouterr().out


def test_they_survive_a_file(tmp_path):
    kept = documents.read(documents.write(FILE, tmp_path / "kept.toml"))
    assert kept == FILE


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("L", "3 kg", "links.arm.length = 3 kg: must be in m"),
        ("L", "3 blah", "unknown unit 'blah'"),
        ("L", [1], "parameters.L = [1]: must be a number"),
        ("h", "L/0", "parameters.h = 'L/0': float division by zero"),
        ("h", "LL/60", "unknown name 'LL', did you mean 'L'?"),
        ("t", 1.0, "parameters.t: is a variable of formulas, too; choose another name"),
        ("A", 1.0, "parameters.A: is the name of a point or link, too; choose another name"),
        ("sin", 1.0, "parameters.sin: is a name that formulas know, too"),
        ("a-b", 1.0, "parameters.a-b: no name for a formula"),
    ],
)
def test_mistakes_are_one_line_with_the_place(name, value, words):
    with pytest.raises(ValueError) as error:
        Mechanism.from_dict({**FILE, "parameters": {**FILE["parameters"], name: value}})
    assert words in str(error.value) and "\n" not in str(error.value)


def test_unknown_ones_are_named_with_their_neighbours():
    with pytest.raises(ValueError, match=r"parameters\.turm: not in the file, did you mean 'turn'\?; there are: L, h, turn, g"):
        change(FILE, {"parameters.turm": 1.0})
