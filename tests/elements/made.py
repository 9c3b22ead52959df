"""A mechanism for tests of what mechanisms are."""

from dataclasses import replace

from buckler.mbs import STEEL, Guide, Link, Mechanism, Revolute, Rigid, Section, Strut
from buckler.mbs.laws import ExactRestitution

BAR = Section(width=0.020, thickness=0.005)
STRIP = Section(width=0.030, thickness=0.0003)  # of the compliant slider-crank, doi 10.1115/IMECE2008-68796
LENGTH = 0.310
LAW = ExactRestitution(1e5, 0.8)


def steel(**changed):
    return replace(STEEL, **changed)


POINTS = {"O": (0, 0), "A": (1, 0), "B": (2, 0)}
LINKS = (Link("crank", "O", "A", Rigid(BAR)), Link("rod", "A", "B", Strut(STRIP)))
JOINTS = (Revolute("O", "ground", "crank"), Revolute("A", "crank", "rod"))
GUIDES = (Guide("B", "rod", mass=1.0),)


def mechanism(**changed):
    parts = dict(points=POINTS, links=LINKS, joints=JOINTS, guides=GUIDES)
    return Mechanism(**{**parts, **changed})


def stiff(**changed):
    """The same of two rigid bars."""
    return mechanism(**{"links": [Link("crank", "O", "A", Rigid(BAR)), Link("rod", "A", "B", Rigid(BAR))], **changed})
