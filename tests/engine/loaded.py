"""Links that loads, motors and springs act on."""

import math

import numpy as np

from buckler.mbs import Equal, Exudyn, Link, Mechanism, Revolute, Rigid

MASS, INERTIA, CENTRE = 2.0, 0.05, (0.10, 0.03)
CRANK = Rigid.of(mass=MASS, inertia=INERTIA, centre=CENTRE)
TIP = (0.3, 0.1)
ABOUT_PIN = INERTIA + MASS * (CENTRE[0] ** 2 + CENTRE[1] ** 2)


def tight(steps):
    return Exudyn(Equal(steps), spectral_radius=0.9, newton_absolute=1e-12)


def crank(*loads, masses=(), gravity=(0.0, 0.0), body=CRANK, joints=None):
    """A link with its centre of mass off its line, on a pin."""
    return Mechanism(
        points={"O": (0, 0), "A": TIP, "P": (0.5, 0.5)},
        links=[Link("crank", "O", "A", body)],
        joints=[Revolute("O", "ground", "crank")] if joints is None else joints,
        loads=loads, masses=masses, gravity=gravity,
    )  # fmt: skip


def turn(result):
    """Angle turned since t = 0 and its rate, from the motion of the tip."""
    x, y, vx, vy = (result.signals[f"A.{name}"] for name in ("x", "y", "vx", "vy"))
    return np.unwrap(np.arctan2(y, x)) - math.atan2(*TIP[::-1]), (x * vy - y * vx) / (x * x + y * y)


def period(time, values):
    """Mean period by the crossings of the mean of the extremes, each found on a cubic."""
    from scipy.interpolate import CubicSpline

    crossings = CubicSpline(time, values - (values.max() + values.min()) / 2).roots(extrapolate=False)
    return 2 * (crossings[-1] - crossings[0]) / (len(crossings) - 1)


def free(*loads, body=CRANK):
    return crank(*loads, body=body, joints=[])
