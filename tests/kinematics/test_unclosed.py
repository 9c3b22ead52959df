"""A linkage whose loops do not close between two times to which it was followed ends there, by name."""

import numpy as np
from simulations import BAR

from buckler.mbs import Status, crank_rocker, simulate
from buckler.mbs.kinematics.determined import Follower, UnclosedError


def test_what_does_not_close_in_between_ends_the_run(monkeypatch):
    """As from 10 ms on."""
    whole = Follower.at

    def torn(self, times):
        if times[-1] > 0.01:
            raise UnclosedError(float(times[np.argmax(times > 0.01)]))
        return whole(self, times)

    monkeypatch.setattr(Follower, "at", torn)
    result = simulate(crank_rocker(BAR, speed=30.0), 0.05)
    assert result.status is Status.SINGULAR and "loops do not close at t = 0.01" in result.message
    assert 0.0 < result.time[-1] <= 0.01
