"""Frequencies at rest without a compiler, as plain Python, against the compiled ones."""

import os
import subprocess
import sys

import numpy as np
import pytest

from buckler.mbs import Beam, Guide, Link, Mechanism, Revolute, Section, Spring, frequencies
from buckler.mbs.functions import Expression

CUBIC = 4e5
HANGING = Mechanism(
    points={"P": (0.0, 0.0), "B": (0.0, -0.1), "C": (0.4, -0.1)},
    links=[Link("strip", "B", "C", Beam(Section(0.02, 0.002), elements=4))],
    joints=[Revolute("C", "ground", "strip")],
    guides=[Guide("B", "strip", along=(0, 1), mass=0.3)],
    loads=[Spring("ground:P", "strip:B", 0.0, free_length=0.1, law=Expression(f"{CUBIC}*x**3"))],
    gravity=(0.0, -9.81),
)
PLAIN = """
import sys
from buckler.mbs import Mechanism, frequencies
found = frequencies(Mechanism.load(sys.argv[1]), count=4)
print(*found.hertz, *found.shapes[0])
assert "numba" not in sys.modules
"""


@pytest.mark.slow
def test_frequencies_as_plain_python_are_the_compiled_ones(tmp_path):
    path = tmp_path / "hanging.toml"
    HANGING.save(path)
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    run = subprocess.run([sys.executable, "-c", PLAIN, path], env=environment, capture_output=True, text=True, check=True)
    plain, found = np.array(run.stdout.split(), float), frequencies(HANGING, count=4)
    assert found.hertz == pytest.approx(plain[:4], rel=1e-6)  # round-off of the stiffest one, 1e5 times as high
    assert np.abs(found.shapes[0]) == pytest.approx(np.abs(plain[4:]), rel=1e-5)
