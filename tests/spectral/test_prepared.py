"""Many runs of mechanisms that differ in their numbers."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("numba")

from buckler.mbs import Link, Mechanism, Revolute, Rigid, Section, Spectral
from buckler.mbs.spectral import elimination
from buckler.mbs.spectral.ensembles import prepare
from buckler.mbs.spectral.scene import Scene

BAR = Section(0.02, 0.005)


def pendulum(length: float) -> Mechanism:
    return Mechanism(
        {"A": (0.0, 0.0), "B": (length, 0.0)}, [Link("bar", "A", "B", Rigid(BAR))], [Revolute("A", "ground", "bar")],
        gravity=(0.0, -9.81),
    )  # fmt: skip


def test_runs_side_by_side_are_those_one_by_one_and_fall_as_rods_do() -> None:
    prepared = prepare(pendulum, 0.005, Spectral(), length=0.1)
    lengths = np.linspace(0.1, 0.4, 12)

    def drop(run) -> float:
        places, _ = run.record.links["bar"].point("B")
        return float(places[-1, 1])

    found = prepared.runs([{"length": length} for length in lengths], drop, workers=3)
    assert found == [drop(prepared.run(length=length)) for length in lengths]
    thick = 1 + (0.005 / lengths) ** 2 / 4  # (L^2 + h^2/4)/3, over L^2/3
    assert np.array(found) == pytest.approx(-0.75 * 9.81 / thick * 0.005**2, rel=1e-5)


def test_the_order_of_elimination_is_found_once_for_all_of_one_structure() -> None:
    elimination._fronts_of.cache_clear()
    for length in (0.1, 0.2, 0.3):
        scene = Scene.of(pendulum(length))
        assert scene.fronts.size > 0
    assert elimination._fronts_of.cache_info().misses == 1


def test_a_wrong_mechanism_is_refused_before_any_run() -> None:
    with pytest.raises(ValueError, match=r"duration = 0\.0 s"):
        prepare(pendulum, 0.0, length=0.1)
    with pytest.raises(ValueError, match="'bar'"):
        prepare(pendulum, 0.1, length=0.0)
