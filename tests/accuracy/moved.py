"""Mechanisms that springs, drives and forces move, each with its signals by another integrator or a closed form."""

from itertools import pairwise
from math import hypot, pi, sin, sqrt

import numpy as np
from scipy.integrate import solve_ivp

from buckler.mbs import (
    Drive,
    Force,
    Guide,
    Link,
    Mechanism,
    Motion,
    Revolute,
    Rigid,
    Section,
    Slider,
    Spring,
    Torque,
)
from buckler.mbs.functions import Table

G = 9.81


ROD = Section(0.03, 0.005)


def solved(rates, duration, state, step, **more):
    """Of another integrator, to 1e-11."""
    return solve_ivp(rates, (0, duration), state, "DOP853", dense_output=True, rtol=1e-11, atol=1e-14, max_step=step, **more).sol


def truss():
    """Two springs that snap through under a force that grows for 30 s: by runs of N and 2N steps that kept the same samples."""
    span, height, k, m, c, rate, duration = 0.3, 0.02, 1e5, 0.5, 2.0, 0.5, 30.0
    free = hypot(span, height)
    y = solved(
        lambda t, z: [z[1], (2 * k * (free - hypot(span, z[0])) * z[0] / hypot(span, z[0]) - c * z[1] - rate * t) / m],
        duration, [height, 0.0], 1e-2,
    )  # fmt: skip
    springs = [Spring("P", f"ground:{foot}", stiffness=k, free_length=free) for foot in "AC"]
    springs.append(Spring("P", "ground:G", stiffness=0.0, damping=c, free_length=1.0))
    mechanism = Mechanism(
        {"P": (0, height), "Q": (0, height + 0.1), "A": (-span, 0), "C": (span, 0), "G": (0, height - 1.0)},
        [Link("b", "P", "Q", Rigid.of(mass=m, inertia=1e-3, centre=(0, 0)))], [Slider("P", "b", "ground", along=(0, 1))],
        loads=[*springs, Force("P", lambda t: (0.0, -rate * t))],
    )  # fmt: skip
    return mechanism, duration, {"P.y": lambda t: y(t)[0], "spring.P-A.force": lambda t: k * (np.hypot(span, y(t)[0]) - free)}


def shaken():
    """A pivot that is shaken: with few samples a period it was known at samples, and wrong between them."""
    a, length, start = 0.02, 0.3, 0.05
    w = 40 * sqrt(G / length)
    duration = 6 * 2 * pi / w
    swing = solved(lambda t, z: [z[1], (G + a * w**2 * np.cos(w * t)) * sin(z[0]) * M / J], duration, [start, 0.0], 0.1 / w)
    mechanism = Mechanism(
        {"A": (0, 0), "T": (length * sin(start), length * np.cos(start))},
        [Link("rod", "A", "T", Rigid.of(mass=0.5, inertia=1e-4, centre=(length, 0.0)))],
        guides=[Guide("A", "rod", along=(0, 1), mass=0.1)],
        drives=[Drive("A", Motion(lambda t: a * (1 - np.cos(w * t)), lambda t: a * w * np.sin(w * t)))], gravity=(0, -G),
    )  # fmt: skip
    return mechanism, duration, {"A.y": lambda t: a * (1 - np.cos(w * t)), "T.x": lambda t: length * np.sin(swing(t)[0])}


M, J = 0.5 * 0.3, 0.5 * 0.3**2 + 1e-4
"""Of the shaken rod about its pivot: first moment, kg m, and inertia, kg m^2."""


def sliding_links():
    """A link that slides on a turning one: two runs had the same longest step, and agreed to the bit."""
    one, h, k, m1, m2 = 0.3, 0.05, 200.0, 0.2, 0.1
    inertia = 2e-3 + m1 * one**2 / 4

    def rates(_t, z):
        s, _, ds, w = z
        r, pull = one + s + 0.1, k * (one + s - 0.2) / m2
        along = r * w**2 - pull  # s'' - h w'
        dw = (-0.3 + m2 * h * along - 2 * m2 * r * ds * w) / (inertia + m2 * r**2)
        return [ds, w, along + h * dw, dw]

    z = solved(rates, 2.0, [0.0, 0.0, 0.0, 0.0], 1e-2)
    mechanism = Mechanism(
        {"O": (0, 0), "A": (one, 0), "B": (0.5, 0.1)},
        [Link("one", "O", "A", Rigid.of(mass=m1, inertia=1e-3)), Link("two", "A", "B", Rigid.of(mass=m2, inertia=1e-3))],
        [Revolute("O", "ground", "one"), Slider("A", "two", "one", along=(1, 0))],
        loads=[Spring("two:A", "ground:O", stiffness=k, free_length=0.2), Torque("one", -0.3)],
    )  # fmt: skip
    spring = next(name for name in mechanism.elements() if "spring" in name)
    return mechanism, 2.0, {"one.angle": lambda t: z(t)[1], f"{spring}.force": lambda t: k * (one + z(t)[0] - 0.2)}


