"""The toy study on the command line."""

import pytest

from buckler.studies.kit import registry
from buckler.studies.kit.cli import main


@pytest.fixture
def toy(monkeypatch, tmp_path):
    """Sweep the toy study in this process: `toy("--vary", "length=1,2")` returns the exit status."""
    monkeypatch.setitem(registry.STUDIES, "toy", registry.StudyEntry("sweep_toy", "a study for tests"))

    def call(*words):
        return main(argv=["sweep", "toy", "--workers", "0", "--out", str(tmp_path), *words])

    call.folder = tmp_path / "toy-sweep"
    call.store, call.page = call.folder / "cases.sqlite", call.folder / "report.html"
    return call
