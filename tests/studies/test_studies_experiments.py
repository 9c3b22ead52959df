"""Measured pendulums: equations against a closed form and `simulate`, fits against data that were made."""

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

from buckler.mbs import simulate
from buckler.studies.kit.cli import main
from buckler.studies.measured import experiments
from buckler.studies.measured.chain import Chain, Data, fitted

TRIPLE = experiments.EXPERIMENTS["triple"].published
SINGLE = Chain((0.15,), (0.0,), {"a": (0.15,), "I": (1.2e-4,), "c": (5e-4,), "q": (1.5e-5,)}, tilt=1e-3)


def made(chain, starts, times, step, noise=0.0):
    """Data of a chain."""
    starts = np.array(starts, float)
    vectors = np.tile(chain.vector, (len(starts), 1))
    angle = np.moveaxis(chain.moved(vectors, starts[:, 0], starts[:, 1], times, step), 0, 1)
    angle += noise * np.random.default_rng(1).normal(size=angle.shape)
    return Data(angle, np.gradient(angle, step, axis=1), step)


def test_a_pendulum_without_friction_moves_as_elliptic_functions_say():
    chain = Chain((1.0,), (0.0,), {"a": (1.0,), "I": (1e-12,)})
    time = 0.002 * np.arange(1001)
    k = np.sin(1.0) ** 2  # let go at 2 rad from hanging
    w = np.sqrt(chain.gravity)
    exact = np.pi + 2 * np.arcsin(np.sqrt(k) * ellipj(w * time + ellipk(k), k)[0])
    angle = chain.moved(chain.vector, np.array([np.pi + 2.0]), np.zeros(1), len(time), 0.002)[:, 0]
    assert np.abs(angle - exact).max() < 1e-9


@pytest.mark.parametrize("chain", [SINGLE, TRIPLE], ids=["single", "triple"])
def test_simulate_moves_the_chain_as_its_own_equations_do(chain):
    arms = len(chain.mass)
    data = made(chain, [(np.pi + 0.5 * np.arange(1, arms + 1), np.ones(arms))], 301, 0.002)
    begin = np.ones(arms)
    result = simulate(chain.mechanism(data.angle[0, 0], begin), 0.6, accuracy=1e-5)
    assert result.status == "OK", result.message
    for arm in range(arms):
        turned = data.angle[0, 0, arm] - result.at(f"arm{arm + 1}.angle", 0.002 * np.arange(301))
        assert np.abs(turned - data.angle[0, :, arm]).max() < 1e-4


def test_a_fit_finds_what_the_data_were_made_with_within_its_errors():
    truth = SINGLE.of(SINGLE.vector * np.where(np.array(SINGLE.names) == "a1", 1.0, 1.2))
    data = made(truth, [([np.pi + 1.2], [0.0]), ([np.pi + 0.6], [1.0])], 400, 0.01, noise=1e-3)
    found = fitted(SINGLE, data, ("I1", "c1", "q1", "tilt"), blocks=4)
    assert found.residual == pytest.approx(1e-3, rel=0.05)
    assert data.scatter == pytest.approx(1e-3, rel=0.1)
    values, right = (dict(zip(chain.names, chain.vector, strict=True)) for chain in (found.chain, truth))
    for name, error in found.errors.items():
        assert 0 < error < 0.2 * abs(right[name])
        assert abs(values[name] - right[name]) < 4 * error, name


def test_the_study_reads_fits_predicts_and_draws(tmp_path, capsys):
    lines = ["segment,use,t_s,angle1_rad,speed1_rad_per_s"]
    data = made(SINGLE, [([4.2], [0.0]), ([3.9], [0.0]), ([3.6], [0.0])], 150, 0.01, noise=1e-4)
    for segment, (angle, speed) in enumerate(zip(data.angle[..., 0], data.speed[..., 0], strict=True)):
        use = "validate" if segment == 2 else "fit"
        lines += [f"{segment},{use},{0.01 * i:.2f},{a:.6f},{s:.5f}" for i, (a, s) in enumerate(zip(angle, speed, strict=True))]
    (tmp_path / "single.csv").write_text("\n".join(lines))
    result = experiments.run(experiments.Parameters(data=str(tmp_path), experiment="single", alternatives=0))
    assert result.status == "OK", result.message
    value = {name: metric.value for name, metric in result.metrics.items()}
    assert value["single.angle.measured"] == pytest.approx(1e-4, rel=0.2)
    assert value["single.angle.estimated"] < 2e-4 and value["single.angle.predicted"] < 0.02
    assert value["single.simulated.predicted"] == pytest.approx(value["single.angle.predicted"], rel=0.01)
    assert value["single.last_peak.predicted"] == pytest.approx(value["single.last_peak.measured"], rel=0.05)
    assert len(experiments.figure(result).axes) == 2
    for words, text in ((["--data", str(tmp_path)], "there is no triple.csv"), ([], "--data")):
        assert main(argv=["run", "experiments", "--out", str(tmp_path), *words]) == (2 if words else 1)
        assert text in capsys.readouterr().err
