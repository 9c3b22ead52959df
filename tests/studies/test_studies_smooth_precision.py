"""Smooth slider-crank: engine, plain run and spectral strip agree, and a wrong one is found."""

import numpy as np
import pytest

from buckler.studies.trust import smooth_precision
from buckler.studies.trust.smooth_precision import Parameters, run

SHORT = {"turns": 0.25, "elements": (4,), "tolerances": (1e-6, 1e-7), "steps": (400, 1600), "repeats": 1, "degree": 10}


@pytest.fixture(scope="module")
def short():
    return run(Parameters(**SHORT))


def test_engine_and_plain_runs_agree_with_the_spectral_strip(short):
    assert short.status == "OK" and short.metrics["best_error"].value < 1e-3
    assert short.metrics["reference_own_error"].value < 3e-4
    plain = short.signals["plain ANCF x 4, tuned.error"]
    assert (plain < 5e-3).all() and plain[-1] < 1e-3
    assert len(short.tables[0].rows) == 4 + 4 and smooth_precision.figure(short).axes


def test_a_wrong_mass_is_found(monkeypatch):
    true = smooth_precision.reference
    monkeypatch.setattr(smooth_precision, "reference", lambda p, n: true(Parameters(**SHORT, mass=0.31), n))
    result = run(Parameters(**SHORT))
    assert result.status == "SUSPECT" and "engine and reference differ" in result.message


def test_failed_plain_run_has_no_error():
    p = Parameters(**SHORT)
    failed = smooth_precision.plainly(p, 4, 50, 1e-300, 1e-300)
    assert failed.status != "OK" and np.isnan(failed.deflection).all()
