"""Stops in the engine: a force on the coordinate of a guide's block, or a user element on the nodes of point and face."""

from math import inf

import exudyn.itemInterface as eii
import numpy as np

from ..elements.element import GROUND, place
from ..elements.stop import Stop
from .forces import FreeContact, StopContact, StopEnd
from .guarded import watch
from .loads import add_coordinate_force
from .scene import EngineScene


def contact_of(scene: EngineScene, stop: Stop) -> StopContact:
    """Make the contact of a stop: of a guide's block with a fixed face, or of a point of a body with a face of another."""
    mechanism = scene.mechanism
    distance = stop.distance_to_face(mechanism)  # [m], along the normal, from the point at t = 0: its travel until contact
    side = stop.side(mechanism)  # sign of the distance
    if stop.is_in_guide:  # the mass, as the effective mass below, serves only to estimate durations of impacts
        return StopContact(stop, face=distance, side=side, mass=mechanism.guide(stop.point).mass)
    link, normal = stop.body(mechanism), stop.face_normal(mechanism)
    node, size, position = scene.placed[link].find_node(stop.point)  # size: number of the node's coordinates
    arm = np.subtract(mechanism.points[stop.point], position)
    first, second = StopEnd(node, size, position, arm), StopEnd()  # `second` is the ground
    inverse_mass = scene.placed[link].inverse_mass(stop.point, normal)  # of the effective mass [1/kg]
    if stop.carrier != GROUND:
        origin = place(stop.origin(mechanism)).point
        node, position = scene.placed[stop.carrier].find_angle_node(origin)  # with an angle, as the face turns
        second = StopEnd(node, size=3, place=position)  # coordinates x, y, theta
        is_rigid = stop.carrier == stop.on  # a flexible link carries the face at a section: then `on` is 'link:point'
        contact_point = stop.point if is_rigid else origin  # a flexible link has effective masses at its own points only
        inverse_mass += scene.placed[stop.carrier].inverse_mass(contact_point, normal)
    # `reach` is the distance along the normal from the node of `second` to the face, and gives the depth; `face` does not
    reach = stop.at - float(np.dot(normal, second.place))
    mass = 1 / inverse_mass if inverse_mass > 0 else inf
    return FreeContact(stop, face=distance, side=side, mass=mass, first=first, second=second, normal=normal, reach=reach)


def connect(scene: EngineScene, stops: dict[str, Stop]) -> None:
    """Add stops, and their forces as channels."""
    for k, (name, stop) in enumerate(stops.items()):
        contact = scene.stops[name] = contact_of(scene, stop)
        what = f"the law of the stop of '{stop.point}'"  # for the message if it raises an exception
        if isinstance(contact, FreeContact):
            ends = [end for end in (contact.first, contact.second) if end.size]
            size = sum(end.size for end in ends)
            forces = watch(scene, what, contact.forces)
            nodes, no_mass = [end.node for end in ends], np.zeros((size, size))
            scene.system.AddObject(eii.ObjectGenericODE2(nodeNumbers=nodes, massMatrix=no_mass, forceUserFunction=forces))
        else:
            force = watch(scene, what, contact.force_along)
            add_coordinate_force(scene, scene.coordinate_marker(stop.point, 0), force)
        # `run.contact` has one column for each of `scene.stops`
        scene.readers[name, "force"] = lambda run, _record, k=k: run.contact[:, k : k + 1]  # type: ignore[misc]
