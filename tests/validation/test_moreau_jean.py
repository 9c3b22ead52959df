"""Smooth contact in a joint with clearance against rigid contact by the time stepping of Moreau and Jean, implemented here.

A body's pin moves in a bush of 1 mm clearance under a force whose direction turns. With restitution near 0 it slides along the
bush; with 0.8 it bounces. Where contact lasts, the pin of a smooth law is too deep by F/K: the distance of the two motions falls
as 1/K. An impact of a smooth law lasts pi sqrt(m/K): the distance falls as 1/sqrt(K).

M. Jean, The non-smooth contact dynamics method, doi 10.1016/S0045-7825(98)00383-1.
"""

from math import cos

import numpy as np
import pytest

from buckler.mbs import Clearance, Controlled, Exudyn, Force, Link, Mechanism, Rigid, simulate
from buckler.mbs.laws import CarvalhoMartins

GAP, MASS, WEIGHT, TURN = 1e-3, 0.1, 0.981, 40.0
"""Radial clearance [m], mass of the body [kg], amplitude of the force [N], its angular frequency [rad/s]."""


def force(time):
    return WEIGHT * cos(TURN * time), -WEIGHT * cos(0.7 * TURN * time)


def moreau_jean(restitution, duration, step):
    """Compute the motion of a point mass in a circle without friction, (steps + 1, 2), by Newton's law of impact."""
    x = y = vx = vy = 0.0
    out = np.zeros((round(duration / step) + 1, 2))
    for i in range(1, len(out)):
        fx, fy = force((i - 0.5) * step)
        wx, wy = vx + step * fx / MASS, vy + step * fy / MASS
        xm, ym = x + step / 2 * vx, y + step / 2 * vy
        r = (xm * xm + ym * ym) ** 0.5
        if r >= GAP:
            nx, ny = xm / r, ym / r
            jump = max(0.0, nx * wx + ny * wy + restitution * max(nx * vx + ny * vy, 0.0))  # impulse over mass
            wx, wy = wx - jump * nx, wy - jump * ny
        vx, vy = wx, wy
        x, y = xm + step / 2 * vx, ym + step / 2 * vy
        out[i] = x, y
    return out


def find_distance(stiffness, restitution, rigid, duration):
    """Compute the root mean square distance of the smooth motion from a rigid one, over the clearance."""
    mechanism = Mechanism(
        points={"O": (0, 0), "A": (0.1, 0)},
        links=[Link("body", "O", "A", Rigid.of(mass=MASS, inertia=1e-4, centre=(0, 0)))],
        joints=[Clearance("O", "ground", "body", 5e-3, GAP, CarvalhoMartins(stiffness, restitution, exponent=1.0))],
        loads=[Force("body:O", force)],
    )
    result = simulate(mechanism, duration, solver=Exudyn(Controlled(1e-6)))
    assert result.status == "OK", result.message
    time = np.linspace(0, duration, len(rigid))
    # The ground carries the pin: it moves in the bush against the body.
    body = -np.stack([result.at(f"O.journal_{axis}", time) for axis in "xy"], axis=1)
    return np.sqrt(np.mean(np.abs(body - rigid).max(axis=1) ** 2)) / GAP


@pytest.mark.parametrize(
    ("restitution", "duration", "stiffnesses", "rate", "finest"),
    [(0.01, 0.1, (1e5, 1e6), (-1.3, -0.8), 4e-3), (0.8, 0.06, (1e5, 1e7), (-0.55, -0.45), 3e-2)],
    ids=["lasting contact", "impacts"],
)
def test_smooth_contact_nears_rigid_contact_at_its_rate(restitution, duration, stiffnesses, rate, finest):
    rigid, coarse = (moreau_jean(restitution, duration, step) for step in (4e-6, 8e-6))
    assert np.abs(rigid[::2] - coarse).max() < 3e-3 * GAP
    longest_move = np.hypot(*np.diff(rigid, axis=0).T).max()  # in one time step
    assert np.hypot(*rigid.T).max() < GAP + 3 * longest_move
    distance = [find_distance(stiffness, restitution, rigid, duration) for stiffness in stiffnesses]
    assert rate[0] < np.polyfit(np.log(stiffnesses), np.log(distance), 1)[0] < rate[1]
    assert distance[-1] < finest
