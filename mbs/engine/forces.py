"""Forces of stops and struts as callbacks of the engine, with their state at the last call or accepted step."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import cos, sin
from typing import NamedTuple

import numpy as np

from ..elements.element import Pair
from ..elements.stop import GRAZE, SLOWEST_ONSET, Stop
from ..elements.strut import StrutLaw
from ..geometry import Array
from . import System
from .placed import EngineBody


@dataclass
class StopContact:
    """Contact of a guide's block with a stop, with a memory of approach speeds that is updated after each accepted step.

    The contact closes at the travel `face` [m] along the guide; `side` is +1 if the face lies in the positive direction, else -1.
    `mass` [kg] is the effective mass of the point as if its body had no joints. With this lower bound the control of steps
    estimates the duration of impacts.
    `columns` are indices of the coordinates in the engine's vector. `is_touching` and `last_force` [N] are of the last step.
    """

    stop: Stop
    onset_speed: float = SLOWEST_ONSET  # approach speed at the onset of the present contact, or else at the last step [m/s]
    fastest: float = SLOWEST_ONSET  # largest approach speed of contacts so far [m/s]
    share: float = GRAZE  # of `fastest`: least `onset_speed`
    face: float = 0.0
    side: float = 1.0
    mass: float = 0.0
    columns: Array = field(init=False)
    is_touching: bool = False
    last_force: float = 0.0

    def locate(self, system: System, placed: Mapping[str, EngineBody]) -> None:
        """Find the indices of the coordinates in the assembled system."""
        (self.columns,) = placed[self.stop.point].columns()  # the guide's block has the name of its point, and one node

    def state(self, q: Array, q_t: Array) -> tuple[float, float]:
        """Return depth [m], positive in contact, and its rate [m/s], from all coordinates and rates."""
        column = self.columns[0]
        return self.side * (float(q[column]) - self.face), self.side * float(q_t[column])

    def force_along(self, _system: System, _time: float, travel: float, speed: float) -> float:
        """Return the force on the block along the guide [N]; the engine calls it."""
        return -self.side * self.force(self.side * (travel - self.face), self.side * speed)

    def force(self, depth: float, rate: float) -> float:
        """Return the contact force [N], from the depth [m] and its rate [m/s]; 0 out of contact."""
        return self.stop.law.force(depth, rate, self.onset_speed) if depth > 0 else 0.0

    def step(self, q: Array, q_t: Array) -> float:
        """Update the contact and its speed at onset after an accepted step; return the contact force [N]."""
        depth, rate = self.state(q, q_t)
        self.is_touching = depth > 0
        if self.is_touching:
            self.fastest = max(self.fastest, self.onset_speed)
        else:
            self.onset_speed = max(rate, SLOWEST_ONSET, self.share * self.fastest)
        self.last_force = self.force(depth, rate)
        return self.last_force


class StopEnd(NamedTuple):
    """Node of one of the two bodies of a stop, with `size` coordinates; the ground has `size` 0.

    `place` is the position of the node and `arm` leads from it to the contact point, both at t = 0 in axes of the ground [m].
    """

    node: int = -1
    size: int = 0
    place: Array = np.zeros(2)
    arm: Array = np.zeros(2)


@dataclass(kw_only=True)
class FreeContact(StopContact):
    """Contact of a point p of a body, `first`, with a straight face of another body or of the ground, `second`; `face` is unused.

    o is the position of the node of `second` and phi its angle since t = 0; the ground has o = 0 and phi = 0. `normal` is that of
    the face at t = 0, u = R(phi) `normal` the present one. The contact closes where u . (p - o) is `reach`:

        depth = side (u . (p - o) - reach),    forces = -F d(depth)/dq.

    So the force F acts on both bodies at p, normal to the face, and momentum and angular momentum are conserved. Friction acts in
    the same way on the coordinate R(phi) (-normal_y, normal_x) . (p - o), along the face.
    """

    first: StopEnd
    second: StopEnd
    normal: Pair
    reach: float

    def locate(self, system: System, placed: Mapping[str, EngineBody]) -> None:
        """Find the indices of the coordinates in the assembled system."""
        ends = [(system.GetNodeODE2Index(end.node), end.size) for end in (self.first, self.second) if end.size]
        self.columns = np.concatenate([np.arange(start, start + size) for start, size in ends])

    def state(self, q: Array, q_t: Array) -> tuple[float, float]:
        """Return depth [m], positive in contact, and its rate [m/s], from all coordinates and rates."""
        depth, rate, _gradient = self.differentiate_depth(q[self.columns], q_t[self.columns])
        return depth, rate

    def differentiate_depth(self, q: Array, v: Array) -> tuple[float, float, list[float]]:
        """Compute depth, its rate and its gradient by q from coordinates `q` and velocities `v` of the two nodes."""
        distance, rate, gradient = self.project(q, v, self.normal)
        return self.side * (distance - self.reach), self.side * rate, [self.side * derivative for derivative in gradient]

    def project(self, q: Array, v: Array, line: Pair) -> tuple[float, float, list[float]]:
        """Project p - o on a line that turns with `second`: u . (p - o) with u = R(phi) line, its rate, its gradient by q.

        q are displacements since t = 0: x, y, theta of each node. Only `first` may be a cable's node (x, y, dx/ds, dy/ds). Its
        arm is zero, so that q[2] has no effect. Below, (px, py) and (wx, wy) become position and velocity of p relative to o.
        """
        x0, y0 = self.first.arm
        gradient = [0.0] * len(q)
        c, s = cos(q[2]), sin(q[2])
        arm_x, arm_y = c * x0 - s * y0, s * x0 + c * y0
        px, py = self.first.place[0] + q[0] + arm_x, self.first.place[1] + q[1] + arm_y
        wx, wy = v[0] - v[2] * arm_y, v[1] + v[2] * arm_x
        ux, uy = line
        k = self.first.size  # index of the first coordinate of `second`
        if self.second.size:
            c, s = cos(q[k + 2]), sin(q[k + 2])
            ux, uy = c * ux - s * uy, s * ux + c * uy
            px, py = px - self.second.place[0] - q[k], py - self.second.place[1] - q[k + 1]
            wx, wy = wx - v[k], wy - v[k + 1]
            by_phi = ux * py - uy * px  # derivative of u . (p - o) by phi
            gradient[k : k + 3] = [-ux, -uy, by_phi]
        gradient[:3] = [ux, uy, uy * arm_x - ux * arm_y]  # the fourth of a cable's node stays 0
        rate = ux * wx + uy * wy
        if self.second.size:
            rate += v[k + 2] * by_phi
        return ux * px + uy * py, rate, gradient

    def forces(self, _system: System, _time: float, _item: int, q: Array, q_t: Array) -> list[float]:
        """Return the generalised forces on the nodes [N, N m]; the engine calls it."""
        depth, rate, by_depth = self.differentiate_depth(q, q_t)
        force = self.force(depth, rate)
        has_friction = self.stop.friction_at != ""  # the name of the point, or '' without friction
        if force == 0 or not has_friction:
            return [-force * n for n in by_depth]
        _, speed, by_way = self.project(q, q_t, (-self.normal[1], self.normal[0]))  # along the face
        friction = float(self.stop.friction.coefficient(speed)) * force
        return [-force * n - friction * t for n, t in zip(by_depth, by_way, strict=True)]


class StrutSpring(StrutLaw):
    """Force law of a strut as a callback; `elongation` [m] and `rate` [m/s] are those of the engine's last call."""

    elongation = rate = 0.0

    def __call__(self, _system: System, _time: float, _item: int, elongation: float, rate: float, *_: float) -> float:
        """Return the tension [N]."""
        self.elongation, self.rate = elongation, rate
        return self.force(elongation, rate)
