"""Constraints of elements in the engine: native items for pins and angles, user functions for other rows.

A row is one scalar equation: a sum of coefficients times measures of two bodies keeps its value. A measure is a turn, a distance
of two points, or a coordinate of a point along a line. Rows of drives, which follow a motion, are added in `loads`.
"""

from functools import partial

import exudyn.itemInterface as eii
import numpy as np

from ..elements.element import GROUND, Element
from ..elements.rows import Row, Turn, find_pin
from ..geometry import Array
from ..record.record import Record
from ..scene.forms import Forms
from . import System
from .placed import History
from .scene import EngineScene


def connect(scene: EngineScene, elements: dict[str, Element]) -> None:
    """Add the rows of each element, and the channels that its method `reactions` makes from their multipliers."""
    for name, element in elements.items():
        rows = list(element.rows(scene.mechanism))
        if any(row.bodies & scene.strut_links for row in rows):
            continue  # a strut has no coordinates: it acts directly on the bodies at its ends
        constraints = {f"{name}: {k}" if k else name: item for k, item in enumerate(_add(scene, rows))}
        scene.constraints |= constraints
        no_samples = np.zeros((0, len(rows)))  # for the names of the channels
        for channel in element.reactions(no_samples) or ():
            scene.readers[name, channel] = partial(_compute_reaction, scene, list(constraints), element, channel)


def _add(scene: EngineScene, rows: list[Row]) -> list[int]:
    """Add rows as native constraints, one for a pin and one for each turn, if possible, else as one item; return item numbers."""
    pin = find_pin(rows)
    if pin is None:
        return [_add_rows(scene, rows)]
    # a measure is first end less second, a constraint of the engine second marker less first
    markers = [scene.marker(*end) for end in (pin.second, pin.first)]
    items = [int(scene.system.AddObject(eii.ObjectJointRevolute2D(markerNumbers=markers)))]
    for row in rows[2:]:  # `find_pin` has returned a pin: the first two rows are its x and y, all others are constant turns
        _coefficient, turn = row.terms[0]  # the only term, with the coefficient 1
        markers = [scene.angle_marker(*end) for end in (turn.second, turn.first)]  # of the bodies' angles
        # in a constraint of single coordinates the engine counts them from t = 0: the difference of both stays 0
        items.append(int(scene.system.AddObject(eii.CoordinateConstraint(markerNumbers=markers))))
    return items


def _compute_reaction(
    scene: EngineScene, constraints: list[str], element: Element, channel: str, run: History, _record: Record
) -> Array:
    """Return the values of a channel of an element (times, ...), from the multipliers of its constraints."""
    columns = np.concatenate([scene.multiplier_indices(name) for name in constraints])
    reactions = element.reactions(-run.multipliers[:, columns])  # a multiplier has the opposite sign of the force
    return (reactions or {})[channel]  # not None, as the element has this channel


def _make_forms(scene: EngineScene, rows: list[Row]) -> tuple[Forms, list[int]]:
    """Return the equations of rows in the coordinates of engine nodes, and the numbers of these nodes in their order.

    A node has x, y and the angle since t = 0. The ground has the index after the last node.
    """
    measures = [measure for row in rows for _, measure in row.terms]
    ends = [end for measure in measures for end in (measure.first, measure.second) if end.body != GROUND]
    at = {end: scene.placed[end.body].find_angle_node(end.point) for end in ends}  # node that moves with the body, and its place
    order = list(dict.fromkeys(node for node, _place in at.values()))
    origins = {end: (order.index(node), complex(*place)) for end, (node, place) in at.items()}  # arms lead from the nodes
    return Forms(rows, len(order), scene.mechanism.points, locate=lambda end: origins.get(end, (len(order), 0j))), order


def _add_rows(scene: EngineScene, rows: list[Row]) -> int:
    """Add rows as one constraint on nodes: native if it is linear in their coordinates, else with callbacks."""
    system, (forms, nodes) = scene.system, _make_forms(scene, rows)
    reference = np.array([system.GetNodeParameter(node, "referenceCoordinates")[:3] for node in nodes])  # x, y, angle of each
    # the engine's total coordinates include the angles at t = 0, those of `forms` do not; shape (nodes, 3), 0 for x and y
    initial_angles = reference * (0.0, 0.0, 1.0)
    # an object without mass collects the coordinates of all nodes for one marker; the other marker of the constraint has none
    collector = system.AddObject(eii.ObjectGenericODE2(nodeNumbers=nodes, massMatrix=np.zeros(2 * [reference.size])))
    ground = system.AddMarker(eii.MarkerNodeCoordinates(nodeNumber=system.AddNode(eii.NodePointGround())))
    markers = [ground, system.AddMarker(eii.MarkerObjectODE2Coordinates(objectNumber=collector))]

    def evaluate(q: Array) -> tuple[Array, Array]:
        """Return residuals (rows,) and their Jacobian (rows, 3 nodes) at the engine's total coordinates."""
        return forms.system(np.reshape(q, reference.shape) - initial_angles)

    def residual(_system: System, _time: float, _item: int, q: Array, q_t: Array, on_speeds: bool) -> Array:
        """Return residuals, or their rates."""
        value, jacobian = evaluate(q)
        return jacobian @ np.asarray(q_t) if on_speeds else value  # its rate if the engine solves for velocities

    is_linear = all(isinstance(measure, Turn) for row in rows for _, measure in row.terms)
    if is_linear:
        _, matrix = evaluate(reference)
        # A q - b = 0 for the total coordinates q, with A = `scalingMarker1`: in a row the turns since t = 0 add up to zero
        options: dict[str, object] = {"scalingMarker1": matrix, "offset": matrix @ reference.ravel()}
    else:
        options = {
            "constraintUserFunction": residual,
            "jacobianUserFunction": lambda _system, _time, _item, q, _q_t, _on_speeds: evaluate(q)[1],
            "scalingMarker0": np.zeros((forms.row_count, reference.size)),  # tells the engine the number of equations alone
        }
    return int(system.AddObject(eii.CoordinateVectorConstraint(markerNumbers=markers, **options)))
