"""From a `Mechanism` to an assembled Exudyn system: only what the mechanism names is built."""

from __future__ import annotations

import exudyn as exu
import exudyn.itemInterface as eii

from buckler.mbs.engine import guide as guides
from buckler.mbs.engine.loads import attach
from buckler.mbs.engine.registry import BODIES, connect
from buckler.mbs.engine.scene import Scene
from buckler.mbs.engine.settle import settle
from buckler.mbs.kinematics.diagnosis import redundancies
from buckler.mbs.kinematics.start import start
from buckler.mbs.mechanism import Mechanism

exu.config.printToConsole = False


def build(mechanism: Mechanism) -> Scene:
    """Assemble a mechanism in Exudyn.

    Parameters
    ----------
    mechanism : Mechanism

    Returns
    -------
    Scene
        With the engine's system, not yet stepped.

    Raises
    ------
    ValueError
        If a strut's end has nothing with mass to act on, or a guide that a strut leans on has no mass.
    KinematicsError
        If the drive cannot move the linkage from where it starts.
    """
    container = exu.SystemContainer()
    system = container.AddSystem()
    scene = Scene(mechanism, system, container)
    scene.start = begun = start(mechanism)
    scene.redundant = redundancies(mechanism)
    for link in mechanism.links:
        placed = BODIES[type(link.body)](scene, link, begun.rates[begun.linkage.index[link.name]])
        if placed is not None:
            scene.placed[link.name] = placed
        scene.parts[type(link.body).__name__] += 1
    for guide in mechanism.guides:
        velocity = begun.velocity(guide.link, guide.point)
        scene.placed[guide.point] = guides.place(scene, guide, float(velocity @ guide.along))
        scene.parts["Guide"] += 1
    for burden in scene.burdens:
        attach(scene, burden)
    node = scene.system.AddNode(eii.NodePointGround())
    scene.ground = scene.system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    connect(scene)
    _add_gravity(scene)
    scene.system.Assemble()
    for group in scene.remembering:
        group.locate(scene.system)
    for contact in scene.stops.values():
        contact.locate(scene.system, scene.placed)
    settle(scene)
    return scene


def _add_gravity(scene: Scene) -> None:
    """Add weight, and only where gravity lies in the plane."""
    gx, gy = scene.mechanism.gravity
    if gx == gy == 0:
        return
    for placed in scene.placed.values():
        for body in placed.objects:
            marker = scene.system.AddMarker(eii.MarkerBodyMass(bodyNumber=body))
            scene.system.AddLoad(eii.LoadMassProportional(markerNumber=marker, loadVector=[gx, gy, 0.0]))
    scene.parts["gravity"] += 1
