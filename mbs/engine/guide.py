"""Guides in the engine: a block of one coordinate, its travel since t = 0, whatever the guide's direction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import exudyn.itemInterface as eii
import numpy as np

from buckler.mbs.elements.element import Array
from buckler.mbs.elements.guide import Guide
from buckler.mbs.engine.placed import Placed, States
from buckler.mbs.record.motion import BlockMotion


@dataclass(frozen=True)
class PlacedBlock(Placed):
    """A guide's block."""

    origin: tuple[float, float]

    def motion(self, system: Any, states: States) -> BlockMotion:
        """Of its travel."""
        column = self.columns(system)[0, 0]
        travel = (values[:, column] for values in states)
        return BlockMotion(self.body.mass, self.origin, self.body.along, *travel)

    def attach(self, scene: Any, _point: str, mass: float, _inertia: float) -> bool:
        """Add to the mass of its coordinate."""
        scene.system.AddObject(eii.ObjectGenericODE2(nodeNumbers=[self.nodes[0]], massMatrix=np.array([[mass]])))
        return True

    def weights(self, system: Any) -> Array:
        """1."""
        return np.ones((1, 1))


def place(scene: Any, guide: Guide, speed: float) -> PlacedBlock:
    """Add the block; `speed` is its speed along the guide."""
    x, y = scene.mechanism.points[guide.point]
    ax, ay = guide.along
    node = scene.system.AddNode(eii.Node1D(referenceCoordinates=[0.0], initialVelocities=[speed]))
    body = scene.system.AddObject(
        eii.ObjectMass1D(
            mass=guide.mass,
            nodeNumber=node,
            referencePosition=[x, y, 0.0],
            referenceRotation=np.array([[ax, -ay, 0.0], [ay, ax, 0.0], [0.0, 0.0, 1.0]]),
        )
    )
    ends = {guide.point: scene.system.AddMarker(eii.MarkerBodyPosition(bodyNumber=body, localPosition=[0.0, 0.0, 0.0]))}
    return PlacedBlock(guide.point, guide, (node,), (body,), np.zeros((1, 1)), ends, (x, y))


def connect(scene: Any, guides: dict[str, Guide]) -> None:
    """Pin each block to its link, and let friction act on it."""
    for name, guide in guides.items():
        if guide.link not in scene.strut_links:
            scene.constrain(name, scene.marker(guide.point, guide.point), scene.marker(guide.link, guide.point))
        elif guide.mass == 0:
            raise ValueError(f"guide of '{guide.point}': mass = 0 kg: must be positive where a Strut leans on it")
        if guide.friction is not None:
            _add_friction(scene, guide)
            scene.parts["GuideFriction"] += 1


def _add_friction(scene: Any, guide: Guide) -> None:
    """Add a guide's friction on its block's coordinate: a native element without a data node."""
    friction = guide.friction
    assert friction is not None
    scene.system.AddObject(
        eii.ObjectConnectorCoordinateSpringDamperExt(
            markerNumbers=[scene.ground, scene.coordinate(guide.point, 0)],
            dynamicFrictionForce=friction.dynamic,
            staticFrictionOffsetForce=friction.static_offset,
            viscousFrictionFactor=friction.viscous,
            exponentialDecayStatic=friction.stribeck,
            frictionProportionalZone=friction.regularisation,
        )
    )
