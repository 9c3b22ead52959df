"""Mechanisms of which runs are checked, and the reason by which a run is suspect."""

import numpy as np
from simulations import LENGTH, STRIP

from buckler import mbs
from buckler.mbs.laws import AdamsFriction, CarvalhoMartins, Impact

K = 2.53e5 * 1e3**1.5
RATTLING, CLOSED = Impact(K, 253.0, 1e-5), Impact(K, 253e3, 1e-5)
FRICTION = AdamsFriction(0.3, 0.1)
BARS = mbs.Section(0.005, 0.020)


def rattling(law=RATTLING, friction=FRICTION, rocker=None, with_play="OABC", gap=2.5e-4):
    def play(point, first, second):
        return mbs.Clearance(point, first, second, 5e-3, gap, law, friction)

    return mbs.crank_rocker(rocker or mbs.Rigid(BARS), speed=10 * np.pi, play=play, with_play=with_play, section=BARS, angle=0.5)


def striking(coupler):
    return mbs.slider_crank(coupler, law=CarvalhoMartins(7.2e4, 0.8, exponent=1.0), mass=0.3, speed=1.25)


WET = STRIP.damped(0.05, LENGTH)


def suspect(result, name):
    """The reasons by which a run is suspect, which must name this check."""
    assert result.status is mbs.Status.SUSPECT, f"{result.status}: {result.message}"
    reasons = [reason for reason in result.message.split("; ") if reason.startswith(f"{name}:")]
    assert reasons, result.message
    return reasons[0]
