"""Mechanisms run by several files of tests, and how their runs are judged."""

import math

import numpy as np
from scipy.special import ellipj, ellipk

from buckler.mbs import Beam, Drive, Force, Guide, Link, Mechanism, Motion, Revolute, Rigid, Section, Spring, Status, Stop
from buckler.mbs.kinematics.closing import Course
from buckler.mbs.kinematics.determined import Follower

G = 9.81
BAR = Rigid(Section(width=0.020, thickness=0.010))
STRIP = Section(width=0.030, thickness=0.0003)  # of the compliant slider-crank, doi 10.1115/IMECE2008-68796
LENGTH = 0.310
UNIT = STRIP.bending_stiffness / LENGTH**2
SPAN = 0.5  # of the pendulum
SIMPLE = 0.5  # length of the simply supported strip


def fine(result):
    """The result, if it is trustworthy."""
    assert result.status is Status.OK, result.message
    return result


def rates(errors, factor=2.0):
    """Observed orders of convergence, steps shrinking by a factor each time."""
    return np.log(np.divide(errors[:-1], errors[1:])) / np.log(factor)


def closed(mechanism, times):
    """The mechanism as a linkage of rigid links, and what its loops say at times: one `Course` each."""
    times = np.asarray(times, dtype=float)
    follower = Follower(mechanism, max(1e-6, times.max()))
    assert follower.failure is None, follower.failure
    return follower.linkage, [Course(*each) for each in zip(*follower.at(times), strict=True)]


def position(linkage, link, point, q):
    """Place of a point of a link, or of the ground, at coordinates q (links, 3)."""
    if link == "ground":
        return np.array(linkage.mechanism.points[point])
    i = linkage.index[link]
    arm = complex(*linkage.mechanism.points[point]) - complex(*linkage.reference[i, :2])  # at t = 0
    z = arm * np.exp(1j * (q[i, 2] - linkage.reference[i, 2]))
    return q[i, :2] + [z.real, z.imag]


def velocity(linkage, link, point, q, q_t):
    i = linkage.index[link]
    arm = position(linkage, link, point, q) - q[i, :2]
    return q_t[i, :2] + q_t[i, 2] * np.array([-arm[1], arm[0]])


def pendulum(angle, swapped=False):
    names = ("bar", "ground") if swapped else ("ground", "bar")
    points = {"O": (0, 0), "A": (SPAN * math.sin(angle), -SPAN * math.cos(angle))}
    return Mechanism(points, [Link("bar", "O", "A", BAR)], [Revolute("O", *names)], gravity=(0.0, -G))


def pendulum_frequency():
    """Small swings, rad/s: omega^2 = m g (L/2)/I_O with I_O = m (L^2 + h^2)/12 + m L^2/4."""
    return math.sqrt(G * SPAN / 2 / ((SPAN**2 + BAR.section.thickness**2) / 12 + SPAN**2 / 4))


def exact_swing(angle, times):
    """Angle from hanging and its rate, (2, times), by elliptic functions."""
    w, k = pendulum_frequency(), math.sin(angle / 2)
    sn, cn, _, _ = ellipj(ellipk(k**2) + w * np.asarray(times), k**2)
    return np.array([2 * np.arcsin(k * sn), 2 * k * w * cn])


def parallelogram(drives, third_bar=True, **more):
    points = {"O": (0, 0), "P": (2, 0), "A": (0, 1), "B": (2, 1), "Q": (1, 0), "C": (1, 1)}
    links = [Link("a", "O", "A", BAR), Link("b", "P", "B", BAR), Link("k", "A", "B", BAR, carries=["C"])]
    joints = [Revolute("O", "ground", "a"), Revolute("P", "ground", "b"), Revolute("A", "a", "k"), Revolute("B", "b", "k")]
    if third_bar:
        links += [Link("c", "Q", "C", BAR)]
        joints += [Revolute("Q", "ground", "c"), Revolute("C", "c", "k")]
    return Mechanism(points, links, joints, drives=drives, **more)


FEATHER = Rigid(Section(1e-3, 1e-3))
BLOCK = 0.5
MASS = BLOCK + FEATHER.section.mass_per_length * 0.1


def block(pull=0.0, law=None, stop=0.1, friction=None, speed=None, along=(1.0, 0.0)):
    """A block on a guide, pulled along it; a light bar carries it, both its ends on the line."""
    unit = np.array(along) / np.hypot(*along)
    return Mechanism(
        points={"A": (0, 0), "B": tuple(0.1 * unit)},
        links=[Link("bar", "A", "B", FEATHER)],
        guides=[Guide("A", "bar", along, BLOCK, friction), Guide("B", "bar", along)],
        stops=[] if law is None else [Stop("A", at=stop, law=law)],
        drives=[] if speed is None else [Drive("A", speed)],
        gravity=tuple(pull * unit),
    )


def guided(mass=0.5, start=(0.0, 0.0), along=(1.0, 0.0), points=(), **parts):
    """A block O on a line, held by a bar without mass."""
    end = (start[0] + 0.2 * along[0], start[1] + 0.2 * along[1])
    links = [Link("bar", "O", "A", Rigid.of(mass=1e-9, inertia=1e-12))]
    guides = [Guide("O", "bar", mass=mass, along=along), Guide("A", "bar", along=along)]
    return Mechanism({"O": start, "A": end, **dict(points)}, links, guides=guides, **parts)


def pushed(stiffness=200.0, mass=0.5, push=3.0, damping=0.0):
    """A block on a guide, a spring and a steady push from rest: undamped x = (F/k)(1 - cos(w t)), 2 F/k at the most."""
    loads = [Spring("C", "O", stiffness=stiffness, damping=damping), Force("O", (push, 0.0))]
    return guided(mass, points={"C": (-0.1, 0.0)}, loads=loads)


def simply_supported(body, pull=0.0, length=SIMPLE):
    strip, pin = Link("strip", "A", "B", body), Revolute("A", "ground", "strip")
    return Mechanism({"A": (0, 0), "B": (length, 0)}, [strip], [pin], [Guide("B", "strip")], gravity=(0.0, -pull))


def slim(thickness):
    """A strip of 0.3 m by 20 mm."""
    return simply_supported(Beam(Section(0.02, thickness)), length=0.3)


def pressed(body, travel, duration, mass=0.1):
    """A strip in line with its guide, its far end on a pin; the near end travels as t^3."""
    strip, pin, guide = Link("strip", "A", "B", body), Revolute("B", "ground", "strip"), Guide("A", "strip", mass=mass)
    cubic = Motion(lambda t: travel * (t / duration) ** 3, lambda t: 3 * travel * t**2 / duration**3)
    return Mechanism({"A": (0, 0), "B": (LENGTH, 0)}, [strip], [pin], [guide], drives=[Drive("A", cubic)])
