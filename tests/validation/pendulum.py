"""Triple pendulum with drag and with viscous and dry friction in its joints, against its equations of motion.

Angles t_i are measured from the upward vertical, s_i = t_i'. Arm i has the mass m_i, the length L_i, the inertia J_i about its
centre of mass, at the distance a_i from its joint, and carries the mass M_i of the arms beyond it:

    sum_j A_ij (cos(t_i - t_j) s_j' + sin(t_i - t_j) s_j^2) = g h_i sin(t_i) - T_i + T_(i+1) - q |s_i| s_i
    h_i = m_i a_i + M_i L_i,   A_ii = J_i + m_i a_i^2 + M_i L_i^2,   A_ij = A_ji = L_i h_j for i < j
    T_i = k r_i + c tanh(r_i/r_0),   r_i = s_i - s_(i-1)
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from buckler.mbs import Link, Mechanism, Revolute, Rigid, Torque, TorsionSpring, simulate
from buckler.mbs.functions import Expression
from buckler.mbs.geometry import Array
from buckler.studies.kit.published import GRAVITY

from .known import Answer, Known

MASS, LENGTH = np.array([0.258, 0.279, 0.119]), np.array([0.173, 0.229, 0.3])
CENTRE, INERTIA = np.array([0.160, 0.203, 0.184]), np.array([1.0e-4, 3.1e-4, 1.7e-4])
"""Arms: mass [kg], length and distance of the centre of mass [m], inertia about it [kg m^2]."""
VISCOUS, DRY, CREEP, DRAG = 1.5e-3, 5e-4, 0.02, 1.5e-5
"""Friction of a joint: k [N m s], c [N m], r_0 [rad/s]; drag q of an arm [N m s^2]."""
START, SPEED, DURATION = np.pi + np.array([0.5, 1.0, 1.5]), 1.0, 0.6
"""Angles t_i [rad] and speeds s_i of all arms [rad/s] at the start; duration of the run [s]."""


def integrate() -> Array:
    """Integrate the equations of motion with a tolerance of 1e-11; return the angles at the end [rad], (3,)."""
    beyond = np.append(np.cumsum(MASS[::-1])[::-1][1:], 0.0)
    h = MASS * CENTRE + beyond * LENGTH
    cross = np.triu(np.outer(LENGTH, h), 1)
    matrix = cross + cross.T + np.diag(INERTIA + MASS * CENTRE**2 + beyond * LENGTH**2)

    def rates(_t: float, y: Array) -> Array:
        angle, speed = y[:3], y[3:]
        relative = np.diff(speed, prepend=0.0)
        torque = VISCOUS * relative + DRY * np.tanh(relative / CREEP)
        difference = angle[:, None] - angle
        moment = GRAVITY * h * np.sin(angle) - torque + np.append(torque[1:], 0.0) - DRAG * np.abs(speed) * speed
        moment -= (matrix * np.sin(difference)) @ speed**2
        return np.concatenate([speed, np.linalg.solve(matrix * np.cos(difference), moment)])

    start = np.concatenate([START, np.full(3, SPEED)])
    return solve_ivp(rates, (0.0, DURATION), start, method="DOP853", rtol=1e-11, atol=1e-12).y[:3, -1]


def make_pendulum() -> Mechanism:
    """Make the pendulum. Angles of links are counterclockwise, those of the equations clockwise."""
    steps = np.cumsum(LENGTH * np.exp(1j * (np.pi / 2 - START)))
    points: dict[str, Any] = {"P0": (0.0, 0.0)} | {f"P{i + 1}": (z.real, z.imag) for i, z in enumerate(steps)}
    names = [f"arm{i + 1}" for i in range(3)]
    bodies = [Rigid.of(mass=m, inertia=j, centre=(a, 0.0)) for m, j, a in zip(MASS, INERTIA, CENTRE, strict=True)]
    friction = Expression(f"{VISCOUS}*v + {DRY}*tanh(v/{CREEP})")
    return Mechanism(
        points,
        [Link(name, f"P{i}", f"P{i + 1}", body) for i, (name, body) in enumerate(zip(names, bodies, strict=True))],
        [Revolute(f"P{i}", names[i - 1] if i else "ground", name) for i, name in enumerate(names)],
        loads=[
            *(TorsionSpring(names[i - 1] if i else "ground", x, stiffness=0.0, law=friction) for i, x in enumerate(names)),
            *(Torque(name, Expression(f"-{DRAG}*abs(speed)*speed")) for name in names),
        ],
        gravity=(0.0, -GRAVITY),
        velocities=dict.fromkeys(names, -SPEED),
    )


def solve(arm: int) -> Answer:
    """Compare the angle of an arm at the end."""
    result = simulate(make_pendulum(), DURATION, 1e-5)
    found = float(START[arm] - result.signals[f"arm{arm + 1}.angle"][-1])
    return Answer(found, float(integrate()[arm]), 1e-4, "rad", status=str(result.status), message=result.message)


def list_known() -> Iterator[Known]:
    """Yield the angles of the three arms."""
    for arm in range(3):
        yield Known("published", "triple pendulum with friction and drag, 0.6 s", f"arm {arm + 1}", partial(solve, arm))
