"""How the cost of a step grows with the mechanism."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("numba")

from drawing import drawn

from buckler.studies.trust import scaling


@pytest.mark.parametrize("families", [("chain", "lattice"), pytest.param(tuple(scaling.FAMILIES), marks=pytest.mark.slow)])
def test_every_family_runs_in_every_series(families: tuple[str, ...]) -> None:
    p = scaling.Parameters(links=(3, 16, 20), families=families, compared=(3,), repeats=1, tolerances=(1e-4, 1e-5), duration=0.02)
    result = scaling.run(p)
    assert result.status == "OK", result.message
    for family in families:
        for series in scaling.SERIES:
            assert (result.signals[f"{family}.{series}"] > 0).all()
            assert np.isfinite(result.metrics[f"{family}.{series}.exponent"].value)
        assert f"{family}.ratio_3" in result.metrics
    assert len(drawn(scaling, result).axes) == len(families)


def test_the_slope_is_that_of_the_larger_mechanisms() -> None:
    links = np.array([1, 2, 16, 32, 128])
    assert scaling.exponent(links, np.array([9.0, 9.0, 2.0, 4.0, 16.0])) == pytest.approx(1.0)
    assert np.isnan(scaling.exponent(links[:3], np.ones(3)))


@pytest.mark.parametrize("links", [1, 2, 7, 16, 128])
def test_the_net_has_as_many_strips_as_asked_for_and_hangs_together(links: int) -> None:
    net = scaling.lattice(links, scaling.BAR)
    assert len(net.links) == links
    # each knot but the upper edge's joins all of its strips: as many pins as strips' ends, less one a knot
    knots = sum(y < 0 for _, y in net.points.values())
    assert len(net.joints) == 2 * links - knots


def test_a_rod_let_go_from_the_horizontal_falls_with_one_and_a_half_g_at_its_end() -> None:
    t = np.array([0.0, 2e-3])
    run = scaling.compiled(scaling.chain(1, scaling.BAR), 2e-3, 1e-6)
    assert run.end is not None
    thick = 1 + (0.005 / scaling.SIDE) ** 2 / 4  # (L^2 + h^2/4)/3, the moment of inertia of a bar about its end, over L^2/3
    assert np.diff(run.end(t), axis=0)[0] == pytest.approx([0.0, -0.75 * 9.81 / thick * t[1] ** 2], abs=1e-8)


def test_an_error_is_the_distance_over_the_way() -> None:
    times = np.linspace(0.0, 1.0, 11)
    exact = scaling.Run(1.0, 1.0, lambda t: np.array([t, 0 * t]).T)
    other = scaling.Run(1.0, 1.0, lambda t: np.array([t, 0.1 * t]).T)
    assert scaling.error(other, exact, times) == pytest.approx(0.1)
    assert np.isnan(scaling.error(scaling.Run(1.0, 1.0), exact, times))
