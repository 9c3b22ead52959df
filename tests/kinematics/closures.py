"""Linkages whose loops are closed."""

from dataclasses import replace

import numpy as np

from buckler.mbs import Rigid, Section, library

BAR = Rigid(Section(width=0.020, thickness=0.005))
SPEED = 1.25
CRANK, COUPLER, ROCKER, FRAME = LENGTHS = library.CrankRocker()
START = np.radians(50)


def crank_rocker(speed=SPEED, **carried):
    """The crank-rocker, with points that its coupler carries."""
    made = library.crank_rocker(BAR, speed=speed, section=BAR.section, angle=START)
    crank, coupler, rocker = made.links
    return replace(made, points={**made.points, **carried}, links=[crank, replace(coupler, carries=list(carried)), rocker])
