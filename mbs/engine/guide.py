"""Guides in the engine: the block that slides in a guide, with its travel [m] since t = 0 as coordinate, and its friction."""

from dataclasses import dataclass
from functools import partial

import exudyn.itemInterface as eii
import numpy as np

from ..elements import strut
from ..elements.guide import Guide, GuideFriction
from ..geometry import Array, cross
from ..laws import BristleLaw
from ..laws.friction import as_bristle_law
from ..laws.journal import BRISTLE, MEMORY, SINCE, SLIDING
from ..mechanism import Mechanism
from ..record.record import BlockMotion, Record
from . import System
from .guarded import watch
from .loads import add_coordinate_force
from .placed import EngineBody, EngineStates, History
from .scene import EngineScene

TRAVEL = SLIDING
"""Column of the travel [m] in a guide's memory. All memories have the columns `MEMORY`; a joint has the sliding speed there."""


@dataclass(frozen=True)
class PlacedBlock(EngineBody):
    """Block of a guide; its position at t = 0 is `origin` [m]."""

    origin: tuple[float, float]

    def motion(self, states: EngineStates) -> BlockMotion:
        """Compute the motion of the block from its travel."""
        column = self.columns()[0, 0]  # one node with one coordinate
        q, q_t, q_tt = (values[:, column] for values in states)
        return BlockMotion(self.body.mass, self.origin, self.body.along, q, q_t, q_tt)

    def find_node(self, _point: str) -> tuple[int, int, Array]:
        """Return the only node, the number of its coordinates, and its position at t = 0 [m]."""
        return self.nodes[0], 1, np.array(self.origin)


def place(scene: EngineScene, guide: Guide, speed: float) -> PlacedBlock:
    """Add the block of a guide, with its initial speed [m/s] along the guide."""
    x, y = scene.mechanism.points[guide.point]
    ax, ay = guide.along
    node = scene.system.AddNode(eii.Node1D(referenceCoordinates=[0.0], initialVelocities=[speed]))
    rotation = np.array([[ax, -ay, 0.0], [ay, ax, 0.0], [0.0, 0.0, 1.0]])
    item = eii.ObjectMass1D(mass=guide.mass, nodeNumber=node, referencePosition=[x, y, 0.0], referenceRotation=rotation)
    body = scene.system.AddObject(item)
    markers = {guide.point: scene.system.AddMarker(eii.MarkerBodyPosition(bodyNumber=body, localPosition=[0.0, 0.0, 0.0]))}
    # `reference` and `scales` (1 node, 1 coordinate): the travel is 0 m at t = 0, and 1 m of it moves the block by 1 m
    return PlacedBlock(
        scene.system, guide.point, guide, nodes=(node,), objects=(body,), reference=np.zeros((1, 1)), markers=markers,
        scales=np.ones((1, 1)), origin=(x, y),
    )  # fmt: skip


def connect(scene: EngineScene, guides: dict[str, Guide]) -> None:
    """Pin each block to its link, and add friction."""
    for name, guide in guides.items():
        # a strut, a force element without coordinates, pushes the block instead: then the block is a body of its own
        if guide.link not in scene.strut_links:
            markers = [scene.marker(body, guide.point) for body in (guide.point, guide.link)]  # the block has its point's name
            scene.constraints[name] = int(scene.system.AddObject(eii.ObjectJointRevolute2D(markerNumbers=markers)))
            scene.readers[name, "reaction"] = partial(_compute_reaction, scene, name, guide)
        elif guide.mass == 0:
            raise ValueError(f"guide of '{guide.point}': mass = 0 kg: must be positive where a Strut leans on it")
        else:
            scene.readers[name, "reaction"] = partial(_compute_reaction_under_strut, guide)
        friction = guide.friction
        if isinstance(friction, GuideFriction):  # it depends on the speed alone: the engine has an element for it
            scene.system.AddObject(eii.ObjectConnectorCoordinateSpringDamperExt(
                markerNumbers=[scene.ground, scene.coordinate_marker(guide.point, 0)],
                dynamicFrictionForce=friction.dynamic, staticFrictionOffsetForce=friction.static_offset,
                viscousFrictionFactor=friction.viscous, exponentialDecayStatic=friction.stribeck,
                frictionProportionalZone=friction.regularisation,
            ))  # fmt: skip
        elif friction is not None:
            _add_reaction_friction(scene, name, guide)


def _compute_weight(mechanism: Mechanism, guide: Guide) -> float:
    """Compute the component of the block's weight to the left of the guide's direction [N]."""
    gx, gy = mechanism.gravity
    return guide.mass * (guide.along[0] * gy - guide.along[1] * gx)


def _compute_reaction(scene: EngineScene, name: str, guide: Guide, run: History, _record: Record) -> Array:
    """Return the force of the guide on the block, to the left of the guide [N], (times, 1): it balances pin and weight."""
    pin = run.multipliers[:, scene.multiplier_indices(name)]  # force of the pin on the block, x and y [N]
    return (guide.along[1] * pin[:, :1] - guide.along[0] * pin[:, 1:]) - _compute_weight(scene.mechanism, guide)


