"""Mistakes of a first hour: each is one line with its place and its cure."""

import pytest

from buckler.studies.kit.cli import main

FILE = """points = { O = [0, 0], C = ["225 mm", 0] }
pins = ["O: ground crank", "A: crank coupler", "B: coupler rocker", "C: ground rocker"]
drives = [{ target = "crank", speed = "60 rpm" }]
defaults = { body = { kind = "Rigid" }, section = { width = "20 mm", thickness = "5 mm" } }
[links]
crank = { start = "O", end = "A", length = "105 mm", angle = "60 deg" }
coupler = { start = "A", end = "B", length = "272 mm" }
rocker = { start = "C", end = "B", length = "175 mm" }
"""


@pytest.mark.parametrize(
    ("right", "wrong", "message"),
    [
        ('"105 mm"', "105 mm", "every name, needs quotes"),
        ('"105 mm"', "105", "out of reach, no pose has these lengths"),
        ('"105 mm"', '"105 millimeters"', "unknown unit 'millimeters'; known: m, "),
        ('"60 rpm"', '"1 Hz"', "turns in a time are written as '60 rpm' or '1 rev/s'"),
        ('"60 rpm"', '"60 rpm * t"', "a formula has plain numbers, in SI, as 6.28 for 60 rpm"),
        ('"60 rpm"', '"2 (1 + t)"', "a product is written with *"),
        ('"60 rpm"', '"2*sin(t"', "'2*sin(t' is no formula: '(' was never closed"),
        ("[links]", "[[links]]", "links = [...]: must be tables by name, as [links.crank]"),
        ("[links]", "[links]\nrocker = {}", "a name stands twice there"),
    ],
)
def test_of_a_file(tmp_path, capsys, right, wrong, message):
    path = tmp_path / "m.toml"
    path.write_text(FILE.replace(right, wrong), encoding="utf-8")
    assert main(argv=["run", str(path)]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: {path}") and message in said and said.count("\n") == 1


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["simulate"], "unknown command 'simulate'; there are: list, new, show, run"),
        (
            ["run", "m.toml", "--measure", "peak(A.vx)"],
            "write peak(signal, n), n = 1 for the first contact; of the whole run max(signal)",
        ),
        (["run", "m.txt"], "m.txt: neither a file of a mechanism (.toml, .json) nor of a study (.py)"),
        (["run", "n.toml"], "No such file or directory; there are: m.toml"),
        (["sweep", "m.toml", "--vary", "crank.length=1,2"], "crank: not in the file, did you mean 'links.crank'?"),
    ],
)
def test_of_the_command_line(tmp_path, capsys, monkeypatch, words, message):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.toml").write_text(FILE, encoding="utf-8")
    assert main(argv=words) == 2
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1
