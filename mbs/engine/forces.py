"""Forces of stops and struts as callbacks of the engine, with the state of the last call or step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import cos, sin

import numpy as np

from ..elements.stop import Striking
from ..elements.strut import Strut, StrutLaw
from ..geometry import Array
from . import System
from .placed import EngineBody


@dataclass
class StopContact(Striking):
    """One stop in the engine's coordinates.

    Contact closes at the travel `face` [m] along its direction; `side` is +1 if the face is ahead of the start, else -1. `mass`
    [kg] is the effective mass of the point, its lower bound without joined bodies. `columns` are indices of the coordinates in
    the engine's vector. `touching`, and the force `pressing` [N], are those at the last accepted step.
    """

    face: float = 0.0
    side: float = 1.0
    mass: float = 0.0
    columns: Array = field(default_factory=lambda: np.empty(0, dtype=int))
    touching: bool = False
    pressing: float = 0.0

    def locate(self, system: System, placed: Mapping[str, EngineBody]) -> None:
        """Find the indices of the coordinates in the assembled system."""
        self.columns = placed[self.stop.point].columns()[0]

    def state(self, q: Array, q_t: Array) -> tuple[float, float]:
        """Return depth, m, positive in contact, and its rate, m/s, from all coordinates and rates."""
        column = self.columns[0]
        return self.side * (float(q[column]) - self.face), self.side * float(q_t[column])

    def step(self, q: Array, q_t: Array) -> float:
        """Update the state after an accepted step; return the contact force, N."""
        depth, rate = self.state(q, q_t)
        self.touching = self.accept(depth, rate)
        self.pressing = self.force(depth, rate) if self.touching else 0.0
        return self.pressing


@dataclass
class StopEnd:
    """One body of a stop: its node and number of coordinates; none for the ground.

    `place` is that of the node at t = 0 [m], `arm` leads from the node to the point and turns with its third coordinate.
    """

    node: int = -1
    size: int = 0
    place: Array = field(default_factory=lambda: np.zeros(2))
    arm: Array = field(default_factory=lambda: np.zeros(2))


@dataclass
class FreeContact(StopContact):
    """Contact of any point of a link against a line of another body or the ground.

    With p the point, o the place and phi the angle of the face's node, u = R(phi) along and reach = at - along . o(0):

        depth = side (u . (p - o) - reach),    forces = -F d(depth)/dq,

    so that the force acts on both bodies at p, normal to the face, and momentum and angular momentum are conserved. Friction
    acts likewise along the coordinate R(phi) (-along_y, along_x) . (p - o).
    """

    first: StopEnd = field(default_factory=StopEnd)
    second: StopEnd = field(default_factory=StopEnd)
    along: tuple[float, float] = (1.0, 0.0)
    reach: float = 0.0

    def locate(self, system: System, placed: Mapping[str, EngineBody]) -> None:
        """Find the indices of the coordinates in the assembled system."""
        ends = [end for end in (self.first, self.second) if end.size]
        first = [system.GetNodeODE2Index(end.node) for end in ends]
        self.columns = np.concatenate([np.arange(at, at + end.size) for at, end in zip(first, ends, strict=True)])

    def state(self, q: Array, q_t: Array) -> tuple[float, float]:
        """Return depth, m, positive in contact, and its rate, m/s, from all coordinates and rates."""
        depth, rate, _ = self.depth(q[self.columns], q_t[self.columns])
        return depth, rate

    def depth(self, q: Array, v: Array) -> tuple[float, float, list[float]]:
        """Compute the depth, its rate, and its derivatives by the element's coordinates."""
        travel, rate, slope = self.travel(q, v, self.along)
        return self.side * (travel - self.reach), self.side * rate, [self.side * each for each in slope]

    def travel(self, q: Array, v: Array, line: tuple[float, float]) -> tuple[float, float, list[float]]:
        """Compute the coordinate along a line that turns with the face, its rate, and its derivatives by the coordinates."""
        ax, ay = self.first.arm
        slope = [0.0] * len(q)
        px, py, wx, wy = self.first.place[0] + q[0], self.first.place[1] + q[1], v[0], v[1]
        c, s = cos(q[2]), sin(q[2])
        bx, by = c * ax - s * ay, s * ax + c * ay
        px, py, wx, wy = px + bx, py + by, wx - v[2] * by, wy + v[2] * bx
        ux, uy = line
        k = self.first.size
        if self.second.size:
            c, s = cos(q[k + 2]), sin(q[k + 2])
            ux, uy = c * ux - s * uy, s * ux + c * uy
            px, py = px - self.second.place[0] - q[k], py - self.second.place[1] - q[k + 1]
            wx, wy = wx - v[k], wy - v[k + 1]
            by_angle = ux * py - uy * px
            slope[k : k + 3] = [-ux, -uy, by_angle]
        slope[:3] = [ux, uy, uy * bx - ux * by]
        rate = ux * wx + uy * wy
        if self.second.size:
            rate += v[k + 2] * by_angle
        return ux * px + uy * py, rate, slope

    def forces(self, _system: System, _time: float, _item: int, q: Array, q_t: Array) -> list[float]:
        """Engine callback: generalised forces on the element's coordinates, N and N m."""
        depth, rate, slope = self.depth(q, q_t)
        force = self.force(depth, rate)
        if not (force and self.stop.rubs):
            return [-force * each for each in slope]
        _, speed, along = self.travel(q, q_t, (-self.along[1], self.along[0]))
        drag = float(self.stop.friction.coefficient(speed)) * force
        return [-force * across - drag * each for across, each in zip(slope, along, strict=True)]


class StrutSpring(StrutLaw):
    """Callback of one strut, with elongation [m] and rate [m/s] of the engine's last call."""

    def __init__(self, strut: Strut, length: float) -> None:
        super().__init__(strut, length)
        self.elongation = self.rate = 0.0

    def __call__(self, _system: System, _time: float, _item: int, elongation: float, rate: float, *_: float) -> float:
        """Return the tension, N."""
        self.elongation, self.rate = elongation, rate
        return self.force(elongation, rate)