def hummer(driven=()):
    """A milligram on a spring of 1e5 Hz, loaded at once: it moves by less than an atom, and its force swings."""
    m, f = 1e-6, 1e5
    k = m * (2 * pi * f) ** 2
    mechanism = Mechanism(
        {"A": (0, 0), "A2": (0, -0.1), "D": (0.1, 0)} | ({"E": (0, 1), "F": (0, 1.1)} if driven else {}),
        [Link("b", "A", "A2", Rigid.of(mass=m, inertia=m * 1e-3, centre=(0, 0))),
         *(Link(name, "E", "F", Rigid.of(mass=1.0, inertia=1e-3)) for name in driven)],
        [Slider("A", "b", "ground", along=(1, 0)), *(Revolute("E", "ground", name) for name in driven)],
        drives=[Drive(name, 3.0) for name in driven],
        loads=[Spring("A", "ground:D", stiffness=k, free_length=0.1)], gravity=(G, 0),
    )  # fmt: skip
    return mechanism, 2e-3, {"spring.A-D.force": lambda t: -m * G * (1 - np.cos(2 * pi * f * t))}


def trammel():
    """A bar whose ends slide on two lines at right angles: its angle, after two seconds of a fall near its upright pose."""
    length, start = 0.4, 0.3
    m = ROD.mass_per_length * length
    inertia = m * (length**2 + ROD.thickness**2) / 12 + m * length**2 / 4
    z = solved(lambda _t, z: [z[1], m * G * length / 2 * sin(z[0]) / inertia], 2.0, [start, 0.0], 1e-2)
    mechanism = Mechanism(
        {"A": (length * sin(start), 0), "B": (0, length * np.cos(start))}, [Link("bar", "A", "B", Rigid(ROD))],
        guides=[Guide("A", "bar"), Guide("B", "bar", (0, 1))], gravity=(0, -G),
    )  # fmt: skip
    return mechanism, 2.0, {"bar.angle": lambda t: z(t)[0] - start, "A.x": lambda t: length * np.sin(z(t)[0])}


def jerked():
    """A block that a drive moves by a centimetre within a thousandth of the run: its force was told as none."""
    way, begin, lasts, m = 0.01, 1.1, 2e-3, 1.0

    def share(t):
        return np.clip((np.asarray(t) - begin) / lasts, 0.0, 1.0)

    def speed(t):
        return way / lasts * 140 * share(t) ** 3 * (1 - share(t)) ** 3

    def place(t):
        return way * np.polyval([-20, 70, -84, 35, 0, 0, 0, 0], share(t))

    mechanism = Mechanism(
        {"A": (0, 0), "B": (0.1, 0)}, [Link("block", "A", "B", Rigid.of(mass=m, inertia=1e-3))],
        guides=[Guide("A", "block"), Guide("B", "block")], drives=[Drive("A", Motion(place, speed))],
    )  # fmt: skip
    pull = 420 * m * way / lasts**2
    return mechanism, 2.0, {
        "A.x": place, "drive.force": lambda t: pull * share(t) ** 2 * (1 - share(t)) ** 2 * (1 - 2 * share(t)),
    }  # fmt: skip


def kinked():
    """A sled by a table of speeds, and one on a spring behind it: its force jumps at each point; peaks there were doubted."""
    times, speeds, m, behind, k = (0.0, 0.1, 0.25, 0.4), (0.0, 0.6, -0.3, 0.2), 1.0, 0.4, 300.0
    rises, free = np.diff(speeds) / np.diff(times), 0.2

    def piece(t):
        return np.clip(np.searchsorted(times, t, side="right") - 1, 0, 2)

    def place(t):
        since = np.clip(np.subtract.outer(t, times[:3]), 0.0, np.diff(times))
        return since @ speeds[:3] + since**2 @ rises / 2

    def rates(t, z):
        return [z[1], k * (float(place(t)) - z[0]) / behind]

    parts, state = [], [0.0, 0.0]
    for span in pairwise(times):
        parts.append(solve_ivp(rates, span, state, "DOP853", dense_output=True, rtol=1e-11, atol=1e-14))
        state = parts[-1].y[:, -1]

    def follows(t):
        return np.choose(piece(t), [part.sol(t)[0] for part in parts])

    mechanism = Mechanism(
        {"A": (0, 0), "B": (0.1, 0), "C": (free, 0), "D": (0.3, 0)},
        [Link("sled", "A", "B", Rigid.of(mass=m, inertia=1e-3)), Link("tail", "C", "D", Rigid.of(mass=behind, inertia=1e-3))],
        guides=[Guide("A", "sled"), Guide("B", "sled"), Guide("C", "tail"), Guide("D", "tail")],
        drives=[Drive("A", Table(times, speeds))], loads=[Spring("sled:A", "tail:C", stiffness=k, free_length=free)],
    )  # fmt: skip
    return mechanism, times[-1], {
        "C.x": lambda t: free + follows(t), "drive.force": lambda t: m * rises[piece(t)] + k * (place(t) - follows(t)),
    }  # fmt: skip
