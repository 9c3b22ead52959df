"""Linkages whose loops are closed."""

import numpy as np

from buckler.mbs import Drive, Link, Mechanism, Revolute, Rigid, Section

BAR = Rigid(Section(width=0.020, thickness=0.005))
SPEED = 1.25
CRANK, COUPLER, ROCKER, FRAME = 0.105, 0.272, 0.175, 0.225
START = np.radians(50)


def joint_by_circles(angle):
    """Coupler-rocker joint above the frame: two circles cut each other."""
    pin = CRANK * np.exp(1j * angle)
    line = FRAME - pin
    along = (COUPLER**2 - ROCKER**2 + abs(line) ** 2) / (2 * abs(line))
    return pin + line / abs(line) * (along + 1j * np.sqrt(COUPLER**2 - along**2))


def crank_rocker(speed=SPEED, carried=()):
    b, a = joint_by_circles(START), CRANK * np.exp(1j * START)
    points = {"O": (0, 0), "A": (a.real, a.imag), "B": (b.real, b.imag), "C": (FRAME, 0), **dict(carried)}
    joints = [("O", "ground", "crank"), ("A", "crank", "coupler"), ("B", "coupler", "rocker"), ("C", "ground", "rocker")]
    links = [
        Link("crank", "O", "A", BAR),
        Link("coupler", "A", "B", BAR, carries=[name for name, _ in carried]),
        Link("rocker", "C", "B", BAR),
    ]
    return Mechanism(points, links, [Revolute(*joint) for joint in joints], drives=[Drive("crank", speed)])
