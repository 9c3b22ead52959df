"""The pendulum as a file in the working folder."""

import json

import pytest
from own_file import PENDULUM


@pytest.fixture
def pendulum(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pendulum.json").write_text(json.dumps(PENDULUM))
    return tmp_path
