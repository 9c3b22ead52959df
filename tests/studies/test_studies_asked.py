"""An accuracy that cannot be asked for is wrong input, told at once."""

from buckler.studies.kit.cli import main


def test_an_accuracy_beyond_reach_is_wrong_input(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(None, ["new", "six-bar"]) == 0
    assert main(None, ["run", "six-bar.toml", "--accuracy", "1e-9"]) == 2
    said = capsys.readouterr().err
    assert "accuracy = 1e-09" in said and "[1e-06, 0.1]" in said and "Traceback" not in said