def _compute_reaction_under_strut(guide: Guide, _run: History, record: Record) -> Array:
    """Return the force of the guide on a block at a strut's end, to the guide's left [N], (times, 1)."""
    mechanism = record.mechanism
    link = mechanism.link(guide.link)
    law = strut.StrutLaw(link.body, mechanism.length(link.name))  # type: ignore[arg-type]
    elongation, rate = strut.state(link, record)
    tension = np.array([law.force(float(e), float(v)) for e, v in zip(elongation, rate, strict=True)])
    other = link.end if guide.point == link.start else link.start
    (far, _), (near, _) = record.point(other), record.point(guide.point)
    chord = far - near  # from the block
    pull = tension / np.hypot(*chord.T) * cross(np.array(guide.along), chord)  # to the guide's left
    return (-pull - _compute_weight(mechanism, guide))[:, None]


class ReactionFriction:
    """Friction of a guide, proportional to its reaction, from the multipliers of the current Newton iteration.

    `memory` (1, 4) has the columns `BRISTLE`, `TRAVEL` and `SINCE` (time [s]) at the last accepted step; `ONSET` is unused. Only
    a law with a bristle `updates_memory`; another ignores the deflection. `column` is the index of the block's coordinate, `rows`
    has those of the pin's two multipliers.
    """

    # False, as guides need the implicit integrator, which gives up at its smallest step; the explicit one may go on for ever
    is_stuck = False

    def __init__(self, scene: EngineScene, name: str, guide: Guide) -> None:
        self.scene, self.name, self.guide, self.law = scene, name, guide, as_bristle_law(guide.friction)  # type: ignore[arg-type]
        self.memory = np.zeros((1, len(MEMORY)))
        self.updates_memory = isinstance(guide.friction, BristleLaw)
        # state of the iteration in `normal`: time of its step [s], last reaction, its relaxed value, their last difference [N]
        self.time = -1.0
        self.reaction = self.relaxed = self.last_residual = 0.0
        self.factor = 1.0  # relaxation factor; a new step begins with the last one

    def normal(self, t: float, reaction: float) -> float:
        """Return the normal force [N] by Aitken's relaxation (doi 10.1007/s00466-008-0255-5), once for each Newton iteration.

        The engine's Jacobian lacks the derivative of friction by the multipliers. Without relaxation the iteration converges only
        if the reaction depends weakly on friction. A new value of the reaction shows a new Newton iteration.
        """
        if t != self.time:
            self.time, self.reaction, self.relaxed, self.last_residual = t, reaction, reaction, 0.0
        elif reaction != self.reaction:
            residual = reaction - self.relaxed
            is_first = self.last_residual == 0.0
            if not is_first and residual != self.last_residual:
                factor = self.factor * self.last_residual / (self.last_residual - residual)
                # 0.1: the iteration must go on; 5: the secant of two nearly equal residuals leads far away
                self.factor = min(5.0, max(0.1, factor))
            self.reaction, self.last_residual = reaction, residual
            self.relaxed += self.factor * residual
        return abs(self.relaxed)

    def locate(self, system: System) -> None:
        """Find the indices of coordinate and multipliers in the assembled system."""
        self.data = system.systemData
        self.column = int(self.scene.placed[self.guide.point].columns()[0, 0])  # of the travel
        self.rows = self.scene.multiplier_indices(self.name)
        self.weight = _compute_weight(self.scene.mechanism, self.guide)

    def bristle(self, t: float, travel: float, speed: float) -> float:
        """Return the deflection of the bristle [m], by the mean speed since the last accepted step."""
        deflection, last_travel, last_time = self.memory[0, [BRISTLE, TRAVEL, SINCE]]
        h = t - last_time
        # with it a block that returns to its place also returns to the same deflection
        mean_speed = (travel - last_travel) / h if h > 0 else speed
        return float(self.law.after(deflection, mean_speed, max(h, 0.0)))

    def __call__(self, _system: System, t: float, travel: float, speed: float) -> float:
        """Return the friction along the guide [N], as a force of `add_coordinate_force`."""
        fx, fy = self.data.GetAECoordinates()[self.rows]
        normal = self.normal(t, self.guide.along[1] * fx - self.guide.along[0] * fy - self.weight)
        return -float(self.law.coefficient(speed, self.bristle(t, travel, speed)) * normal)

    def accept(self, q: Array, q_t: Array, t: float) -> Array:
        """Update the memory after an accepted step; return a copy."""
        travel, speed = float(q[self.column]), float(q_t[self.column])
        self.memory[0, [BRISTLE, TRAVEL, SINCE]] = self.bristle(t, travel, speed), travel, t
        return self.memory.copy()


def _add_reaction_friction(scene: EngineScene, name: str, guide: Guide) -> None:
    """Add friction proportional to the guide's reaction; a ValueError says that a strut gives no constraint force."""
    if guide.link in scene.strut_links:
        raise ValueError(f"guide of '{guide.point}': friction from the reaction needs a link with mass there, not a Strut")
    friction = ReactionFriction(scene, name, guide)
    scene.add_with_memory(friction, [name])
    if not friction.updates_memory:  # without a bristle friction acts at t = 0 already; a bristle is undeflected then
        scene.initial_multipliers_lack_friction = True
    force = watch(scene, f"the friction law of the guide of '{guide.point}'", friction)
    add_coordinate_force(scene, scene.coordinate_marker(guide.point, 0), force)
