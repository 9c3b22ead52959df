"""An accuracy that cannot be asked for is wrong input, told at once."""

import pytest

from buckler.studies.kit.cli import main


@pytest.mark.parametrize("study", ["slider-crank", "crank-rocker"])
def test_an_accuracy_beyond_reach_is_wrong_input(study, tmp_path, capsys):
    assert main(None, ["run", study, "--accuracy", "1e-9", "--out", str(tmp_path)]) == 2
    said = capsys.readouterr().err
    assert "accuracy = 1e-09" in said and "[1e-06, 0.1]" in said and "Traceback" not in said
