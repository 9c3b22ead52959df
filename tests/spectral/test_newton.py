"""Newton's method for the nodes of an implicit step: ratio of its increments."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("numba")

from buckler.mbs.spectral import newton


def test_the_ratio_of_increments_starts_anew_with_new_matrices(monkeypatch: pytest.MonkeyPatch) -> None:
    """The old matrices diverge, the first increment with new ones suffices: the next step can keep them."""
    sizes = iter([(1.0, 1.0), (3.0, 3.0), (1e-3, 1e-3)])
    monkeypatch.setattr(newton, "_compute_residuals", lambda *_: None)
    monkeypatch.setattr(newton, "_apply_increment", lambda *_: next(sizes))
    monkeypatch.setattr(newton, "renew_matrices", lambda *_: True)
    model = SimpleNamespace(tables=None, orders=None, work=None, state=SimpleNamespace(error_ratio=np.ones(1)))
    ratio = newton.solve_nodes.py_func(model, 0.0, 1.0, 1e-2, False, SimpleNamespace(iterations=0))
    assert ratio <= newton.SLOW
