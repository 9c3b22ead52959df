"""Published trajectories of mechanisms with clearance by nonsmooth dynamics: numbers only, from the examples of Siconos.

Source: the reference files (.ref) of the Siconos tutorials, repository siconos/siconos-tutorials on GitHub, commit b6c9bfd
(24 July 2024), examples/mechanics/FourBarLinkageWith3clearance/FourBarClearance.ref and
examples/mechanics/SliderCrank/SliderCrankMoreauJean(Direct|Combined)ProjectionOSI.ref. Copyright INRIA, Apache License 2.0.
The slider-crank is that of P. Flores, R. Leine, C. Glocker, doi 10.1007/s11044-009-9178-y.

Four-bar: every row that is published. Slider-crank: every tenth, up to 0.1 s.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from buckler.mbs.geometry import Array


def _columns(name: str) -> Array:
    return np.loadtxt(Path(__file__).with_name(f"siconos_{name}.csv"), delimiter=",", skiprows=1, unpack=True)


FOURBAR = _columns("four_bar")
"""Time, s; angles of crank, coupler and rocker, rad; speed of the crank, rad/s; torque of its drive, N m."""
SLIDER_CRANK = _columns("slider_crank")
"""Time, s; crank's revolutions and the slider's height over the clearance, by direct and by combined projection."""
