"""The table of signs fits the files."""

from pathlib import Path

import pytest
from signs import COMPILED, PLAIN, SPECTRAL

ROOT = Path(__file__).parents[2]
ROWS = [row[:3] for row in PLAIN] + [(kind, f"{SPECTRAL}/{name}", it.replace("FLIP * ", "")) for kind, _, name, it in COMPILED]


@pytest.mark.parametrize(("kind", "file", "text"), ROWS, ids=lambda value: value)
def test_what_is_turned_stands_once_in_its_file(kind, file, text):
    assert (ROOT / file).read_text(encoding="utf-8").count(text) == 1
