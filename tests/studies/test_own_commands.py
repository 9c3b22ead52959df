"""Commands about mechanisms of files: examples, schema, sweeps, studies of others."""

import json
import re
from pathlib import Path

import pytest
from made_up_study import metrics_of

from buckler.mbs.documents.document import read as read_document
from buckler.studies.kit.cli import main
from buckler.studies.sweeping.sweep import read

ROOT = Path(__file__).resolve().parents[2]


def test_new_show_and_the_names_of_examples(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(argv=["new", "list"]) == 0
    names = [line.split()[0] for line in capsys.readouterr().out.splitlines()]
    assert set(names) >= {"slider-crank", "crank-rocker", "six-bar", "arch", "pendulum"}
    for name in names:
        assert main(argv=["new", name]) == 0
        assert main(argv=["show", f"{name}.toml", "--out", f"{name}.png"]) == 0
        out = capsys.readouterr().out
        assert re.search(r"mobility [0-3]", out) and "ground" in out and f"drawn in {name}.png" in out
        assert read_document(Path(f"{name}.toml"))["run"]["duration"]
        assert "lowest frequencies" in out or name in ("pendulum", "crank-rocker", "stephenson")
    assert main(argv=["new", "pendulum"]) == 2
    assert capsys.readouterr().err == "error: pendulum.toml is there already; name another with --out\n"
    assert main(argv=["new", "pendulm"]) == 2
    assert "did you mean pendulum?" in capsys.readouterr().err


def test_show_draws_what_set_changes(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(argv=["new", "stephenson"]) == 0
    assert main(argv=["show", "stephenson.toml", "--set", "links.rod.length=420mm"]) == 0
    assert re.search(r"^rod +D-E +Rigid +0\.42 ", capsys.readouterr().out, re.MULTILINE)
    assert main(argv=["show", "stephenson.toml", "--set", "links.rod.lenght=420mm"]) == 2


@pytest.mark.slow
@pytest.mark.parametrize("name", ["slider-crank", "crank-rocker", "six-bar", "arch", "pendulum"])
def test_every_example_runs_and_passes_its_checks(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(argv=["new", name]) == 0
    assert main(argv=["run", f"{name}.toml", "--ledger"]) == 0, capsys.readouterr().err


def test_the_schema_knows_units_ranges_and_kinds(capsys):
    assert main(argv=["--schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    section = schema["$defs"]["Section"]
    assert section["required"] == ["width", "thickness"]
    thickness, poisson = section["properties"]["thickness"], schema["$defs"]["Material"]["properties"]["poisson"]
    assert "Unit: m." in thickness["description"] and poisson["anyOf"][0]["exclusiveMinimum"] == -1
    assert thickness["anyOf"][0] == {"type": "number", "minimum": 1e-9, "maximum": 1e6}
    restitution = schema["$defs"]["CarvalhoMartins"]["properties"]["restitution"]["anyOf"][0]
    assert restitution == {"type": "number", "minimum": 0.0, "maximum": 1.0}
    laws = {part["$ref"].rpartition("/")[2] for part in schema["$defs"]["Stop"]["properties"]["law"]["anyOf"]}
    assert {"Impact", "Hertz", "CarvalhoMartins"} <= laws and "Coulomb" not in laws
    for name, kind in schema["$defs"].items():
        assert kind.get("description"), name


VARY = ["--vary", "links.arm.body.mass=0.5kg:2kg:3", "--measure", "max(abs(O.ground-arm.fy))", "--workers", "0"]


def test_a_sweep_of_a_file_is_stored_and_resumed(pendulum, capsys):
    assert main(argv=["sweep", "pendulum.json", *VARY]) == 0
    out, _ = capsys.readouterr()
    assert "links.arm.body.mass [kg]" in out and re.search(r"pendulum: OK in \S+ s", out)
    first = read(pendulum / "results" / "pendulum-sweep" / "cases.sqlite")[0]
    assert main(argv=["sweep", "pendulum.json", *VARY]) == 0
    rows, units = read(pendulum / "results" / "pendulum-sweep" / "cases.sqlite")
    assert [row.parameters["links.arm.body.mass"] for row in rows] == [0.5, 1.25, 2.0]
    assert units == {"links.arm.body.mass": "kg"}
    assert [row.provenance["ended"] for row in rows] == [row.provenance["ended"] for row in first]
    forces = [row.value("max(abs(O.ground-arm.fy))") for row in rows]
    assert forces == sorted(forces) and forces[0] > 0
    document = json.loads((pendulum / "pendulum.json").read_text())
    document["gravity"] = [0, -1.62]
    (pendulum / "pendulum.json").write_text(json.dumps(document))
    assert main(argv=["sweep", "pendulum.json", *VARY]) == 2
    assert "holds another sweep, with mechanism = pendulum" in capsys.readouterr().err


def test_a_study_of_ones_own_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_own_study.py").write_text((ROOT / "tests" / "support" / "made_up_study.py").read_text())
    assert main(argv=["run", "./my_own_study.py", "--thickness", "1mm"]) == 0
    assert metrics_of(tmp_path / "results" / "my_own_study")["status"] == "OK"
    (tmp_path / "no_study_at_all.py").write_text("x = 1\n")
    assert main(argv=["run", "no_study_at_all.py"]) == 2
    assert "no study, it defines no `Parameters`" in capsys.readouterr().err
    (tmp_path / "not_python_at_all.py").write_text("x = (\n")
    assert main(argv=["run", "not_python_at_all.py"]) == 2
    assert "not_python_at_all.py: line 1: '(' was never closed" in capsys.readouterr().err
    assert main(argv=["run", "absent_study.py"]) == 2


def test_studies_of_other_packages_by_entry_points(monkeypatch, capsys, tmp_path):
    from importlib import metadata

    point = metadata.EntryPoint("theirs", "made_up_study", "buckler.studies")
    monkeypatch.setattr(metadata, "entry_points", lambda group: [point] if group == "buckler.studies" else [])
    assert main(argv=["list"]) == 0
    assert "theirs" in capsys.readouterr().out
    assert main(argv=["run", "theirs", "--out", str(tmp_path)]) == 0
