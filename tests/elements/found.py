"""Mechanisms in which faults were found."""

from simulations import BAR

from buckler.mbs import Guide, Link, Mechanism, Revolute

POINTS = {"O": (0, 0), "A": (1, 0), "B": (2, 0)}


def made(**changed):
    parts = dict(
        points=POINTS,
        links=[Link("crank", "O", "A", BAR), Link("rod", "A", "B", BAR)],
        joints=[Revolute("O", "ground", "crank"), Revolute("A", "crank", "rod")],
        guides=[Guide("B", "rod", mass=1.0)],
    )
    return Mechanism(**{**parts, **changed})
