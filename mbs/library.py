"""Ready mechanisms: small functions that return a `Mechanism`, with no privileges a user's own one lacks."""

from __future__ import annotations

import numpy as np

from mbs.kinematics import SliderCrank
from mbs.laws import NormalLaw
from mbs.mechanism import (
    Body,
    Drive,
    Guide,
    GuideFriction,
    Link,
    Mechanism,
    Motion,
    Ramp,
    Revolute,
    Rigid,
    Stop,
)
from mbs.sections import Section

PAPER = SliderCrank(crank=0.140, coupler=0.310)
"""Lengths of the compliant slider-crank, m (Demirel et al. 2008, Table 1, doi 10.1115/IMECE2008-68796)."""
PAPER_STOP = float(PAPER.slider(np.radians(120)))
"""Place of its stopper, m: the rigid slider arrives at a crank angle of 120 degrees."""


def slider_crank(
    coupler: Body,
    *,
    law: NormalLaw | None,
    mass: float,
    speed: float | Ramp | Motion,
    friction: GuideFriction | None = None,
    stop: float = PAPER_STOP,
    lengths: SliderCrank = PAPER,
) -> Mechanism:
    """Return the compliant slider-crank at crank angle 0, its slider on the far side of the crank pivot.

    Parameters
    ----------
    coupler : Beam, Cable, Strut or Rigid
        Body of the coupler, from the crank pin A to the slider B.
    law : NormalLaw or None
        Contact law of the stopper; None leaves the stopper out.
    mass : float
        Of the slider, kg.
    speed : float, Ramp or Motion
        Of the crank, rad/s.
    friction : GuideFriction, optional
        Of the slider's guide.
    stop : float
        Place of the stopper on the slider's line, m, negative.
    lengths : SliderCrank
        Of crank and coupler, m.
    """
    crank = Rigid(Section(width=0.030, thickness=0.005))  # its speed is prescribed: its mass changes the torque only
    return Mechanism(
        points={"O": (0.0, 0.0), "A": (lengths.crank, 0.0), "B": (float(lengths.slider(0.0)), 0.0)},
        links=[Link("crank", "O", "A", crank), Link("coupler", "A", "B", coupler)],
        joints=[Revolute("O", "ground", "crank"), Revolute("A", "crank", "coupler")],
        guides=[Guide("B", "coupler", mass=mass, friction=friction)],
        stops=[] if law is None else [Stop("B", at=stop, law=law)],
        drive=Drive("crank", speed),
    )
