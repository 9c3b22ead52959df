"""Assembly of an Exudyn system from a `Mechanism`: bodies, blocks, added masses, then all other elements.

`EngineScene.source` is the `mbs.scene.Scene` of the mechanism: elements, added masses (`burdens`) and start velocities.
"""

from collections.abc import Callable
from itertools import chain

import exudyn as exu
import exudyn.itemInterface as eii

from .. import elements
from ..elements.element import Element, place
from ..geometry import Array
from ..imports import extensions
from ..mechanism import Mechanism
from . import clearance, loads, modal, rigid, rows, stop, strip
from . import guide as guides
from .placed import EngineBody
from .scene import EngineScene

exu.config.printToConsole = False

BODIES: dict[type, Callable[[EngineScene, elements.Link, Array], EngineBody | None]] = {
    elements.Rigid: rigid.add,
    elements.Beam: strip.add,
    elements.Cable: strip.add,
    elements.Modal: modal.add,
    elements.Strut: lambda _scene, _link, _velocity: None,  # it has no body
}
"""Functions that add a link, by the class of its body; the array is the velocity (vx, vy, omega) of its start."""

CONNECTORS: dict[type, Callable[..., None]] = {
    elements.Revolute: rows.connect,
    elements.Clearance: clearance.connect,
    elements.Weld: rows.connect,
    elements.Slider: rows.connect,
    elements.Slot: rows.connect,
    elements.Guide: guides.connect,
    elements.Strut: loads.join_struts,
    elements.Stop: stop.connect,
    elements.Drive: loads.add_drives,
    elements.Force: loads.add_forces,
    elements.LineLoad: loads.add_line_loads,
    elements.Torque: loads.add_torques,
    elements.Motor: loads.add_motors,
    elements.Spring: loads.add_springs,
    elements.TorsionSpring: loads.add_torsion_springs,
    elements.Mass: lambda _scene, _masses: None,  # built with the bodies
}
"""Functions that add all elements of a class to a scene that has the bodies: (scene, elements by name) -> None."""


def connect(scene: EngineScene) -> None:
    """Add the elements, class by class in the order of `CONNECTORS`; a class without a function, by its constraint rows."""
    by_kind: dict[type, dict[str, Element]] = {kind: {} for kind in CONNECTORS}
    for name, element in scene.source.elements.items():
        kind = type(element.body if isinstance(element, elements.Link) else element)
        is_built = kind in BODIES and kind not in CONNECTORS  # already, as a body; a strut has none and is added as a connector
        if not is_built:
            by_kind.setdefault(kind, {})[name] = element
    for kind, named in by_kind.items():
        function = CONNECTORS.get(kind) or extensions("buckler.exudyn").get(kind.__name__)  # entry points of other packages
        if function is None and any(not list(element.rows(scene.mechanism)) for element in named.values()):
            raise ValueError(f"{kind.__name__}: Exudyn's scene does not know this kind, and it has no rows")
        (function or rows.connect)(scene, named)


def build(mechanism: Mechanism) -> EngineScene:
    """Assemble a mechanism; ValueError if a strut's end is on no body with mass, KinematicsError if a drive cannot move it."""
    container = exu.SystemContainer()
    system = container.AddSystem()
    scene = EngineScene(mechanism, system, container)
    start = scene.source.start
    for link in mechanism.links:
        placed = BODIES[type(link.body)](scene, link, start.rates[start.linkage.index[link.name]])
        if placed is not None:
            scene.placed[link.name] = placed
    for guide in mechanism.guides:
        velocity = start.velocity(guide.link, guide.point)
        scene.placed[guide.point] = guides.place(scene, guide, float(velocity @ guide.along))  # its block
    for at, mass, inertia in scene.source.burdens:
        body, point = place(at)  # splits a point reference
        # with its weight, as gravity below acts on the `objects` of bodies alone
        scene.placed[body].add_burden(point, mass, inertia, mechanism.gravity)
    node = system.AddNode(eii.NodePointGround())
    scene.ground = system.AddMarker(eii.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
    connect(scene)
    if any(mechanism.gravity):
        for number in chain.from_iterable(placed.objects for placed in scene.placed.values()):
            marker = system.AddMarker(eii.MarkerBodyMass(bodyNumber=number))
            system.AddLoad(eii.LoadMassProportional(markerNumber=marker, loadVector=[*mechanism.gravity, 0.0]))
    system.Assemble()
    for force in scene.with_memory:  # only the assembled system has indices of coordinates
        force.locate(system)
    for contact in scene.stops.values():
        contact.locate(system, scene.placed)
    return scene
